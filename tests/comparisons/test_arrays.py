"""Formulas by Dr.Jit and by NumPy: each is stated once, and both give the same."""

import numpy as np
import pytest
from drjit.llvm import Float64

from fotismos.comparisons.departure import arrays
from fotismos.comparisons.departure.colour import DEFAULT_VIEWING, cam16ucs_unclipped, itp, lab
from fotismos.comparisons.departure.metrics import METRICS, Pixelwise

SHAPE = (40, 300, 3)


def cases():
    """Pairs of linear images by what is hard about them."""
    rng = np.random.default_rng(7)
    some, other = rng.random((2, *SHAPE))
    grey = np.repeat(some[..., :1], 3, axis=-1)
    hue = some * [1.0, 1.0, 0.0] + [0.0, 0.0, 0.5]
    levels = rng.integers(0, 3, (2, *SHAPE)) / 2
    wide = np.exp(rng.normal(0.0, 6.0, (2, *SHAPE)))
    return {
        "random": (some, other),
        "near": (some, np.clip(some + rng.normal(0.0, 1e-3, SHAPE), 0.0, None)),
        "greys": (grey, grey[::-1]),
        "a grey and a colour": (grey, other),
        "black and a colour": (np.zeros(SHAPE), other),
        "blacks": (np.zeros(SHAPE), np.zeros(SHAPE)),
        "opposed hues": (hue, 1.0 - hue),
        "corners": tuple(levels),
        "negative": (-some, other),
        "above white": (1e4 * some, 3.0 * other),
        "far apart": tuple(wide),
    }


@pytest.fixture
def both(monkeypatch):
    """A function that computes by Dr.Jit, then by NumPy."""

    def computed(function, *arguments):
        results = []
        for is_compiled in (lambda: True, lambda: False):
            with monkeypatch.context() as patch:
                patch.setattr(arrays, "is_compiled", is_compiled)
                results.append(function(*arguments))
        return results

    return computed


@pytest.mark.parametrize("name", cases())
@pytest.mark.parametrize("kind", [np.float32, np.float64])
def test_distances_are_the_same_by_either(both, name, kind):
    first, second = (image.astype(kind) for image in cases()[name])
    for metric in METRICS.values():
        compiled, plain = both(metric, first, second)
        assert compiled.dtype == plain.dtype
        if isinstance(metric, Pixelwise):
            # The hue of a grey is rounding, and ΔE2000 depends on it by the root of the chromas.
            absolute = 1e-5 if metric.name == "dE2000" and "grey" in name else 1e-9
            np.testing.assert_allclose(plain, compiled, rtol=1e-9, atol=absolute)
        else:  # in single precision, from which the 0.7th power of small differences is taken
            np.testing.assert_allclose(plain, compiled, atol=5e-5)
            assert np.abs(plain - compiled).mean() < 1e-5


@pytest.mark.parametrize("space", [lab, itp, cam16ucs_unclipped])
def test_spaces_are_the_same_by_either(both, space):
    for image, _ in cases().values():
        compiled, plain = both(space, image, DEFAULT_VIEWING)
        assert compiled.shape == plain.shape == image.shape
        np.testing.assert_allclose(plain, compiled, rtol=1e-9, atol=1e-9)


def test_each_function_is_the_same_for_either_kind_of_array():
    values = np.array([-3.0, -0.5, -0.0, 0.0, 0.25, 1.0, 7.0])
    others = values[::-1] + 0.1
    sizes = np.abs(values)
    for function, *arguments in (
        (arrays.absolute, values),
        (arrays.arctan2, values, others),
        (arrays.cbrt, sizes),
        (arrays.clip, values, 0.0, 1.0),
        (arrays.cos, values),
        (arrays.exp, values),
        (arrays.hypot, values, others),
        (arrays.log, sizes + 1.0),
        (arrays.maximum, values, others),
        (arrays.minimum, values, 0.5),
        (arrays.power, sizes, 0.42),
        (arrays.sin, values),
        (arrays.sqrt, sizes),
        (arrays.square, values),
        (arrays.with_sign, sizes, values),
    ):
        compiled = [Float64(each) if isinstance(each, np.ndarray) else each for each in arguments]
        np.testing.assert_allclose(function(*arguments), function(*compiled), rtol=1e-14, atol=0)


def test_numpy_takes_blocks_of_any_number_of_pixels(both, monkeypatch):
    monkeypatch.setattr(arrays, "PIXELS", 7)
    for count in (0, 1, 7, 15):
        colours = np.random.default_rng(count).random((2, count, 3))
        compiled, plain = both(METRICS["dE2000"].difference, *colours)
        np.testing.assert_allclose(plain, compiled, rtol=1e-9)
        compiled, plain = both(lab, colours, DEFAULT_VIEWING)
        np.testing.assert_allclose(plain, compiled, rtol=1e-9, atol=1e-12)
