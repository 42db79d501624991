"""What every record says of its circumstances: pixels, machine, and how values are looked at."""

from typing import Annotated

from msgspec import Meta

from comparisons.amounts import Count, Positive, Size
from comparisons.records import Record

Versions = Annotated[dict[str, str], Meta(description="Versions that a result depends on.")]


class Pixels(Record):
    """Pixels whose centre sees a surface, and all."""

    counted: Count
    total: Size


class Machine(Record):
    """What times depend on: model of the processor, cores that may be used, system."""

    processor: str
    cores: Size
    system: str


class Viewed(Record):
    """How linear values are looked at; see :class:`comparisons.departure.spaces.Viewing`."""

    exposure: Positive
    white: str
    white_luminance: Positive
    ambient_illuminance: Positive
    background: Positive
    surround: str
