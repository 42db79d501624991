"""The values of one parameter of a design: a value, a list, or a range."""

from dataclasses import dataclass
from math import isfinite
from numbers import Real
from typing import Any

import numpy as np

from comparisons.study.scenes import Parameter
from heuristic.errors import InputError


@dataclass(frozen=True)
class Listed:
    """A list of values; drawn with equal chance."""

    listed: tuple[float, ...]

    def values(self) -> tuple[float, ...]:
        """Return all values, for a grid."""
        return self.listed

    def at(self, u: np.ndarray) -> np.ndarray:
        """Return the values at ``u``, an array of numbers in [0, 1)."""
        return np.array(self.listed)[(u * len(self.listed)).astype(int)]


class Fixed(Listed):
    """One value for all points."""


@dataclass(frozen=True)
class Span:
    """An inclusive range, in ``steps`` values of equal differences or ratios."""

    low: float
    high: float
    steps: int
    logarithmic: bool

    def values(self) -> tuple[float, ...]:
        """Return all values, for a grid; rounded to six digits, so 0.1 is 0.1."""
        spacing = np.geomspace if self.logarithmic else np.linspace
        return tuple(float(f"{value:.6g}") for value in spacing(self.low, self.high, self.steps))

    def at(self, u: np.ndarray) -> np.ndarray:
        """Return the values at ``u``, an array of numbers in [0, 1)."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** u
        return self.low + (self.high - self.low) * u


def values(raw: object, parameter: Parameter, is_grid: bool, where: str) -> Listed | Span:
    """Read the values of a parameter, and ensure that they are in its range.

    ``raw`` is a number, a list of numbers, or a table with ``from``, ``to``, ``scale`` (``linear``
    or ``log``) and, for a grid, ``steps``.

    Raises
    ------
    InputError
        Naming the parameter, the value and the allowed range.
    """
    if isinstance(raw, dict):
        return _span(raw, parameter, is_grid, where)
    if isinstance(raw, list):
        if not raw:
            raise InputError(f"{where} = []: give at least one value.")
        return Listed(tuple(_checked(value, parameter, where) for value in raw))
    return Fixed((_checked(raw, parameter, where),))


def _span(raw: dict[str, Any], parameter: Parameter, is_grid: bool, where: str) -> Span:
    needed = {"from", "to", "steps"} if is_grid else {"from", "to"}
    if not needed <= set(raw) <= {*needed, "scale"}:
        raise InputError(
            f"{where} has {', '.join(raw)}: give a range {', '.join(sorted(needed))} and, if you"
            " like, scale (linear or log)."
        )
    low, high = (_checked(raw[end], parameter, f"{where}, {end}") for end in ("from", "to"))
    scale, steps = raw.get("scale", "linear"), raw.get("steps", 2)
    if scale not in ("linear", "log"):
        raise InputError(f"{where}: scale = {scale!r}: choose linear or log.")
    if not isinstance(steps, int) or steps < 2:
        raise InputError(f"{where}: steps = {steps!r}: give an integer of at least 2.")
    if not low < high or (scale == "log" and low <= 0):
        least = "above 0 and " if scale == "log" else ""
        raise InputError(f"{where} runs from {low:g} to {high:g}: begin {least}below the end.")
    return Span(low, high, steps, scale == "log")


def _checked(value: Any, parameter: Parameter, where: str) -> float:
    is_number = isinstance(value, Real) and not isinstance(value, bool) and isfinite(value)
    if not is_number or not parameter.low <= value <= parameter.high:
        allowed = (
            "a finite number"
            if not isfinite(parameter.low)
            else f"a number from {parameter.low:g} to {parameter.high:g}"
        )
        unit = f" {parameter.unit}" if parameter.unit not in ("", "1") else ""
        raise InputError(f"{where} = {value!r}: give {allowed}{unit}.")
    return float(value)
