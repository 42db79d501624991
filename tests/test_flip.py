"""FLIP: closed forms, an independent computation of its colour stage, exposures, and neighbours."""

import numpy as np
import pytest
from colour.models import RGB_COLOURSPACE_BT709, XYZ_to_Lab
from flip_evaluator import evaluate

from comparisons.departure import definitions
from comparisons.departure.flip import MOST_STOPS, exposures, hdr_flip, ldr_flip
from comparisons.departure.metrics import LEADING, METRICS
from comparisons.departure.spaces import DEFAULT_VIEWING, Viewing
from heuristic.errors import InputError

FLIPS = pytest.mark.parametrize("name", ["ldr_flip", "hdr_flip"])
SIZE = (11, 13, 3)


def flat(colour):
    return np.broadcast_to(np.asarray(colour, float), SIZE)


def hunted(colour):
    """L*a*b* of a linear colour, its chroma scaled by the lightness (Hunt's effect)."""
    matrix = RGB_COLOURSPACE_BT709.matrix_RGB_to_XYZ
    lab = XYZ_to_Lab(matrix @ colour, RGB_COLOURSPACE_BT709.whitepoint)
    return lab * [1.0, 0.01 * lab[0], 0.01 * lab[0]]


def colour_difference(first, second):
    """Sections 4.1.2 and 4.1.3 of the paper, from 0 to 1: HyAB, compressed and redistributed."""

    def compressed(a, b):
        delta = hunted(np.array(a)) - hunted(np.array(b))
        return (abs(delta[0]) + np.hypot(*delta[1:])) ** 0.7

    largest = compressed([0, 1, 0], [0, 0, 1])
    found, knee = compressed(first, second), 0.4 * largest
    if found < knee:
        return 0.95 * found / knee
    return 0.95 + 0.05 * (found - knee) / (largest - knee)


@pytest.mark.parametrize("seed", range(8))
def test_colours_without_a_pattern_differ_as_the_paper_says(seed):
    first, second = np.random.default_rng(seed).random((2, 3))
    found = ldr_flip(flat(first), flat(second), DEFAULT_VIEWING)
    np.testing.assert_allclose(found, colour_difference(first, second), atol=2e-3)


def cases():
    """Pairs of linear images by what they are: test, reference."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:70, 0:90] / 90
    smooth = np.stack((0.9 * x, 0.2 + 0.5 * y, np.abs(x - y)), axis=-1)
    wide, other = np.exp(rng.normal(0.0, 2.0, (2, *smooth.shape)))
    sparse = np.where(rng.random(smooth.shape) < 0.02, 30.0, 0.0)
    return {
        "noisy": (smooth + rng.normal(0.0, 0.05, smooth.shape), smooth),
        "shifted": (np.roll(smooth, 2, axis=1), smooth),
        "dimmed": (0.7 * smooth, smooth),
        "bright": (wide, other),
        "sparse": (sparse, np.roll(sparse, 1, axis=0)),
        "dark": (1e-4 * wide, 1e-4 * other),
        "a row": (wide[:1], other[:1]),
        "a column": (smooth[:, :1], wide[:, :1]),
    }


@pytest.mark.guarantee(
    "means", "FLIP and HDR-FLIP agree with their authors' program to 1e-4, at any distance."
)
@pytest.mark.parametrize("pixels", [20.0, 67.0, 300.0])
@pytest.mark.parametrize("case", list(cases()))
@FLIPS
def test_flip_is_its_authors(name, case, pixels):
    viewing = Viewing(pixels_per_degree=pixels, exposure=1.3)
    found = METRICS[name](*cases()[case], viewing)
    wanted = definitions.flip(name, *cases()[case], viewing)
    assert found.shape == wanted.shape
    assert found.max() > 0.01
    np.testing.assert_allclose(found, wanted, rtol=0.0, atol=definitions.AGREEMENT)


@FLIPS
def test_images_together_are_as_far_as_each_alone(name):
    """Also where they exceed one band of rows."""
    first, second, reference = np.random.default_rng(4).random((3, 300, 9, 3))
    metric = METRICS[name]
    found = metric.each([first, second], reference, ..., DEFAULT_VIEWING)
    for image, values in zip((first, second), found, strict=True):
        np.testing.assert_array_equal(values, metric(image, reference))
        np.testing.assert_allclose(
            values, definitions.flip(name, image, reference, DEFAULT_VIEWING), atol=1e-4
        )


def test_closed_forms():
    rgb = np.random.default_rng(0).random(SIZE)
    assert not ldr_flip(rgb, rgb, DEFAULT_VIEWING).any()
    assert not hdr_flip(rgb, rgb, DEFAULT_VIEWING).any()
    green_blue = ldr_flip(flat([0, 1, 0]), flat([0, 0, 1]), DEFAULT_VIEWING)
    np.testing.assert_allclose(green_blue, 1.0, atol=1e-5)
    white_black = ldr_flip(flat([1, 1, 1]), flat([0, 0, 0]), DEFAULT_VIEWING)
    np.testing.assert_allclose(white_black, colour_difference([1] * 3, [0] * 3), atol=1e-4)


def test_ldr_flip_is_symmetric_and_ends_at_white():
    first, second = np.random.default_rng(1).random((2, *SIZE))
    there, back = (ldr_flip(*pair, DEFAULT_VIEWING) for pair in ((first, second), (second, first)))
    np.testing.assert_allclose(there, back, atol=1e-6)
    assert not ldr_flip(1.0 + first, 1.0 + second, DEFAULT_VIEWING).any()
    assert hdr_flip(1.0 + first, 1.0 + second, DEFAULT_VIEWING).max() > 0.01


def test_a_pattern_counts_less_the_more_pixels_there_are_to_a_degree():
    """Pixel by pixel a fine checkerboard is far from its mean, and from afar nobody sees it."""
    fine = np.indices(SIZE)[:2].sum(axis=0) % 2.0
    grey = flat([0.5] * 3)
    means = [
        ldr_flip(fine, grey, Viewing(pixels_per_degree=pixels)).mean() for pixels in (5, 30, 120)
    ]
    assert means[0] > 1.5 * means[1] > 2.25 * means[2]
    assert LEADING(fine, grey).mean() > 20


@pytest.mark.parametrize("seed", range(4))
def test_exposures_are_those_of_the_authors(seed):
    reference = np.random.default_rng(seed).lognormal(0.0, 1.0, SIZE)
    *_, used = evaluate(reference.astype(np.float32), reference.astype(np.float32), "HDR")
    expected = used["startExposure"], used["stopExposure"]
    np.testing.assert_allclose(exposures(reference), expected, atol=1e-3)


@pytest.mark.parametrize("value", [0.0, 1e-38, 1e-9, 1.0, 1e30])
def test_no_reference_ends_the_process_or_the_range(value):
    """The authors' code calls exit where the reference is black."""
    reference = np.zeros(SIZE)
    reference[0, 0] = value
    test = flat([0.5] * 3)
    start, stop = exposures(reference)
    assert 0.0 <= stop - start <= MOST_STOPS
    for function in (hdr_flip, ldr_flip):
        found = function(test, reference, DEFAULT_VIEWING)
        assert found.shape == SIZE[:2]
        assert ((found >= 0.0) & (found <= 1.0)).all()


@FLIPS
def test_exposure_is_that_of_the_viewing_conditions(name):
    test, reference = np.random.default_rng(2).random((2, *SIZE))
    bright = METRICS[name](2.0 * test, 2.0 * reference)
    exposed = METRICS[name](test, reference, Viewing(exposure=2.0))
    np.testing.assert_allclose(bright, exposed, atol=1e-6)


@pytest.mark.parametrize("pixels", [0.0, 0.5, -67.0, 1001.0, np.nan, np.inf])
def test_pixels_per_degree_have_bounds(pixels):
    with pytest.raises(InputError, match="give 1 to 1000, such as 67"):
        Viewing(pixels_per_degree=pixels)


def test_the_command_line_says_how_many_pixels_there_are_to_a_degree(run, scene_file, tmp_path):
    means = {}
    for words in ((), ("--pixels-per-degree", 20)):
        out = tmp_path / f"out{len(words)}"
        run("compare", scene_file, "-o", out, "--spp", 4, "--no-why", *words)
        text = (out / "tables/metrics.csv").read_text(encoding="utf-8")
        rows = (line.split(",") for line in text.splitlines()[1:])
        means[words] = {row[1]: float(row[2]) for row in rows}
    first, second = means.values()
    assert first["dE2000"] == pytest.approx(second["dE2000"], rel=1e-6)
    assert first["ldr_flip"] != second["ldr_flip"]
    code, _, messages = run("compare", scene_file, "--pixels-per-degree", "nan")
    assert (code, "1<=x<=1000" in messages) == (2, True)
