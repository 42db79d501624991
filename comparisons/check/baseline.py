"""A baseline: earlier measurements of a scene, as a small text that people can read and diff.

It is JSON in a fixed order, with a line per number and its error, or per block's colours. Values
keep 8 significant digits, far finer than rounding errors, and errors 3.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any

import msgspec
import numpy as np
from msgspec import Meta

from comparisons import record
from comparisons.check.measurement import MOST_PASSES, Half, Measurement, MetricAmount
from comparisons.departure.metrics import LEADING, METRICS, RATIO
from comparisons.options import Options
from heuristic import program
from heuristic.errors import InputError
from reference import records
from reference.records import VERSION, Record, Versions, laid_out

LARGEST = float(np.finfo(np.float32).max)
"""Largest number: images are in single precision, and squares of errors must not overflow."""

FORMAT_0_1 = '"format": "fotismos baseline 1"'
"""The first line of a baseline of fotismos 0.1; its other lines are still valid."""


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
    metrics: dict[str, MetricAmount]
    heuristic: Half
    reference: Half

    def measured(self) -> Measurement:
        """Return the measurement."""
        return Measurement(
            passes=self.passes,
            metrics=self.metrics,
            heuristic=self.heuristic,
            reference=self.reference,
        )

    def text(self) -> str:
        """Return the file's content."""
        return laid_out(records.plain(self)) + "\n"


def of(
    scene: str, options: Mapping[str, Any], measured: Measurement, images: str | None = None
) -> Baseline:
    """Return the baseline of a scene just measured, with the current versions."""
    return msgspec.convert(
        {
            "record_version": VERSION,
            "scene": scene,
            "options": dict(sorted(options.items())),
            "versions": record.versions(),
            "images": images,
            **_rounded(records.plain(measured)),
        },
        Baseline,
    )


def parse(text: str, name: str) -> Baseline:
    """Read a baseline from its file's content, also one of fotismos 0.1.

    ``InputError`` has the name of the file and the fault in it.
    """
    text = text.replace(FORMAT_0_1, f'"record_version": {VERSION}', 1)
    try:
        baseline = records.read(Baseline, text, name)
        _require_sane(baseline)
        Options.of(baseline.options)
        baseline.text()  # rejects what cannot be written, such as a NaN among the options
    # Numbers too long for Python and lists nested too deeply raise other errors.
    except (InputError, ValueError, OverflowError, RecursionError) as error:
        where = "" if str(error).startswith(name) else f"{name}: "
        raise InputError(
            f"{where}{error} `{program.command('check', 'BASELINE', '--update', '--scene')} SCENE`"
            " writes it."
        ) from error
    return baseline


def _require_sane(baseline: Baseline) -> None:
    if not baseline.scene or not baseline.scene.isprintable():
        raise ValueError(
            f"the scene is {baseline.scene!r}: a built-in name or the path of a file is allowed."
        )
    for name in baseline.metrics:
        if name not in {*METRICS, RATIO.name}:
            raise ValueError(f"{name!r} is not a metric.")
    for name in (LEADING.name, RATIO.name):
        if name not in baseline.metrics:
            raise ValueError(f"the metric {name!r} is missing.")
    for half in (baseline.heuristic, baseline.reference):
        if half.means().ndim != 3:  # raises ValueError for rows that differ in length
            raise ValueError("there are no blocks.")
    numbers = [(value, error) for *_, value, error in baseline.measured().quantities()]
    floors = [metric.noise_floor or 0.0 for metric in baseline.metrics.values()]
    if not (np.abs(np.hstack([*numbers, floors])) <= LARGEST).all():
        raise ValueError(f"a number is not finite, or larger than {LARGEST:.2g}.")


def _rounded(value: Any, digits: int = 8) -> Any:
    """Round all numbers inside plain data: those of errors, at these keys, to fewer digits."""
    if isinstance(value, dict):
        errors = ("error", "noise_floor")
        return {key: _rounded(one, 3 if key in errors else digits) for key, one in value.items()}
    if isinstance(value, (list, tuple)):
        return [_rounded(one, digits) for one in value]
    return float(f"{value:.{digits}g}") if isinstance(value, float) else value
