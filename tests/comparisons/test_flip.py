"""FLIP against its authors' program, closed forms, and exposures."""

import numpy as np
import pytest
from flip_evaluator import evaluate

from fotismos.comparisons.departure.flip import LARGEST, exposures, hdr_flip, ldr_flip
from fotismos.comparisons.departure.metrics import METRICS
from fotismos.comparisons.records.departure import DEFAULT_VIEWING, Viewing

pytestmark = pytest.mark.usefixtures("computed_by")
FLIPS = pytest.mark.parametrize("name", ["ldr_flip", "hdr_flip"])
SIZE = (11, 13, 3)


def defined(name, test, reference, viewing):
    """Return "ldr_flip" or "hdr_flip" (H, W) of linear images from 0 to 65504, by its authors."""
    is_high = name == "hdr_flip"
    truth, shown = (
        np.clip(viewing.exposure * image, 0.0, LARGEST if is_high else 1.0)
        for image in (reference, test)
    )
    parameters = {"ppd": float(viewing.pixels_per_degree)}
    found, *_ = evaluate(
        np.ascontiguousarray(truth, np.float32),
        np.ascontiguousarray(shown, np.float32),
        "HDR" if is_high else "LDR",
        inputsRGB=False,
        applyMagma=False,
        computeMeanError=False,
        parameters=parameters,
    )
    return found[..., 0]


def flat(colour):
    return np.broadcast_to(np.asarray(colour, float), SIZE)


def cases():
    """Pairs of linear images by what they are: test, reference."""
    rng = np.random.default_rng(3)
    y, x = np.mgrid[0:70, 0:90] / 90
    smooth = np.stack((0.9 * x, 0.2 + 0.5 * y, np.abs(x - y)), axis=-1)
    wide, other = np.exp(rng.normal(0.0, 2.0, (2, *smooth.shape)))
    small = (20, 24, 3)  # they have many exposures
    sparse = np.where(rng.random(small) < 0.02, 30.0, 0.0)
    contrast = np.exp(rng.uniform(np.log(1e-5), np.log(1e2), small))
    contrast[:7] = 0.0
    return {
        "noisy": (smooth + rng.normal(0.0, 0.05, smooth.shape), smooth),
        "shifted": (np.roll(smooth, 2, axis=1), smooth),
        "bright": (wide, other),
        "sparse": (sparse, np.roll(sparse, 1, axis=0)),
        "contrast": (1.1 * contrast, contrast),
        "long": tuple(rng.random((2, 300, 9, 3))),  # more than one band of rows
        "a row": (1e-4 * wide[:1], 1e-4 * other[:1]),
    }


@pytest.mark.guarantee(
    "means",
    "FLIP and HDR-FLIP agree with their authors' program.",
)
@pytest.mark.parametrize("pixels", [20.0, 67.0, 300.0])
@FLIPS
def test_flip_is_its_authors(name, pixels):
    viewing = Viewing(pixels_per_degree=pixels, exposure=1.3)
    for case, images in cases().items():
        found = METRICS[name](*images, viewing)
        wanted = defined(name, *images, viewing)
        assert found.shape == wanted.shape
        assert found.max() > 0.01
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-4, err_msg=case)


@pytest.mark.parametrize(("share", "scale"), [(0, 1.0), (0.5, 1.0), (0.9, 1e4), (0, 1e-6)])
def test_exposures_are_those_of_the_authors(share, scale):
    """Also of references that are black in a share of their pixels."""
    random = np.random.default_rng(int(10 * share))
    reference = scale * random.lognormal(0.0, 1.0, SIZE)
    reference[random.random(SIZE[:2]) < share] = 0.0
    reference[0, 0] = scale
    parameters = {"ppd": 10.0}
    *_, used = evaluate(*2 * [reference.astype(np.float32)], "HDR", parameters=parameters)
    expected = used["startExposure"], used["stopExposure"]
    np.testing.assert_allclose(exposures(reference), expected, atol=1e-5)


def test_no_reference_ends_the_process_or_the_range():
    """The authors' code calls exit where the reference is black."""
    test = flat([0.5] * 3)
    for value in (0.0, 1e-38, 1e-9, 1.0, 1e30):
        reference = np.zeros(SIZE)
        reference[0, 0] = value
        start, stop = exposures(np.minimum(reference, LARGEST))
        assert 0.0 <= stop - start <= 39.1
        for function in (hdr_flip, ldr_flip):
            (found,) = function([test], reference, DEFAULT_VIEWING)
            assert found.shape == SIZE[:2]
            assert ((found >= 0.0) & (found <= 1.0)).all()
