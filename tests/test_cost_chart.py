"""The chart: names that do not collide, and a specification that Vega-Lite takes without a word."""

import re

import numpy as np
import pytest
import vl_convert
from msgspec import convert, structs

from comparisons.cost.cost_record import Measured
from reports.charts import error_over_time
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


def symbols(svg):
    """Return the places of the points of a chart, in pixels."""
    (marks,) = re.findall(r'<g class="mark-symbol role-mark [^>]*>(.*?)</g>', svg)
    return [
        tuple(map(float, place)) for place in re.findall(r"translate\(([^,]+),([^)]+)\)", marks)
    ]


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
