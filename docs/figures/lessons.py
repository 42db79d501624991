"""The pictures, equations and numbers of docs/lessons.md: both halves of built-in scenes."""

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
from PIL import Image, ImageDraw

from docs.figures.documents import DOCS, compared, panels, read_table, replace
from fotismos.comparisons import atomic
from fotismos.comparisons.records.images import Comparison, Images, LightTerms, PixelTerms
from fotismos.comparisons.steps import TERMS
from fotismos.heuristic.convention import Floats
from fotismos.reference.records import Missing
from fotismos.reports.files.images import webp

SIDE, SAMPLES = 64, 1024
"""Size of the pictures whose pixels a lesson names, and samples per pixel."""

PANEL, PANEL_SAMPLES = 256, 64
"""Side of the pictures that a lesson shows, and samples per pixel."""

GAP = 8
"""Pixels between two pictures."""

RING = "#2ca0ff"
"""The colour of the circles around the pixels that a lesson names."""


@dataclass(frozen=True)
class Pixel:
    """A pixel of a scene: the words of the command that renders it, column and row."""

    command: str
    column: int
    row: int


def _listed() -> dict[str, list[Pixel]]:
    found: dict[str, list[Pixel]] = {}
    for row in read_table("lessons"):
        pixel = Pixel(command=row["command"], column=int(row["column"]), row=int(row["row"]))
        found.setdefault(row["lesson"], []).append(pixel)
    return found


LESSONS = _listed()
"""The pixels of each lesson; its picture shows the scene of the first."""

MOVED = {
    "sky": "k_a:0:0.9",
    "shadow": "k_a:0:0.39",
    "exponent": "n:0:3",
    "beam": "cutoff:0:20,m:0:0",
}
"""Sliders that a lesson moves: the part ``live`` of the page's address."""


@cache
def rendered(command: str, side: int = SIDE, spp: int = SAMPLES) -> Comparison:
    """Compare as a command does whose words are a scene and options."""
    scene, *words = command.split(" --")
    given: dict[str, Any] = dict(word.replace("-", "_").split() for word in words)
    return compared(scene, then=[TERMS], resolution=(side, side), spp=spp, **given)


def values(lesson: str) -> Floats:
    """Return the linear RGB of textbook and reference at each pixel, (pixels, 2, 3)."""
    found = []
    for pixel in LESSONS[lesson]:
        shown: Images = rendered(pixel.command).images
        halves = (shown.heuristic, shown.reference)
        found.append([half[pixel.row, pixel.column] for half in halves])
    return np.array(found)


def write() -> None:
    """Write the picture and the pixels of each lesson."""
    for lesson in LESSONS:
        atomic.write(DOCS / file(lesson), _picture(lesson))
        replace("lessons.md", lesson, _lines(lesson))


def _lines(lesson: str) -> Iterator[str]:
    """Yield the picture of a lesson, and its pixels: both halves, and 8.10 with numbers put in."""
    yield f"![{LESSONS[lesson][0].command}: textbook, physical, error]({file(lesson)})"
    yield ""
    for pixel, halves in zip(LESSONS[lesson], values(lesson), strict=True):
        textbook, physical = map(_shown, halves)
        equation = _equation(pixel)
        if equation:
            equation = f" ({equation})"
        yield (
            f"- `{pixel.command}` at {pixel.column}, {pixel.row}: textbook {textbook}{equation};"
            f" physical {physical}"
        )


def file(lesson: str) -> str:
    """Return the path of a lesson's picture, from docs."""
    return f"lessons/{lesson.replace(' ', '-')}.webp"


def _picture(lesson: str) -> bytes:
    """Return a lesson's picture: both halves and the map of the error, with its pixels marked."""
    command = LESSONS[lesson][0].command
    pictures = panels(rendered(command, PANEL, PANEL_SAMPLES).images)
    width = len(pictures) * (PANEL + GAP) - GAP
    strip = Image.new("RGB", (width, PANEL), "white")
    for number, picture in enumerate(pictures):
        drawing = ImageDraw.Draw(picture)
        for pixel in LESSONS[lesson]:
            if pixel.command == command:
                x, y = ((place + 0.5) * PANEL / SIDE for place in (pixel.column, pixel.row))
                drawing.ellipse((x - 5, y - 5, x + 5, y + 5), outline=RING, width=2)
        strip.paste(picture, (number * (PANEL + GAP), 0))
    return webp(strip)


def scenes() -> list[str]:
    """Return the scenes of all lessons."""
    commands = (pixel.command for pixels in LESSONS.values() for pixel in pixels)
    return list(dict.fromkeys(command.partition(" ")[0] for command in commands))


def with_pages(text: str, folder: str) -> str:
    """Return docs/lessons.md with a link to each lesson's page in a folder, for the site."""
    sections = re.split(r"(?m)^(?=## )", text)
    return "".join(_with_page(section, folder) for section in sections)


def _with_page(section: str, folder: str) -> str:
    lesson = re.search(r"<!-- (.*?): made by", section)
    command = re.search(r"\*\*Try:\*\* `\./run compare ([\w-]+)[^`]*`", section)
    if lesson is None or command is None:
        return section
    fragment = f"scene={command[1]}"
    if moved := MOVED.get(lesson[1]):
        fragment = f"{fragment}&amp;live={moved}"
    link = f'<a href="{folder}/index.html#{fragment}">Open its page, with sliders.</a>'
    return f"{section.rstrip()}\n\n{link}\n\n"


def _equation(pixel: Pixel) -> str:
    """Return 8.10 with a pixel's numbers, in red; empty if its intensities are interpolated."""
    grid = rendered(pixel.command).terms
    terms = None if grid is None or isinstance(grid, Missing) else grid.at(pixel.column, pixel.row)
    if terms is None or terms.pixel != (pixel.column, pixel.row):
        return ""
    parts = [
        *_product(terms.emission[0]),
        *_product(terms.material.ambient[0], terms.material.k_a[0]),
    ]
    for light in terms.lights:
        parts += _reflected(light, terms)
    if not parts:
        return "$0$"
    return f"${' + '.join(parts)}$"


def _reflected(light: LightTerms, terms: PixelTerms) -> Iterator[str]:
    """Yield both terms of a light: ``I_p f_att k_d (N.L)``, and the same with ``k_s`` and lobe."""
    material = terms.material
    if light.cos_incidence <= 0:
        return
    yield from _product(light.intensity[0], light.attenuation, material.k_d[0], light.cos_incidence)
    if material.k_s[0] and light.lobe > 0:
        cosine = f"{light.cos_reflection:.3f}^{{{material.n:g}}}"
        if material.form != "phong":
            cosine = f"{light.lobe:.3f}"
        front = _product(light.specular_intensity[0], light.attenuation, material.k_s[0])
        yield from (f"{factors}·{cosine}" for factors in front)


def _product(*factors: float) -> Iterator[str]:
    """Yield factors as a product, without those that are 1; nothing if one is 0."""
    if 0 in factors:
        return
    kept = [factor for factor in factors if abs(factor - 1) > 5e-4] or [1.0]
    yield "·".join(f"{factor:.3g}" for factor in kept)


def _shown(colour: Floats) -> str:
    """Return a grey as one number, another colour as three."""
    shown = [f"{value:.3f}" for value in colour]
    return ", ".join(shown if len(set(shown)) > 1 else shown[:1])
