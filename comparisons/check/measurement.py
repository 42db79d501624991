"""Measure the departure and the regional colours of a scene, each with its uncertainty.

Both halves are rendered in independent passes, as in a comparison. All standard errors come from
the spread of the passes, so they hold for any kind of noise.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from comparisons.compare import Prepared
from comparisons.departure.metrics import METRICS, RATIO, log2_luminance_ratio
from comparisons.departure.spaces import Array, Viewing
from comparisons.departure.statistics import noise_floor
from comparisons.intervals import jackknife_error
from comparisons.records import Amount, Record
from reference.rendering.passes import Progress, passes

PASSES = 16
"""Enough for a t-test, corrected for a hundred quantities, to detect five standard errors."""

GRID = 4
"""Blocks along each side of the image: few enough to read, small enough to locate a change."""

HALVES = ("heuristic", "reference")

LINEAR_ROUNDING = 1e-6


def rounding(metric: str) -> float:
    """Return the difference that rounding can make in a metric; ``KeyError`` for other names."""
    return RATIO.rounding if metric == RATIO.name else METRICS[metric].rounding


@dataclass(frozen=True)
class Quantity:
    """One measured number.

    Attributes
    ----------
    name
        A metric's name, or ``heuristic R`` and the like; for a block with row and column, from 1.
    value, error
        The number, and its standard error.
    rounding
        The difference that rounding can make.
    half, block
        Where a colour was measured: the half, and the block's ``(row, column)`` from 0.
    """

    name: str
    value: float
    error: float
    rounding: float
    half: str | None = None
    block: tuple[int, int] | None = None


class Metric(Record, omit_defaults=True):
    """A departure metric, its standard error, and its value from noise alone.

    ``noise_floor`` is None for the signed ratio of luminances, which noise does not raise.
    """

    value: float
    error: Amount
    noise_floor: Amount | None = None


@dataclass(frozen=True)
class Colours:
    """Mean linear RGB of one half over the image (3,) and over blocks (rows, columns, 3)."""

    whole: Array
    whole_error: Array
    blocks: Array
    blocks_error: Array


@dataclass(frozen=True)
class Measurement:
    """All measurements of a scene, from ``passes`` independent passes."""

    passes: int
    metrics: dict[str, Metric]
    colours: dict[str, Colours]

    def of(self, metrics: Iterable[str]) -> Measurement:
        """Return the measurement with only these metrics."""
        return replace(self, metrics={name: self.metrics[name] for name in metrics})

    def quantities(self) -> Iterator[Quantity]:
        """Yield all numbers: metrics, then whole images, then blocks."""
        for name, metric in self.metrics.items():
            yield Quantity(name, metric.value, metric.error, rounding(name))
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


def measure(
    ready: Prepared, seed: int, count: int, viewing: Viewing, progress: Progress | None = None
) -> tuple[Measurement, Pictures]:
    """Render both halves of a prepared scene, and measure them.

    Parameters
    ----------
    ready
        The scene; its renderers hold the samples per pixel of a pass.
    seed
        Seed of the run; each pass hashes its own from it (`pass_seed`).
    count
        Independent passes, 2 or more.
    viewing
        Viewing conditions.
    progress
        See :func:`comparisons.compare.compare`.
    """
    loop = passes((ready.heuristic, ready.reference), seed, count, progress=progress)
    images = np.array([[np.array(image) for image in one.images] for one in loop], np.float64)
    measured = measurement(images, ready.counted, viewing)
    return measured, Pictures(*images.mean(axis=0))


def measurement(images: Array, counted: Array, viewing: Viewing) -> Measurement:
    """Measure passes (n, 2, H, W, 3) of the heuristic half and the reference.

    Metrics compare the mean images over the pixels of ``counted`` (H, W); their standard errors are
    the jackknife's. Metrics are not linear, and noise raises them: compare only measurements with
    equal numbers of passes and samples.
    """
    metrics = _metrics(images, counted, viewing)
    colours = {half: _colours(images[:, index]) for index, half in enumerate(HALVES)}
    return Measurement(len(images), metrics, colours)


def _metrics(images: Array, counted: Array, viewing: Viewing) -> dict[str, Metric]:
    """Return metrics over the counted pixels, with the jackknife's error over passes."""
    if not counted.any():
        return {name: Metric(0.0, 0.0, 0.0) for name in (*METRICS, RATIO.name)}
    count, total = len(images), images.sum(axis=0)
    values = _departure(total / count, counted, viewing)
    errors = jackknife_error(
        [_departure((total - one) / (count - 1), counted, viewing) for one in images]
    )
    floors = _floors(images, counted, viewing)
    return {
        name: Metric(float(value), float(error), floors.get(name))
        for name, value, error in zip((*METRICS, RATIO.name), values, errors, strict=True)
    }


def _departure(pair: Array, counted: Array, viewing: Viewing) -> tuple[float, ...]:
    """Return the means of all metrics, and last of the ratio."""
    test, reference = pair
    means = [
        metric.mean(metric.against(reference, counted, viewing)(test))
        for metric in METRICS.values()
    ]
    return (*means, log2_luminance_ratio(test[counted], reference[counted]).mean())


def _floors(images: Array, counted: Array, viewing: Viewing) -> dict[str, float]:
    signs = np.where(np.arange(len(images)) % 2, -1.0, 1.0)
    noise = np.einsum("i,ijkl->jkl", signs, images[:, 0] - images[:, 1]) / len(images)
    reference = images[:, 1].mean(axis=0)
    return {
        name: noise_floor(metric, reference, noise, counted, viewing)
        for name, metric in METRICS.items()
    }


def _colours(images: Array) -> Colours:
    """Return the colours of the passes (n, H, W, 3) of one half."""
    whole, blocks = images.mean(axis=(1, 2)), block_means(images)
    return Colours(*_estimate(whole), *_estimate(blocks))


def _estimate(passes: Array) -> tuple[Array, Array]:
    return passes.mean(axis=0), passes.std(axis=0, ddof=1) / np.sqrt(len(passes))


def block_means(images: Array) -> Array:
    """Return means over `GRID` by `GRID` blocks, (..., rows, columns, 3), of images (..., H, W, 3).

    Blocks may differ by a pixel in size; a smaller image has fewer blocks.
    """
    for axis in (-3, -2):
        edges = block_edges(images.shape[axis])
        sums = np.add.reduceat(images, edges[:-1], axis=axis)
        images = sums / np.diff(edges).reshape((-1, *(1,) * (-1 - axis)))
    return images


def block_edges(side: int) -> NDArray[np.int_]:
    """Return the first pixel of each block along a side, and the side itself."""
    count = min(GRID, side)
    return np.arange(count + 1) * side // count
