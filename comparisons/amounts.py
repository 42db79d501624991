"""Kinds of numbers in records, with the bounds that their schemas state."""

from typing import Annotated

from msgspec import Meta

Amount = Annotated[float, Meta(ge=0)]
Positive = Annotated[float, Meta(gt=0)]
Share = Annotated[float, Meta(ge=0, le=1)]
Count = Annotated[int, Meta(ge=0)]
Size = Annotated[int, Meta(ge=1)]
Resolution = Annotated[tuple[Size, Size], Meta(description="Width and height in pixels.")]
