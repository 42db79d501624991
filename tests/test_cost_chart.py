"""The chart: names that do not collide, and a specification that Vega-Lite takes without a word."""

import numpy as np
import pytest
import vl_convert
from msgspec import convert, structs

from comparisons.cost.timing import Measured
from reports.charts import error_over_time, labels
from tests import cost_records


@pytest.mark.parametrize("seed", range(20))
def test_names_stand_apart_in_order_and_inside(seed):
    wanted = np.sort(np.random.default_rng(seed).uniform(0, 380, 3 + seed))
    places = labels.spread(list(wanted), 15, 380)
    assert np.all(np.diff(places) >= 15 - 1e-9)
    assert min(places) >= 0
    assert max(places) <= 380 + 1e-9


def test_names_with_room_stay_where_they_want_to_be():
    assert labels.spread([10, 50, 300], 15, 380) == [10, 50, 300]
    assert labels.spread([100, 102], 15, 380) == [93.5, 108.5]


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


def test_points_lie_where_their_axes_say():
    points = [point("full plan", n, 0.02 * n, 8 / n**0.5) for n in (4, 16, 64)]
    rows = [error_over_time._row(p, "physical") for p in points]
    x = error_over_time._Axis(
        min(r["low"] for r in rows), max(r["high"] for r in rows), error_over_time.WIDTH
    )
    pixels = [x.pixel(row["time"]) for row in rows]
    assert np.diff(pixels)[0] == pytest.approx(np.diff(pixels)[1])
    assert 0 < pixels[0] < pixels[-1] < error_over_time.WIDTH
