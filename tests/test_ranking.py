"""Whether metrics rank scenes alike, and where the page says so."""

import pytest
from msgspec import structs

from comparisons.departure.metrics import METRICS
from reports.page import page
from reports.page.page import FEWEST, rankings
from tests import records


def run_of(**means):
    """Return a record for each of the scenes, with such means by metric; others are all alike."""
    count = len(next(iter(means.values())))
    made = records.record()
    return [
        structs.replace(
            made,
            scene=f"scene {place}",
            metrics={
                name: structs.replace(
                    made.metrics[name], debiased=float(means.get(name, [1.0] * count)[place])
                )
                for name in METRICS
            },
        )
        for place in range(count)
    ]


def test_orders_are_told_and_not_sizes():
    found = rankings(run_of(dE2000=[1, 2, 3, 4], dE_ITP=[1, 10, 1e3, 1e6], rmse=[4, 3, 2, 1]))
    alike, opposite = found["dE2000"]["dE_ITP"], found["dE2000"]["rmse"]
    assert (alike.spearman, alike.kendall) == pytest.approx((1.0, 1.0))
    assert (opposite.spearman, opposite.kendall) == pytest.approx((-1.0, -1.0))
    # One pair of six is ordered otherwise: (5 - 1) / 6, and 1 - 6 * 2 / (4 * 15).
    (swapped,) = (rankings(run_of(dE2000=[1, 2, 3, 4], rmse=[1, 3, 2, 4]))["dE2000"]["rmse"],)
    assert (swapped.spearman, swapped.kendall) == pytest.approx((0.8, 2 / 3))


def test_what_ranks_nothing_is_left_out():
    assert set(rankings(run_of(dE2000=[1, 2, 3, 4], dE_ITP=[0] * 4))) == {"dE2000"}
    assert rankings(run_of(dE2000=range(FEWEST - 1))) == {}


def test_the_page_has_the_table_where_there_are_scenes_enough():
    def shown(count):
        made = run_of(dE2000=range(count), rmse=range(count))
        return page.render([records.SceneView(record=record) for record in made])

    assert "Do the metrics rank alike?" in shown(FEWEST)
    assert "Do the metrics rank alike?" not in shown(FEWEST - 1)
