"""Arguments of :func:`heuristic.shade`, converted to what the kernel takes, or rejected."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from numbers import Real
from typing import Any

import drjit as dr
import numpy as np

from heuristic.errors import InputError
from heuristic.light import Light
from heuristic.materials import Material

HOW = "give a Dr.Jit array of three components, such as drjit.auto.Array3f(x, y, z)"


def vectors(position: Any, normal: Any, view: Any) -> tuple[Any, Any, Any]:
    """Return the three vectors as Dr.Jit arrays of floats of at least single precision.

    Three plain numbers, in a list, tuple or NumPy array, are one vector for all points; at least
    one argument must be a Dr.Jit array. Half precision and integers become single.

    Raises
    ------
    InputError
        For anything else.
    """
    given = {"position": position, "normal": normal, "view": view}
    arrays = {name: _array(name, value) for name, value in given.items() if dr.is_array_v(value)}
    if not arrays:
        raise InputError(f"position, normal, view: {HOW}; none of them is one.")
    common = type(next(iter(arrays.values())))
    plain = {name: _plain(name, given[name]) for name in given if name not in arrays}
    found = arrays | {name: common(*value) for name, value in plain.items()}
    return found["position"], found["normal"], found["view"]


def lights(given: Any) -> Sequence[Light]:
    """Return lights as a sequence.

    Raises
    ------
    InputError
        If it is not an iterable of lights.
    """
    if isinstance(given, (str, bytes, Mapping)) or not isinstance(given, Iterable):
        raise InputError(
            f"lights is {_kind(given)}: give a list of PointLight, DirectionalLight or SpotLight,"
            " empty for none."
        )
    found = given if isinstance(given, Sequence) else list(given)
    for number, light in enumerate(found):
        if not isinstance(light, Light):
            raise InputError(
                f"lights[{number}] is {_kind(light)}: give a PointLight, DirectionalLight or"
                " SpotLight."
            )
    return found


def material(given: Any) -> Material:
    """Return a material; raise InputError for anything else."""
    if not isinstance(given, Material):
        raise InputError(f"material is {_kind(given)}: give a heuristic.Material.")
    return given


def visibility(given: Any) -> Callable[[Any, Any], Any] | None:
    """Return a function that returns masks, or None.

    Raises
    ------
    InputError
        If it cannot be called, or, when called, does not return a mask.
    """
    if given is None:
        return None
    if not callable(given):
        raise InputError(
            f"visible is {_kind(given)}: give a function of a direction and a distance that returns"
            " a mask, or None."
        )

    def visible(toward: Any, distance: Any) -> Any:
        seen = given(toward, distance)
        if not (isinstance(seen, bool) or (dr.is_array_v(seen) and dr.is_mask_v(seen))):
            raise InputError(f"visible returned {_kind(seen)}: it must return a mask.")
        return seen

    return visible


def require_one_size(values: Mapping[str, Any]) -> None:
    """Reject Dr.Jit arrays of different numbers of points; one point fits any number.

    Raises
    ------
    InputError
        With the number of points of each array that has more than one.
    """
    if dr.flag(dr.JitFlag.SymbolicScope):
        return
    widths = {name: dr.width(value) for name, value in values.items() if dr.is_jit_v(value)}
    several = {name: width for name, width in widths.items() if width != 1}
    if len(set(several.values())) > 1 or 0 in several.values():
        listing = ", ".join(f"{name} has {width}" for name, width in several.items())
        raise InputError(
            f"Mixed numbers of points: {listing}. Give each array one entry, or the same number."
        )


def _array(name: str, value: Any) -> Any:
    is_vector = dr.depth_v(value) == 1 + dr.is_jit_v(value) and dr.size_v(value) == 3
    if not is_vector or dr.is_mask_v(value) or dr.is_complex_v(value):
        raise InputError(f"{name} is {_kind(value)}: {HOW}.")
    if not dr.is_float_v(value) or dr.itemsize_v(value) < 4:
        return dr.float32_array_t(type(value))(value)
    return value


def _plain(name: str, value: Any) -> tuple[float, float, float]:
    is_sequence = isinstance(value, (list, tuple, np.ndarray))
    numbers = list(value) if is_sequence and np.ndim(np.asarray(value, object)) == 1 else []
    if len(numbers) != 3 or not all(isinstance(number, Real) for number in numbers):
        raise InputError(f"{name} is {_kind(value)}: {HOW}, or three numbers.")
    x, y, z = map(float, numbers)
    return x, y, z


def _kind(value: Any) -> str:
    shape = f" of shape {value.shape}" if isinstance(value, np.ndarray) else ""
    if isinstance(value, (list, tuple)):
        shape = f" of {len(value)}"
    return f"of type {type(value).__module__}.{type(value).__qualname__}{shape}".replace(
        "builtins.", ""
    )
