"""A baseline: earlier measurements of a scene, as a small text that people can read and diff.

It is JSON in a fixed order, with a line per number and its error, or per block's colours. Values
keep 8 significant digits, far finer than rounding errors, and errors 3.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta, structs
from numpy.typing import ArrayLike

from comparisons import record, records
from comparisons.case import Request
from comparisons.check.measurement import HALVES, Colours, Measurement, Metric
from comparisons.departure.metrics import LEADING, METRICS, RATIO
from comparisons.departure.spaces import Array
from comparisons.records import VERSION, Amount, Record, Versions, laid_out
from heuristic import program
from heuristic.errors import InputError

MOST_PASSES = 1024
"""Far more than a t-test needs; all their images are in memory at once."""

LARGEST = float(np.finfo(np.float32).max)
"""Largest number: images are in single precision, and squares of errors must not overflow."""

FORMAT_0_1 = '"format": "fotismos baseline 1"'
"""The first line of a baseline of fotismos 0.1; its other lines are still valid."""

Colour = tuple[float, float, float]
Errors = Annotated[tuple[Amount, Amount, Amount], Meta(description="Standard errors.")]


class Block(Record):
    """Mean linear RGB of a block of pixels."""

    mean: Colour
    error: Errors


class Half(Record):
    """Mean linear RGB of a half, over the image and over its blocks, row by row."""

    mean: Colour
    error: Errors
    blocks: tuple[tuple[Block, ...], ...]


class Baseline(Record, kw_only=True, omit_defaults=True):
    """Measurements of one scene, from independent passes of both halves.

    Attributes
    ----------
    scene
        A built-in name, or the path of a Mitsuba or Python file, relative to the baseline's folder.
    options
        Rendering options, named as on the command line; defaults are left out.
    versions
        Versions of the software that measured it.
    images
        Name of an EXR file next to the baseline with both halves, for people to look at; None if
        there is none.
    metrics, heuristic, reference
        Departure metrics, and colours of both halves.
    """

    record_version: int
    scene: str
    options: dict[str, Any]
    passes: Annotated[int, Meta(ge=2, le=MOST_PASSES)]
    versions: Versions
    images: str | None = None
    metrics: dict[str, Metric]
    heuristic: Half
    reference: Half

    def measured(self) -> Measurement:
        """Return the numbers as arrays; ``ValueError`` for rows of blocks that differ in length."""
        colours = {half: _colours(getattr(self, half)) for half in HALVES}
        return Measurement(self.passes, self.metrics, colours)

    def text(self) -> str:
        """Return the file's content."""
        return laid_out(records.plain(self)) + "\n"


def of(
    scene: str, options: Mapping[str, Any], measured: Measurement, images: str | None = None
) -> Baseline:
    """Return the baseline of a scene just measured, with the current versions."""
    return Baseline(
        record_version=VERSION,
        scene=scene,
        options=dict(sorted(options.items())),
        passes=measured.passes,
        versions=record.versions(),
        images=images,
        metrics={name: _rounded_metric(metric) for name, metric in measured.metrics.items()},
        **{half: _half(measured.colours[half]) for half in HALVES},
    )


def parse(text: str, name: str) -> Baseline:
    """Read a baseline from its file's content, also one of fotismos 0.1.

    Raises
    ------
    InputError
        With the name of the file and the fault in it.
    """
    text = text.replace(FORMAT_0_1, f'"record_version": {VERSION}', 1)
    try:
        baseline = records.read(Baseline, text, name)
        _require_scene(baseline.scene)
        msgspec.convert(baseline.options, Request)
        _require_metrics(baseline.metrics)
        _require_moderate(baseline)
        baseline.text()  # rejects what cannot be written, such as a NaN among the options
    # Numbers too long for Python and lists nested too deeply raise other errors.
    except (InputError, ValueError, OverflowError, RecursionError) as error:
        where = "" if str(error).startswith(name) else f"{name}: "
        raise InputError(
            f"{where}{error} `{program.command('check', 'BASELINE', '--update', '--scene')} SCENE`"
            " writes it."
        ) from error
    return baseline


def _require_scene(scene: str) -> None:
    if not scene or not scene.isprintable():
        raise ValueError(
            f"the scene is {scene!r}: a built-in name or the path of a file is allowed."
        )


def _require_metrics(metrics: Iterable[str]) -> None:
    for name in metrics:
        if name not in {*METRICS, RATIO.name}:
            raise ValueError(f"{name!r} is not a metric.")
    for name in (LEADING.name, RATIO.name):
        if name not in metrics:
            raise ValueError(f"the metric {name!r} is missing.")


def _require_moderate(baseline: Baseline) -> None:
    for metric in baseline.metrics.values():
        _require_numbers(metric.value, metric.error, metric.noise_floor or 0.0)
    for colours in baseline.measured().colours.values():
        _require_numbers(*(values.ravel() for values in vars(colours).values()))


def _require_numbers(*values: ArrayLike) -> None:
    if not (np.abs(np.hstack(values)) <= LARGEST).all():
        raise ValueError(f"a number is not finite, or larger than {LARGEST:.2g}.")


def _colours(half: Half) -> Colours:
    blocks = np.array([[(b.mean, b.error) for b in row] for row in half.blocks], float)
    if blocks.ndim != 4:
        raise ValueError("there are no blocks.")
    return Colours(np.array(half.mean), np.array(half.error), blocks[:, :, 0], blocks[:, :, 1])


def _half(colours: Colours) -> Half:
    rows = zip(colours.blocks, colours.blocks_error, strict=True)
    blocks = (tuple(map(_block, *row)) for row in rows)
    return Half(**structs.asdict(_block(colours.whole, colours.whole_error)), blocks=tuple(blocks))


def _block(mean: Array, error: Array) -> Block:
    return Block(_rounded_colour(mean, 8), _rounded_colour(error, 3))


def _rounded_colour(values: Array, digits: int) -> Colour:
    red, green, blue = (_rounded(value, digits) for value in values)
    return red, green, blue


def _rounded_metric(metric: Metric) -> Metric:
    floor = metric.noise_floor
    floor = None if floor is None else _rounded(floor, 3)
    return Metric(_rounded(metric.value, 8), _rounded(metric.error, 3), floor)


def _rounded(value: float, digits: int) -> float:
    return float(f"{value:.{digits}g}")
