"""Heuristics made of plain functions: parameters from the signature, needs from a trial.

::

    import drjit as dr
    from heuristic import Range

    def shade(point, steps: Range(1, 8) = 3):
        value = point.ambient * point.material.k_a
        for light in point.lights:
            cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
            value += point.material.k_d * light.intensity * dr.ceil(cosine * steps) / steps
        return value
"""

import inspect
from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from math import inf, isfinite
from numbers import Real
from typing import Any, get_args

from heuristic import trial
from heuristic.errors import InputError
from heuristic.heuristics import Heuristic, Parameter, Range
from heuristic.points import INPUTS, Point
from heuristic.user_code import defined

UNBOUNDED = Range(-inf, inf)


def heuristic_of(given: Any, name: str, label: str = "") -> Heuristic:
    """Return a user's function or object as a heuristic, after a trial.

    Parameters
    ----------
    given
        A function of a :class:`heuristic.points.Point` and of numbers with a default. These are the
        parameters; a :class:`Range` as annotation gives their bounds. Or a :class:`Heuristic`.
    name, label
        Name and label of the heuristic; an object keeps its own label.

    Raises
    ------
    InputError
        If it is neither, has another signature, or fails the trial.
    """
    if isinstance(given, Heuristic):
        found = replace(given, name=name)
        return found if found.prepare else replace(found, reads=trial.examine(found))
    if not callable(given):
        raise InputError(
            f"{name} is of type {type(given).__name__}: give a function of a point that returns a"
            " colour, or a heuristic.Heuristic."
        )
    parameters = _parameters(given)
    names = [parameter.name for parameter in parameters]

    @wraps(given)
    def shade(point: Point) -> Any:
        return given(point, **{each: getattr(point.parameters, each) for each in names})

    found = Heuristic(name, shade, label, frozenset(INPUTS), parameters)
    read = trial.examine(found)
    needs = {part.partition(".")[0] for part in read} & set(INPUTS)
    return replace(found, needs=frozenset(needs), reads=read)


def _parameters(function: Callable[..., Any]) -> tuple[Parameter, ...]:
    """Return the parameters of a function: its arguments besides the point."""
    try:
        signature = inspect.signature(function, eval_str=True)
    except (TypeError, ValueError, NameError) as error:
        raise InputError(f"{defined(function)}: its signature cannot be read: {error}.") from error
    given = list(signature.parameters.values())
    positional = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    if not given or given[0].kind not in positional:
        raise _refused(function, "it does not take a point")
    return tuple(_parameter(function, one) for one in given[1:])


def _parameter(function: Callable[..., Any], one: inspect.Parameter) -> Parameter:
    if one.kind in (one.VAR_POSITIONAL, one.VAR_KEYWORD, one.POSITIONAL_ONLY):
        raise _refused(function, f"{one} is not a number")
    is_number = isinstance(one.default, Real) and not isinstance(one.default, bool)
    if not (is_number and isfinite(one.default)):
        raise _refused(function, f"{one.name!r} has no number as its default")
    stated = [part for part in (one.annotation, *get_args(one.annotation))
              if isinstance(part, Range)]  # fmt: skip
    bounds = stated[0] if stated else UNBOUNDED
    try:
        return Parameter(one.name, float(one.default), bounds.low, bounds.high)
    except InputError as error:
        raise InputError(f"{defined(function)}: {error}") from error


def _refused(function: Callable[..., Any], reason: str) -> InputError:
    return InputError(
        f"{defined(function)}: {reason}. Write a function such as `{function.__name__}(point,"
        " gloss: Range(0, 1) = 0.5)`: it takes the points, and numbers with a default."
    )
