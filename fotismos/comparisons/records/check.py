"""Baselines, what is measured for them, and the results of checks."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, TypeVar

import numpy as np
from msgspec import Meta, field, structs

from fotismos.comparisons.records.comparison import PictureFiles
from fotismos.comparisons.records.departure import Colour, Verdict, VisibleShare
from fotismos.heuristic import program
from fotismos.heuristic.convention import Doubles
from fotismos.reference import records
from fotismos.reference.records import (
    VERSION,
    Amount,
    Count,
    Record,
    Resolution,
    Share,
    Versions,
    laid_out,
)

MOST_PASSES = 1024
"""Passes of a measurement, at most: the images of all of them are in memory at once."""

HALVES = ("heuristic", "reference")

Value = TypeVar("Value")

Errors = Annotated[tuple[Amount, Amount, Amount], Meta(description="Standard errors.")]


class MetricAmount(Record, omit_defaults=True):
    """A departure metric, its standard error, and its value from noise alone.

    ``noise_floor`` is None for the signed ratio of luminances, which noise does not raise.
    """

    value: float
    error: Amount
    noise_floor: Amount | None = None


class Block(Record):
    """Mean linear RGB of a block of pixels."""

    mean: Colour
    error: Errors


class Half(Record):
    """Mean linear RGB of a half, over the image and over its blocks, row by row."""

    mean: Colour
    error: Errors
    blocks: tuple[tuple[Block, ...], ...]

    def means(self) -> Doubles:
        """Return the blocks' colours, (rows, columns, 3)."""
        return np.array([[block.mean for block in row] for row in self.blocks])


@dataclass(frozen=True)
class Quantity:
    """A number that a check tests: of a metric, of the colour of a half, or of a block of it.

    ``block`` is its row and column, from 1.
    """

    name: str
    value: float
    error: float
    half: str | None = None
    block: tuple[int, int] | None = None


class Measurement(Record):
    """All measurements of a scene, from ``passes`` independent passes of both halves."""

    passes: Annotated[int, Meta(ge=2, le=MOST_PASSES)]
    metrics: dict[str, MetricAmount]
    heuristic: Half
    reference: Half

    def of(self, metrics: Iterable[str]) -> "Measurement":
        """Return the measurement with only these metrics."""
        return structs.replace(self, metrics={name: self.metrics[name] for name in metrics})

    def quantities(self) -> Iterator[Quantity]:
        """Yield all numbers: metrics, then whole images, then blocks."""
        for name, metric in self.metrics.items():
            yield Quantity(name=name, value=metric.value, error=metric.error)
        halves = {name: getattr(self, name) for name in HALVES}
        for name, half in halves.items():
            for letter, value, error in zip("RGB", half.mean, half.error, strict=True):
                yield Quantity(name=f"{name} {letter}", half=name, value=value, error=error)
        for name, half in halves.items():
            for i, row in enumerate(half.blocks, start=1):
                for j, block in enumerate(row, start=1):
                    for letter, value, error in zip("RGB", block.mean, block.error, strict=True):
                        yield Quantity(
                            name=f"{name} {letter}, block {i},{j}",
                            half=name,
                            block=(i, j),
                            value=value,
                            error=error,
                        )


class Baseline(Record, omit_defaults=True):
    """Measurements of one scene, from independent passes of both halves."""

    record_version: int
    scene: Annotated[
        str, Meta(description="A built-in name, or a file's path from the baseline's folder.")
    ]
    options: Annotated[
        dict[str, Any], Meta(description="As on the command line; defaults are left out.")
    ]
    passes: Annotated[int, Meta(ge=2, le=MOST_PASSES)]
    versions: Annotated[Versions, Meta(description="Of the software that measured it.")]
    images: Annotated[
        str | None,
        Meta(description="An EXR with both pictures, beside the baseline, for people to look at."),
    ] = None
    metrics: dict[str, MetricAmount]
    heuristic: Half
    reference: Half

    def measured(self) -> Measurement:
        """Return the measurement."""
        return Measurement(
            passes=self.passes,
            metrics=self.metrics,
            heuristic=self.heuristic,
            reference=self.reference,
        )

    def text(self) -> str:
        """Return the file's content."""
        return laid_out(records.plain(self)) + "\n"


class PictureBaseline(Record):
    """Repeats of a picture; the mean and the variance of each pixel are in an EXR beside it.

    Attributes
    ----------
    transfer, over
        How its files are read; null for what they say themselves.
    mean, error
        Mean linear RGB of the picture, and its standard errors.
    correlation
        Variance of sums over tiles, over that of independent pixels.
    """

    record_version: int = VERSION
    repeats: Annotated[int, Meta(ge=2)]
    resolution: Resolution
    transfer: Literal["linear", "srgb"] | None
    over: str | None = None
    mean: Colour
    error: Errors
    correlation: Amount
    images: str


READERS = {"heuristic": "textbook", "reference": "physical"}
"""What readers call the halves."""


class Move(Record):
    """One quantity, before and after.

    Attributes
    ----------
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

    @property
    def name(self) -> str:
        """What readers call the quantity: halves are textbook and physical."""
        name = self.quantity
        for half, shown in READERS.items():
            name = name.replace(half, shown)
        return name

    @property
    def size(self) -> float:
        """How much it moved: metrics, which differ in unit, by their share, colours in light."""
        change = abs(self.after - self.before)
        if self.half or self.block:
            return change
        return change / max(abs(self.before), abs(self.after), 1e-9)

    @property
    def change(self) -> str:
        """How much it moved, in words: in percent of what it was, unless that was 0."""
        change = self.after - self.before
        return f"{100 * change / abs(self.before):+.2g} %" if self.before else f"{change:+.2g}"


class SmallestChanges(Record):
    """The smallest changes that a check catches with the chance `power`, in linear R, G, B.

    Attributes
    ----------
    mean
        Of the mean of the picture.
    block, noisiest
        Of the mean of a block of 16 by 16 pixels: the median of the blocks, and the largest.
    """

    power: Share
    mean: Colour
    block: Colour
    noisiest: Colour


class PictureGate(Record):
    """Whether too many pixels of a picture differ visibly from its baseline.

    Attributes
    ----------
    visible
        The share of pixels above a ΔE2000, with an interval that holds the repeats' noise.
    bound
        The largest share that is allowed.
    """

    visible: VisibleShare
    bound: Share
    state: Verdict

    @property
    def sentence(self) -> str:
        """What differs, what is allowed, and the result."""
        share = self.visible
        shown = f"{share.value:.2%}"
        if share.low != share.high:
            shown = f"{shown} ({share.low:.2%} to {share.high:.2%})"
        results: dict[Verdict, str] = {
            "pass": "it passes",
            "fail": "it fails",
            "undecided": "noise leaves it undecided, and more repeats decide",
        }
        return (
            f"{shown} of the pixels differ by more than ΔE2000 {share.threshold:g}, at"
            f" most {self.bound:.2%} may: {results[self.state]}."
        )


class Change(Record, Generic[Value]):
    """A number, or the version of a library, in the baseline and now."""

    before: Value
    after: Value


class CheckRecord(Record, omit_defaults=True):
    """The result for one baseline; without numbers if it was not compared."""

    # Made by functions, which `omit_defaults` does not omit.
    record_version: int = field(default_factory=lambda: VERSION)
    baseline: Annotated[str, Meta(description="Path of its file.")]
    scene: str
    status: Literal["passed", "failed", "error", "created", "updated", "unchanged"]
    passed: bool = field(default_factory=lambda: True)
    seconds: Amount
    message: str = ""
    tested: Count | None = None
    significance: Share | None = None
    moved: tuple[Move, ...] | None = None
    metrics: dict[str, Change[float]] | None = None
    versions: dict[str, Change[str]] | None = None
    causes: Annotated[
        tuple[str, ...], Meta(description="Why, as far as the numbers tell, in sentences.")
    ] = ()
    pictures: Annotated[str, Meta(description="Folder of the pictures of a failure.")] | None = None
    smallest_changes: SmallestChanges | None = None
    picture: Annotated[PictureFiles | None, Meta(description="The pictures that were checked.")] = (
        None
    )
    gate: Annotated[
        PictureGate | None, Meta(description="The tolerance that decided, in place of drift.")
    ] = None

    @property
    def name(self) -> str:
        """The baseline's name."""
        return Path(self.baseline).stem

    @property
    def largest(self) -> Move | None:
        """What moved most: of a block, which says where, if any did."""
        moved = self.moved or ()
        return next((move for move in moved if move.block), moved[0] if moved else None)

    @property
    def headline(self) -> str:
        """What moved most, where, from what to what, and how much else; empty for nothing.

        If a tolerance decided, what differs visibly.
        """
        if self.gate is not None:
            return self.gate.sentence
        if (most := self.largest) is None:
            return ""
        others = len(self.moved or ()) - 1
        more = f", and {others} more" if others else ""
        values = f"from {most.before:.4g} to {most.after:.4g} ({most.change})"
        return f"{most.name} moved {values}{more}."

    @property
    def exit_code(self) -> int:
        """1 if something moved, 2 if the baseline could not be checked, else 0."""
        return {"failed": 1, "error": 2}.get(self.status, 0)

    @property
    def update_command(self) -> str:
        """The command that writes what moved to the baseline."""
        picture = ("--picture", f"{self.name}={self.scene}") if self.smallest_changes else ()
        return program.command("check", self.baseline, "--update", *picture)

    @property
    def other_mitsuba(self) -> str:
        """What to know if the baseline is of another Mitsuba than the installed; else empty."""
        change = (self.versions or {}).get("mitsuba")
        if change is None:
            return ""
        return (
            f"Mitsuba {change.after} renders here, and {change.before} made the baselines: what"
            " moved may be its noise."
        )

    @property
    def versions_line(self) -> str:
        """Which versions changed since the baseline; empty for none."""
        changed = (self.versions or {}).items()
        changes = ", ".join(f"{name} {both.before} -> {both.after}" for name, both in changed)
        return f"versions since the baseline: {changes}" if changes else ""


class Checks(Record):
    """The results of one command."""

    record_version: int = VERSION
    passed: bool
    significance: Share
    checks: tuple[CheckRecord, ...]
