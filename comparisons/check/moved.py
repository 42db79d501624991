"""Find the numbers that moved by more than both sides' uncertainty: Welch's t-test, many at once.

Before and after are independent measurements. If they share a seed, unchanged numbers differ by
even less than the test allows for.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Annotated

import numpy as np
from msgspec import Meta
from numpy.typing import ArrayLike, NDArray

from comparisons.check.measurement import Measurement
from comparisons.records import Amount, Record, Share

LEVEL = 0.01
"""Chance of a false alarm, over all quantities that one check tests."""

RELATIVE_ROUNDING = 1e-5
"""Share of a value that rounding can change: other machines order float32 sums otherwise."""


class Move(Record):
    """One quantity, before and after.

    Attributes
    ----------
    quantity, half, block
        See :class:`comparisons.check.measurement.Quantity`; row and column count from 1.
    before, after
        The values then and now.
    error
        Standard error of the difference.
    standard_errors
        The signed difference over that error; None if neither side has any spread.
    p
        Chance of a difference at least this large if nothing changed.
    p_corrected
        Chance of one such among all quantities tested (Šidák).
    """

    quantity: str
    half: str | None
    block: Annotated[tuple[int, int], Meta(description="Row and column, from 1.")] | None
    before: float
    after: float
    error: Amount
    standard_errors: float | None
    p: Share
    p_corrected: Share


def differences(before: Measurement, after: Measurement) -> tuple[Move, ...]:
    """Compare all quantities of two measurements of the same kind.

    ::

        t = (x₂ − x₁) / √(e₁² + e₂²)
        ν = (n − 1) (e₁² + e₂²)² / (e₁⁴ + e₂⁴)

    with standard errors e over n passes on each side (Welch 1947; Satterthwaite 1946). A difference
    within rounding has p = 1. A larger one has p = 0 if neither side has any spread. Šidák's
    correction treats the quantities as independent; they nearly are, and alarms get rarer.

    Raises
    ------
    ValueError
        For measurements of different quantities, or with different numbers of passes: Welch's test
        is then wrong in the far tails, which a correction for many tests needs.
    """
    from scipy.stats import ttest_ind_from_stats

    pairs = list(zip(before.quantities(), after.quantities(), strict=True))
    if before.passes != after.passes or any(old.name != new.name for old, new in pairs):
        raise ValueError("measurements with different passes or quantities cannot be compared")
    count = before.passes
    x = np.array([[old.value, new.value] for old, new in pairs])
    errors = np.array([[old.error, new.error] for old, new in pairs])
    difference, total = x[:, 1] - x[:, 0], (errors**2).sum(axis=1)
    rounding = np.array([old.rounding for old, _ in pairs])
    rounding = np.maximum(rounding, RELATIVE_ROUNDING * np.abs(x).max(axis=1))
    spread = total > (1e-6 * rounding) ** 2  # sums of equal numbers differ in their last bits
    deviations = np.where(spread[:, None], errors, 1.0) * np.sqrt(count)
    t, p = ttest_ind_from_stats(
        x[:, 1], deviations[:, 1], count, x[:, 0], deviations[:, 0], count, equal_var=False
    )
    p = np.where(np.abs(difference) <= rounding, 1.0, np.where(spread, p, 0.0))
    corrected = sidak(p, len(pairs))
    return tuple(
        Move(
            quantity=old.name,
            half=old.half,
            block=old.block and (old.block[0] + 1, old.block[1] + 1),
            before=old.value,
            after=new.value,
            error=float(np.sqrt(total[i])),
            standard_errors=float(t[i]) if spread[i] else None,
            p=float(p[i]),
            p_corrected=float(corrected[i]),
        )
        for i, (old, new) in enumerate(pairs)
    )


def sidak(p: ArrayLike, tests: int) -> NDArray[np.float64]:
    """Return the chance of a p-value as small as `p` among this many independent tests."""
    with np.errstate(divide="ignore"):  # p = 1
        return -np.expm1(tests * np.log1p(-np.asarray(p, float)))


def level_of_each(level: float, checks: int) -> float:
    """Return the level of each of several checks, so that together they have `level`."""
    return float(-np.expm1(np.log1p(-level) / checks))


def moved(moves: Sequence[Move], level: float = LEVEL) -> list[Move]:
    """Return those that moved: metrics, then whole images, then blocks, smallest p first.

    Equal ones are in order of their difference, the largest first.
    """
    found = [move for move in moves if not move.p_corrected >= level]  # a NaN does not pass
    return sorted(found, key=_order)


def _order(move: Move) -> tuple[int, float, float]:
    part = (move.half is not None) + (move.block is not None)
    return part, move.p, -abs(move.after - move.before)
