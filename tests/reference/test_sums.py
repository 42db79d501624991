"""Sums of passes, by Dr.Jit and by NumPy, against NumPy's own statistics of all passes at once."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.reference.rendering.sums import (
    DEVIATION,
    MEAN,
    Accumulator,
    DifferenceSums,
    add_difference,
)

SIZE = (24, 17)


KINDS = ("TensorXd", "ndarray")


def passed(kind, image):
    """An image as a pass of a kind."""
    return image if kind == "ndarray" else getattr(mi, kind)(image)


def total_of(images, kind, **options):
    total = Accumulator(**options)
    for image in images:
        total.add(passed(kind, image))
    return total


@pytest.mark.parametrize("kind", ["TensorXf", "ndarray"])
@pytest.mark.parametrize("passes", [2, 3, 16])
def test_running_sums_are_numpys_mean_and_deviation(rgb, passes, kind):
    images = np.random.default_rng(passes).exponential(size=(passes, 5, 7, 3)).astype(np.float32)
    found, images = total_of(images, kind).estimate(), images.astype(float)
    np.testing.assert_allclose(found.mean, images.mean(axis=0), rtol=1e-12)
    error = images.std(axis=0, ddof=1) / np.sqrt(passes)
    np.testing.assert_allclose(found.standard_error, error, rtol=1e-9)
    signs = np.where(np.arange(passes) % 2, -1, 1)[:, None, None, None]
    np.testing.assert_allclose(found.noise, (signs * images).mean(axis=0), atol=1e-12)
    assert found.passes == passes


@pytest.mark.parametrize("kind", KINDS)
def test_small_noise_on_a_large_level_is_kept(rgb, kind):
    """A sum of squares less the square of the sum would lose it."""
    images = 1e4 + np.random.default_rng(1).normal(size=(50, 4, 4, 3)) * 1e-3
    error = images.std(axis=0, ddof=1) / np.sqrt(50)
    found = total_of(images, kind, moments=DEVIATION).standard_error()
    np.testing.assert_allclose(found, error, rtol=1e-6)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("scale", [1e-15, 1.0, 1e10])
def test_the_sums_of_halves_are_those_of_their_difference(rgb, scale, kind):
    """However dim or bright; and a difference without noise has none."""
    counted = np.ones(SIZE, bool)
    images = scale * np.random.default_rng(1).exponential(size=(2, 16, *SIZE, 3)) ** 2
    for passes, is_noisy in ((images, True), (np.repeat(images[:, :1], 6, axis=1), False)):
        sums = Accumulator(MEAN), Accumulator(DEVIATION), DifferenceSums(counted)
        for pair in zip(*passes, strict=True):
            add_difference(sums, [passed(kind, image) for image in pair])
        difference, found = passes[0] - passes[1], sums[2].estimate()
        count = len(difference)
        np.testing.assert_allclose(
            found.mean, difference.mean(axis=0), rtol=1e-9, atol=1e-12 * scale
        )
        error = difference.std(axis=0, ddof=1) / np.sqrt(count)
        np.testing.assert_allclose(found.standard_error, error, rtol=1e-6, atol=1e-12 * scale)
        third = np.sum((difference - difference.mean(axis=0)) ** 3, axis=0)
        third /= count * (count - 1) * (count - 2)
        np.testing.assert_allclose(found.third, third, rtol=1e-6, atol=1e-9 * scale**3)
        assert found.noise.any() == is_noisy
        groups = found.grouped.means.reshape(-1, *SIZE, 3)
        np.testing.assert_allclose(groups[0], difference[::8].mean(axis=0))
