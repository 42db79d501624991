"""What is said without noise, where noise is heavy: verdicts, means, shares, closures, shifts."""

from collections import Counter

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons import attribution
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure import criterion, statistics
from fotismos.comparisons.departure.estimate import Replicates, estimate
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import guarded
from fotismos.comparisons.steps import steps
from fotismos.reference.scene.source import Source
from tests.shared import noisy
from tests.shared.parts import camera, moved

PASSES = 16
RUNS = 4


def verdict_of(test, passes):
    found = noisy.estimate(test - passes)
    counted = np.ones(test.shape[:2], bool)
    summary, _ = statistics.summarise(
        LEADING, test, test - found.mean, counted, noise=found.noise, grouped=found.grouped
    )
    return criterion.decide(summary.visible)


def runs(spread):
    """Yield kinds of noise, and passes of a known truth with it."""
    truth = noisy.truth()
    for run in range(RUNS):
        for name, noise in noisy.kinds(PASSES, np.random.default_rng(1000 * run)):
            yield name, truth * (1 + spread * np.sqrt(PASSES) * noise)


@pytest.mark.guarantee("means", "Noise of eight kinds alone fails no exact pair.")
@pytest.mark.parametrize("spread", [0.1, 0.4])
def test_noise_alone_fails_no_pair(rgb, spread):
    found = Counter((name, verdict_of(noisy.truth(), passes)) for name, passes in runs(spread))
    assert [name for name, verdict in found if verdict == "fail"] == []


@pytest.mark.guarantee("means", "A visible difference in a tenth of the pixels passes in no noise.")
@pytest.mark.parametrize("spread", [0.1, 0.4])
def test_a_difference_in_a_tenth_of_the_pixels_never_passes(rgb, spread):
    test = noisy.truth()
    test[: noisy.SIZE // 10] *= 1.23
    assert LEADING(test, noisy.truth())[0].mean() > 4
    found = Counter((name, verdict_of(test, passes)) for name, passes in runs(spread))
    assert [name for name, verdict in found if verdict == "pass"] == []


@pytest.mark.guarantee("means", "Intervals of means and shares hold the truth in heavy noise.")
@pytest.mark.parametrize("spread", [0.05, 0.2, 0.5])
@pytest.mark.parametrize("factor", [1.0, 1.05, 1.3])
def test_intervals_hold_the_truth_in_heavy_noise(rgb, spread, factor):
    test = factor * noisy.truth()
    departure = LEADING(test, noisy.truth())
    means, shares = [], []
    for _, passes in runs(spread):
        found = noisy.estimate(test - passes)
        raw = LEADING(test, test - found.mean).ravel()
        clean = estimate(LEADING, Replicates.of(test, found.grouped), measured=raw)
        means.append(clean.mean.low - 1e-6 <= departure.mean() <= clean.mean.high)
        share = criterion.share_above(clean.visible)
        shares.append(share.low <= (departure > share.threshold).mean() <= share.high)
    assert np.mean(means) >= 0.9
    assert np.mean(shares) >= 0.9


def caustic():
    """A glass ball over a floor, under a small lamp."""
    lamp = {"type": "sphere", "center": (2, 1, 4), "radius": 0.3}
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 8},
        "sensor": camera((0, -6, 3), (0, 0, 0.5), size=48, fov=40.0),
        "floor": {"type": "rectangle", "to_world": moved(0, 6), "bsdf": {"type": "diffuse"}},
        "ball": {
            "type": "sphere",
            "center": (0, 0, 1),
            "radius": 0.8,
            "bsdf": {"type": "dielectric"},
        },
        "lamp": lamp | {"light": {"type": "area", "radiance": 40.0}},
    }


@pytest.mark.thorough
@pytest.mark.guarantee("attribution", "A closure that noise may explain holds 0 in its interval.")
@pytest.mark.parametrize("seed", [0, 1])
def test_causes_of_a_caustic_take_more_samples_and_their_closure_holds_zero(rgb, seed):
    source = Source("a ball", caustic())
    options = Options(seed=seed)
    ready = guarded(source, options)
    few = attribution.find(ready).record
    more = attribution.find(ready, limit=2**26).record
    assert few.spp < more.spp
    for record in (few, more):
        assert record.closure.low <= 0 <= record.closure.high


@pytest.mark.thorough
def test_a_noisy_picture_of_the_scene_itself_is_not_said_to_be_shifted(rgb, tmp_path):
    made = mi.load_dict(caustic())
    for seed in range(3):
        path = str(tmp_path / f"{seed}.exr")
        mi.util.write_bitmap(path, mi.render(made, spp=16, seed=50 + seed), write_async=False)
        options = Options(image=path, seed=seed)
        record = compare(Source("a ball", caustic()), options, then=steps(why=False)).record
        said = " ".join(record.warnings)
        assert "shifted" not in said
        assert "misread" not in said
