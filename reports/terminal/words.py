"""Numbers and sentences, the same on a terminal and on every page."""

from __future__ import annotations

import math
from collections.abc import Iterator

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import LEADING
from comparisons.departure.statistics import Summary
from comparisons.hybrids.nearness import Nearest, Renderings

#: A departure of this size, in the leading metric, can be seen.
NOTICEABLE = 1.0


def number(value: float | None) -> str:
    """Three significant digits, as a power of ten below 0.001 and from a million."""
    if value is None:
        return "–"
    size = abs(float(f"{value:.2e}"))  # rounded first: 9.999 is 10.0, not 10.00
    if size == 0:
        return "0"
    if not 1e-3 <= size < 1e6:
        mantissa, exponent = f"{value:.1e}".split("e")
        superscript = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
        return f"{_minus(mantissa)} × 10{superscript}"
    decimals = max(0, 2 - math.floor(math.log10(size)))
    return _minus(f"{value:,.{decimals}f}")


def difference(value: float | None) -> str:
    """A colour difference like `number`, but "< 0.01" where nobody sees it."""
    if value and abs(value) < 0.01:
        return "< 0.01" if value > 0 else "> −0.01"
    return number(value)


def parameter(value: float) -> str:
    """A value that was set, not measured: up to four significant digits, no trailing zeros."""
    return _minus(f"{value:,}" if isinstance(value, int) else f"{value:.4g}")


def seconds(value: float | None) -> str:
    """A time with its unit: µs, ms or s."""
    if value is None:
        return "–"
    for scale, unit in ((1.0, "s"), (1e-3, "ms")):
        if abs(value) >= scale:
            return f"{number(value / scale)} {unit}"
    return f"{number(value / 1e-6)} µs" if value else "0 s"


def percent(value: float) -> str:
    """A fraction as a percentage."""
    return f"{number(100 * value)} %"


def about_noise(metric: Summary) -> bool:
    """Whether a mean may be only noise: it may be 0, and is at most `NOTICEABLE`."""
    return may_be_none(metric) and metric.high <= NOTICEABLE


def may_be_none(metric: Summary) -> bool:
    """Whether a mean may be 0 without its noise, which may also hide a departure."""
    return metric.noise_floor > 0 and metric.low == 0


def _minus(digits: str) -> str:
    return digits.replace("-", "−")


def nearest_lines(record: ComparisonRecord) -> Iterator[str]:
    """Yield what a picture seems to lack, as a whole and where it departs most; or nothing."""
    picture = record.picture
    if not picture or not picture.nearest or not picture.renderings:
        return
    yield f"As a whole, the picture {nearest_sentence(picture.nearest)}."
    for region in record.regions[:1]:
        if region.nearest:
            yield (
                f"Where it departs most ({percent(region.share)} of the error), it"
                f" {nearest_sentence(region.nearest)}."
            )
    yield caution(picture.renderings)


def nearest_sentence(nearest: Nearest) -> str:
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
            listed = " and ".join(filter(None, (", ".join(effects[:-1]), effects[-1])))
            parts.append(f"{word} {listed}")
    return ", ".join(parts)
