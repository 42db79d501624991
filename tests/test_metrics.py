"""The metrics against published values and against formulas written again, in plain NumPy."""

import json

import numpy as np
import pytest

from comparisons.departure import definitions
from comparisons.departure.metric import Metric, Pixelwise
from comparisons.departure.metrics import (
    LOG2_EPSILON,
    METRICS,
    RMSE,
    delta_e_2000,
    delta_e_cam16ucs,
    delta_e_itp,
    log2_luminance_ratio,
    rmse,
)
from comparisons.departure.spaces import Viewing
from comparisons.departure.statistics import (
    best_exposure,
    noise_floor,
    summarise,
    summarise_log2_luminance,
)
from comparisons.records import plain
from heuristic.errors import InputError, InstallationError, NonFiniteError
from reference.rendering.renderer import require_finite
from reports.commands import doctor

VIEWING = Viewing()
ALL = pytest.mark.parametrize("metric", METRICS.values(), ids=METRICS.keys())
POINTWISE = pytest.mark.parametrize(
    "metric", [m for m in METRICS.values() if isinstance(m, Pixelwise)], ids=lambda m: m.name
)
PERCEPTUAL = pytest.mark.parametrize("metric", [m for m in METRICS.values() if not m.linear])

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


@pytest.fixture(scope="module")
def images():
    """A smooth colourful reference with shadow and highlight, and a test image beside it."""
    rng = np.random.default_rng(1)
    y, x = np.mgrid[0:48, 0:64] / 64.0
    reference = np.stack((0.9 * x, 0.2 + 0.5 * y, np.abs(x - y)), axis=-1)
    return np.clip(reference + rng.normal(0, 0.02, reference.shape), 0, None), reference


def primaries_to_xyz(red, green, blue, white=(0.3127, 0.3290)):
    columns = np.array([[x / y, 1.0, (1 - x - y) / y] for x, y in (red, green, blue)]).T
    x, y = white
    return columns * np.linalg.solve(columns, [x / y, 1.0, (1 - x - y) / y])


BT709 = primaries_to_xyz((0.64, 0.33), (0.30, 0.60), (0.15, 0.06))
BT2020 = primaries_to_xyz((0.708, 0.292), (0.170, 0.797), (0.131, 0.046))


def lab_by_hand(rgb):
    ratio = np.clip(rgb, 0, 1) @ BT709.T / BT709.sum(axis=1)
    linear = ratio / (3 * (6 / 29) ** 2) + 4 / 29
    f = np.where(ratio > (6 / 29) ** 3, np.cbrt(ratio), linear)
    return np.stack(
        (116 * f[..., 1] - 16, 500 * (f[..., 0] - f[..., 1]), 200 * (f[..., 1] - f[..., 2])), -1
    )


def itp_by_hand(rgb, white):
    """BT.2100-2, tables 4 and 7, with their integer matrices."""
    rgb = np.clip(rgb @ (np.linalg.inv(BT2020) @ BT709).T * white, 0, 10_000)
    lms = rgb @ np.array([[1688, 2146, 262], [683, 2951, 462], [99, 309, 3688]]).T / 4096
    power = (lms / 10_000) ** (2610 / 16384)
    pq = ((3424 / 4096 + 2413 / 128 * power) / (1 + 2392 / 128 * power)) ** (2523 / 32)
    matrix = np.array([[2048, 2048, 0], [6610, -13613, 7003], [17933, -17390, -543]]) / 4096
    return (pq @ matrix.T) * [1.0, 0.5, 1.0]


def cam16ucs_by_hand(rgb, illuminance=64.0, background=20.0):
    """Li et al. 2017 in its own order, average surround (F = 1, c = 0.69, N_c = 1)."""
    m16 = np.array(
        [
            [0.401288, 0.650173, -0.051461],
            [-0.250268, 1.204414, 0.045854],
            [-0.002079, 0.048952, 0.953127],
        ]
    )
    adapting = illuminance / np.pi * 0.2
    k = 1 / (5 * adapting + 1)
    level = 0.2 * k**4 * 5 * adapting + 0.1 * (1 - k**4) ** 2 * np.cbrt(5 * adapting)
    n = background / 100
    z, induction = 1.48 + np.sqrt(n), 0.725 * n**-0.2
    white = m16 @ (100 * BT709.sum(axis=1))
    degree = np.clip(1 - np.exp((-adapting - 42) / 92) / 3.6, 0, 1)
    gain = degree * 100 / white + 1 - degree

    def respond(v):
        p = (level * np.abs(v) / 100) ** 0.42
        return 400 * np.sign(v) * p / (p + 27.13) + 0.1

    weights = np.array([2, 1, 1 / 20])
    white_response = (respond(gain * white) @ weights - 0.305) * induction
    r = respond(gain * (100 * np.clip(rgb, 0, 1) @ BT709.T @ m16.T))
    a = r[..., 0] - 12 * r[..., 1] / 11 + r[..., 2] / 11
    b = (r[..., 0] + r[..., 1] - 2 * r[..., 2]) / 9
    hue = np.arctan2(b, a)
    eccentricity = (np.cos(hue + 2) + 3.8) / 4
    lightness = 100 * ((r @ weights - 0.305) * induction / white_response) ** (0.69 * z)
    t = 50_000 / 13 * induction * eccentricity * np.hypot(a, b) / (r @ [1, 1, 21 / 20])
    chroma = t**0.9 * np.sqrt(lightness / 100) * (1.64 - 0.29**n) ** 0.73
    stretched = np.log(1 + 0.0228 * chroma * level**0.25) / 0.0228
    j = 1.7 * lightness / (1 + 0.007 * lightness)
    return np.stack((j, stretched * np.cos(hue), stretched * np.sin(hue)), axis=-1)


def test_ciede2000_gives_the_published_values():
    rows = np.array([line.split() for line in SHARMA.split("\n") if line], float)
    assert rows.shape == (34, 7)
    a, b = rows[:, :3], rows[:, 3:6]
    for pair in ((a, b), (b, a)):
        np.testing.assert_allclose(METRICS["dE2000"].difference(*pair), rows[:, 6], atol=5.1e-5)


def test_lab_is_the_formula_and_white_is_neutral(images):
    expected = lab_by_hand(images[0])
    got = METRICS["dE2000"].coordinates(images[0], VIEWING)
    np.testing.assert_allclose(got, expected, atol=1e-6)
    white = METRICS["dE2000"].coordinates(np.ones((1, 1, 3)), VIEWING)
    np.testing.assert_allclose(white, [[[100, 0, 0]]], atol=1e-9)


@pytest.mark.parametrize("white", [100.0, 203.0, 1000.0])
def test_itp_is_720_times_the_distance_of_bt2124(images, white):
    import colour

    test, reference = 3.0 * images[0], images[1]
    a, b = itp_by_hand(test, white), itp_by_hand(reference, white)
    expected = 720 * np.linalg.norm(a - b, axis=-1)
    got = delta_e_itp(test, reference, Viewing(white_luminance=white))
    np.testing.assert_allclose(got, expected, rtol=1e-6, atol=1e-6)
    # colour-science's own distance halves Ct itself, so it wants (I, Ct, Cp).
    own = colour.difference.delta_E_ITP(a * [1, 2, 1], b * [1, 2, 1])
    np.testing.assert_allclose(got, own, rtol=1e-6, atol=1e-6)


def test_cam16ucs_is_the_formula(images):
    expected = np.linalg.norm(cam16ucs_by_hand(images[0]) - cam16ucs_by_hand(images[1]), axis=-1)
    np.testing.assert_allclose(delta_e_cam16ucs(*images), expected, rtol=1e-6, atol=1e-6)
    other = Viewing(ambient_illuminance=500.0, background=40.0)
    a, b = (cam16ucs_by_hand(image, 500.0, 40.0) for image in images)
    np.testing.assert_allclose(
        delta_e_cam16ucs(*images, other), np.linalg.norm(a - b, axis=-1), rtol=1e-6, atol=1e-6
    )


@POINTWISE
def test_identity_is_zero_and_order_does_not_matter(metric, images):
    test, reference = images
    np.testing.assert_array_equal(metric(test, test), 0.0)
    np.testing.assert_allclose(metric(test, reference), metric(reference, test), atol=1e-9)
    assert metric(test, reference).min() > 0.0


@PERCEPTUAL
def test_the_exposure_is_a_factor_on_both_images(metric, images):
    expected = metric(0.3 * images[0], 0.3 * images[1])
    got = metric(*images, Viewing(exposure=0.3))
    np.testing.assert_allclose(got, expected, rtol=1e-9, atol=1e-9)


@POINTWISE
def test_blocks_do_not_show(metric):
    rng = np.random.default_rng(2)
    test, reference = rng.random((2, 190, 180, 3))  # 34,200 pixels: one block and a bit
    whole = metric(test, reference)
    assert whole.shape == (190, 180)
    np.testing.assert_array_equal(whole[-1:], metric(test[-1:], reference[-1:]))


@POINTWISE
def test_arguments_are_left_alone(metric, images):
    coordinates = [metric.coordinates(image, VIEWING) for image in images]
    before = [c.copy() for c in (*images, *coordinates)]
    metric.difference(*coordinates)
    for array, copy in zip((*images, *coordinates), before, strict=True):
        np.testing.assert_array_equal(array, copy)


@ALL
def test_every_finite_colour_has_a_finite_distance(metric):
    values = [-1e6, -1e-3, 0.0, 1e-30, 1e-9, 1e-5, 1e-3, 0.02, 0.5, 1.0, 7.0, 1e6]
    cube = np.stack(np.meshgrid(values, values, values), axis=-1).reshape(1, -1, 3)
    for other in (0.0, 0.5, 1e6):
        distance = metric(cube, np.full_like(cube, other))
        assert np.isfinite(distance).all()
        assert distance.min() >= 0.0


def test_known_extremes():
    black, white = np.zeros((1, 1, 3)), np.ones((1, 1, 3))
    assert delta_e_2000(white, black) == pytest.approx(100.0)
    assert delta_e_cam16ucs(white, black) == pytest.approx(100.0, abs=3.0)
    # PQ encodes 203 cd/m² as 0.5807 (BT.2408, table 1: 58 %).
    assert delta_e_itp(white, black) == pytest.approx(720 * 0.5807, abs=0.1)


def test_displays_clip_and_itp_does_not():
    two, four = np.full((1, 1, 3), 2.0), np.full((1, 1, 3), 4.0)
    assert delta_e_2000(two, four) == 0.0
    assert delta_e_cam16ucs(two, four) == 0.0
    assert delta_e_itp(two, four) > 50.0
    assert delta_e_2000(two, four, Viewing(exposure=0.25)) > 10.0


def test_log2_ratio_is_signed_and_defined_at_black():
    test = np.array([[[0.5] * 3, [0.125] * 3, [0.0] * 3, [-1.0] * 3, [0.0] * 3]])
    reference = np.array([[[0.25] * 3, [0.25] * 3, [0.0] * 3, [0.0] * 3, [1.0] * 3]])
    expected = np.log2(
        (np.array([0.5, 0.125, 0, 0, 0]) + LOG2_EPSILON)
        / (np.array([0.25, 0.25, 0, 0, 1]) + LOG2_EPSILON)
    )
    np.testing.assert_allclose(log2_luminance_ratio(test, reference)[0], expected, atol=1e-12)
    green = np.array([[[0.0, 0.4, 0.0]]])
    assert log2_luminance_ratio(2 * green, green)[0, 0] == pytest.approx(1.0, abs=1e-3)


def test_rmse_counts_the_mask_only():
    test, reference = np.zeros((2, 2, 3)), np.zeros((2, 2, 3))
    test[0, 0] = [0.3, 0.0, 0.0]
    assert rmse(test, reference) == pytest.approx(0.3 / np.sqrt(12))
    assert rmse(test, reference, [[True, False], [False, False]]) == pytest.approx(0.3 / 3**0.5)
    assert rmse(test, reference, np.zeros((2, 2), bool)) == 0.0


@ALL
@pytest.mark.parametrize("factor", [0.11, 0.8, 1.0, 1.7, 13.0])
def test_best_exposure_finds_a_known_factor(metric, factor, images):
    reference = images[1]
    test, mask = reference / factor, np.ones(reference.shape[:2], bool)
    assert best_exposure(metric, test, reference, mask) == pytest.approx(factor, rel=1e-6)
    if metric.linear:
        assert best_exposure(metric, test, reference, mask) == pytest.approx(factor, rel=1e-12)
    after = summarise(metric, test, reference, mask)[0].after_exposure
    assert after.max == pytest.approx(0.0, abs=1e-3)


@POINTWISE
def test_best_exposure_is_the_minimum_of_a_scan(metric, images):
    """With another shape there is no exact factor; no factor of a fine scan may do better."""
    reference = images[1]
    test = 0.4 * reference**1.3
    mask = np.ones(reference.shape[:2], bool)
    factor = best_exposure(metric, test, reference, mask)

    def mean(scale):
        return metric.mean(metric(scale * test, reference))

    assert factor != 1.0
    assert mean(factor) <= min(mean(s) for s in np.geomspace(1 / 64, 64, 241)) * (1 + 1e-6)


@ALL
def test_best_exposure_is_one_where_it_has_no_meaning(metric, images):
    test, reference = images
    mask = np.ones(test.shape[:2], bool)
    black = np.zeros_like(test)
    assert best_exposure(metric, black, reference, mask) == 1.0
    assert best_exposure(metric, test, black, mask) == 1.0
    assert best_exposure(metric, test, reference, ~mask) == 1.0


@ALL
def test_summary_is_of_the_mask(metric, images):
    test, reference = images
    mask = np.zeros(test.shape[:2], bool)
    mask[10:30, 5:40] = True
    summary, distance = summarise(metric, test, reference, mask, noise=test - reference)
    values = metric(test, reference)
    np.testing.assert_array_equal(distance, values.astype(np.float32))
    mean = np.sqrt((values[mask] ** 2).mean()) if metric.linear else values[mask].mean()
    assert summary.mean == pytest.approx(mean)
    shares = {f"{limit:g}": (values[mask] > limit).mean() for limit in metric.visible}
    assert summary.visible == pytest.approx(shares)
    assert summary.p50 == pytest.approx(np.median(values[mask]))
    assert summary.p95 == pytest.approx(np.percentile(values[mask], 95))
    assert summary.max == pytest.approx(values[mask].max())
    floor = noise_floor(metric, reference, test - reference, mask)
    assert summary.noise_floor == pytest.approx(floor)
    assert summary.after_exposure.mean <= summary.mean
    empty = summarise(metric, test, reference, np.zeros_like(mask), noise=test - reference)[0]
    assert (empty.mean, empty.max, empty.noise_floor) == (0.0, 0.0, 0.0)
    assert empty.after_exposure.exposure == 1.0


def test_linear_summaries(images):
    test, reference = images
    mask = np.ones(test.shape[:2], bool)
    summary, _ = summarise(RMSE, 0.5 * reference, reference, mask, noise=test - reference)
    assert summary.mean == pytest.approx(np.sqrt(np.mean((0.5 * reference) ** 2)))
    assert summary.noise_floor == pytest.approx(rmse(test, reference))
    assert summary.after_exposure.exposure == pytest.approx(2.0)
    assert summary.after_exposure.mean == pytest.approx(0.0, abs=1e-12)
    ratios, stops = summarise_log2_luminance(0.5 * reference + 0.5, reference + 1.0, mask)
    assert stops.shape == mask.shape
    np.testing.assert_allclose(list(plain(ratios).values()), -1.0, atol=1e-3)
    # Plain floats throughout: the record goes into JSON as it is.
    json.dumps([plain(summary), plain(ratios)])


@POINTWISE
def test_noise_floor_is_what_noise_alone_gives(metric):
    """Twice the noise gives twice the floor, another draw the same, none gives none."""
    rng = np.random.default_rng(3)
    reference = np.full((80, 80, 3), 0.4)
    mask = np.ones((80, 80), bool)
    first, second = rng.normal(0, 0.002, (2, 80, 80, 3))
    floor = noise_floor(metric, reference, first, mask)
    assert floor > 0.0
    assert noise_floor(metric, reference, second, mask) == pytest.approx(floor, rel=0.05)
    assert noise_floor(metric, reference, 2 * first, mask) == pytest.approx(2 * floor, rel=0.02)
    assert noise_floor(metric, reference, 0 * first, mask) == 0.0
    # An exact test image sees just this against a noisy reference.
    seen = metric.mean(metric(reference, reference + second))
    assert seen == pytest.approx(floor, rel=0.05)


def test_non_finite_pixels_are_named(images):
    image = images[0].copy()
    image[7, 3, 1], image[20, 5, 2] = np.nan, np.inf
    with pytest.raises(NonFiniteError, match=r"^reference: 2 of 3072 .*\(3, 7\)"):
        require_finite(image, "reference")
    with pytest.raises(NonFiniteError, match="test image"):
        delta_e_2000(image, images[1])
    with pytest.raises(NonFiniteError, match="reference image"):
        rmse(images[1], image)
    with pytest.raises(NonFiniteError, match=r"depth: 1 of 4 .*\(1, 0\)"):
        require_finite(np.array([[0.0, np.nan], [0.0, 0.0]]), "depth")


def test_wrong_shapes_and_viewing_are_refused(images):
    with pytest.raises(InputError, match="cannot be compared"):
        delta_e_2000(images[0], images[1][:-1])
    with pytest.raises(InputError, match="cannot be compared"):
        delta_e_itp(np.zeros((4, 4)), np.zeros((4, 4)))
    for value in (0.0, -1.0, np.nan, np.inf):
        with pytest.raises(InputError, match="exposure"):
            Viewing(exposure=value)
    with pytest.raises(InputError, match="white_luminance"):
        Viewing(white_luminance=0.0)


# --- Metrics from outside, and the definitions that `fotismos doctor` compares --------------------


def declared(**others):
    """A metric of a user's own: a colour space and a distance that are plain functions."""
    return Pixelwise(
        name="own", label="Own", unit="", definition="", caution="", map_range=(0.0, 1.0),
        coordinates=lambda rgb, viewing: np.sqrt(viewing.exposure * np.maximum(rgb, 0)),
        difference=lambda one, other: np.abs(one - other).sum(axis=-1),
        **others,
    )  # fmt: skip


@pytest.mark.parametrize("exposure", [1.0, 0.25])
def test_a_metric_of_plain_functions_is_measured_as_the_others(images, exposure):
    test, reference = images
    viewing, metric = Viewing(exposure=exposure), declared()
    roots = [np.sqrt(exposure * image) for image in images]
    expected = np.abs(roots[0] - roots[1]).sum(axis=-1)
    np.testing.assert_allclose(metric(test, reference, viewing), expected, rtol=1e-12)
    where = expected > np.median(expected)
    distances = metric.against(reference, where, viewing)
    for image, factor in ((test, 1.0), (reference, 0.0)):
        np.testing.assert_allclose(distances(image), factor * expected[where], rtol=1e-12)
    summary, _ = summarise(metric, test, reference, where, viewing=viewing)
    assert summary.mean == pytest.approx(expected[where].mean())


def test_a_metric_without_a_function_says_so(images):
    given = {"name": "own", "label": "Own", "unit": "", "definition": "", "caution": ""}
    metric = Metric(**given, map_range=(0.0, 1.0))
    with pytest.raises(InputError, match="'own' has no function"):
        metric(*images)


def test_the_doctor_finds_the_metrics_as_defined():
    assert 0 < doctor.compared() <= definitions.AGREEMENT


@pytest.mark.parametrize("name", [*definitions.DEFINED, *definitions.FLIPS])
def test_the_doctor_finds_out_a_metric_that_is_not_as_defined(monkeypatch, name):
    right = METRICS[name]

    def wrong(*images):
        return right(*images) + 2 * definitions.AGREEMENT

    monkeypatch.setattr(definitions, "METRICS", {**METRICS, name: wrong})
    with pytest.raises(InstallationError, match="from colour-science's"):
        doctor.compared()
