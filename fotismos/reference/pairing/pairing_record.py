"""The record of pairing: which values correspond, and what is lost or not used."""

from typing import Annotated, Any

from msgspec import Meta

from fotismos.reference.records import Record

SECOND_INTENSITY = "specular intensity L_s"
"""What a light of two intensities loses."""

SUN = "sun_of_"
"""Key of the textbook's light in place of the sun of a sky, before the sky's node."""


class Miss(Record):
    """A quantity that no partner reaches."""

    what: str
    wanted: float
    reached: float


class BsdfPair(Record):
    """A BSDF and its partner; grey colours are one value. The note says what is odd."""

    name: str
    given: str
    derived: str
    parameters: dict[str, Any]
    note: str = ""


class EmitterPair(Record):
    """A light and its partner, and the factor between their intensities."""

    name: str
    given: str
    derived: str
    factor: float
    exact: bool
    note: str = ""


class Unrepresentable(Record):
    """Something that the textbook model cannot represent; compared nevertheless."""

    name: Annotated[str, Meta(description="Id, or place in the file.")]
    plugin: str
    lost: str
    nearest: Annotated[str, Meta(description="What replaces it, and by which rule.")]


class Pairing(Record):
    """How textbook and physical materials and lights correspond."""

    convention: str
    bsdfs: tuple[BsdfPair, ...]
    emitters: tuple[EmitterPair, ...]
    misses: tuple[Miss, ...]


class Override(Record):
    """A setting of the scene that is not used, and what is used instead."""

    what: str
    given: str
    used: str
