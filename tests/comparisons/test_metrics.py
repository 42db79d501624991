"""The metrics against colour-science, at their limits, and summed up; by Dr.Jit and by NumPy."""

import colour
import numpy as np
import pytest

from fotismos.comparisons.departure import arrays, definitions
from fotismos.comparisons.departure.colour import cam16ucs_unclipped, ciede2000, from_srgb
from fotismos.comparisons.departure.definitions import AGREEMENT, DEFINED
from fotismos.comparisons.departure.metrics import (
    LEADING,
    LOG2_EPSILON,
    METRICS,
    Metric,
    Pixelwise,
    log2_luminance_ratio,
)
from fotismos.comparisons.departure.statistics import (
    best_exposure,
    noise_floor,
    summarise,
    summarise_log2_luminance,
)
from fotismos.comparisons.records.departure import Viewing
from fotismos.heuristic.errors import InputError, InstallationError, NonFiniteError
from fotismos.reference.records import plain
from fotismos.reference.rendering.passes import require_finite
from fotismos.reports.run import doctor

pytestmark = pytest.mark.usefixtures("computed_by")
ALL = pytest.mark.parametrize("metric", METRICS.values(), ids=METRICS.keys())
POINTWISE = pytest.mark.parametrize(
    "metric", [m for m in METRICS.values() if isinstance(m, Pixelwise)], ids=lambda m: m.name
)

# Sharma, Wu and Dalal 2005, table 1: two CIE L*a*b* colours and their ΔE00, to 4 decimals.
SHARMA = """
50.0000 2.6772 -79.7751 50.0000 0.0000 -82.7485 2.0425
50.0000 3.1571 -77.2803 50.0000 0.0000 -82.7485 2.8615
50.0000 2.8361 -74.0200 50.0000 0.0000 -82.7485 3.4412
50.0000 -1.3802 -84.2814 50.0000 0.0000 -82.7485 1.0000
50.0000 -1.1848 -84.8006 50.0000 0.0000 -82.7485 1.0000
50.0000 -0.9009 -85.5211 50.0000 0.0000 -82.7485 1.0000
50.0000 0.0000 0.0000 50.0000 -1.0000 2.0000 2.3669
50.0000 -1.0000 2.0000 50.0000 0.0000 0.0000 2.3669
50.0000 2.4900 -0.0010 50.0000 -2.4900 0.0009 7.1792
50.0000 2.4900 -0.0010 50.0000 -2.4900 0.0010 7.1792
50.0000 2.4900 -0.0010 50.0000 -2.4900 0.0011 7.2195
50.0000 2.4900 -0.0010 50.0000 -2.4900 0.0012 7.2195
50.0000 -0.0010 2.4900 50.0000 0.0009 -2.4900 4.8045
50.0000 -0.0010 2.4900 50.0000 0.0010 -2.4900 4.8045
50.0000 -0.0010 2.4900 50.0000 0.0011 -2.4900 4.7461
50.0000 2.5000 0.0000 50.0000 0.0000 -2.5000 4.3065
50.0000 2.5000 0.0000 73.0000 25.0000 -18.0000 27.1492
50.0000 2.5000 0.0000 61.0000 -5.0000 29.0000 22.8977
50.0000 2.5000 0.0000 56.0000 -27.0000 -3.0000 31.9030
50.0000 2.5000 0.0000 58.0000 24.0000 15.0000 19.4535
50.0000 2.5000 0.0000 50.0000 3.1736 0.5854 1.0000
50.0000 2.5000 0.0000 50.0000 3.2972 0.0000 1.0000
50.0000 2.5000 0.0000 50.0000 1.8634 0.5757 1.0000
50.0000 2.5000 0.0000 50.0000 3.2592 0.3350 1.0000
60.2574 -34.0099 36.2677 60.4626 -34.1751 39.4387 1.2644
63.0109 -31.0961 -5.8663 62.8187 -29.7946 -4.0864 1.2630
61.2901 3.7196 -5.3901 61.4292 2.2480 -4.9620 1.8731
35.0831 -44.1164 3.7933 35.0232 -40.0716 1.5901 1.8645
22.7233 20.0904 -46.6940 23.0331 14.9730 -42.5619 2.0373
36.4612 47.8580 18.3852 36.2715 50.5065 21.2231 1.4146
90.8027 -2.0831 1.4410 91.1528 -1.6435 0.0447 1.4441
90.9257 -0.5406 -0.9208 88.6381 -0.8985 -0.7239 1.5381
6.7747 -0.2908 -2.4247 5.8714 -0.0985 -2.2286 0.6377
2.0776 0.0795 -1.1350 0.9033 -0.0636 -0.5514 0.9082
"""


VIEWINGS = [
    Viewing(),
    Viewing(exposure=3.7, white_luminance=80.0, ambient_illuminance=500.0, background=50.0),
    Viewing(exposure=1e-3, white_luminance=1e4, ambient_illuminance=1e-2, background=1.0),
]
HOSTILE = [
    -1e300, -1e6, -1.0, -1e-30, 0.0, 5e-324, 1e-310, 1e-30, 1e-9, 1e-5, 3e-3, 0.0031308, 0.18, 0.5,
    np.nextafter(1, 0), 1.0, np.nextafter(1, 2), 1.5, 49.26, 1e4, 1e6, 1e30,
]  # fmt: skip


@pytest.fixture(scope="module")
def images():
    """A smooth colourful reference with shadow and highlight, and a test image beside it."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[0:48, 0:64] / 64.0
    reference = np.stack((0.9 * x, 0.2 + 0.5 * y, np.abs(x - y)), axis=-1)
    return np.clip(reference + rng.normal(0, 0.02, reference.shape), 0, None), reference


@pytest.fixture(scope="module")
def quiet():
    with np.errstate(all="ignore"), colour.utilities.suppress_warnings(python_warnings=True):
        yield


# --- Definitions ----------------------------------------------------------------------------------


def colours():
    """Pairs of linear colours (N, 3) by what they are."""
    rng = np.random.default_rng(5)
    size = (2_000, 3)
    some, other, noise = *rng.random((2, *size)), rng.normal(size=size)
    grey = rng.random((len(some), 1)) * np.ones(3)
    cube = np.stack(np.meshgrid(*3 * [HOSTILE]), axis=-1).reshape(-1, 3)
    return {
        "in gamut": (some, other),
        "near": (some, some + 1e-4 * noise),
        "nearer": (some, some + 1e-9 * noise),
        "greys": (grey, rng.permutation(grey)),
        "grey and colour": (grey, other),
        "high dynamic range": tuple(np.exp(rng.normal(0.0, 6.0, (2, *size)))),
        "out of gamut": (noise, rng.permutation(noise)),
        "dark": tuple(np.exp(rng.normal(-12.0, 4.0, (2, *size)))),
        "hostile": (cube, rng.permutation(cube)),
    }


def opposite(a, b):
    """Whether the hues of L*a*b* colours are opposite, where CIE DE2000 jumps."""
    (_, a1, b1), (_, a2, b2) = a.T, b.T
    stretch = 1.5 - 0.5 * np.sqrt(1.0 / (1.0 + (50.0 / (np.hypot(a1, b1) + np.hypot(a2, b2))) ** 7))
    turn = np.arctan2(b1, stretch * a1) - np.arctan2(b2, stretch * a2)
    return np.abs(np.abs(turn) - np.pi) < 1e-9


@pytest.mark.guarantee("means", "Colour differences agree with colour-science to 1e-4.")
@pytest.mark.parametrize("viewing", VIEWINGS, ids=["usual", "bright", "dim"])
def test_metrics_are_colour_sciences(viewing, quiet):
    for name, (space, difference) in DEFINED.items():
        for case, (test, reference) in colours().items():
            pair = [space(image, viewing) for image in (test, reference)]
            wanted, defined = difference(*pair), np.full(len(test), True)
            if name == "dE2000":
                defined = ~opposite(*pair)
            found = METRICS[name](test[None], reference[None], viewing)[0]
            assert defined.mean() > 0.5
            assert np.isfinite(found).all()
            np.testing.assert_allclose(
                found[defined], wanted[defined], rtol=0.0, atol=AGREEMENT, err_msg=f"{name} {case}"
            )


def test_the_published_pairs_have_their_difference():
    rows = np.array([line.split() for line in SHARMA.split("\n") if line], float)
    assert rows.shape == (34, 7)
    # Pairs 10 and 14 have opposite hues: 180 degrees are not more than 180.
    for a, b in ((rows[:, :3], rows[:, 3:6]), (rows[:, 3:6], rows[:, :3])):
        np.testing.assert_allclose(ciede2000(a, b), rows[:, 6], atol=5.1e-5)


def test_brighter_than_white(quiet):
    rgb = np.random.default_rng(7).uniform(0.0, 12.0, (5000, 3))
    found = cam16ucs_unclipped(rgb, VIEWINGS[0])
    wanted = definitions.cam16ucs(rgb, VIEWINGS[0], white=np.inf)
    np.testing.assert_allclose(found, wanted, atol=AGREEMENT)


def test_known_extremes():
    black, white, two, four = (np.full((1, 1, 3), value) for value in (0.0, 1.0, 2.0, 4.0))
    cam, itp = METRICS["dE_CAM16UCS"], METRICS["dE_ITP"]
    assert LEADING(white, black) == pytest.approx(100.0)
    assert cam(white, black) == pytest.approx(100.0, abs=3.0)
    # PQ encodes 203 cd/m² as 0.5807 (BT.2408, table 1: 58 %).
    assert itp(white, black) == pytest.approx(720 * 0.5807, abs=0.1)
    # Displays clip, and dE_ITP does not.
    assert LEADING(two, four) == cam(two, four) == 0.0
    assert itp(two, four) > 50.0
    assert LEADING(two, four, Viewing(exposure=0.25)) > 10.0


def test_the_former_name_of_a_root_mean_square_still_works():
    declared = {
        "name": "mine",
        "label": "Contrast",
        "unit": "1",
        "definition": "",
        "caution": "",
        "map_range": (0, 1),
    }
    with pytest.warns(DeprecationWarning, match="averages_squares"):
        former = Metric(**declared, linear=True)
    assert former.mean(np.array([3.0, 4.0])) == pytest.approx(12.5**0.5)


def test_log2_ratio_is_signed_and_defined_at_black():
    greys = np.array([[0.5, 0.125, 0, -1, 0], [0.25, 0.25, 0, 0, 1]])
    found = log2_luminance_ratio(*greys[..., None] * np.ones(3))
    lifted = np.maximum(greys, 0) + LOG2_EPSILON
    np.testing.assert_allclose(found, np.log2(lifted[0] / lifted[1]), atol=1e-12)
    green = np.full((3, 4, 3), (0.0, 0.4, 0.0))
    ratios, stops = summarise_log2_luminance(2 * green, green, np.ones((3, 4), bool))
    np.testing.assert_allclose([*plain(ratios).values(), *stops.ravel()], 1.0, atol=1e-3)


# --- Limits ---------------------------------------------------------------------------------------

LIMITS = {
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
TABLE = np.array(list(LIMITS.values()), float)
ROWS, COLUMNS = (np.repeat(TABLE[:, None], 11, 1), np.repeat(TABLE[None], 11, 0))
"""Every pair of them, as images (11, 11, 3)."""


@ALL
def test_every_pair_of_colours_has_a_finite_symmetric_distance(metric):
    if not isinstance(metric, Pixelwise):  # each pair an image of its own
        found = np.array([
            [metric(a.reshape(1, 1, 3), b.reshape(1, 1, 3)).item() for b in TABLE] for a in TABLE
        ])  # fmt: skip
    else:
        found = metric(ROWS, COLUMNS)
    assert np.isfinite(found).all()
    assert (found >= 0).all()
    assert not found.diagonal().any()
    if metric.name not in ("hdr_flip", "relmse"):
        np.testing.assert_allclose(found, found.T, rtol=1e-9, atol=1e-6)
    assert found[1, 2] < 1e-6  # the hues of greys are undefined
    for viewing in (Viewing(exposure=1e-30), Viewing(exposure=1e30), Viewing(white_luminance=1e6)):
        assert np.isfinite(metric(ROWS, COLUMNS, viewing)).all()


@pytest.mark.parametrize("metric", METRICS.values(), ids=METRICS)
def test_a_map_is_not_a_view_of_the_memory_of_dr_jit(metric):
    """Dr.Jit could wait for ever for a lock when it gives back an array that is made of one."""
    images = np.random.default_rng(7).random((2, 16, 16, 3))
    made = [metric(*images)]
    if isinstance(metric, Pixelwise):
        made += [metric.coordinates(image, Viewing()) for image in images]
    for owner in made:
        while isinstance(owner, np.ndarray) and owner.base is not None:
            owner = owner.base
        assert isinstance(owner, np.ndarray)


def test_errors_of_the_literature_are_as_defined():
    """Against NumPy, with closed forms: of greys whose codes of 8 bits differ by one, and of black.

    Their PSNR is 20 log10(255) = 48.13 dB.
    """
    x, r = np.random.default_rng(3).lognormal(-1, 2, (2, 24, 20, 3))
    mask = np.random.default_rng(4).random((24, 20)) < 0.7
    shown = [colour.cctf_encoding((0.5 * image).clip(0, 1), function="sRGB") for image in (x, r)]
    expected = {
        "rmse": np.sqrt(np.mean((x - r)[mask] ** 2)),
        "relmse": np.mean(((x - r) ** 2 / (r**2 + 0.01))[mask]),
        "smape": np.mean((np.abs(x - r) / (x + r + 0.01))[mask]),
        "srgb_rmse": np.sqrt(np.mean((shown[0] - shown[1])[mask] ** 2)),
    }
    for name, value in expected.items():
        found = summarise(METRICS[name], x, r, mask, Viewing(exposure=0.5))[0]
        assert found.mean == pytest.approx(value, rel=1e-6)
        assert (found.psnr is not None) == (name == "srgb_rmse")
        if found.psnr is not None:
            assert found.psnr == pytest.approx(10 * np.log10(1 / value**2))
    greys = [np.full((8, 8, 3), from_srgb(np.array(code / 255))) for code in (100, 101)]
    everywhere = np.ones((8, 8), bool)
    assert summarise(METRICS["srgb_rmse"], *greys, everywhere)[0].psnr == pytest.approx(48.1308)
    assert summarise(METRICS["srgb_rmse"], greys[0], greys[0], everywhere)[0].psnr is None
    white, black = np.ones((8, 8, 3)), np.zeros((8, 8, 3))
    assert METRICS["relmse"](white, black).mean() == pytest.approx(100)
    assert METRICS["relmse"](black, white).mean() == pytest.approx(1 / 1.01)
    assert METRICS["smape"](white, black).mean() == pytest.approx(1 / 1.01)


def test_a_pixel_that_is_not_finite_is_named_with_layer_count_and_place():
    for wrong in (np.nan, np.inf):
        bad = np.zeros((4, 5, 3))
        bad[2, 3, 1] = bad[3, 0, 0] = wrong
        with pytest.raises(NonFiniteError, match=r"test image: 2 of 20 .* \(x, y\) = \(3, 2\)"):
            LEADING(bad, np.zeros_like(bad))
        with pytest.raises(NonFiniteError, match=r"reference picture: 2 of 20"):
            LEADING(np.zeros_like(bad), bad)
        with pytest.raises(NonFiniteError, match=r"depth: 1 of 4 .*\(1, 0\)"):
            require_finite(np.array([[0, wrong], [1, 2]]), "depth")


def test_wrong_shapes_and_viewing_are_refused(images):
    for pair in ((images[0], images[1][:-1]), np.zeros((2, 4, 4))):
        with pytest.raises(InputError, match="cannot be compared"):
            LEADING(*pair)
    for value in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="exposure"):
            Viewing(exposure=value)
    with pytest.raises(InputError, match="white_luminance"):
        Viewing(white_luminance=0.0)
    for value in (0.0, 0.5, -67.0, 1001.0, np.nan, np.inf):
        with pytest.raises(InputError, match="give 1 to 1000, such as 67"):
            Viewing(pixels_per_degree=value)


# --- Statistics -----------------------------------------------------------------------------------


@ALL
def test_best_exposure_finds_a_known_factor(metric, images):
    reference = images[1]
    mask, black = np.ones(reference.shape[:2], bool), np.zeros_like(reference)
    for factor in (0.11, 1.0, 13.0):
        precision = 1e-12 if metric.name == "rmse" else 1e-6
        found = best_exposure(metric, reference / factor, reference, mask)
        assert found == pytest.approx(factor, rel=precision)
    after = summarise(metric, reference / 1.7, reference, mask)[0].after_exposure
    assert after.max == pytest.approx(0.0, abs=1e-3)
    # It is 1 where it has no meaning.
    for test, truth, where in (
        (black, reference, mask),
        (images[0], black, mask),
        (*images, ~mask),
    ):
        assert best_exposure(metric, test, truth, where) == 1.0


@POINTWISE
def test_best_exposure_is_the_minimum_of_a_scan(metric, images):
    """With another shape there is no exact factor; no factor of a scan may do better."""
    reference = images[1]
    test = 0.4 * reference**1.3
    factor = best_exposure(metric, test, reference, np.ones(reference.shape[:2], bool))
    means = [metric.mean(metric(s * test, reference)) for s in np.geomspace(1 / 64, 64, 121)]
    assert factor != 1.0
    assert metric.mean(metric(factor * test, reference)) <= min(means) * (1 + 1e-6)


@ALL
def test_summary_is_of_the_mask(metric, images):
    test, reference = images
    mask = np.zeros(test.shape[:2], bool)
    mask[10:30, 5:40] = True
    summary, distance = summarise(metric, test, reference, mask, noise=test - reference)
    values = metric(test, reference)
    np.testing.assert_array_equal(distance, values.astype(np.float32))
    values = values[mask]
    mean = np.sqrt((values**2).mean()) if metric.averages_squares else values.mean()
    found = (summary.mean, summary.p50, summary.p95, summary.max)
    assert found == pytest.approx((mean, *np.percentile(values, (50, 95, 100))))
    for share in summary.visible:
        assert share.low <= (values > share.threshold).mean() <= share.high
    assert tuple(share.threshold for share in summary.visible) == metric.visible
    floor = noise_floor(metric, reference, test - reference, mask)
    assert summary.noise_floor == pytest.approx(floor)
    assert summary.after_exposure.mean <= summary.mean
    empty = summarise(metric, test, reference, np.zeros_like(mask), noise=test - reference)[0]
    assert (empty.mean, empty.max, empty.noise_floor) == (0.0, 0.0, 0.0)
    assert empty.after_exposure.exposure == 1.0


@POINTWISE
def test_noise_floor_is_what_noise_alone_gives(metric):
    """Twice the noise gives twice the floor, four times of squares; another draw gives the same."""
    rng = np.random.default_rng(3)
    reference = np.full((80, 80, 3), 0.4)
    mask = np.ones((80, 80), bool)
    first, second = rng.normal(0, 0.002, (2, 80, 80, 3))
    floor = noise_floor(metric, reference, first, mask)
    assert floor > 0.0
    assert noise_floor(metric, reference, second, mask) == pytest.approx(floor, rel=0.05)
    factor = 4 if metric.squared else 2
    twice = noise_floor(metric, reference, 2 * first, mask)
    assert twice == pytest.approx(factor * floor, rel=0.02)
    assert noise_floor(metric, reference, 0 * first, mask) == 0.0


# --- Blocks, and the doctor -----------------------------------------------------------------------


def test_single_precision_is_widened_first():
    images = np.random.default_rng(0).random((2, 15, 3)).astype(np.float32)
    found = METRICS["dE2000"](*images[:, None])
    np.testing.assert_allclose(found, METRICS["dE2000"](*images[:, None].astype(float)), rtol=1e-9)


def test_numpy_takes_blocks_of_any_number_of_pixels(monkeypatch):
    images = np.random.default_rng(0).random((2, 15, 3))
    whole = METRICS["dE2000"].difference(*images)
    monkeypatch.setattr(arrays, "PIXELS", 7)
    for count in (0, 1, 7, 15):
        found = METRICS["dE2000"].difference(*images[:, :count])
        np.testing.assert_allclose(found, whole[:count], rtol=1e-12)


def test_the_doctor_finds_the_metrics_as_defined(monkeypatch):
    assert 0 < doctor.compared() <= AGREEMENT
    space, _ = DEFINED["dE_ITP"]
    monkeypatch.setitem(
        DEFINED, "dE_ITP", (space, lambda a, b: np.linalg.norm(a - b, axis=-1) + 2e-4)
    )
    with pytest.raises(InstallationError, match="from colour-science's"):
        doctor.compared()
