"""How values are printed, the same on every page."""

from __future__ import annotations

import math

from markupsafe import Markup

from comparisons.departure.statistics import Summary

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
        return f"{_minus(mantissa)} × 10{_superscript(int(exponent))}"
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


def code_spans(text: str) -> Markup:
    """A docstring's ````code```` as HTML, everything else escaped."""
    parts = text.split("``")
    return Markup("").join(
        Markup("<code>{}</code>").format(part) if place % 2 else part
        for place, part in enumerate(parts)
    )


def about_noise(metric: Summary) -> bool:
    """Whether a mean may be only noise: it may be 0, and is at most `NOTICEABLE`."""
    return may_be_none(metric) and metric.high <= NOTICEABLE


def may_be_none(metric: Summary) -> bool:
    """Whether a mean may be 0 without its noise, which may also hide a departure."""
    return metric.noise_floor > 0 and metric.low == 0


def _minus(digits: str) -> str:
    return digits.replace("-", "−")


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
