"""Templates of pages: how values are printed, and the style and scripts that a page holds."""

from __future__ import annotations

import base64
import hashlib
import math
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from reference.records import plain
from reports import verdict
from reports.charts import theme
from reports.files import images
from reports.page import viewer_data
from reports.terminal.words import (
    NOTICEABLE,
    about_noise,
    difference,
    may_be_none,
    number,
    parameter,
    percent,
    seconds,
)

TEMPLATES = Path(__file__).parent / "templates"

#: Pictures narrower than this are enlarged without smoothing.
PIXELATED_BELOW = 400

#: How values are printed, by the names of forms.
FORMS = {form.__name__: form for form in (number, difference, parameter, seconds, percent)}

#: Runs before anything is drawn: content that needs scripts is shown only if they run.
#: A page in a notebook's frame begins with the viewer.
EARLY = """const framed = location.protocol === "about:" ? " framed" : "";
document.documentElement.className = `js${framed}`;"""


def templates() -> Environment:
    """Return an environment of the templates of all pages, which escapes everything."""
    return Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )


def style(parts: Iterable[str]) -> Markup:
    """Return the stylesheet of some parts, in order."""
    return Markup("".join(_source(f"styles/{part}.css") for part in parts))


def scripts(parts: Iterable[str], last: str = "") -> list[dict[str, Markup]]:
    """Return a page's scripts: one that runs early, and its own.

    Each has its ``code``, and the ``source`` by which the page's policy allows it. The page's own
    consists of some parts and then ``last``.
    """
    code = "\n".join([*(_source(f"viewer/{part}.js") for part in parts), last])
    return [
        {"code": Markup(script), "source": _hash(script)}
        for script in (EARLY, '"use strict";\n' + code)
    ]


def _data_uri(png: bytes) -> str:
    return "data:image/png;base64," + base64.b64encode(png).decode("ascii")


def _hash(script: str) -> Markup:
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    return Markup(f"'sha256-{digest}'")


def _source(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def environment() -> Environment:
    """Return the environment of the report's templates, which escapes everything."""
    environment = templates()
    environment.filters.update(
        FORMS,
        judged=verdict.judged,
        region_view=viewer_data.region_view,
        plain=plain,
        uri=_data_uri,
        webp_uri=images.webp_uri,
        webp_of=images.webp_of,
    )
    environment.tests.update(about_noise=about_noise, may_be_none=may_be_none, finite=math.isfinite)
    environment.globals.update(
        forms=FORMS,
        marked=images.css_colour(images.MARKED),
        unmarked=images.css_colour(images.UNMARKED),
        uncounted=images.css_colour(images.UNCOUNTED),
        undetermined=images.css_colour(images.UNDETERMINED),
        effects_title=theme.EFFECTS_TITLE,
        value_bar=images.colour_bar(images.VALUE_COLOURS),
        pixelated_below=PIXELATED_BELOW,
        noticeable=NOTICEABLE,
    )
    return environment
