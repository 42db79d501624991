"""What one parameter of a design runs over: a value, a list of values, or a range."""

from dataclasses import dataclass
from math import isfinite
from numbers import Real

import numpy as np

from heuristic.errors import InputError


@dataclass(frozen=True)
class Listed:
    """Values one by one; drawn with equal chance."""

    listed: tuple[float, ...]

    def values(self):
        """Return all values, for a grid."""
        return self.listed

    def at(self, u):
        """Return the values at ``u``, an array of numbers in [0, 1)."""
        return np.array(self.listed)[(u * len(self.listed)).astype(int)]


class Fixed(Listed):
    """One value for all points."""


@dataclass(frozen=True)
class Span:
    """A range, its ends included, in ``steps`` values of equal differences or ratios."""

    low: float
    high: float
    steps: int
    logarithmic: bool

    def values(self):
        """Return all values, for a grid; rounded, so that 0.1 is 0.1."""
        spacing = np.geomspace if self.logarithmic else np.linspace
        return tuple(float(f"{value:.6g}") for value in spacing(self.low, self.high, self.steps))

    def at(self, u):
        """Return the values at ``u``, an array of numbers in [0, 1)."""
        if self.logarithmic:
            return self.low * (self.high / self.low) ** u
        return self.low + (self.high - self.low) * u


def values(raw, parameter, is_grid, where):
    """Read what a parameter runs over, and see that it is in its range.

    ``raw`` is a number, a list of numbers, or a table with ``from``, ``to``, ``scale`` (``linear``
    or ``log``) and, for a grid, ``steps``.

    Raises
    ------
    InputError
        Naming the parameter, the value and what is allowed.
    """
    if isinstance(raw, dict):
        return _span(raw, parameter, is_grid, where)
    if isinstance(raw, list):
        if not raw:
            raise InputError(f"{where} = []: give one value or more.")
        return Listed(tuple(_checked(value, parameter, where) for value in raw))
    return Fixed((_checked(raw, parameter, where),))


def _span(raw, parameter, is_grid, where):
    wanted = {"from", "to", "steps"} if is_grid else {"from", "to"}
    if not wanted <= set(raw) <= {*wanted, "scale"}:
        raise InputError(
            f"{where} has {', '.join(raw)}: a range has {', '.join(sorted(wanted))}, and may have a"
            " scale (linear or log)."
        )
    low, high = (_checked(raw[end], parameter, f"{where}, {end}") for end in ("from", "to"))
    scale, steps = raw.get("scale", "linear"), raw.get("steps", 2)
    if scale not in ("linear", "log"):
        raise InputError(f"{where}: scale = {scale!r}: choose linear or log.")
    if not isinstance(steps, int) or steps < 2:
        raise InputError(f"{where}: steps = {steps!r}: give an integer of 2 or more.")
    if not low < high or (scale == "log" and low <= 0):
        least = "above 0 " if scale == "log" else ""
        raise InputError(
            f"{where} runs from {low:g} to {high:g}: let it begin {least}below its end."
        )
    return Span(low, high, steps, scale == "log")


def _checked(value, parameter, where):
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
