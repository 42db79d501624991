"""Numbers per pixel, which Dr.Jit compiles or NumPy computes: a formula is stated once for both.

A formula is a function of *numbers* (N,) and *colours* (3, N), Dr.Jit's arrays or NumPy's, made of
operators and of the functions here, which follow their arguments. Dr.Jit takes a tenth of NumPy's
time. But two pictures are compared without loading it, and where it cannot be installed.
"""

import sys
from collections.abc import Callable, Sequence
from functools import cache
from importlib import import_module
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Numbers: TypeAlias = Any  # one number per pixel
Colours: TypeAlias = Any  # three numbers per pixel, which can be unpacked
Formula: TypeAlias = Callable[..., Any]

PIXELS = 8192
"""Pixels that NumPy takes at a time: temporaries stay in the processor's cache."""


def is_compiled() -> bool:
    """Return whether Dr.Jit computes: where scenes are loaded, and so LLVM is known to work.

    It is asked at each call, so it does not matter what was imported first.
    """
    return "fotismos.reference.scene" in sys.modules


def _function(name: str, of_numpy: Callable[..., Any]) -> Callable[..., Any]:
    """Return the function of Dr.Jit of a name, or the one of NumPy for NumPy's arrays."""

    def function(*arguments: Any) -> Any:
        if any(isinstance(argument, np.ndarray) for argument in arguments):
            return of_numpy(*arguments)
        return getattr(sys.modules["drjit"], name)(*arguments)

    return function


absolute = _function("abs", np.abs)
arctan2 = _function("atan2", np.arctan2)
cbrt = _function("cbrt", np.cbrt)
clip = _function("clip", np.clip)
cos = _function("cos", np.cos)
exp = _function("exp", np.exp)
log = _function("log", np.log)
maximum = _function("maximum", np.maximum)
minimum = _function("minimum", np.minimum)
power = _function("power", np.power)
select = _function("select", np.where)
sin = _function("sin", np.sin)
sqrt = _function("sqrt", np.sqrt)
square = _function("square", np.square)
squared_norm = _function("squared_norm", lambda colours: np.square(colours).sum(axis=0))
total = _function("sum", lambda colours: colours.sum(axis=0))
"""``total(colours)`` is the sum of their three components."""
with_sign = _function("mulsign", np.copysign)
"""``with_sign(size, other)`` is a size ≥ 0 with the sign of another number."""


def colours(*components: Numbers) -> Colours:
    """Return colours of three components."""
    if isinstance(components[0], np.ndarray):
        return np.stack(components)
    llvm = import_module("drjit.llvm")
    is_double = isinstance(components[0], llvm.Float64)
    return (llvm.Array3f64 if is_double else llvm.Array3f)(*components)


def constant(value: float) -> Any:
    """Return a number as an input of the kernel, not a part of it: one kernel serves all."""
    return _opaque(float(value)) if is_compiled() else float(value)


@cache
def _opaque(value: float) -> Any:
    return import_module("drjit").opaque(import_module("drjit.llvm").Float64, value)


def planes(formula: Formula, *given: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return what a formula makes of planes of one shape (...), in single precision: (K, ...).

    The formula takes a number of each plane, and returns K numbers.
    """
    flat = [plane.reshape(-1) for plane in given]
    count = len(flat[0])
    if is_compiled():
        kind = import_module("drjit.llvm").Float32
        numbers = formula(*(kind(np.ascontiguousarray(plane)) for plane in flat))
        import_module("drjit").eval(numbers)
        shown = np.stack([np.array(number) for number in numbers])
    else:
        shown = _in_parts(
            lambda part: np.stack(formula(*(plane[part] for plane in flat))), count, np.float32
        )
    return shown.reshape(-1, *given[0].shape)


def computed(formula: Formula, *pixels: NDArray[Any]) -> NDArray[np.float64]:
    """Return a formula's numbers (...) or colours (..., 3) of arrays (..., 3), in doubles.

    Results are copies, not views of Dr.Jit's memory: Dr.Jit gives back an array that was made of
    such a view in a thread that has Python's lock and waits for Dr.Jit's, while a rendering has the
    latter and waits for the former.
    """
    shape = pixels[0].shape
    compute = _by_drjit if is_compiled() else _by_numpy
    values = compute(formula, [each.reshape(-1, 3) for each in pixels])
    return values.reshape(shape[:-1] if values.size < pixels[0].size else shape)


def _by_drjit(formula: Formula, pixels: Sequence[NDArray[Any]]) -> NDArray[np.float64]:
    dr = import_module("drjit")
    llvm = import_module("drjit.llvm")
    inputs = []
    for each in pixels:
        # Single precision is widened within kernels.
        if each.dtype == np.float32:
            flat = llvm.Float32(np.ascontiguousarray(each).ravel())
            inputs.append(llvm.Array3f64(dr.unravel(llvm.Array3f, flat)))
        else:
            flat = llvm.Float64(np.ascontiguousarray(each, np.float64).ravel())
            inputs.append(dr.unravel(llvm.Array3f64, flat))
    return np.array(dr.ravel(formula(*inputs)))


def _by_numpy(formula: Formula, pixels: Sequence[NDArray[Any]]) -> NDArray[np.float64]:
    def values(part: slice) -> NDArray[np.float64]:
        inputs = [np.ascontiguousarray(each[part].T, np.float64) for each in pixels]
        return np.atleast_2d(formula(*inputs))

    shown = _in_parts(values, len(pixels[0]), np.float64)
    return np.ascontiguousarray(shown.T)


def _in_parts(values: Callable[[slice], NDArray[Any]], count: int, kind: type) -> NDArray[Any]:
    """Return values (K, count), computed for :data:`PIXELS` at a time."""
    shown: NDArray[Any] | None = None
    # The branch that `select` drops may divide by 0.
    with np.errstate(all="ignore"):
        for start in range(0, count, PIXELS):
            part = slice(start, start + PIXELS)
            found = values(part)
            if shown is None:
                shown = np.empty((len(found), count), kind)
            shown[:, part] = found
    assert shown is not None, "there are pixels"
    return shown
