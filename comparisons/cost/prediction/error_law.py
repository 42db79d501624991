"""Errors of all methods of a scene at another size and any count, with intervals.

Between sizes the error of a count follows a straight line in ``1 / width``: edges make it depend on
the size, and so does their share of the pixels. Between counts it follows a method's
:class:`~comparisons.cost.prediction.error_curve.ErrorCurve` at one size.

How far off that is, the fitted points tell by cross-validation: the largest size is predicted from
the others, and the middle counts of a curve from its other ones. What the line misses grows as the
root of the error, for edges that meet the pixels by chance add up so; what the curve misses, as the
part of the error that is noise. Both are told over all methods of the scene together, and of each
method more by its own.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import exp, hypot, log, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy import stats

from comparisons.cost.prediction.error_curve import ErrorCurve

LEVEL = 0.9
"""Chance of an interval to hold what is measured later."""

SHARED = 4
"""Cases that those of all methods count as, for one method beside its own two."""

OWN_CHANCE = 1 / 3
"""Of what the line misses at the largest size: what the edges of the asked one add by chance."""

Point = tuple[int, int]
"""A width and a count."""


@dataclass(frozen=True)
class ErrorLaw:
    """The error of one method, at any size and count.

    Attributes
    ----------
    widths
        The sizes that were measured, three from the smallest; the curve is of the middle one.
    errors
        ``{(width, count): error of each round}``, with the counts of the largest at all widths.
    curve
        The method's, at the middle width.
    """

    widths: tuple[int, int, int]
    errors: Mapping[Point, Sequence[float]]
    curve: ErrorCurve

    def at(self, width: float, spp: float) -> float:
        """Return the error of a size and a count."""
        grown = [log(self._across(self.widths, s, width) / self._mean(1, s)) for s in self.counts]
        return self.curve.at(spp) * exp(np.interp(log(spp), np.log(self.counts), grown))

    @cached_property
    def counts(self) -> list[int]:
        """The counts that were measured at every size."""
        return sorted(spp for width, spp in self.errors if width == self.widths[-1])

    @cached_property
    def missed_by_size(self) -> tuple[float, float]:
        """Sums over the counts: the square of what the line misses of the largest size, the error.

        The line is that of the other sizes.
        """
        *others, last = self.widths
        found = [self._mean(2, s) for s in self.counts]
        missed = [
            self._across(others, s, last) - error
            for s, error in zip(self.counts, found, strict=True)
        ]
        return float(np.square(missed).sum()), sum(found)

    @cached_property
    def missed_by_count(self) -> tuple[float, float]:
        """Sums over middle counts: squares of what the curve misses without them, and of noise."""
        held = sorted(self.curve.residuals)[1:-1]
        errors = [self._mean(1, s) for s in held]
        missed = [self.curve.without(s).at(s) - e for s, e in zip(held, errors, strict=True)]
        noise = [max(error - self.curve.bias, 0.0) for error in errors]
        return float(np.square(missed).sum()), float(np.square(noise).sum())

    def spread(self, width: float, spp: float, by_size: float, by_count: float) -> float:
        """Return the standard deviation of an error that is predicted.

        ``by_size`` and ``by_count`` are the ratios of the sums of :attr:`missed_by_size` and
        :attr:`missed_by_count`, over all methods.
        """
        _, middle, last = self.widths
        reach = hypot((1 / last - 1 / width) / (1 / middle - 1 / last), OWN_CHANCE)
        value, error = self.at(width, spp), self._mean(2, self.counts[-1])
        noise = max(value - self.curve.bias * value / self.curve.at(spp), 0.0)
        rounds = self.errors[last, self.counts[-1]]
        return hypot(
            reach * sqrt(_shrunk(self.missed_by_size, by_size, len(self.counts)) * value),
            noise * sqrt(_shrunk(self.missed_by_count, by_count, 2)),
            value / error * float(np.std(rounds, ddof=1)) * sqrt(2 / len(rounds)),
        )

    def _mean(self, place: int, spp: int) -> float:
        return max(float(np.mean(self.errors[self.widths[place], spp])), TINY)

    def _across(self, widths: Sequence[float], spp: int, width: float) -> float:
        """Continue errors along a line in 1 / width; at most, all of the last is at edges."""
        errors = [self._mean(place, spp) for place in range(len(widths))]
        slope, end = np.polyfit(1 / np.asarray(widths, float), errors, 1, w=1 / np.array(errors))
        return max(slope / width + end, errors[-1] * min(widths[-1] / width, 1.0))


TINY = 1e-9
"""An error of nothing, as a number that has a logarithm."""


def _shrunk(own: tuple[float, float], shared: float, count: int) -> float:
    """Return a ratio of sums: a method's own, drawn towards that of all."""
    missed, whole = own
    return (missed / whole * count + SHARED * shared) / (count + SHARED) if whole else shared


def intervals(laws: Sequence[ErrorLaw], width: float) -> Callable[[ErrorLaw, float], NDArray]:
    """Return ``(law, count) -> (error, low, high)`` at a width, for the methods of a scene."""
    size, count = (
        np.sum([getattr(law, name) for law in laws], axis=0)
        for name in ("missed_by_size", "missed_by_count")
    )
    by_size, by_count = (missed / max(whole, TINY) for missed, whole in (size, count))
    reach = stats.t.ppf((1 + LEVEL) / 2, SHARED + 2)

    def interval(law: ErrorLaw, spp: float) -> NDArray:
        value, spread = law.at(width, spp), law.spread(width, spp, by_size, by_count)
        return np.clip([value, value - reach * spread, value + reach * spread], 0.0, None)

    return interval
