"""A hard case, and how it is judged.

A case has the exact value, a naive evaluation, ours, and a bound on the error that ours keeps and
the naive one does not. Tests demand both of every case; the report prints them. The cases are in
:mod:`comparisons.hard.collection`.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from comparisons.hard.textbook import Setting

ABSENT = 1e-3
"""Values below this share of the largest are judged by their absolute error."""

Values = Callable[[], ArrayLike]


@dataclass(frozen=True)
class Description:
    """A case in words: its name and group, the difficulty, and the bound on the relative error."""

    name: str
    group: str
    hard: str
    bound: float


@dataclass(frozen=True)
class HardCase(Description):
    """A case that can be evaluated.

    ``naive``, ``ours`` and ``exact`` return arrays of one shape.
    """

    naive: Values
    ours: Values
    exact: Values
    setting: Setting | None = None

    def described(self) -> Description:
        """Return the words without the code, which cannot be sent to another process."""
        return Description(self.name, self.group, self.hard, self.bound)


@dataclass(frozen=True)
class Statement:
    """A convention: no formula breaks, but somebody must decide."""

    name: str
    text: str
    stated: ArrayLike


@dataclass(frozen=True)
class Convention(Statement):
    """A statement that can be tested.

    ``ours`` must return ``stated``, which ``text`` says in words.
    """

    ours: Values

    def holds(self) -> bool:
        """Return whether the code does what is stated, to single precision."""
        return bool(np.allclose(self.ours(), self.stated, rtol=1e-6, atol=0))

    def described(self) -> Statement:
        """Return the words without the code."""
        return Statement(self.name, self.text, self.stated)


@dataclass(frozen=True)
class Outcome:
    """A case and its two errors; infinite for a NaN, an infinity, or light where there is none."""

    case: Description
    naive_error: float
    our_error: float

    @property
    def holds(self) -> bool:
        """Whether ours keeps the bound."""
        return self.our_error <= self.case.bound


def evaluate(case: HardCase) -> Outcome:
    """Return the outcome of a case."""
    exact = np.asarray(case.exact(), np.longdouble)
    return Outcome(case.described(), error(case.naive(), exact), error(case.ours(), exact))


def error(found: ArrayLike, exact: np.ndarray) -> float:
    """Return the largest error, relative to the exact value or to a thousandth of the largest."""
    found = np.asarray(found, np.longdouble)
    if found.shape != exact.shape:
        raise ValueError(f"shapes {found.shape} and {exact.shape}")
    if not np.isfinite(found).all():
        return np.inf
    scale = np.maximum(np.abs(exact), ABSENT * np.abs(exact).max())
    difference = np.abs(found - exact)
    if not scale.all():
        return np.inf if difference.any() else 0.0
    return float((difference / scale).max())


def quietly(function: Values) -> Values:
    """Return a function without NumPy's warnings of NaN and infinities, which cases provoke."""

    def call() -> ArrayLike:
        with np.errstate(all="ignore"):
            return function()

    return call
