"""The chart: names that do not collide, and a specification that Vega-Lite takes without a word."""

import re

import numpy as np
import pytest
import vl_convert
from msgspec import convert, structs

from comparisons.cost.cost_record import Measured, Prediction
from reports.charts import error_over_time, prediction_chart, vega
from tests import cost_records


@pytest.mark.parametrize("seed", range(20))
def test_names_stand_apart_in_order_and_inside(seed):
    wanted = np.sort(np.random.default_rng(seed).uniform(0, 380, 3 + seed))
    places = error_over_time.spread(list(wanted), 15, 380)
    assert np.all(np.diff(places) >= 15 - 1e-9)
    assert min(places) >= 0
    assert max(places) <= 380 + 1e-9


def test_names_with_room_stay_where_they_want_to_be():
    assert error_over_time.spread([10, 50, 300], 15, 380) == [10, 50, 300]
    assert error_over_time.spread([100, 102], 15, 380) == [93.5, 108.5]


def point(rung, spp, time, error, pareto=False):
    return convert(cost_records.point(rung, spp, time, error, pareto), Measured)


def record(points, floor=0.4):
    whole = cost_records.record("synthetic")
    reference = structs.replace(whole.reference, noise_floor=floor)
    return structs.replace(whole, points=tuple(points), reference=reference)


@pytest.mark.parametrize(
    ("points", "floor"),
    [
        ([point("Phong kernel", 16, 0.01, 12.0, True)], 0.0),
        ([point("Phong kernel", 16, 0.01, 0.0, True)], 0.0),
        (
            [point("Phong kernel", 16, 0.01, 12.0, True)]
            + [point("full plan", n, 0.02 * n, 8 / n**0.5, True) for n in (4, 16, 64)],
            0.4,
        ),
    ],
    ids=["one point", "no error at all", "ladder"],
)
def test_it_draws_and_names_axes_units_and_every_rung(points, floor):
    svg = vl_convert.vegalite_to_svg(error_over_time.error_over_time(record(points, floor)))
    for word in ("time for one image (ms", "mean ΔE2000", "Pareto", *(p.rung for p in points)):
        assert word in svg
    assert "NaN" not in svg


def symbol_layers(svg):
    """Return the places of the points of each layer that has some, in pixels."""
    return [
        [tuple(map(float, place)) for place in re.findall(r"translate\(([^,]+),([^)]+)\)", marks)]
        for marks in re.findall(r'<g class="mark-symbol role-mark [^>]*>(.*?)</g>', svg)
    ]


def symbols(svg):
    """Return the places of the points of a chart, in pixels."""
    (marks,) = symbol_layers(svg)
    return marks


def lines(svg):
    """Return the ends of each dashed line of a chart, in pixels, by its dash."""
    ends = r'd="M([-\d.]+),([-\d.]+)L([-\d.]+),([-\d.]+)"[^>]*stroke-dasharray="([\d,]+)"'
    return {dash: tuple(map(float, place)) for *place, dash in re.findall(ends, svg)}


def test_points_lie_where_their_axes_say():
    points = [point("full plan", n, 0.02 * n, 8 / n**0.5) for n in (4, 16, 64)]
    svg = vl_convert.vegalite_to_svg(error_over_time.plot(record(points)))
    places = np.array(symbols(svg))
    steps = np.diff(places, axis=0)
    np.testing.assert_allclose(steps[0], steps[1], atol=1e-3)
    assert np.all((places > 0) & (places < (error_over_time.WIDTH, error_over_time.HEIGHT)))


def test_lines_of_plain_monte_carlo_and_of_the_references_noise_lie_among_the_points():
    points = [point("full plan", n, 0.02 * n, 8 / n**0.5) for n in (4, 16, 64)]
    points.append(point("Phong kernel", 16, 0.01, 0.4))
    svg = vl_convert.vegalite_to_svg(error_over_time.plot(record(points, floor=0.4)))
    places, drawn = symbols(svg), lines(svg)
    left, top, right, bottom = drawn["6,4"]
    for x, y in places[:3]:  # errors fall as the root of the samples: all on the line
        assert y == pytest.approx(top + (x - left) / (right - left) * (bottom - top), abs=0.1)
    assert drawn["1,3"] == pytest.approx((0, places[3][1], error_over_time.WIDTH, places[3][1]))


def test_names_stand_beside_the_plot_and_lead_to_their_slowest_point():
    points = [point("full plan", n, 0.02 * n, 8 / n**0.5) for n in (4, 16)]
    points.append(point("Phong kernel", 16, 0.01, 2.05))
    svg = vl_convert.vegalite_to_svg(error_over_time.plot(record(points)))
    text = r'translate\(([^,]+),([^)]+)\)"[^>]*>(Phong kernel|full plan)</text>'
    found = {name: (float(x), float(y)) for x, y, name in re.findall(text, svg)}
    assert {x for x, _ in found.values()} == {error_over_time.WIDTH + 14}
    places = dict(zip(("first", "full plan", "Phong kernel"), symbols(svg), strict=True))
    between = abs(found["full plan"][1] - found["Phong kernel"][1])
    assert between >= error_over_time.LABEL_GAP
    for name, (_, y) in found.items():
        assert y == pytest.approx(places[name][1] + 3, abs=error_over_time.LABEL_GAP)


# --- Predictions ----------------------------------------------------------------------------------


def spread_about(value):
    return {"value": value, "low": 0.8 * value, "high": 1.5 * value}


FORECASTS = [
    ("full plan", 4, 0.04, 4.0),
    ("full plan", 16, 0.16, 2.0),
    ("Phong kernel", 4, 0.002, 7.0),
]


def predicted(forecasts=FORECASTS, measured=()):
    """A record with forecasts at a size, and the seconds and errors measured for the first ones."""
    rows = [
        {"method": name, "spp": spp, "seconds": spread_about(time), "error": spread_about(error)}
        for name, spp, time, error in forecasts
    ]
    for row, (time, error) in zip(rows, measured, strict=False):
        seconds = cost_records.point(row["method"], 4, time, error, False)["seconds"]
        row["measured"] = {"seconds": seconds, "error": error, "error_spread": 0.1}
    found = {"resolution": (640, 480), "level": 0.9, "fitted": [(64, 48), (128, 96)], "rounds": 3}
    found |= {"laws": [], "forecasts": rows, "cheapest": []}
    whole = cost_records.record("synthetic")
    return structs.replace(whole, prediction=convert(found, Prediction))


def on_axes(places, values):
    """Return where logarithmic axes through the first and the last place have other values."""
    places, logarithms = np.array(places), np.log(values)
    begin, end = logarithms[0], logarithms[-1]
    return places[0] + (logarithms - begin) / (end - begin) * (places[-1] - places[0])


def test_forecasts_and_measurements_lie_on_the_same_axes():
    measured = [(0.05, 5.0), (0.02, 2.5)]
    svg = vl_convert.vegalite_to_svg(prediction_chart.standing_alone(predicted(measured=measured)))
    points, crosses = symbol_layers(svg)
    values = [row[2:] for row in FORECASTS]
    expected = on_axes([points[0], *crosses, *points[1:]], [values[0], *measured, *values[1:]])
    np.testing.assert_allclose([points[0], *crosses, *points[1:]], expected, atol=1e-3)
    (slow_x, low_y), (fast_x, high_y) = points[1:]
    assert fast_x < slow_x
    assert high_y < low_y  # larger errors stand higher
    assert np.all((np.array(points) > 0) & (np.array(points) < (560, 380)))
    strokes = re.findall(
        r'aria-label="fastest[^"]*" [^>]*translate\(([^,]+),[^>]*x2="([^"]+)"', svg
    )
    for (x, _), (begin, length) in zip(points, np.array(strokes, float), strict=True):
        scale = (slow_x - fast_x) / np.log(0.16 / 2e-3)
        assert begin - x == pytest.approx(scale * np.log(0.8), abs=1e-3)
        assert begin + length - x == pytest.approx(scale * np.log(1.5), abs=1e-3)


def test_bands_reach_from_the_low_to_the_high_error_of_each_forecast():
    svg = vl_convert.vegalite_to_svg(prediction_chart.standing_alone(predicted()))
    (points,) = symbol_layers(svg)
    bands = re.findall(r'aria-roledescription="area mark" d="([^"]+)Z"', svg)
    corners = {
        tuple(np.round(np.array(corner.split(","), float), 1))
        for band in bands
        for corner in band[1:].split("L")
    }
    rise = (points[1][1] - points[2][1]) / np.log(3.5)  # from an error of 2 to one of 7
    expected = {(x, y - rise * np.log(share)) for x, y in points for share in (0.8, 1.5)}
    # A band of one forecast has no width, and so both its ends in one place of the outline.
    assert len(corners) == len(expected)
    for corner in expected:
        assert min(np.abs(np.array(list(corners)) - corner).max(axis=1)) < 0.15


def test_a_prediction_is_titled_by_its_size_and_tells_of_crosses_only_where_some_are():
    bare, seen = predicted(), predicted(measured=[(0.05, 5.0)])
    for record, says_so in ((bare, False), (seen, True)):
        svg = vega.paper(prediction_chart.standing_alone(record)).decode()
        assert "synthetic: predicted at 640 × 480 pixels" in svg
        assert "fitted to 64x48, 128x96" in svg
        assert "90% intervals" in svg
        assert ("crosses: measured" in svg) == says_so
        assert len(symbol_layers(svg)) == 1 + says_so
        assert "NaN" not in svg


def test_errors_of_nothing_are_drawn_at_the_lower_border():
    rows = [("full plan", 4, 0.04, 4.0), ("Phong kernel", 4, 2e-3, 0.0)]
    record = predicted(rows, measured=[(0.05, 0.0)])
    svg = vl_convert.vegalite_to_svg(prediction_chart.prediction_chart(record))
    (_, nothing), (measured,) = symbol_layers(svg)
    assert nothing[1] == measured[1] == pytest.approx(380, abs=1e-3)
    bands = re.findall(r'aria-roledescription="area mark" d="([^"]+)Z"', svg)
    heights = [float(y) for band in bands for y in re.findall(r",([^L]+)", band)]
    assert max(heights) == pytest.approx(380, abs=1e-3)
    assert "NaN" not in svg
