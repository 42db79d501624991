"""The metrics at their limits: defined, finite and symmetric, and what out of range means."""

import numpy as np
import pytest

from comparisons.departure.metrics import METRICS, log2_luminance_ratio, rmse
from comparisons.departure.spaces import Viewing
from heuristic.errors import NonFiniteError
from reference.rendering.renderer import require_finite

ALL = pytest.mark.parametrize("metric", METRICS.values(), ids=METRICS.keys())
PERCEPTUAL = pytest.mark.parametrize("metric", [m for m in METRICS.values() if not m.linear])
COLOURS = {
    "black": (0, 0, 0),
    "grey": (0.18, 0.18, 0.18),
    "nearly grey": (0.18, 0.18, 0.18 + 1e-12),
    "white": (1, 1, 1),
    "red alone": (1, 0, 0),
    "blue alone": (0, 0, 0.5),
    "negative": (-0.2, 0.1, 0.3),
    "all negative": (-1, -2, -3),
    "denormal": (1e-310, 0, 1e-320),
    "a million cd/m²": (1e6 / 203, 1e6 / 203, 1e6 / 203),
    "beyond": (1e30, 1, 1e-30),
}
PAIRS = [(a, b) for a in COLOURS for b in COLOURS]


def image(name):
    return np.array(COLOURS[name], float).reshape(1, 1, 3)


@ALL
@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_every_pair_of_colours_has_a_finite_symmetric_distance(metric, a, b):
    there, back = metric(image(a), image(b)), metric(image(b), image(a))
    assert np.isfinite(there).all()
    assert there >= 0
    if metric.name != "hdr_flip":
        np.testing.assert_allclose(there, back, rtol=1e-9, atol=1e-6)
    if a == b:
        assert there == 0


@ALL
def test_grey_and_nearly_grey_are_the_same(metric):
    """Their hues are undefined, and opposite for all that rounding says."""
    assert metric(image("grey"), image("nearly grey")) < 1e-6


@PERCEPTUAL
def test_what_lies_beyond_the_range_is_clipped_as_documented(metric):
    """Display-referred metrics see no difference above white, and all see none below black."""
    assert metric(image("all negative"), image("black")) < 1e-6
    above = metric(2 * image("white"), 3 * image("white"))
    assert above > 1 if metric.name == "dE_ITP" else above < 1e-9 or metric.name == "hdr_flip"
    peak = 10_000 / 203
    if metric.name != "hdr_flip":  # its exposures go on
        assert metric(image("a million cd/m²"), np.full((1, 1, 3), peak)) < 1e-6


@ALL
def test_any_exposure_and_white_give_finite_distances(metric):
    for viewing in (Viewing(exposure=1e-30), Viewing(exposure=1e30), Viewing(white_luminance=1e6)):
        assert np.isfinite(metric(image("red alone"), image("grey"), viewing)).all()


@pytest.mark.parametrize(("a", "b"), PAIRS)
def test_ratio_and_rmse_are_finite_and_antisymmetric_or_symmetric(a, b):
    ratio = log2_luminance_ratio(image(a), image(b))
    assert np.isfinite(ratio).all()
    np.testing.assert_allclose(ratio, -log2_luminance_ratio(image(b), image(a)), atol=1e-12)
    assert np.isfinite(rmse(image(a), image(b)))
    assert rmse(image(a), image(b)) == rmse(image(b), image(a))


@ALL
@pytest.mark.parametrize("wrong", [np.nan, np.inf, -np.inf])
def test_a_pixel_that_is_not_finite_is_named_with_layer_count_and_place(metric, wrong):
    bad = np.zeros((4, 5, 3))
    bad[2, 3, 1] = bad[3, 0, 0] = wrong
    with pytest.raises(NonFiniteError, match=r"test image: 2 of 20 .* \(x, y\) = \(3, 2\)"):
        metric(bad, np.zeros_like(bad))
    with pytest.raises(NonFiniteError, match=r"reference image: 2 of 20"):
        metric(np.zeros_like(bad), bad)
    with pytest.raises(NonFiniteError, match=r"depth: 1 of 4"):
        require_finite(np.array([[0, wrong], [1, 2]]), "depth")
