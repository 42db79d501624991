"""What a check measures of a scene: the departure and regional colours, each with its doubt.

Both halves are rendered in independent passes, as a comparison does. The spread of passes is the
only source of the standard errors here, so that they hold whatever noise a scene has.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from comparisons.departure.metrics import METRICS, Array, log2_luminance_ratio, rmse
from comparisons.departure.spaces import Viewing
from comparisons.departure.statistics import noise_floor
from reference.rendering.gbuffer import gbuffer
from reference.rendering.passes import passes

PASSES = 16
"""Enough for a t-test corrected for a hundred quantities to see five standard errors."""

GRID = 4
"""Blocks along each side of the image: few enough to be read, small enough to tell places apart."""

HALVES = ("heuristic", "reference")

ROUNDING = dict.fromkeys(METRICS, 1e-3) | {"rmse": 1e-6, "log2_luminance": 1e-4}
"""Differences of a metric that rounding can make, in its own unit: perceptual distances and stops
are steep near black, where 1e-6 of linear light shows most."""

LINEAR_ROUNDING = 1e-6


@dataclass(frozen=True)
class Quantity:
    """One number that was measured.

    Attributes
    ----------
    name
        Of a metric, or ``heuristic R`` and the like; of a block with its row and column, from 1.
    value, error
        The number, and its standard error.
    rounding
        Difference that rounding can make.
    half, block
        Where a colour was measured: the half, and ``(row, column)`` from 0 if not all over it.
    """

    name: str
    value: float
    error: float
    rounding: float
    half: str | None = None
    block: tuple[int, int] | None = None


@dataclass(frozen=True)
class Metric:
    """A departure metric, its standard error, and what noise alone would give.

    ``noise_floor`` is None for the signed ratio of luminances, which noise does not raise.
    """

    value: float
    error: float
    noise_floor: float | None


@dataclass(frozen=True)
class Colours:
    """Mean linear RGB of one half over the image (3,) and over blocks (rows, columns, 3)."""

    whole: Array
    whole_error: Array
    blocks: Array
    blocks_error: Array


@dataclass(frozen=True)
class Measurement:
    """All that was measured of a scene in ``passes`` independent passes."""

    passes: int
    metrics: dict[str, Metric]
    colours: dict[str, Colours]

    def quantities(self) -> Iterator[Quantity]:
        """All numbers, one by one: metrics, whole images, blocks."""
        for name, metric in self.metrics.items():
            yield Quantity(name, metric.value, metric.error, ROUNDING[name])
        for half, colours in self.colours.items():
            for c, letter in enumerate("RGB"):
                value, error = float(colours.whole[c]), float(colours.whole_error[c])
                yield Quantity(f"{half} {letter}", value, error, LINEAR_ROUNDING, half)
        for half, colours in self.colours.items():
            for row, column, c in np.ndindex(colours.blocks.shape):
                yield Quantity(
                    f"{half} {'RGB'[c]}, block {row + 1},{column + 1}",
                    float(colours.blocks[row, column, c]),
                    float(colours.blocks_error[row, column, c]),
                    LINEAR_ROUNDING,
                    half,
                    (row, column),
                )


@dataclass(frozen=True)
class Pictures:
    """Means of the passes, (H, W, 3) linear."""

    heuristic: Array
    reference: Array


def measure(ready, seed, count, viewing, progress=None) -> tuple[Measurement, Pictures]:
    """Render both halves of a prepared scene, and measure.

    Parameters
    ----------
    ready : comparisons.compare.Prepared
        The scene; its renderers say how many samples a pass has.
    seed
        Of the run; each pass hashes its own from it (`pass_seed`).
    count
        Independent passes, 2 or more.
    viewing
        How linear values are looked at.
    progress
        As of :func:`comparisons.compare.compare`.

    Raises
    ------
    NonFiniteError
        When a rendering holds a NaN or an infinity.
    """
    loop = passes((ready.heuristic, ready.reference), seed, count, progress=progress)
    images = np.array([[np.array(image) for image in one.images] for one in loop], np.float64)
    height, width = images.shape[2:4]
    counted = gbuffer(ready.scene, width, height).hit
    measured = measurement(images, counted, viewing)
    return measured, Pictures(*images.mean(axis=0))


def measurement(images: Array, counted: Array, viewing: Viewing) -> Measurement:
    """Measure passes (n, 2, H, W, 3) of the heuristic half and the reference.

    Metrics are those of the mean images over the pixels of ``counted`` (H, W), with the jackknife's
    standard error: they are not linear, and the mean of ``n`` passes has less noise in it than each
    of them, so that only as many passes of as many samples compare with each other.
    """
    metrics = _metrics(images[:, :, counted], viewing)
    colours = {half: _colours(images[:, index]) for index, half in enumerate(HALVES)}
    return Measurement(len(images), metrics, colours)


def _metrics(pixels, viewing):
    """Metrics of passes (n, 2, N, 3), each with the jackknife's error over passes."""
    count = len(pixels)
    if pixels.shape[2] == 0:
        return {name: Metric(0.0, 0.0, 0.0) for name in ROUNDING}
    total = pixels.sum(axis=0)
    values = _departure(*(total / count), viewing)
    left_out = np.array([_departure(*((total - one) / (count - 1)), viewing) for one in pixels])
    errors = np.sqrt((count - 1) * left_out.var(axis=0))
    floors = _floors(pixels, viewing)
    return {
        name: Metric(float(value), float(error), floors.get(name))
        for name, value, error in zip(ROUNDING, values, errors, strict=True)
    }


def _departure(test, reference, viewing):
    """The metrics of pixels (N, 3), in the order of `ROUNDING`."""
    distances = [metric(test, reference, viewing).mean() for metric in METRICS.values()]
    return (
        *distances,
        rmse(test, reference),
        log2_luminance_ratio(test, reference).mean(),
    )


def _floors(pixels, viewing):
    signs = np.where(np.arange(len(pixels)) % 2, -1.0, 1.0)
    noise = np.einsum("i,ijk->jk", signs, pixels[:, 0] - pixels[:, 1]) / len(pixels)
    reference, everywhere = pixels[:, 1].mean(axis=0), np.ones(len(noise), bool)
    floors = {
        name: noise_floor(metric, reference, noise, everywhere, viewing)
        for name, metric in METRICS.items()
    }
    return floors | {"rmse": rmse(noise, np.zeros_like(noise))}


def _colours(images):
    """Colours of the passes (n, H, W, 3) of one half."""
    whole, blocks = images.mean(axis=(1, 2)), block_means(images)
    return Colours(*_estimate(whole), *_estimate(blocks))


def _estimate(passes):
    return passes.mean(axis=0), passes.std(axis=0, ddof=1) / np.sqrt(len(passes))


def block_means(images: Array) -> Array:
    """Means over `GRID` by `GRID` blocks, (..., rows, columns, 3), of images (..., H, W, 3).

    Sizes that do not divide give blocks that differ by a pixel; a smaller image has fewer blocks.
    """
    for axis in (-3, -2):
        edges = block_edges(images.shape[axis])
        sums = np.add.reduceat(images, edges[:-1], axis=axis)
        images = sums / np.diff(edges).reshape((-1, *(1,) * (-1 - axis)))
    return images


def block_edges(side: int) -> Array:
    """First pixel of each block along a side, and the side itself."""
    count = min(GRID, side)
    return np.arange(count + 1) * side // count
