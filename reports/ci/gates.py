"""Bounds on the results of a comparison: beyond one, ``compare`` ends with exit code 1.

A gate fails only if noise cannot be the reason: the lower end of the 95 % interval is above the
bound. If the interval contains the bound, the gate is undetermined: more samples decide.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final, Literal

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import LEADING
from reports.terminal.printing import number, percent
from reports.terminal.tables import printed
from reports.verdict import USUAL

FAILED: Final = "failed"
UNDETERMINED: Final = "undetermined"
PASSED: Final = "passed"

HEADINGS = ("scene", "gate", "bound", "found", "from", "to", "result")


@dataclass(frozen=True)
class Outcome:
    """The result of one gate for one scene.

    Attributes
    ----------
    scene, gate
        The names of the scene, and of the bounded quantity.
    bound, found, low, high
        The largest value allowed, the value found, and its 95 % interval.
    is_share
        Whether these are shares, printed as percentages.
    """

    scene: str
    gate: str
    bound: float
    found: float
    low: float
    high: float
    is_share: bool

    @property
    def state(self) -> Literal["failed", "undetermined", "passed"]:
        """Return whether the interval is above the bound, contains it, or is below."""
        if self.low > self.bound:
            return FAILED
        return PASSED if self.high <= self.bound else UNDETERMINED

    def cells(self) -> tuple[str, ...]:
        """Return the cells of its row in a table, under :data:`HEADINGS`."""
        form = percent if self.is_share else number
        numbers = self.bound, self.found, self.low, self.high
        return self.scene, self.gate, *map(form, numbers), self.state

    def __str__(self) -> str:
        _, gate, bound, found, low, high, state = self.cells()
        return f"{gate}: {found} ({low} to {high}), at most {bound} allowed: {state}"


@dataclass(frozen=True)
class Gates:
    """The bounds of a command; None for no bound.

    Attributes
    ----------
    mean
        The largest mean of the leading metric.
    visible
        The largest share of pixels that depart by more than :data:`reports.verdict.USUAL`.
    """

    mean: float | None = None
    visible: float | None = None

    def judge(self, records: Sequence[ComparisonRecord]) -> list[Outcome]:
        """Return the outcome of each gate for each scene."""
        return [outcome for record in records for outcome in self._of(record)]

    def _of(self, record: ComparisonRecord) -> Iterator[Outcome]:
        found, limit = record.metrics[LEADING.name], f"{USUAL:g}"
        if self.mean is not None:
            numbers = self.mean, found.debiased, found.low, found.high
            yield Outcome(record.scene, f"mean {LEADING.label}", *numbers, is_share=False)
        if self.visible is not None:
            between = found.visible_between[limit]
            numbers = self.visible, found.visible[limit], between.low, between.high
            yield Outcome(record.scene, f"above {LEADING.label} {limit}", *numbers, is_share=True)


def lines(outcomes: Sequence[Outcome]) -> Iterator[str]:
    """Yield the lines on the gates of a run."""
    yield ""
    yield from printed([HEADINGS, *(outcome.cells() for outcome in outcomes)], right=2)
    yield verdict(outcomes)


def verdict(outcomes: Sequence[Outcome]) -> str:
    """Return the line that says how it went."""
    counts = {
        state: sum(outcome.state == state for outcome in outcomes)
        for state in (FAILED, UNDETERMINED, PASSED)
    }
    said = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
    more = " More samples (--spp, --noise) decide." if counts[UNDETERMINED] else ""
    return f"gates: {said}.{more}"
