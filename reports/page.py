"""The report: one offline HTML file with the pictures, maps and numbers of a run.

`render` reads the records of `comparison.json` (schema: ``reports/comparison.schema.json``) and
PNG files; it computes nothing that is not in them but how to print a number. Names and messages
come from users' files, so everything is escaped, and the page may load nothing: its pictures are
inside, and a content security policy forbids the rest.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from comparisons.metrics import LOG2_EPSILON, LOG2_RANGE, METRICS
from heuristic.equations import Entry
from reports import images

#: The page's heading.
TITLE = "Textbook shading against physically based rendering"

#: A mean up to this many times its noise floor is said to be about noise.
NOISE_MARGIN = 1.1

#: Pictures narrower than this are enlarged without smoothing.
PIXELATED_BELOW = 400


@dataclass(frozen=True)
class Legend:
    """A map's colour bar: title, CSS background, labels from low to high, and a sentence."""

    name: str
    title: str
    bar: str
    labels: tuple[str, ...]
    note: str


def render(
    comparisons: Sequence[Mapping[str, Any]],
    title: str = TITLE,
    equations: Sequence[Entry] = (),
    verifications: Sequence[Mapping[str, Any]] = (),
    hard_cases: Mapping[str, Any] | None = None,
) -> str:
    """One HTML page of all scenes, in the order given.

    Each comparison is a mapping with

    record
        The scene's record, as in ``comparison.json``.
    images
        PNG bytes by name: "heuristic", "reference", the metrics' names, "log2_luminance" and
        "significant". `reports.images.pictures` makes them. A missing one is left out.
    files (optional)
        Paths relative to the page by label, shown as links.

    `equations` is the index of `heuristic.equations`, `verifications` the data of
    `comparisons.verification`, `hard_cases` what `reports.hard_cases.view` returns; each is a
    section of its own, left out where it is empty.
    """
    scenes = [
        {
            "id": f"scene-{number}",
            "record": comparison["record"],
            "images": {name: _data_uri(png) for name, png in comparison["images"].items()},
            "files": {
                label: "./" + quote(str(path))
                for label, path in comparison.get("files", {}).items()
            },
        }
        for number, comparison in enumerate(comparisons, 1)
    ]
    page = _environment().get_template("page.html.j2")
    return page.render(
        title=title,
        scenes=scenes,
        metrics=METRICS,
        legends=legends(),
        equations=equations,
        hard_cases=hard_cases,
        verifications=verifications,
    )


def legends() -> tuple[Legend, ...]:
    """The maps in the order of the page."""
    maps = [
        Legend(
            metric.name,
            metric.label,
            images.colour_bar(images.ERROR_COLOURS),
            _labels(*metric.map_range),
            metric.unit,
        )
        for metric in METRICS.values()
    ]
    return (
        *maps,
        Legend(
            "log2_luminance",
            "Luminance ratio",
            images.colour_bar(images.SIGNED_COLOURS),
            (f"≤ −{LOG2_RANGE:g}", "0", f"≥ +{LOG2_RANGE:g} stops"),
            f"log2 of heuristic over reference, red where the heuristic is brighter; "
            f"ε = {LOG2_EPSILON:g}",
        ),
        Legend(
            "significant",
            "Significant difference",
            "",
            (),
            "more than the reference's noise",
        ),
    )


def number(value: float | None) -> str:
    """Three significant digits, in powers of ten below 0.001 and from a million on."""
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


def parameter(value: float) -> str:
    """A value that was set, not measured: up to four significant digits, no trailing zeros."""
    return _minus(f"{value:,}" if isinstance(value, int) else f"{value:.4g}")


def seconds(value: float | None) -> str:
    """A time with its unit: µs, ms or s."""
    if value is None:
        return "–"
    for scale, unit in ((1.0, "s"), (1e-3, "ms")):
        if value >= scale:
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


def about_noise(metric: Mapping[str, float]) -> bool:
    """Whether a metric's mean is about what its noise floor gives (see `NOISE_MARGIN`)."""
    return metric["noise_floor"] > 0 and metric["mean"] <= NOISE_MARGIN * metric["noise_floor"]


def _labels(low: float, high: float) -> tuple[str, ...]:
    return f"{low:g}", f"{(low + high) / 2:g}", f"≥ {high:g}"


def _minus(digits: str) -> str:
    return digits.replace("-", "−")


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))


def _data_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


@lru_cache(maxsize=1)
def _environment() -> Environment:
    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent / "templates"),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters.update(
        number=number,
        parameter=parameter,
        seconds=seconds,
        percent=percent,
        code_spans=code_spans,
    )
    environment.tests["about_noise"] = about_noise
    environment.globals.update(
        marked=images.css_colour(images.MARKED),
        unmarked=images.css_colour(images.UNMARKED),
        uncounted=images.css_colour(images.UNCOUNTED),
        pixelated_below=PIXELATED_BELOW,
    )
    return environment
