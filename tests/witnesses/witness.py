"""A case whose answer is known in closed form, and how far the reference is from it.

A case goes the way of every command: it is opened, paired, planned and rendered at the samples that
its plan asks for. What counts is the difference between reference and closed form, in the mean over
the image and over its blocks; its standard error comes from the passes, pixels being independent.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy import stats

from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.rendering.passes import passes

BLOCKS = 4
"""Blocks along each side of the image, whose means are looked at too: the shape counts."""

CHANCE = 1e-4
"""That one right case fails, over its image and blocks."""

ROUNDING = 2e-5
"""Of single precision, in rendering and in the tables of plans."""

POINTS = 4
"""Along each side of a pixel, at which the closed form is averaged (Gauss and Legendre)."""


@dataclass(frozen=True)
class Witness:
    """A scene, and its picture in closed form.

    Attributes
    ----------
    name
        What is seen.
    form, source
        The formula, and who published or how one derives it.
    scene
        Returns the scene's dictionary, whose camera is of :func:`above`.
    radiance
        ``(x, y) -> radiance`` at points (N,) of the film, from -1 to 1 rightwards and upwards.
    precision
        The half width of the interval about the measured mean, at most. What is twice as far off
        is found.
    form_error
        Of a formula that is evaluated numerically, and of tables in Mitsuba and in plans.
    mean_only
        Whether the form tells the mean over the image alone.
    size
        Of the image, in pixels along each side.
    """

    name: str
    form: str
    source: str
    scene: Callable[[], dict]
    radiance: Callable[[np.ndarray, np.ndarray], np.ndarray]
    precision: float = 1e-3
    form_error: float = ROUNDING
    mean_only: bool = False
    size: int = 128


@dataclass(frozen=True)
class Deviation:
    """The reference less the closed form, its standard errors, and half widths of intervals.

    All are in units of the closed form's mean. The first entry is the mean over the image, the
    others are those over its blocks.
    """

    value: np.ndarray
    standard_error: np.ndarray
    half_width: np.ndarray
    spp: int
    passes: int


@cache
def rendered(witness: Witness, everything: bool = False) -> tuple[np.ndarray, int]:
    """Return the passes (P, H, W) of the reference in grey, and samples per pixel in all."""
    request = Options(resolution=(witness.size, witness.size), everything=everything)
    case = open_case(witness.scene, request, witness.name)
    ready = prepare(case.source, case.options)
    images = [np.mean(one[0], axis=2) for one in passes((ready.reference,), 0, ready.passes)]
    return np.array(images, float), ready.reference.pass_spp * ready.passes


def deviation(witness: Witness, everything: bool = False, factor: float = 1.0) -> Deviation:
    """Return how far the reference, times a factor, is from the closed form."""
    images, spp = rendered(witness, everything)
    images, expected = factor * images, picture(witness)
    pixels = expected.size / np.array([1, *[BLOCKS**2] * BLOCKS**2])
    found = means(images.mean(axis=0) - expected) / expected.mean()
    # The variance of a pixel is known badly from its passes, that of many together well.
    variance = means(images.var(axis=0, ddof=1)) / len(images)
    error = np.sqrt(variance / pixels) / expected.mean()
    tests = 1 if witness.mean_only else len(found)
    half_width = stats.norm.isf(CHANCE / tests / 2) * error + witness.form_error
    return Deviation(found[:tests], error[:tests], half_width[:tests], spp, len(images))


def picture(witness: Witness) -> np.ndarray:
    """Return the closed form's picture (size, size): means over the pixels."""
    nodes, weights = np.polynomial.legendre.leggauss(POINTS)
    size = witness.size
    edges = -1 + 2 * np.arange(size) / size
    places = (edges[:, None] + (nodes + 1) / size).ravel()
    x, y = np.meshgrid(places, -places)
    values = np.broadcast_to(witness.radiance(x.ravel(), y.ravel()), x.size)
    cells = values.reshape(size, POINTS, size, POINTS)
    return np.einsum("ipjq,p,q->ij", cells, weights / 2, weights / 2)


def means(image):
    """Return the mean of an image (H, W, ...) and those of its blocks."""
    side, colours = len(image) // BLOCKS, image.shape[2:]
    blocks = image.reshape(BLOCKS, side, BLOCKS, side, *colours).mean(axis=(1, 3))
    return np.array([image.mean(axis=(0, 1)), *blocks.reshape(-1, *colours)])
