"""A baseline: what was measured of a scene once, as a small text that people can read and diff.

It is JSON with a fixed order and a line for each number and its error, or for each block's colours.
Values keep 8 significant digits, far below what rounding can change, and errors 3.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from comparisons.check.measurement import HALVES, ROUNDING, Colours, Measurement, Metric
from heuristic.errors import InputError

FORMAT = "fotismos baseline 1"


@dataclass(frozen=True)
class Baseline:
    """A measured scene.

    Attributes
    ----------
    scene
        A built-in name, or the path of a Mitsuba file, relative to the baseline's own folder.
    options
        Rendering options by the names of the command line's; those at rest are left out.
    versions
        What it was measured with.
    measured
        The numbers.
    images
        Name of an EXR file beside the baseline with both halves, for people to look at; None
        without.
    """

    scene: str
    options: Mapping[str, object]
    versions: Mapping[str, str]
    measured: Measurement
    images: str | None = None

    def text(self) -> str:
        """Return the file's content."""
        head = {
            "format": FORMAT,
            "scene": self.scene,
            "options": dict(sorted(self.options.items())),
            "passes": self.measured.passes,
            "versions": dict(self.versions),
        }
        if self.images:
            head["images"] = self.images
        lines = [f"  {json.dumps(key)}: {_object(value)}" for key, value in head.items()]
        metrics = [
            f"    {json.dumps(name)}: {_line(_metric_data(metric))}"
            for name, metric in self.measured.metrics.items()
        ]
        lines.append('  "metrics": {\n' + ",\n".join(metrics) + "\n  }")
        for half in HALVES:
            lines.append(f'  "{half}": {_colours_text(self.measured.colours[half])}')
        return "{\n" + ",\n".join(lines) + "\n}\n"


def parse(text: str, name: str) -> Baseline:
    """Read a baseline from its file's content.

    Raises
    ------
    InputError
        Naming the file `name` and what is wrong in it.
    """
    try:
        data = json.loads(text)
    except ValueError as error:
        raise InputError(f"{name}: this is no JSON: {error}. {_ANEW}") from error
    if not isinstance(data, dict) or data.get("format") != FORMAT:
        found = data.get("format") if isinstance(data, dict) else type(data).__name__
        raise InputError(f"{name}: its format is {found!r}, not {FORMAT!r}. {_ANEW}")
    try:
        baseline = Baseline(
            scene=_of(data["scene"], str),
            options=_of(data["options"], dict),
            versions=_of(data["versions"], dict),
            measured=_measurement(data),
            images=_of(data.get("images"), (str, type(None))),
        )
    except (KeyError, TypeError, ValueError) as error:
        what = f"{error} is missing" if isinstance(error, KeyError) else str(error)
        raise InputError(f"{name}: {what}. {_ANEW}") from error
    return baseline


_ANEW = "Restore the file, or write it anew with `fotismos check BASELINE --update --scene SCENE`."


def _measurement(data):
    passes = _of(data["passes"], int)
    if passes < 2:
        raise ValueError(f"passes = {passes}, but there must be 2 or more")
    metrics = {
        name: Metric(
            float(_numbers(data["metrics"][name]["value"], ())),
            float(_numbers(data["metrics"][name]["error"], (), least=0.0)),
            data["metrics"][name].get("noise_floor"),
        )
        for name in ROUNDING
    }
    return Measurement(passes, metrics, {half: _colours(data[half]) for half in HALVES})


def _colours(data):
    rows = len(data["blocks"])
    columns = len(data["blocks"][0])
    blocks = data["blocks"]
    return Colours(
        _numbers(data["mean"], (3,)),
        _numbers(data["error"], (3,), least=0.0),
        _numbers([[block["mean"] for block in row] for row in blocks], (rows, columns, 3)),
        _numbers(
            [[block["error"] for block in row] for row in blocks], (rows, columns, 3), least=0.0
        ),
    )


def _numbers(values, shape, least=-np.inf):
    array = np.array(values, float)
    if array.shape != shape:
        raise ValueError(f"{values} has the shape {array.shape} and not {shape}")
    if not (np.isfinite(array).all() and (array >= least).all()):
        raise ValueError(f"{values} is not finite, or an error is negative")
    return array


def _of(value, kind):
    if not isinstance(value, kind) or isinstance(value, bool):
        raise TypeError(f"{value!r} is not what belongs there")
    return value


def _colours_text(colours):
    lines = [
        f'    "mean": {_line(_rounded(colours.whole, 8))}',
        f'    "error": {_line(_rounded(colours.whole_error, 3))}',
    ]
    rows = []
    for means, errors in zip(colours.blocks, colours.blocks_error, strict=True):
        blocks = (
            {"mean": _rounded(mean, 8), "error": _rounded(error, 3)}
            for mean, error in zip(means, errors, strict=True)
        )
        rows.append("      [\n" + ",\n".join(f"        {_line(b)}" for b in blocks) + "\n      ]")
    lines.append('    "blocks": [\n' + ",\n".join(rows) + "\n    ]")
    return "{\n" + ",\n".join(lines) + "\n  }"


def _metric_data(metric):
    data = {"value": _rounded(metric.value, 8), "error": _rounded(metric.error, 3)}
    if metric.noise_floor is not None:
        data["noise_floor"] = _rounded(metric.noise_floor, 3)
    return data


def _object(value):
    if not isinstance(value, dict):
        return _line(value)
    lines = (f"    {json.dumps(key)}: {_line(item)}" for key, item in value.items())
    return "{\n" + ",\n".join(lines) + "\n  }"


def _line(value):
    return json.dumps(value, ensure_ascii=False, allow_nan=False)


def _rounded(values, digits):
    if np.ndim(values):
        return [_rounded(value, digits) for value in values]
    return float(f"{values:.{digits}g}")
