"""Faster switching of Mitsuba's variants.

With each switch, Mitsuba loads its Python integrators again, and Dr.Jit transforms the syntax of
the same functions again: 0.1 s, as long as a pass. The same code has the same transformation.
"""

from collections.abc import Callable
from types import CodeType, FunctionType
from typing import Any

import drjit

_transform = drjit.syntax
_transformed: dict[tuple[str, CodeType], CodeType] = {}


def syntax(f: FunctionType | None = None, **options: Any) -> Callable[..., Any]:
    """Do what ``drjit.syntax`` does, once for each function's code."""
    if f is None or options:
        return _transform(f, **options)
    key = f.__code__.co_filename, f.__code__
    if key not in _transformed:
        made = _transform(f)
        _transformed[key] = made.__code__
        return made
    made = FunctionType(_transformed[key], f.__globals__)
    made.__defaults__ = f.__defaults__
    return made


drjit.syntax = syntax  # for Mitsuba's modules, which look it up when they are loaded
