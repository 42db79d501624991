"""How many passes are rendered: stopping at a noise target."""

import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import METRICS
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import LIMIT_SPP

SMALL = (24, 24)


@pytest.mark.thorough
def test_the_run_ends_once_the_noise_is_under_the_target(rgb):
    options = Options(resolution=SMALL, noise=6.0)
    result = compare(SCENES["cornell-box"].source(), options)
    stop, plan = result.record.noise_target, result.record.plan
    assert stop.stopped_by == "target"
    assert 0 < stop.reached <= 6.0
    assert stop.limit_spp == LIMIT_SPP
    assert plan.spp < LIMIT_SPP
    # The noise that was predicted is that between this run and one of other seeds, by √2.
    other = compare(SCENES["cornell-box"].source(), Options(resolution=SMALL, noise=6.0, seed=900))
    assert other.record.plan.spp == plan.spp
    between = METRICS["dE2000"](result.images.reference, other.images.reference)
    measured = np.percentile(between[result.images.counted], 95) / np.sqrt(2)
    assert stop.reached == pytest.approx(measured, rel=0.25)


def test_a_limit_on_samples_stops_first_and_says_so(rgb):
    result = compare(SCENES["cornell-box"].source(), Options(resolution=SMALL, noise=0.01, spp=40))
    stop, plan = result.record.noise_target, result.record.plan
    assert stop.stopped_by == "samples"
    assert stop.reached > 0.01
    assert plan.spp <= 40
    assert plan.spp == stop.limit_spp
