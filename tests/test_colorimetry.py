"""The compiled colour spaces and differences against colour-science, which defines them."""

import colour
import numpy as np
import pytest
from colour.difference import delta_E_CIE2000

from comparisons.departure import definitions
from comparisons.departure.definitions import AGREEMENT, DEFINED
from comparisons.departure.metrics import METRICS
from comparisons.departure.spaces import Viewing, cam16ucs_unclipped, ciede2000

VIEWINGS = [
    Viewing(),
    Viewing(exposure=3.7, white_luminance=80.0, ambient_illuminance=500.0, background=50.0),
    Viewing(exposure=1e-3, white_luminance=1e4, ambient_illuminance=1e-2, background=1.0),
]
HOSTILE = [
    -1e300, -1e6, -1.0, -1e-30, 0.0, 5e-324, 1e-310, 1e-30, 1e-9, 1e-5, 3e-3, 0.0031308, 0.18, 0.5,
    np.nextafter(1, 0), 1.0, np.nextafter(1, 2), 1.5, 49.26, 1e4, 1e6, 1e30,
]  # fmt: skip


def cases():
    """Pairs of linear colours (N, 3) by what they are."""
    rng = np.random.default_rng(5)
    size = (20_000, 3)
    plain, other = rng.random((2, *size))
    grey = rng.random((len(plain), 1)) * np.ones(3)
    cube = np.stack(np.meshgrid(*3 * [HOSTILE]), axis=-1).reshape(-1, 3)
    corners = np.stack(np.meshgrid(*3 * [[0.0, 1.0]]), axis=-1).reshape(-1, 3)
    return {
        "in gamut": (plain, other),
        "near": (plain, plain + 1e-4 * rng.normal(size=size)),
        "nearer": (plain, plain + 1e-9 * rng.normal(size=size)),
        "equal": (plain, plain),
        "greys": (grey, rng.permutation(grey)),
        "grey and colour": (grey, other),
        "high dynamic range": tuple(np.exp(rng.normal(0.0, 6.0, (2, *size)))),
        "out of gamut": tuple(rng.normal(size=(2, *size))),
        "dark": tuple(np.exp(rng.normal(-12.0, 4.0, (2, *size)))),
        "hostile": (cube, rng.permutation(cube)),
        "corners": (np.repeat(corners, 8, axis=0), np.tile(corners, (8, 1))),
    }


def opposite(a, b):
    """Whether the hues of L*a*b* colours are opposite, where CIE DE2000 jumps."""
    (_, a1, b1), (_, a2, b2) = a.T, b.T
    stretch = 1.5 - 0.5 * np.sqrt(1.0 / (1.0 + (50.0 / (np.hypot(a1, b1) + np.hypot(a2, b2))) ** 7))
    turn = np.arctan2(b1, stretch * a1) - np.arctan2(b2, stretch * a2)
    return np.abs(np.abs(turn) - np.pi) < 1e-9


@pytest.fixture(scope="module")
def quiet():
    with np.errstate(all="ignore"), colour.utilities.suppress_warnings(python_warnings=True):
        yield


@pytest.mark.guarantee(
    "means",
    "Colour differences agree with colour-science to 1e-4, for random, near, dark, very "
    "bright, out-of-gamut and hostile colours.",
)
@pytest.mark.parametrize("viewing", VIEWINGS, ids=["usual", "bright", "dim"])
@pytest.mark.parametrize("name", list(cases()))
@pytest.mark.parametrize("metric", list(DEFINED))
def test_metrics_are_colour_sciences(metric, name, viewing, quiet):
    test, reference = cases()[name]
    space, difference = DEFINED[metric]
    pair = [space(image, viewing) for image in (test, reference)]
    wanted, defined = difference(*pair), np.full(len(test), True)
    if metric == "dE2000":
        defined = ~opposite(*pair)
    found = METRICS[metric](test[None], reference[None], viewing)[0]
    assert defined.mean() > 0.5
    assert np.isfinite(found).all()
    np.testing.assert_allclose(found[defined], wanted[defined], rtol=0.0, atol=AGREEMENT)


def test_any_lab_colours_have_colour_sciences_difference(quiet):
    rng = np.random.default_rng(6)
    pair = rng.uniform([0, -120, -120], [100, 120, 120], (2, 50_000, 3))
    pair[:, :5000, 1:] = 0.0
    pair[1, 5000:10_000] = pair[0, 5000:10_000] * [1.0, 1.0, 0.0]
    defined = ~opposite(*pair)
    wanted = delta_E_CIE2000(*pair)
    np.testing.assert_allclose(ciede2000(*pair)[defined], wanted[defined], atol=AGREEMENT)


@pytest.mark.parametrize(("hue", "wanted"), [((2.49, -0.001), 7.1792), ((-0.001, 2.49), 4.8045)])
def test_opposite_hues_take_the_branch_of_the_definition(hue, wanted):
    """Sharma, Wu and Dalal, table 1, pairs 10 and 14: 180 degrees are not more than 180."""
    a, b = np.array([[50.0, *hue]]), np.array([[50.0, -hue[0], -hue[1]]])
    assert ciede2000(a, b) == pytest.approx(wanted, abs=5e-5)
    assert ciede2000(b, a) == pytest.approx(wanted, abs=5e-5)


def test_brighter_than_white(quiet):
    rgb = np.random.default_rng(7).uniform(0.0, 12.0, (5000, 3))
    found = cam16ucs_unclipped(rgb, VIEWINGS[0])
    wanted = definitions.cam16ucs(rgb, VIEWINGS[0], white=np.inf)
    np.testing.assert_allclose(found, wanted, atol=AGREEMENT)


def test_one_kernel_serves_all_viewing_conditions():
    import drjit as dr

    rgb = np.random.default_rng(8).random((64, 3))
    space = METRICS["dE_CAM16UCS"].coordinates
    space(rgb, VIEWINGS[0])
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        space(rgb, VIEWINGS[1])
        kernels = dr.kernel_history([dr.KernelType.JIT])
    assert kernels
    assert all(kernel["cache_hit"] for kernel in kernels)
