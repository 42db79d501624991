"""Errors of all methods of a scene at another size and any count, with intervals.

Between sizes, the error at a count is linear in ``1 / width``, as the edges' share of the pixels
is. Between counts, it follows a method's
:class:`~comparisons.cost.prediction.error_curve.ErrorCurve` at one size.

Cross-validation shows how far off that is: the largest size is predicted from the others, and the
middle counts of a curve from its other counts. The line's misfit grows as the root of the error,
since edges meet the pixels by chance; the curve's misfit grows as the noise. Both are estimated
over all methods of the scene, with more weight on a method's own cases. Below :data:`UNSEEN` and
:data:`UNRESOLVED`, three small sizes show nothing: all methods share the reference's chance of rare
bright pixels, and edges that one size resolves and another does not. No interval is narrower.
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
"""Chance that an interval holds a later measurement."""

SHARED = 4
"""Weight of all methods' cases together, next to a method's own."""

OWN_CHANCE = 1 / 3
"""Share of the line's misfit at the largest size that edges add by chance at the requested size."""

UNSEEN = 0.02
"""Half an interval, at least: errors in ΔE that differ by less count as equal."""

UNRESOLVED = 0.015
"""Half an interval, at least, as a share of the error."""

Point = tuple[int, int]
"""A width and a count."""


@dataclass(frozen=True)
class ErrorLaw:
    """The error of one method, at any size and count.

    Attributes
    ----------
    widths
        The measured widths, from the smallest; the curve is of the middle one.
    errors
        ``{(width, count): error of each round}``; the largest width's counts are at all widths.
    curve
        The method's curve at the middle width.
    """

    widths: tuple[int, int, int]
    errors: Mapping[Point, Sequence[float]]
    curve: ErrorCurve

    def at(self, width: float, spp: float) -> float:
        """Return the error at a size and a count."""
        grown = [log(self._across(self.widths, s, width) / self._mean(1, s)) for s in self.counts]
        return self.curve.at(spp) * exp(np.interp(log(spp), np.log(self.counts), grown))

    @cached_property
    def counts(self) -> list[int]:
        """The counts measured at every size."""
        return sorted(spp for width, spp in self.errors if width == self.widths[-1])

    @cached_property
    def missed_by_size(self) -> tuple[float, float]:
        """Sums over the counts at the largest size: squared misfit of the line, and the error.

        The line is fitted to the other sizes.
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
        """Sums over middle counts: squared misfit of the curve without them, and squared noise."""
        held = sorted(self.curve.residuals)[1:-1]
        errors = [self._mean(1, s) for s in held]
        missed = [self.curve.without(s).at(s) - e for s, e in zip(held, errors, strict=True)]
        noise = [max(error - self.curve.bias, 0.0) for error in errors]
        return float(np.square(missed).sum()), float(np.square(noise).sum())

    def spread(self, width: float, spp: float, by_size: float, by_count: float) -> float:
        """Return the standard deviation of a predicted error.

        ``by_size`` and ``by_count`` are the ratios of the sums of ``missed_by_size`` and
        ``missed_by_count``, over all methods.
        """
        _, middle, last = self.widths
        reach = hypot((1 / last - 1 / width) / (1 / middle - 1 / last), OWN_CHANCE)
        value, error = self.at(width, spp), self._mean(2, self.counts[-1])
        bias = self.curve.bias / max(self.curve.at(spp), TINY)
        noise = value * max(1.0 - bias, 0.0)
        rounds = self.errors[last, self.counts[-1]]
        return hypot(
            reach * sqrt(_shrunk(self.missed_by_size, by_size, len(self.counts)) * value),
            noise * sqrt(_shrunk(self.missed_by_count, by_count, 2)),
            value / error * float(np.std(rounds, ddof=1)) * sqrt(2 / len(rounds)),
        )

    def _mean(self, place: int, spp: int) -> float:
        return max(float(np.mean(self.errors[self.widths[place], spp])), TINY)

    def _across(self, widths: Sequence[float], spp: int, width: float) -> float:
        """Continue errors along a line in 1 / width; at most, all of the last error is at edges."""
        errors = [self._mean(place, spp) for place in range(len(widths))]
        slope, end = np.polyfit(1 / np.asarray(widths, float), errors, 1, w=1 / np.array(errors))
        return max(slope / width + end, errors[-1] * min(widths[-1] / width, 1.0))


TINY = 1e-9
"""Stands for an error of 0, which has no logarithm."""


def _shrunk(own: tuple[float, float], shared: float, count: int) -> float:
    """Return a method's own ratio of sums, drawn towards that of all methods."""
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
        half = hypot(reach * spread, UNSEEN, UNRESOLVED * value)
        return np.clip([value, value - half, value + half], 0.0, None)

    return interval
