"""Numbers per pixel, which Dr.Jit compiles or NumPy computes: a formula is stated once for both.

A formula is a function of *numbers* (N,) and *colours* (3, N), Dr.Jit's arrays or NumPy's, made of
operators and of the functions here, which follow their arguments. Dr.Jit takes a tenth of NumPy's
time. But two pictures are compared without loading it, and where it cannot be installed.
"""

import sys
from collections.abc import Callable, Sequence
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
        return getattr(import_module("drjit"), name)(*arguments)

    return function


absolute = _function("abs", np.abs)
arctan2 = _function("atan2", np.arctan2)
cbrt = _function("cbrt", np.cbrt)
clip = _function("clip", np.clip)
cos = _function("cos", np.cos)
exp = _function("exp", np.exp)
hypot = _function("hypot", np.hypot)
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
evaluate = _function("eval", lambda *values: None)


def colours(*components: Numbers) -> Colours:
    """Return colours of three components."""
    if isinstance(components[0], np.ndarray):
        return np.stack(components)
    llvm = import_module("drjit.llvm")
    is_double = isinstance(components[0], llvm.Float64)
    return (llvm.Array3f64 if is_double else llvm.Array3f)(*components)


def constant(value: float, is_single: bool = False) -> Any:
    """Return a number as an input of the kernel, not a part of it: one kernel serves all."""
    if not is_compiled():
        return float(value)
    llvm = import_module("drjit.llvm")
    kind = llvm.Float32 if is_single else llvm.Float64
    return import_module("drjit").opaque(kind, float(value))


def single(pixels: NDArray[Any]) -> Colours:
    """Return pixels (..., 3) as colours in single precision."""
    if not is_compiled():
        return np.ascontiguousarray(pixels.reshape(-1, 3).T, np.float32)
    llvm = import_module("drjit.llvm")
    flat = llvm.Float32(np.ascontiguousarray(pixels, np.float32).ravel())
    return import_module("drjit").unravel(llvm.Array3f, flat)


def single_numbers(plane: NDArray[np.float32]) -> Numbers:
    """Return a plane (H, W) in single precision as numbers."""
    return import_module("drjit.llvm").Float32(plane.ravel()) if is_compiled() else plane.ravel()


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
    count = len(pixels[0])
    parts = []
    # The branch that `select` drops may divide by 0.
    with np.errstate(all="ignore"):
        for start in range(0, count, PIXELS):
            block = [each[start : start + PIXELS] for each in pixels]
            inputs = [np.ascontiguousarray(each.T, np.float64) for each in block]
            parts.append(np.ascontiguousarray(formula(*inputs).T))
    return np.concatenate(parts)
