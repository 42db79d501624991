"""What every record says of its circumstances."""

from typing import Annotated

from msgspec import Meta

from comparisons.amounts import Count, Size
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
