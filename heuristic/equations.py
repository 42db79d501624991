"""The index of the chapters' equations: each has one home function, or a written reason.

A function is the home of an equation when its docstring begins with the number, as in ``Equations
8.5, 8.6, 6.6, 6.7: ...``. The index is read from the docstrings, so it cannot disagree with them.
"""

import importlib
import inspect
import pkgutil
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import heuristic

NUMBERS = tuple(f"6.{number}" for number in range(1, 39)) + tuple(
    f"8.{number}" for number in range(1, 13)
)

WITHOUT_HOME = {
    "8.3": "a step of Lambert's derivation: emitted power goes with dE cos b",
    "8.4": "its other step, dE = dA / cos b; together they say that the view angle b does not"
    " matter, which a test shows",
    "8.7": "the perfect mirror is the limit of 8.8 for large n; a test shows that off the mirror"
    " direction the lobe goes to 0",
}
"""Equations that no function computes, with the reason."""

_CLAIM = re.compile(r"Equations? ((?:\d+\.\d+(?:-\d+\.\d+)?(?:, )?)+):")
_RANGE = re.compile(r"(\d+)\.(\d+)(?:-\d+\.(\d+))?")


@dataclass(frozen=True)
class Entry:
    """An equation, its home as ``module.function``, and the first sentence there or the reason."""

    number: str
    home: str | None
    meaning: str


def claims(function: Callable[..., Any]) -> tuple[str, ...]:
    """Return the equation numbers that a function's docstring begins with."""
    match = _CLAIM.match(inspect.getdoc(function) or "")
    if not match:
        return ()
    numbers = []
    for chapter, first, last in _RANGE.findall(match.group(1)):
        numbers += [f"{chapter}.{i}" for i in range(int(first), int(last or first) + 1)]
    return tuple(numbers)


def homes() -> dict[str, list[tuple[str, Callable[..., Any]]]]:
    """Return the functions that claim each equation number.

    Members of classes have their qualified names. A test requires one function per equation.
    """
    found: dict[str, list[tuple[str, Callable[..., Any]]]] = {}
    for name, function in _functions():
        for number in claims(function):
            found.setdefault(number, []).append((name, function))
    return found


def index() -> list[Entry]:
    """Return an :class:`Entry` for each equation of the chapters, in order."""
    found = homes()
    entries = []
    for number in NUMBERS:
        for name, function in found.get(number, ())[:1]:
            text = " ".join((inspect.getdoc(function) or "").split("\n\n")[0].split())
            entries.append(Entry(number, name, _CLAIM.sub("", text, count=1).strip()))
        if number not in found:
            entries.append(Entry(number, None, WITHOUT_HOME.get(number, "")))
    return entries


def _functions() -> Iterator[tuple[str, Callable[..., Any]]]:
    """Yield the qualified names and the functions of all modules of this package."""
    for module_info in pkgutil.iter_modules(heuristic.__path__, "heuristic."):
        module = importlib.import_module(module_info.name)
        for name, member in vars(module).items():
            if getattr(member, "__module__", None) != module.__name__:
                continue
            if inspect.isfunction(member):
                yield f"{module.__name__}.{name}", member
            elif inspect.isclass(member):
                for method, function in vars(member).items():
                    if inspect.isfunction(function):
                        yield f"{module.__name__}.{name}.{method}", function
