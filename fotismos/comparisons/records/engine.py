"""Records of an engine's settings: their errors over given times, with or without a scene."""

from typing import Annotated

from msgspec import Meta

from fotismos.comparisons.records.comparison import Agreement, PictureFiles
from fotismos.comparisons.records.departure import Viewing, VisibleShare
from fotismos.reference.records import (
    VERSION,
    Amount,
    Interval,
    Pixels,
    Positive,
    Record,
    Resolution,
    Versions,
)


class FrontPoint(Record):
    """A time and an error, of which a front is made.

    Attributes
    ----------
    method
        Name of the method, or of an engine's setting.
    seconds
        Wall time of one image.
    error
        Mean ΔE2000 of one image to the reference.
    front
        Whether no other point is clearly faster or clearly more accurate without being clearly
        worse in the other.
    ties
        Others of the front whose time and error are both too close to call.
    """

    method: str
    seconds: Interval
    error: Interval
    front: bool = False
    ties: tuple[str, ...] = ()


class EngineSetting(FrontPoint):
    """A setting of another renderer, whose picture and time are given.

    Its front is that of the given settings alone: their times are of another machine. Its error is
    that of the comparison of its pictures, without noise; that of a single picture counts as error.

    Attributes
    ----------
    visible
        The shares of a picture's pixels above thresholds.
    passes_at
        The smallest of these thresholds at which it passes; null if it passes at none.
    p95
        The ΔE2000 that 5 % of the pixels exceed, with all noise.
    ratio
        Its time over that of the textbook kernel on the same machine, if that is given.
    picture, agreement
        Its files, and what is odd about them.
    """

    visible: tuple[VisibleShare, ...]
    passes_at: Positive | None
    p95: Amount
    ratio: Positive | None = None
    picture: PictureFiles
    agreement: Agreement

    @property
    def has_noise(self) -> bool:
        """Whether repeats, or the reference's passes, show any noise."""
        return self.picture.repeats > 1 or self.error.low < self.error.high


class Engine(Record):
    """Settings of another renderer, and what their times are of.

    Attributes
    ----------
    settings
        The settings, in the order in which they were given.
    machine
        The machine of their times, in the user's words; empty if it is not known.
    kernel_s
        Seconds that the textbook kernel takes there, if given.
    """

    settings: tuple[EngineSetting, ...]
    machine: str = ""
    kernel_s: Positive | None = None


class EngineCost(Record):
    """Settings of another renderer, judged by reference pictures without a scene: ``cost.json``.

    Attributes
    ----------
    scene
        The name of the first reference picture.
    reference_picture
        The reference's files.
    noise_floor
        Mean ΔE2000 of the reference's noise alone; null if it is one file, which shows none.
    warnings
        What is odd about the reference, in words.
    """

    record_version: int = VERSION
    scene: str
    resolution: Resolution
    reference_picture: PictureFiles
    noise_floor: Annotated[float, Meta(ge=0)] | None
    engine: Engine
    viewing: Viewing
    pixels: Pixels
    warnings: tuple[str, ...] = ()
    versions: Versions
    command: str
