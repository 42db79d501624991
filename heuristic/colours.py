"""Coefficients and intensities as numbers, RGB, or one value per wavelength (8.11, 8.12)."""

from collections.abc import Mapping, Sequence
from numbers import Real
from typing import Any

import drjit as dr
import numpy as np

from heuristic.convention import Colour
from heuristic.errors import InputError


def checked(name: str, value: Any) -> Any:
    """Return ``value`` as a float, a tuple of floats, or an unchanged Dr.Jit array.

    Numbers and sequences must be finite and not negative. Dr.Jit arrays are not checked, because
    that would evaluate them.
    """
    if dr.is_array_v(value) and dr.is_jit_v(value):
        return value
    components = _components(value)
    if components is None:
        raise InputError(
            f"{name} = {value!r} is not a colour: give a number, RGB, or one value per wavelength."
        )
    if not components:
        raise InputError(f"{name} = {value!r} is not allowed: give one value or more.")
    for component in components:
        if not (np.isfinite(component) and component >= 0):
            raise InputError(f"{name} = {value!r} is not allowed: give finite values of 0 or more.")
    return components[0] if len(components) == 1 else components


def _components(value):
    """Return the numbers of a value, or None if it is not made of numbers."""
    is_several = isinstance(value, Sequence | np.ndarray) or dr.is_array_v(value)
    if isinstance(value, str) or not (is_several or isinstance(value, Real)):
        return None
    try:
        return tuple(float(component) for component in np.ravel(value))
    except (TypeError, ValueError, OverflowError):
        return None


def is_zero(value: Any) -> bool:
    """Return whether a checked value is zero by construction; its term is then not traced."""
    if isinstance(value, tuple):
        return not any(value)
    return isinstance(value, float) and value == 0


def wavelength_count(value: Any) -> int:
    """Return the number of components of a checked value, 1 for numbers and Dr.Jit floats."""
    if isinstance(value, tuple):
        return len(value)
    if dr.is_array_v(value) and dr.depth_v(value) > 1:
        return len(value)
    return 1


def common_wavelength_count(values: Mapping[str, Any]) -> int:
    """Return the number of components that all ``values`` share; single ones fit any.

    ``values`` maps names to checked values.
    """
    counts = {name: wavelength_count(value) for name, value in values.items()}
    several = {name: count for name, count in counts.items() if count > 1}
    if len(set(several.values())) > 1:
        listing = ", ".join(f"{name} has {count}" for name, count in several.items())
        raise InputError(
            f"Mixed numbers of wavelengths: {listing}. Give each colour one value, or the same"
            " number."
        )
    return max(counts.values(), default=1)


def as_array(value: Any, vector_type: type) -> Colour:
    """Convert a checked value into a factor for the kernel.

    Numbers and Dr.Jit arrays stay unchanged; a tuple of three or fewer becomes a fixed array of
    the backend and precision of ``vector_type``, a longer one a dynamic array.
    """
    if not isinstance(value, tuple):
        return value
    size = len(value) if len(value) <= 4 else -1
    shape = (size, -1) if dr.is_jit_v(vector_type) else (size,)
    return dr.replace_shape_t(vector_type, shape)(value)
