"""Baselines, what moved from them, and the results of checks."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Generic, Literal, TypeVar

from msgspec import Meta, field

from fotismos.comparisons.records.comparison import PictureFiles
from fotismos.comparisons.records.departure import Colour, Gate
from fotismos.heuristic import program
from fotismos.reference.records import VERSION, Amount, Count, Record, Share, Versions

MOST_PASSES = 64
"""Images that a baseline keeps of each half, at most."""

HALVES = ("heuristic", "reference")
PICTURE = "picture"
"""The names of what a baseline keeps: the halves of a scene, or a picture."""

READERS = {"heuristic": "textbook", "reference": "physical", PICTURE: PICTURE}
"""What readers call them."""

CHANNELS = {"R": "red", "G": "green", "B": "blue"}

Value = TypeVar("Value")


class Baseline(Record, omit_defaults=True):
    """What a baseline is of: the attribute `fotismos` in the header of its EXR file.

    The file keeps passes of both halves of a scene, or repeats of a picture, each as a layer, such
    as `pass.heuristic.0`.
    """

    # Made by a function, which `omit_defaults` does not omit.
    record_version: int = field(default_factory=lambda: VERSION)
    scene: Annotated[
        str | None,
        Meta(
            description="A built-in name, or a file's path from the baseline's folder; null for"
            " pictures."
        ),
    ]
    options: Annotated[
        dict[str, Any], Meta(description="As on the command line; defaults are left out.")
    ]
    passes: Annotated[int, Meta(ge=2, le=MOST_PASSES)]
    versions: Annotated[Versions, Meta(description="Of the software that measured it.")]

    @property
    def halves(self) -> tuple[str, ...]:
        """What its file keeps."""
        return (PICTURE,) if self.scene is None else HALVES


def part_of(shape: str | None = None, block: tuple[int, int] | None = None) -> str:
    """Return what readers call a part of a picture: the whole, a shape or a block."""
    if shape is not None:
        return shape
    return "row {}, column {}".format(*block) if block else "whole picture"


class Move(Record):
    """A channel of what is compared, over the whole picture, a shape or a block of it.

    Attributes
    ----------
    half
        `heuristic` and `reference` of a scene, or `picture`.
    error
        Standard error of the difference.
    standard_errors
        The signed difference over that error; None if there is no noise.
    p
        Chance of a difference at least this large if nothing changed.
    p_corrected
        Chance of one such among all that are tested alike (Šidák).
    """

    half: str
    channel: Annotated[str, Meta(description="R, G or B.")]
    shape: str | None = None
    block: Annotated[
        tuple[int, int] | None, Meta(description="Row and column of 16 by 16 pixels, from 1.")
    ] = None
    before: float
    after: float
    error: Amount
    standard_errors: float | None
    p: Share
    p_corrected: Share

    @property
    def name(self) -> str:
        """What readers call it."""
        half = "" if self.half == PICTURE else f"{READERS[self.half]} "
        return f"{part_of(self.shape, self.block)}: {half}{CHANNELS[self.channel]}"

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


@dataclass(frozen=True)
class Tolerance:
    """At most the share ``bound`` of the pixels may differ by more than the ΔE2000 ``within``."""

    within: float
    bound: float


class Change(Record, Generic[Value]):
    """A number, or the version of a library, in the baseline and now."""

    before: Value
    after: Value


class CheckRecord(Record, omit_defaults=True):
    """The result for one baseline; without numbers if it was not compared."""

    # Made by functions, which `omit_defaults` does not omit.
    record_version: int = field(default_factory=lambda: VERSION)
    baseline: Annotated[str, Meta(description="Path of its file.")]
    scene: Annotated[str, Meta(description="Of pictures the pattern of their files.")]
    status: Literal["passed", "failed", "error", "created", "updated", "unchanged"]
    passed: bool = field(default_factory=lambda: True)
    seconds: Amount
    message: str = ""
    headline: Annotated[
        str, Meta(description="What moved most, where and by how much; empty for nothing.")
    ] = ""
    tested: Count | None = None
    significance: Share | None = None
    moved: tuple[Move, ...] | None = None
    metrics: dict[str, Change[float]] | None = None
    versions: dict[str, Change[str]] | None = None
    causes: Annotated[
        tuple[str, ...], Meta(description="Why, as far as the numbers tell, in sentences.")
    ] = ()
    pictures: Annotated[str, Meta(description="Folder of the pictures of a failure.")] | None = None
    smallest_changes: Annotated[
        dict[str, SmallestChanges] | None, Meta(description="By half, or of the picture.")
    ] = None
    picture: Annotated[PictureFiles | None, Meta(description="The pictures that were checked.")] = (
        None
    )
    gate: Annotated[
        Gate | None, Meta(description="The tolerance that decided, in place of drift.")
    ] = None

    @property
    def name(self) -> str:
        """The baseline's name."""
        return Path(self.baseline).stem

    @property
    def exit_code(self) -> int:
        """1 if something moved, 2 if the baseline could not be checked, else 0."""
        return {"failed": 1, "error": 2}.get(self.status, 0)

    @property
    def update_command(self) -> str:
        """The command that writes what moved to the baseline."""
        picture = ("--picture", f"{self.name}={self.scene}") if self.picture else ()
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
