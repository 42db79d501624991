"""What page, files and charts show of a study of cost: the record's figures, and its front."""

import json
import re
from dataclasses import replace

import jsonschema
import pytest
import vl_convert
from msgspec import convert, structs

from fotismos.comparisons.records.cost import Point
from fotismos.reference.records import Interval
from fotismos.reports import cost_tables, sentences, verdict
from fotismos.reports.charts import cost_charts
from fotismos.reports.page import page
from fotismos.reports.page.scene_view import SceneView
from fotismos.reports.run import cost_files, scene_files
from fotismos.reports.terminal.words import number, seconds
from tests.browser.conftest import noisy
from tests.shared import cost_records, records
from tests.shared.pages import HOSTILE, Page
from tests.shared.schemas import schema


@pytest.fixture(scope="module")
def study():
    return cost_records.study()


def shown(study, record=None):
    """The page of one scene with its study."""
    view = SceneView(
        record=record or records.record(),
        chart=cost_files.figure(study.record),
        cost=cost_files.view(study),
    )
    return page.render([view])


def test_the_figures_on_the_page_are_those_of_the_json(study):
    made = json.loads(cost_files.documents(study)["cost.json"])
    jsonschema.Draft202012Validator(schema("cost")).validate(made)
    values = {value for value, _ in Page(shown(study)).values}
    data = study.record
    wanted = [data.reference.noise_floor, data.attribution.departure]
    for method in data.methods:
        wanted += [*structs.astuple(method.ratio), method.per_sample_s.value]
        wanted += [method.overhead_s.value, method.first_s]
    for point in data.points:
        wanted += [*structs.astuple(point.seconds), point.spp]
        for error in (point.error, point.tolerance):
            wanted += [error.value, error.high - error.value]
    for one in data.attribution.effects:
        wanted += [*structs.astuple(one.removes), one.adds_s.low, one.adds_s.high]
        wanted += [one.alone, one.last]
    assert not [number for number in wanted if number not in values]


def test_page_and_terminal_name_what_cannot_be_measured_a_busy_machine_and_ties(study):
    busy = structs.replace(study.record, processor_share=0.625)
    for record, is_busy in ((study.record, False), (busy, True)):
        html = Page(shown(replace(study, record=record))).text
        text = "\n".join(cost_tables.lines(record))
        for said in (" ".join(html.split()), text):
            assert said.count("no measurable time") == 1  # of microfacets
            assert ("The machine was busy: samples got 62%" in said) is is_busy
            assert "direct <b>" in said
            assert "the scene's own paths end at depth 3" in said
    assert "Phong kernel" in text
    assert "22.25" in text


def test_the_last_line_and_the_title_are_the_answer(study):
    record = structs.replace(study.record, stopped="64 samples would take more than 60 s")
    nearest = record.points[2]
    size = verdict.sized(record.resolution)
    answer = (
        f"No method looks right at {size}. The nearest is full plan with 16 samples in"
        f" {seconds(nearest.seconds.value)}, of which 5 % of the pixels exceed ΔE2000"
        f" {number(nearest.tolerance.value)}. More samples may help, but 64 samples would take more"
        " than 60 s."
    )
    *_, last = cost_tables.lines(record)
    assert last == answer
    assert cost_files.title(record, 2.0) == f"fig-8-9: {answer}"
    assert answer in Page(shown(replace(study, record=record))).text


def test_times_are_of_the_size_that_was_asked_for_and_the_table_marks_the_cheapest(study):
    record = study.record
    right = structs.replace(record.points[2], tolerance=Interval(value=1.0, low=0.9, high=1.1))
    predicted = structs.replace(record, at=(1920, 1080), points=(*record.points[:2], right))
    html = Page(shown(replace(study, record=predicted))).text
    assert "Errors depend on the size, and are not predicted" in html
    assert "Errors depend on the size" not in Page(shown(study)).text
    rows = "\n".join(cost_tables.lines(predicted)).splitlines()
    assert "time at 1920x1080" in "\n".join(rows)
    marked = [row for row in rows[:-1] if "cheapest that looks right" in row]
    assert len(marked) == 1
    assert marked[0].startswith(right.method)
    kernel = record.points[0]
    assert rows[-1] == (
        f"Full plan with {right.spp} samples is the cheapest that looks right:"
        f" {seconds(right.seconds.value)} at 1920x1080. In the textbook's time,"
        f" {seconds(kernel.seconds.value)}, Phong kernel reaches ΔE2000"
        f" {number(kernel.tolerance.value)}."
    )


def test_given_pictures_stand_beside_the_methods_with_times_as_given(study):
    for kernel_s in (0.0021, None):
        given = cost_records.with_engine(study, kernel_s=kernel_s)
        made = cost_files.documents(given)
        jsonschema.Draft202012Validator(schema("cost")).validate(json.loads(made["cost.json"]))
        assert {"cost-picture-1.png", "cost-picture-2.png"} <= made.keys()
        html = Page(shown(given))
        shown_values = {value for value, _ in html.values}
        text = "\n".join(cost_tables.lines(given.record))
        for one in given.record.engine.settings:
            wanted = [one.seconds.value, *structs.astuple(one.error), one.ratio]
            wanted += structs.astuple(one.visible[1])[:3]
            assert {value for value in wanted if value is not None} <= shown_values
        for said in (" ".join(html.text.split()), text):
            assert (
                "PCSS low does not pass at ΔE2000 2, as 5 % of its pixels exceed 13.6; nothing"
                " given under 9.1 ms does better."
            ) in said
            assert "PCSS high passes at ΔE2000 2; nothing given does better." in said
            assert "times as given, on RTX 3060; the front is their own" in said
            assert "PCSS low, PCSS high: The picture is misread." in said
            assert "6.3 ms" in said
        assert ("x kernel there" in text) is (kernel_s is not None)
        assert ("x kernel there</th>" in shown(given)) is (kernel_s is not None)
        # What is measured is as without them.
        points = sentences.answer(given.record), given.record.points, given.record.methods
        assert points == (sentences.answer(study.record), study.record.points,
                          study.record.methods)  # fmt: skip
        svg = vl_convert.vegalite_to_svg(cost_charts.titled(given.record))
        assert "diamonds: given pictures, times as given, on RTX 3060" in svg
        assert "PCSS high" in svg
    bare = shown(study)
    assert "Given pictures" not in bare
    assert "diamonds" not in bare
    nowhere = sentences.stated(cost_records.with_engine(study, machine="").record.engine)
    assert nowhere == "times as given"


def test_a_setting_that_is_beaten_names_the_better_one(study):
    given = cost_records.with_engine(study).record.engine
    slow, fast = given.settings
    for spent, said in (
        (0.001, "PCSS high is faster and better."),
        (slow.seconds.value, "PCSS high takes as long and is better."),
    ):
        time = structs.replace(fast.seconds, value=spent, low=spent, high=spent)
        better = structs.replace(fast, seconds=time)
        engine = structs.replace(given, settings=(slow, better))
        first, _ = sentences.judgements(engine)
        assert first.endswith(said)
        alike = structs.replace(better, error=slow.error)
        engine = structs.replace(given, settings=(slow, alike))
        first, _ = sentences.judgements(engine)
        faster = spent < slow.seconds.value
        expected = "is faster and no worse." if faster else "; nothing given does better."
        assert first.endswith(expected)


def test_names_from_files_stay_text(study):
    machine = structs.replace(study.record.machine, processor=HOSTILE)
    given = cost_records.with_engine(study, machine=HOSTILE, names=(HOSTILE, "b"))
    hostile = replace(given, record=structs.replace(given.record, machine=machine))
    html = shown(hostile, records.record(scene=HOSTILE))
    assert HOSTILE not in html
    assert Page(html).text.count(HOSTILE) > 5


def test_a_comparison_with_its_study_replaces_an_earlier_one_as_a_whole(tmp_path, study):
    comparison = noisy()
    scene_files.write(tmp_path, "scene", comparison, study)
    files = {path.name for path in (tmp_path / "scene").glob("cost*")}
    assert {"cost.json", "cost.svg", "cost-method-full-plan.png"} <= files
    methods = {name: study.methods[name] for name in ("Phong kernel",)}
    other = replace(study, record=structs.replace(study.record, seed=8), methods=methods)
    scene_files.write(tmp_path, "scene", comparison, other)
    assert json.loads((tmp_path / "scene" / "cost.json").read_text())["seed"] == 8
    assert not (tmp_path / "scene" / "cost-method-full-plan.png").exists()
    scene_files.write(tmp_path, "scene", comparison)
    assert not list((tmp_path / "scene").glob("cost*"))


# -- Charts ----------------------------------------------------------------------------------------


def point(method, spp, time, error, **more):
    return convert(cost_records.point(method, spp, time, error, **more), Point)


def record(points, floor=0.4, **more):
    whole = cost_records.record("synthetic")
    reference = structs.replace(whole.reference, noise_floor=floor)
    return structs.replace(whole, points=tuple(points), reference=reference, **more)


SAMPLED = [point("full plan", n, 0.02 * n, 8 / n**0.5, front=True) for n in (4, 16, 64)]


def test_a_chart_names_axes_units_and_every_method():
    for error, points, floor in ((12.0, [], 0.0), (0.0, [], 0.0), (12.0, SAMPLED, 0.4)):
        points = [point("Phong kernel", 16, 0.01, error, front=True), *points]
        svg = vl_convert.vegalite_to_svg(cost_charts.titled(record(points, floor)))
        for word in ("time for one image (ms", "mean ΔE2000", *(p.method for p in points)):
            assert word in svg
        assert "NaN" not in svg


def test_lines_to_the_names_in_a_chart_do_not_cross_and_names_say_where_methods_pass():
    """Straight lines from fast methods of a little more error would cross those of slow ones."""
    fast = [point(f"fast {n}", 4, 0.001 * n, 2.0 + n / 50) for n in range(4)]
    slow = [point(f"slow {n}", 4, 0.2 * (n + 1), 1.9 - n / 50) for n in range(4)]
    last = slow.pop()
    slow.append(structs.replace(last, tolerance=structs.replace(last.tolerance, high=1.5)))
    first = cost_records.record("synthetic").methods[0]
    methods = tuple(structs.replace(first, name=one.method) for one in (*fast, *slow))
    shown = record([*fast, *slow], methods=methods)
    svg = vl_convert.vegalite_to_svg(cost_charts.titled(shown))
    found = re.findall(
        r'translate\(([\d.]+),([\d.]+)\)" x2="([-\d.]+)" y2="([-\d.]+)" stroke="#9a9a9a"', svg
    )
    lines = [tuple(map(float, ends)) for ends in found]
    level = [(x, y) for x, y, _, down in lines if down == 0 and x < cost_charts.WIDTH]
    beside = sorted((y, y + down) for x, y, _, down in lines if x == cost_charts.WIDTH)
    assert (len(level), len(beside)) == (8, 8)
    assert sorted(y for _, y in level) == pytest.approx([y for y, _ in beside])
    assert [end for _, end in beside] == sorted(end for _, end in beside)
    for one in (*fast, *slow):
        assert f"{one.method}, passes at {number(one.tolerance.value)}" in svg
    assert len(re.findall('d="M8.062,0A', svg)) == 1  # the ring of the one that passes at 2
