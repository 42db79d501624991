"""What page, files and charts show of a study of cost: the record's figures, and what dominates."""

import json
import re
from dataclasses import replace

import jsonschema
import numpy as np
import pytest
import vl_convert
from msgspec import convert, structs

from comparisons.cost.cost_record import Measured, Prediction
from reports.charts import cost_charts, vega
from reports.page import page
from reports.page.scene_view import SceneView
from reports.run import cost_files, scene
from tests import cost_records, records
from tests.browser.conftest import noisy
from tests.schemas import schema
from tests.test_page import HOSTILE, Page


@pytest.fixture(scope="module")
def study():
    return cost_records.study()


def shown(study, record=None):
    """The page of one scene with its study."""
    made = cost_files.documents(study)
    view = SceneView(
        record=record or records.record(),
        charts=tuple(cost_files.figures(study.record)),
        cost=cost_files.view(study, made),
    )
    return page.render([view])


def test_the_figures_on_the_page_are_those_of_the_json(study):
    made = json.loads(cost_files.documents(study)["cost.json"])
    jsonschema.Draft202012Validator(schema("cost")).validate(made)
    values = {value for value, _ in Page(shown(study)).values}
    data = study.record
    wanted = [data.reference.noise_floor, data.attribution.departure]
    for point in data.points:
        wanted += [*structs.astuple(point.seconds), *structs.astuple(point.error)]
        wanted += [point.first_s, point.spp]
    reached = [row.seconds for row in data.equal_error if row.seconds is not None]
    wanted += [each for row in reached for each in structs.astuple(row)]
    for one in data.attribution.effects:
        wanted += [*structs.astuple(one.removes), one.alone, one.last]
    assert not [number for number in wanted if number not in values]


def test_names_from_files_stay_text_and_a_page_without_a_study_says_nothing_of_cost(study):
    machine = structs.replace(study.record.machine, processor=HOSTILE)
    hostile = replace(study, record=structs.replace(study.record, machine=machine))
    html = shown(hostile, records.record(scene=HOSTILE))
    assert HOSTILE not in html
    assert HOSTILE in Page(html).text
    bare = page.render([SceneView(record=records.record())])
    for text in ("What accuracy costs", "What each effect", "Ladder"):
        assert text in html
        assert text not in bare


def test_the_map_of_effects_tells_halves_none_and_what_does_not_count():
    found = scene.view_of(cost_records.explained(noisy())).why.effects
    assert found.names == cost_records.EFFECTS
    assert len(set(found.colours)) == 3
    rows = [found.map[start : start + 12] for start in range(0, 96, 12)]
    assert rows[0] == "-" * 12
    assert set(rows[1:-1]) == {"000000222222"}
    assert rows[-1] == "." * 12


def test_a_comparison_with_its_study_replaces_an_earlier_one_as_a_whole(tmp_path, study):
    comparison = noisy()
    scene.write(tmp_path, "scene", comparison, study)
    files = {path.name for path in (tmp_path / "scene").glob("cost*")}
    assert {"cost.json", "cost.svg", "cost-method-full-plan.png"} <= files
    methods = {name: study.methods[name] for name in ("Phong kernel",)}
    other = replace(study, record=structs.replace(study.record, seed=8), methods=methods)
    scene.write(tmp_path, "scene", comparison, other)
    assert json.loads((tmp_path / "scene" / "cost.json").read_text("utf-8"))["seed"] == 8
    assert not (tmp_path / "scene" / "cost-method-full-plan.png").exists()
    scene.write(tmp_path, "scene", comparison)
    assert not list((tmp_path / "scene").glob("cost*"))


# -- Charts ----------------------------------------------------------------------------------------


def test_names_stand_apart_in_order_and_inside():
    for seed in range(20):
        places = np.sort(np.random.default_rng(seed).uniform(0, 380, 3 + seed))
        moved = cost_charts.spread(list(places), 15, 380)
        assert np.all(np.diff(moved) >= 15 - 1e-9)
        assert min(moved) >= 0
        assert max(moved) <= 380 + 1e-9
    assert cost_charts.spread([10, 50, 300], 15, 380) == [10, 50, 300]
    assert cost_charts.spread([100, 102], 15, 380) == [93.5, 108.5]


def point(method, spp, time, error, pareto=False):
    return convert(cost_records.point(method, spp, time, error, pareto), Measured)


def record(points, floor=0.4):
    whole = cost_records.record("synthetic")
    reference = structs.replace(whole.reference, noise_floor=floor)
    return structs.replace(whole, points=tuple(points), reference=reference)


SAMPLED = [point("full plan", n, 0.02 * n, 8 / n**0.5, True) for n in (4, 16, 64)]


def test_a_chart_names_axes_units_and_every_method():
    for error, points, floor in ((12.0, [], 0.0), (0.0, [], 0.0), (12.0, SAMPLED, 0.4)):
        points = [point("Phong kernel", 16, 0.01, error, True), *points]
        svg = vl_convert.vegalite_to_svg(cost_charts.titled(record(points, floor)))
        for word in ("time for one image (ms", "mean ΔE2000", *(p.method for p in points)):
            assert word in svg
        assert "NaN" not in svg


def symbol_layers(svg):
    """Return the places of the points of each layer that has some, in pixels."""
    return [
        [tuple(map(float, place)) for place in re.findall(r"translate\(([^,]+),([^)]+)\)", marks)]
        for marks in re.findall(r'<g class="mark-symbol role-mark [^>]*>(.*?)</g>', svg)
    ]


def test_points_guides_and_names_lie_where_the_axes_say():
    points = [*SAMPLED, point("Phong kernel", 16, 0.01, 0.4)]
    svg = vl_convert.vegalite_to_svg(cost_charts.error_over_time(record(points)))
    (places,) = map(np.array, symbol_layers(svg))
    assert np.all((places > 0) & (places < (cost_charts.WIDTH, cost_charts.HEIGHT)))
    steps = np.diff(places[:3], axis=0)
    np.testing.assert_allclose(steps[0], steps[1], atol=1e-3)
    ends = r'd="M([-\d.]+),([-\d.]+)L([-\d.]+),([-\d.]+)"[^>]*stroke-dasharray="([\d,]+)"'
    drawn = {dash: tuple(map(float, place)) for *place, dash in re.findall(ends, svg)}
    left, top, right, bottom = drawn["6,4"]
    for x, y in places[:3]:  # errors fall as the root of the samples: all on the line
        assert y == pytest.approx(top + (x - left) / (right - left) * (bottom - top), abs=0.1)
    assert drawn["1,3"] == pytest.approx((0, places[3][1], cost_charts.WIDTH, places[3][1]))
    text = r'translate\(([^,]+),([^)]+)\)"[^>]*>(Phong kernel|full plan)</text>'
    names = {name: (float(x), float(y)) for x, y, name in re.findall(text, svg)}
    assert {x for x, _ in names.values()} == {cost_charts.WIDTH + 14}
    for name, place in (("full plan", places[2]), ("Phong kernel", places[3])):
        assert names[name][1] == pytest.approx(place[1] + 3, abs=cost_charts.LABEL_GAP)


def about(name, value):
    return {name: value, "low": 0.8 * value, "high": 1.5 * value}


FORECASTS = [
    ("full plan", 4, 0.04, 4.0),
    ("full plan", 16, 0.16, 2.0),
    ("Phong kernel", 4, 0.002, 7.0),
]


def predicted(forecasts=FORECASTS, measured=()):
    """A record with forecasts at a size, and the seconds and errors measured for the first ones."""
    rows = [
        {"method": name, "spp": spp, "seconds": about("value", time)}
        | {"error": about("mean", error)}
        for name, spp, time, error in forecasts
    ]
    for row, (time, error) in zip(rows, measured, strict=False):
        row["measured"] = cost_records.point(row["method"], 4, time, error, False)
    found = {"resolution": (640, 480), "level": 0.9, "fitted": [(64, 48), (128, 96)], "rounds": 3}
    return convert(found | {"forecasts": rows, "cheapest": []}, Prediction)


def drawn(prediction):
    return vl_convert.vegalite_to_svg(
        cost_charts.prediction_chart(cost_records.record("synthetic"), prediction)
    )


def on_axes(places, values):
    """Return where logarithmic axes through the first and the last place have other values."""
    places, logarithms = np.array(places), np.log(values)
    begin, end = logarithms[0], logarithms[-1]
    return places[0] + (logarithms - begin) / (end - begin) * (places[-1] - places[0])


def test_forecasts_bands_and_measurements_lie_on_the_same_axes():
    measured = [(0.05, 5.0), (0.02, 2.5)]
    svg = drawn(predicted(measured=measured))
    points, crosses = symbol_layers(svg)
    values = [row[2:] for row in FORECASTS]
    expected = on_axes([points[0], *crosses, *points[1:]], [values[0], *measured, *values[1:]])
    np.testing.assert_allclose([points[0], *crosses, *points[1:]], expected, atol=1e-3)
    (slow_x, low_y), (fast_x, high_y) = points[1:]
    assert fast_x < slow_x
    assert high_y < low_y  # larger errors stand higher
    bands = re.findall(r'aria-roledescription="area mark" d="([^"]+)Z"', svg)
    outline = np.array([place.split(",") for band in bands for place in band[1:].split("L")], float)
    rise = (low_y - high_y) / np.log(3.5)  # from an error of 2 to one of 7
    for x, y in points:
        for share in (0.8, 1.5):
            place = x, y - rise * np.log(share)
            assert np.abs(outline - place).max(axis=1).min() < 0.15


def test_a_prediction_is_titled_and_tells_of_crosses_only_where_some_are():
    for measured in ([], [(0.05, 5.0)]):
        svg = drawn(predicted(measured=measured))
        assert "synthetic: predicted at 640 × 480 pixels" in svg
        assert "fitted to 64x48, 128x96" in svg
        assert "90% intervals" in svg
        assert ("crosses: measured" in svg) == bool(measured)
        assert len(symbol_layers(svg)) == 1 + bool(measured)
    rows = [("full plan", 4, 0.04, 4.0), ("Phong kernel", 4, 2e-3, 0.0)]
    svg = drawn(predicted(rows, measured=[(0.05, 0.0)]))
    (_, nothing), (cross,) = symbol_layers(svg)  # errors of 0 are drawn at the lower border
    assert nothing[1] == cross[1] == pytest.approx(380, abs=25)
    assert "NaN" not in svg


def test_the_chart_of_the_attribution_has_a_bar_for_each_effect():
    svg = vega.paper(cost_charts.attribution_chart(cost_records.record())).decode()
    for effect in cost_records.EFFECTS:
        assert effect in svg
    assert svg.count('role="graphics-symbol" aria-roledescription="bar"') == 3
