"""Bounds on what a comparison may find: beyond one, ``compare`` ends with exit code 1.

A gate fails only where noise cannot be the reason: the lower end of the 95 % interval is above the
bound. Where the interval holds the bound more samples decide, and the gate is undetermined.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import LEADING
from reports.terminal.printing import number, percent
from reports.terminal.tables import printed
from reports.verdict import USUAL

FAILED, UNDETERMINED, PASSED = "failed", "undetermined", "passed"

HEADINGS = ("scene", "gate", "bound", "found", "from", "to", "result")


@dataclass(frozen=True)
class Outcome:
    """What became of one gate for one scene.

    Attributes
    ----------
    scene, gate
        The scene's name, and what is bounded, in words.
    bound, found, low, high
        What is allowed, what was found, and its 95 % interval; shares for the share of pixels.
    is_share
        Whether these are printed as percentages.
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
        """Return what the interval says of the bound."""
        if self.low > self.bound:
            return FAILED
        return PASSED if self.high <= self.bound else UNDETERMINED

    def cells(self) -> tuple[str, ...]:
        """Return what a table says of it, under :data:`HEADINGS`."""
        form = percent if self.is_share else number
        numbers = self.bound, self.found, self.low, self.high
        return self.scene, self.gate, *map(form, numbers), self.state

    def __str__(self) -> str:
        _, gate, bound, found, low, high, state = self.cells()
        return f"{gate}: {found} ({low} to {high}), at most {bound} allowed: {state}"


@dataclass(frozen=True)
class Gates:
    """The bounds of a command, None for none.

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
    """Yield what people read of the gates of a run."""
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
