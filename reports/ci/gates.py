"""Bounds on the results of a comparison: beyond one, ``compare`` ends with exit code 1.

A gate fails only if noise cannot be the reason: the lower end of the 95 % interval is above the
bound. If the interval contains the bound, the gate is undetermined: more samples decide.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import click

from reports.jobs import Within

if TYPE_CHECKING:
    from comparisons.comparison import ComparisonRecord

FAILED, UNDETERMINED, PASSED = "failed", "undetermined", "passed"

HEADINGS = ("scene", "gate", "bound", "found", "from", "to", "result")


class Percentage(click.ParamType):
    """A percentage with its sign, from 0 % to 100 %, as a share from 0 to 1."""

    name = "percentage"

    def convert(
        self, value: str, parameter: click.Parameter | None, context: click.Context | None
    ) -> float:
        digits, sign, rest = value.strip().partition("%")
        try:
            share = float(digits) / 100.0
        except ValueError:
            share = math.nan
        if not (sign and not rest and 0.0 <= share <= 1.0):
            message = f"{value!r} is not a percentage: give one from 0% to 100%, such as 5%."
            self.fail(message, parameter, context)
        return share


options = (
    click.option(
        "--max-mean",
        type=Within(min=0, max=1000),
        metavar="DE",
        help="Exit code 1 if a scene's mean ΔE2000 is larger, by more than noise.",
    ),
    click.option(
        "--max-visible",
        type=Percentage(),
        metavar="P%",
        help="Exit code 1 if a larger share of a scene's pixels has ΔE2000 above 2, by more than"
        " noise.",
    ),
)


@dataclass(frozen=True)
class Gate:
    """One bound of one scene: the largest value allowed, the value found, its 95 % interval.

    ``is_share`` prints them as percentages.
    """

    scene: str
    name: str
    bound: float
    found: float
    low: float
    high: float
    is_share: bool

    @property
    def state(self) -> str:
        """Whether the interval is above the bound, contains it, or is below."""
        if self.low > self.bound:
            return FAILED
        return PASSED if self.high <= self.bound else UNDETERMINED

    def cells(self) -> tuple[str, ...]:
        """Return the cells of its row in a table, under :data:`HEADINGS`."""
        from reports.terminal.words import number, percent  # loads the metrics

        form = percent if self.is_share else number
        numbers = self.bound, self.found, self.low, self.high
        return self.scene, self.name, *map(form, numbers), self.state

    def __str__(self) -> str:
        _, gate, bound, found, low, high, state = self.cells()
        return f"{gate}: {found} ({low} to {high}), at most {bound} allowed: {state}"


def evaluate(
    records: Sequence[ComparisonRecord], mean: float | None, visible: float | None
) -> list[Gate]:
    """Return the gates of each scene.

    ``mean`` bounds the mean of the leading metric, ``visible`` the share of pixels that depart by
    more than :data:`comparisons.departure.criterion.TOLERANCE`; None is no bound.
    """
    from comparisons.departure import criterion  # loads the metrics
    from comparisons.departure.metrics import LEADING

    made = []
    for record in records:
        found = record.metrics[LEADING.name]
        if mean is not None:
            numbers = mean, found.debiased, found.low, found.high
            made.append(Gate(record.scene, f"mean {LEADING.label}", *numbers, is_share=False))
        if visible is not None:
            share = criterion.share_above(found.visible)
            numbers = visible, share.value, share.low, share.high
            name = f"above {LEADING.label} {share.threshold:g}"
            made.append(Gate(record.scene, name, *numbers, is_share=True))
    return made


def lines(gates: Sequence[Gate]) -> Iterator[str]:
    """Yield the lines on the gates of a run."""
    from reports.terminal.tables import printed  # loads rich

    yield ""
    yield from printed([HEADINGS, *(gate.cells() for gate in gates)], right=2)
    yield outcome(gates)


def outcome(gates: Sequence[Gate]) -> str:
    """Return the line that says how it went."""
    counts = {
        state: sum(gate.state == state for gate in gates)
        for state in (FAILED, UNDETERMINED, PASSED)
    }
    listed = ", ".join(f"{count} {state}" for state, count in counts.items() if count)
    more = " More samples (--spp, --noise) decide." if counts[UNDETERMINED] else ""
    return f"gates: {listed}.{more}"
