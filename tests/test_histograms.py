"""Histograms: every pixel is counted once, and heights are shares."""

import numpy as np
import pytest

from comparisons.departure.statistics import histogram
from reference.records import Pixels
from reports.charts import histograms
from tests import records


def test_every_value_is_counted_once_in_its_bin():
    values = np.concatenate([10.0 ** np.random.default_rng(0).uniform(-4, 4, 5000), np.zeros(10)])
    found = histogram(values)
    assert found.below + found.above + sum(found.counts) == values.size
    assert (found.below, found.above) == ((values < 0.01).sum(), (values >= 1000).sum())
    ratio = (found.high / found.low) ** (1 / len(found.counts))
    for place in (0, 17, 59):
        low = found.low * ratio**place
        assert found.counts[place] == ((values >= low) & (values < low * ratio)).sum()


def test_heights_of_the_chart_are_shares_of_pixels():
    values = 10.0 ** np.random.default_rng(0).uniform(-3, 2, 3000)
    data = histogram(values)
    spec = histograms.spec("dE2000", data, records.summary(3.0), values.size)
    rows = spec["layer"][0]["data"]["values"]
    widths = np.diff(np.log10([row["value"] for row in rows]))
    assert widths == pytest.approx(widths[0], rel=1e-3)
    assert sum(row["share"] for row in rows) == pytest.approx((values >= 0.01).mean(), rel=1e-4)
    assert rows[-1]["share"] == 0.0


def test_a_record_without_counted_pixels_has_no_chart():
    record = records.record()
    assert list(histograms.specs(record)) == ["dE2000"]
    empty = records.record(pixels=Pixels(counted=0, total=24))
    assert histograms.specs(empty) == {}
