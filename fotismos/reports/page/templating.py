"""What all pages share: how values are printed, style and scripts, and how a page begins."""

from __future__ import annotations

import base64
import hashlib
import math
import re
from collections.abc import Sequence
from datetime import date
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined
from markupsafe import Markup

from fotismos.comparisons.records.departure import Region
from fotismos.heuristic.program import __version__
from fotismos.reference.records import plain
from fotismos.reports import verdict
from fotismos.reports.files import images
from fotismos.reports.files.results import PAGE
from fotismos.reports.page.scene_view import EFFECT_COLOURS, parts, title_of
from fotismos.reports.tables import moved
from fotismos.reports.terminal.words import (
    as_typed,
    difference,
    given_time,
    number,
    parameter,
    percent,
    seconds,
)

TEMPLATES = Path(__file__).parent / "templates"

STYLES = ("base", "page", "live", "print")

HELP = ("page", "help")
"""The parts of a script that explains terms; those of the whole page follow."""

KINDS = ("cost", "fit")
"""Commands whose pages of one scene link each other."""

REGION_SIZE = 420
"""Approximate screen pixels of a region that is opened from its link."""

#: How values are printed, by the names of forms.
FORMS = {
    form.__name__: form for form in (number, difference, parameter, seconds, given_time, percent)
}

#: Runs before anything is drawn: content that needs scripts is shown only if they run.
#: A page in a notebook's frame begins with the viewer.
EARLY = """const framed = location.protocol === "about:" ? " framed" : "";
document.documentElement.className = `js${framed}`;"""


def scripts(parts: Sequence[str]) -> list[dict[str, Markup]]:
    """Return a page's scripts: one that runs early, and its own of some parts.

    Each has its ``code``, and the ``source`` by which the page's policy allows it.
    """
    # A browser hashes the exact text between the tags: a blank more, and it runs no script.
    # Markup keeps the template from escaping quotes in it.
    code = "\n".join(_source(f"viewer/{part}.js") for part in parts)
    return [
        {"code": Markup(script), "source": _hash(script)}
        for script in (EARLY, '"use strict";\n' + code)
    ]


def _hash(script: str) -> Markup:
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    return Markup(f"'sha256-{digest}'")


def _source(name: str) -> str:
    return (TEMPLATES / name).read_text(encoding="utf-8")


@lru_cache(maxsize=1)
def environment() -> Environment:
    """Return the environment of the templates of all pages, which escapes everything."""
    environment = Environment(
        loader=FileSystemLoader(TEMPLATES),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=StrictUndefined,
    )
    environment.filters.update(
        FORMS,
        cause=verdict.cause,
        parts=parts,
        title_of=title_of,
        search=verdict.search,
        judged=verdict.judged,
        given_pictures=verdict.given_pictures,
        moved=moved,
        truth=verdict.truth,
        saving=verdict.saving,
        region_view=region_view,
        at=text_at,
        ink=ink,
        noun=verdict.noun,
        plain=plain,
        typed=as_typed,
        minus=minus,
        effect_colour=EFFECT_COLOURS.__getitem__,
        webp_uri=images.webp_uri,
    )
    environment.tests.update(finite=math.isfinite, searched=verdict.is_searched)
    environment.globals.update(forms=FORMS, named=verdict.noun, cost_tables=_cost_tables)
    return environment


def _cost_tables() -> ModuleType:
    """Return the tables and sentences of studies."""
    from fotismos.reports import cost_tables  # loaded late: few pages have a study

    return cost_tables


def minus(text: str) -> str:
    """Return a sentence in which a minus sign stands before numbers below 0."""
    return re.sub(r"(?<!\d)-(?=\d)", "−", text)


def region_view(region: Region) -> str:
    """Return the part of the address that shows and selects a region."""
    zoom = round(min(16.0, REGION_SIZE / max(region.width, region.height)), 2)
    x = region.x + region.width // 2
    y = region.y + region.height // 2
    return f"zoom={zoom}&x={x}&y={y}&box={region.x},{region.y},{region.width},{region.height}"


def text_at(runs: Sequence[tuple[int, str]], location: int) -> str:
    """Return the last text that begins at a place or before."""
    return next(text for start, text in reversed(runs) if start <= location)


def ink(colour: str) -> str:
    """Return black or white, whichever is easier to read on a colour ``#rrggbb``."""
    # At a luminance of 0.18, black and white have about the same contrast (WCAG).
    red = int(colour[1 : 1 + 2], 16) / 255
    green = int(colour[3 : 3 + 2], 16) / 255
    blue = int(colour[5 : 5 + 2], 16) / 255
    return "#000" if 0.2126 * red**2.2 + 0.7152 * green**2.2 + 0.0722 * blue**2.2 > 0.18 else "#fff"


def rendered(template: str, parts: Sequence[str] = (), **content: Any) -> str:
    """Return a page of a template, with the style of all and a script of some parts."""
    style = Markup("".join(_source(f"styles/{part}.css") for part in STYLES))
    content |= {"style": style, "scripts": scripts(parts) if parts else []}
    return environment().get_template(template).render(**content)


def head(command: str, folder: Path | None, scene: str = "") -> dict[str, Any]:
    """Return the head of a page in ``OUTPUT/command/NAME``, with links to what exists.

    They lead to the comparisons in OUTPUT, to that of the same ``scene``, and to its other pages.
    Without a folder there are no links.
    """
    links = {}
    home = ""
    if folder is not None:
        output = folder.absolute().parent.parent
        home = f"../../{PAGE}" if (output / PAGE).exists() else ""
        if scene and home and (output / folder.name / "comparison.json").exists():
            links["Comparison"] = f"{home}#scene={identifier(scene, set())}"
        for kind in KINDS:
            if scene and kind != command and (output / kind / folder.name / PAGE).exists():
                links[kind.capitalize()] = f"../../{kind}/{folder.name}/{PAGE}"
    return {
        "command": command,
        "home": home,
        "links": links,
        "version": __version__,
        "date": date.today().isoformat(),
    }


def identifier(name: str, taken: set[str]) -> str:
    """Return a name for a scene in the page's address: plain characters; added to `taken`."""
    word = "".join(c if (c.isascii() and c.isalnum()) or c in "-_." else "-" for c in name)
    chosen = word or "scene"
    count = 1
    while chosen in taken:
        count += 1
        chosen = f"{word or 'scene'}-{count}"
    taken.add(chosen)
    return chosen
