"""The kernel's view of a light; the kinds are in :mod:`heuristic.lights`.

A light answers one question, ``illuminate(position)``: from which direction ``L``, with what
intensity and over what distance does its light arrive? Occlusion is handled elsewhere. A light also
states which of its values determine the kernel's instructions, so lights of one structure can share
a kernel.
"""

from collections.abc import Callable, Sequence
from dataclasses import fields, replace
from functools import partial
from math import inf, isfinite
from numbers import Real
from typing import Any, ClassVar, NamedTuple, Self

import drjit as dr
import numpy as np

from heuristic import colours, numerics
from heuristic.arrays import Colour, Direction, Number, Position, Vector
from heuristic.errors import InputError

PLUGINS: dict[str, type["Light"]] = {}
"""The kinds of light, by their emitter plugin in a Mitsuba scene."""


class Arrival(NamedTuple):
    """How light arrives at a point: ``L``, ``I_p0 f_att`` and ``d``, infinite for parallel rays.

    ``d`` ends at the shell of a lamp that has one: shadow rays go no further.
    """

    toward: Direction
    intensity: Colour
    distance: Number


class Light:
    """A kind of light, as the kernel sees it; each subclass is a frozen dataclass.

    A subclass that names its ``plugin`` is listed in :data:`PLUGINS`. Fields of the same name mean
    the same in all kinds; :data:`CHECKS` checks them.
    """

    plugin: ClassVar[str]
    intensity: Colour

    def __init_subclass__(cls, plugin: str = "") -> None:
        if plugin:
            cls.plugin, PLUGINS[plugin] = plugin, cls

    def __post_init__(self) -> None:
        for name, check in CHECKS.items():
            if hasattr(self, name):
                object.__setattr__(self, name, check(getattr(self, name)))

    def illuminate(self, position: Position) -> Arrival:
        """Return the light that arrives at positions, Dr.Jit arrays of three components."""
        raise NotImplementedError

    def wide_toward(self, position: Position) -> tuple[Vector, Number]:
        """Return ``L`` in double precision, as a vector and its inverse length."""
        raise NotImplementedError

    def compiled(self) -> dict[str, Any]:
        """Return the fields that are part of the kernel's code, with their values."""
        return {}

    def structure(self) -> tuple:
        """Return what determines the light's instructions, apart from its numbers; hashable."""
        return type(self), colours.wavelength_count(self.intensity), *self.compiled().items()

    def numbers(self) -> dict[str, Any]:
        """Return the fields that are numbers, or tuples of them, and not compiled in."""
        light: Any = self  # a dataclass, as each kind is
        compiled = self.compiled()
        given = {f.name: getattr(self, f.name) for f in fields(light) if f.name not in compiled}
        return {
            name: value
            for name, value in given.items()
            if all(isinstance(v, Real) for v in (value if isinstance(value, tuple) else (value,)))
        }

    def with_numbers(self, fetch: Callable[[Any], Any], vector_type: type) -> Self:
        """Return the light with its :meth:`numbers` replaced by the Dr.Jit values of ``fetch``."""
        fetched = {name: fetch(value) for name, value in self.numbers().items()}
        for name, array in ARRAYS.items():
            if name in fetched:
                fetched[name] = array(fetched[name], vector_type)
        light: Any = self
        return replace(light, **fetched)


def _triple(name: str, value: Any) -> Any:
    """Return three finite floats, or the Dr.Jit array that was given."""
    if dr.is_array_v(value) and dr.is_jit_v(value):
        if dr.depth_v(value) == 2 and dr.size_v(value) == 3:
            return value
        raise InputError(f"{name}: {type(value).__name__} is not allowed: give three components.")
    try:
        triple = tuple(float(component) for component in value)
    except (TypeError, ValueError, OverflowError):
        triple = ()
    if len(triple) != 3 or not all(map(isfinite, triple)):
        raise InputError(f"{name} = {value!r} is not allowed: give three finite numbers.")
    return triple


def _direction(value: Any) -> Any:
    direction = _triple("direction", value)
    if isinstance(direction, tuple) and not any(direction):
        raise InputError("direction = (0, 0, 0) points nowhere: give a vector of any other length.")
    return direction


def _attenuation(value: Any) -> tuple:
    """Return three checked numbers; if one is a Dr.Jit value, none is checked."""
    coefficients = tuple(value) if isinstance(value, Sequence) else ()
    if len(coefficients) == 3 and any(map(dr.is_array_v, coefficients)):
        return coefficients
    are_numbers = all(isinstance(c, Real) and isfinite(c) and float(c) >= 0 for c in coefficients)
    if len(coefficients) != 3 or not are_numbers or not any(coefficients):
        raise InputError(
            f"attenuation = {value!r} is not allowed: give three numbers k0, k1, k2, finite, 0 or"
            " more, and not all 0."
        )
    return coefficients


def _number(name: str, is_allowed: Callable[[Any], bool], allowed: str, value: Any) -> Any:
    number = numerics.plain(value)
    if number is None or (isinstance(number, Real) and not is_allowed(number)):
        raise InputError(f"{name} = {value!r} is not allowed: give {allowed}.")
    return number


def _flag(name: str, value: Any) -> bool:
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} = {value!r} is not allowed: give True or False.")
    return bool(value)


CHECKS: dict[str, Callable[[Any], Any]] = {
    "position": partial(_triple, "position"),
    "direction": _direction,
    "intensity": partial(colours.checked, "intensity"),
    "cutoff": partial(
        _number,
        "cutoff",
        lambda degrees: 0 < degrees < 180,
        "an angle between 0 and 180 degrees, both excluded",
    ),
    "exponent": partial(_number, "exponent", lambda m: 0 <= m < inf, "a finite value of 0 or more"),
    "attenuation": _attenuation,
    "shell": partial(_number, "shell", lambda r: 0 <= r < inf, "a finite radius of 0 or more"),
    "clamped": partial(_flag, "clamped"),
}

ARRAYS = {
    "position": lambda value, vector_type: vector_type(value),
    "direction": lambda value, vector_type: vector_type(value),
    "intensity": colours.as_array,
}
"""Functions that make the kernel's array of a field; other fields stay unchanged."""
