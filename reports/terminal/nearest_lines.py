"""Which rendering a picture is nearest to, in words, for the terminal and the page."""

from __future__ import annotations

from collections.abc import Iterator

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import LEADING
from comparisons.effects.nearness import Nearest, Renderings
from reports.terminal.printing import difference, percent


def lines(record: ComparisonRecord) -> Iterator[str]:
    """Yield what a picture seems to lack, as a whole and where it departs most; or nothing."""
    picture = record.picture
    if not picture or not picture.nearest or not picture.renderings:
        return
    yield f"As a whole, the picture {told(picture.nearest)}."
    for region in record.regions[:1]:
        if region.nearest:
            yield (
                f"Where it departs most ({percent(region.share)} of the error), it"
                f" {told(region.nearest)}."
            )
    yield caution(picture.renderings)


def told(nearest: Nearest) -> str:
    """Return what a picture is nearest to, as the rest of a sentence about it."""
    away, reference = (difference(value) for value in (nearest.dE2000, nearest.reference_dE2000))
    if nearest.outcome == "alike":
        return f"hardly differs from the reference (mean {LEADING.label} {reference})"
    rendering = _rendering(nearest)
    if nearest.outcome == "unexplained":
        return (
            f"is near none of the renderings: {rendering}, the nearest, is {away} away, the"
            f" reference {reference}"
        )
    following = f"; the next {difference(nearest.next_dE2000)}" if nearest.gap else ""
    return f"is nearest to {rendering} (mean {LEADING.label} {away}{following})"


def lacking(nearest: Nearest | None) -> str:
    """Return the effects that a part of a picture seems to lack, in a few words."""
    if nearest is None:
        return "unknown"
    if nearest.outcome != "named":
        return {"alike": "nothing visible", "unexplained": "unexplained"}[nearest.outcome]
    perhaps = f"perhaps {', '.join(nearest.undecided)}" if nearest.undecided else ""
    return "; ".join(filter(None, (", ".join(nearest.lacks), perhaps))) or "nothing"


def caution(renderings: Renderings) -> str:
    """Return what a nearest rendering is, and what it is not."""
    width, height = renderings.resolution
    return (
        f"Nearest of {renderings.count} renderings between textbook shading and the reference, at"
        f" {width} x {height} pixels. This is not an attribution: distances do not add up, and"
        " other mistakes can look like a missing effect."
    )


def _rendering(nearest: Nearest) -> str:
    """Name the nearest renderings."""
    if not nearest.lacks and not nearest.undecided:
        return "the reference itself"
    parts = ["textbook shading"]
    for word, effects in (
        ("with", nearest.simulates),
        ("without", nearest.lacks),
        ("with or without", nearest.undecided),
    ):
        if effects:
            parts.append(f"{word} {_listed(effects)}")
    return ", ".join(parts)


def _listed(effects: tuple[str, ...]) -> str:
    *first, last = effects
    return f"{', '.join(first)} and {last}" if first else last
