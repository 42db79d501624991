"""What a page and its files show of a study of cost: the record's figures, and what dominates."""

import json
from dataclasses import replace

import jsonschema
import pytest
from msgspec import structs

from reports.page import page
from reports.page.costs import cost_overview
from reports.page.scene_view import SceneView
from reports.run import cost_files, output
from reports.run.stages import Run
from tests import cost_records, records
from tests.browser.conftest import noisy
from tests.schemas import schema
from tests.test_page import HOSTILE, Page

SCHEMA = schema("cost")


@pytest.fixture(scope="module")
def study():
    return cost_records.study()


def shown(study, record=None, **more):
    """The page of one scene with its study."""
    made = cost_files.documents(study)
    view = SceneView(
        record=record or records.record(),
        charts=tuple(cost_files.figures(study.record)),
        cost=cost_files.view(study, made),
    )
    return page.render([view], **more)


def test_the_made_up_record_holds_to_the_schema(study):
    made = json.loads(cost_files.documents(study)["cost.json"])
    jsonschema.Draft202012Validator(SCHEMA).validate(made)


def test_the_figures_on_the_page_are_those_of_the_json(study):
    values = {value for value, _ in Page(shown(study)).values}
    data = study.record
    wanted = [data.reference.noise_floor, data.prices.departure]
    for point in data.points:
        seconds = point.seconds
        wanted += [point.error, point.error_stderr, point.first_s, point.spp]
        wanted += [seconds.median, seconds.low, seconds.high]
    reached = [row.seconds for row in data.equal_error if row.seconds is not None]
    wanted += [each for row in reached for each in structs.astuple(row)]
    wanted += [row.best.error for row in data.equal_time if row.best]
    for price in data.prices.effects:
        wanted += [*structs.astuple(price.removes), *structs.astuple(price.adds_s)]
        wanted += [price.alone, price.last]
    for part in (*data.split.parts, data.split.departure):
        wanted += [part.mean, part.mean_stderr, part.rms, part.dE2000]
    assert not [number for number in wanted if number not in values]


def test_a_page_without_a_study_says_nothing_of_cost():
    html = page.render([SceneView(record=records.record())])
    for text in ("What accuracy costs", "Cost of accuracy", "Price of an effect", "Ladder"):
        assert text not in html


def test_names_from_files_stay_text(study):
    machine = structs.replace(study.record.machine, processor=HOSTILE)
    hostile = replace(study, record=structs.replace(study.record, machine=machine))
    html = shown(hostile, records.record(scene=HOSTILE))
    assert HOSTILE not in html
    assert HOSTILE in Page(html).text


def test_the_map_of_effects_tells_halves_none_and_what_does_not_count(study):
    found = cost_files.view(study, cost_files.documents(study)).effects
    assert found.names == cost_records.EFFECTS
    assert len(set(found.colours)) == 3
    rows = [found.map[start : start + 12] for start in range(0, 96, 12)]
    assert rows[0] == "-" * 12
    assert set(rows[1:-1]) == {"000000222222"}
    assert rows[-1] == "." * 12


def test_the_overview_takes_the_most_samples_and_marks_what_is_merged():
    found = cost_records.record()
    flat = structs.replace(found.rungs[0], name="flat kernel", names=("flat kernel",))
    more = structs.replace(found, rungs=(flat, *found.rungs), points=(
        structs.replace(found.points[0], rung="flat kernel"), *found.points,
    ))  # fmt: skip
    methods = cost_overview.methods([found, more])
    assert methods == ("flat kernel", "Phong kernel", "direct", "full plan")
    row, _ = cost_overview.rows([found, more])
    cells = dict(zip(methods, row.cells, strict=True))
    assert cells["Phong kernel"].point.error == 8.765
    assert cells["full plan"].point.spp == 16
    assert (cells["direct"].merged, cells["full plan"].merged) == (False, True)
    assert cells["flat kernel"] is None
    assert row.best.effect == "interreflection"


def test_a_comparison_with_its_study_replaces_an_earlier_one_as_a_whole(tmp_path, study):
    comparison = noisy()
    output.write_scene(tmp_path, "scene", comparison, study)
    files = {path.name for path in (tmp_path / "scene").glob("cost*")}
    assert {"cost.json", "cost.svg", "cost-part-visibility.png"} <= files
    other = replace(study, record=structs.replace(study.record, seed=8), parts=dict(study.parts))
    del other.parts["visibility"]
    output.write_scene(tmp_path, "scene", comparison, other)
    assert json.loads((tmp_path / "scene" / "cost.json").read_text("utf-8"))["seed"] == 8
    assert not (tmp_path / "scene" / "cost-part-visibility.png").exists()
    output.write_scene(tmp_path, "scene", comparison)
    assert not list((tmp_path / "scene").glob("cost*"))


def test_the_stages_of_a_run_add_up_and_stand_on_the_page(study):
    run = Run("fotismos report")
    with run.timing("cost"):
        pass
    run.compared(records.record().time, 100.0)
    run.begin_page()
    html = shown(study, run=run)
    stages = run.record().stages
    assert stages["rendering"] + stages["metrics"] == pytest.approx(100.0)
    assert stages["rendering"] == pytest.approx(0.375 + 2.79)
    values = {value for value, _ in Page(html).values}
    assert set(stages.values()) <= values
