"""The figures of docs/models.md that the kernel computes: its lobes, and sheets of pictures."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from drjit.auto import Array3f
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray
from PIL import Image

import fotismos
from docs.figures.documents import compared, draw, panels
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.images import Images
from fotismos.reports.charts import figures
from fotismos.reports.files import images

GROUND, FAINT = "#fcfcfb", "#8a8a8a"
EXPONENTS = {3: "#b97b00", 9: "#0067a8", 81: "#00795a"}
"""Colours of lobes by exponent; the figures of chapter 8 have 3 and 9."""

COLOURS = {"N": "#1c1e21", "L": "#b97b00", "R": "#0067a8", "V": "#00795a"}
COLOURS |= {rf"\mathbf{{{letter.lower()}}}": colour for letter, colour in COLOURS.items()}
"""Colours of vectors: chapter 8 has capitals, chapter 6 bold letters."""

OTHER = "#6b4ea0"

HALO = [withStroke(linewidth=3, foreground=GROUND)]
"""It keeps lines from crossing letters."""

Place = Any

VIEWS = np.arange(-90, 91, 1.5)
"""Degrees from the normal at which lobes are drawn."""

INCIDENCE = 50.0
"""Degrees between `N` and `L` in the figures."""

ROWS = ("textbook", "physical", LEADING.label)
STYLE = {"font.size": 11, "axes.titlesize": 11, "mathtext.fontset": "dejavuserif"}
INCH = 1.92


SHEETS = {
    "ambient": ("fig-8-5a", "fig-8-5b", "fig-8-5c"),
    "diffuse": ("fig-8-6a", "fig-8-6b", "fig-8-6c"),
    "specular": ("fig-8-7a", "fig-8-7b", "fig-8-7c"),
    "sum": ("fig-8-8a", "fig-8-8c", "fig-8-9", "fig-8-11-n9"),
    "spots": ("fig-6-5-m1", "fig-6-5-m40"),
}
"""Scenes in docs/models.md: heuristic, reference and difference below each other."""

POLYGONS = (
    ("fig-6-10", "flat"),
    ("fig-6-10", "gouraud"),
    ("fig-6-10", "phong"),
    ("fig-6-14", "gouraud"),
    ("fig-6-14", "phong"),
)
"""Scenes and their interpolation, beside each other."""

SIDE, SAMPLES = 192, 64


def write() -> None:
    """Draw the lobes, and render the sheets."""
    draw("models-lobes.svg", lobes())
    for name, scenes in SHEETS.items():
        draw(f"models-{name}.png", halves(scenes, [_images(scene) for scene in scenes]))
    titles = [f"{scene}, {kind}" for scene, kind in POLYGONS]
    shaded = [_images(scene, kind).heuristic for scene, kind in POLYGONS]
    draw("models-polygons.png", pictures(titles, [shaded]))


def _images(scene: str, interpolation: str | None = None) -> Images:
    size = (SIDE, SIDE)
    return compared(scene, interpolation=interpolation, resolution=size, spp=SAMPLES).images


def lobes() -> Figure:
    """Draw the value seen from each direction: Lambert's, Phong's, and Blinn's lobes."""
    with rc_context(STYLE):
        figure = Figure(figsize=(9, 2.4), facecolor=GROUND)
        figure.subplots_adjust(0, 0, 1, 0.9, wspace=0.02)
        diffuse, phong, blinn = figure.subplots(1, 3)
        _panel(diffuse, "diffuse, $k_d\\,(N·L)$")
        for incidence, colour in ((0.0, "#b0426f"), (INCIDENCE, COLOURS["R"])):
            label = f"N·L = {np.cos(np.radians(incidence)):.2f}"
            lobe(diffuse, seen(incidence, k_d=1.0), colour, label)
            arrow(diffuse, "L", -incidence)
        for axes, form, title in (
            (phong, "phong", "Phong, $k_s\\,(R·V)^n$"), (blinn, "blinn", "Blinn, $k_s\\,(N·H)^n$"),
        ):  # fmt: skip
            _panel(axes, title)
            arrow(axes, "L", -INCIDENCE)
            arrow(axes, "R", INCIDENCE)
            for n, colour in EXPONENTS.items():
                lobe(axes, seen(INCIDENCE, k_s=1.0, n=n, form=form), colour, f"n = {n}")
        for axes in (diffuse, phong, blinn):
            axes.legend(loc="lower center", ncols=3, frameon=False, fontsize=9,
                        handlelength=1.2, columnspacing=1)  # fmt: skip
    return figure


def seen(incidence: float, **material: Any) -> NDArray[np.float64]:
    """Return the kernel's value at each of :data:`VIEWS`.

    ``incidence`` is in degrees; the light has intensity 1.
    """
    view = Array3f(*(np.float32(part) for part in at(VIEWS)), 0)
    toward = at(-incidence)
    light = fotismos.DirectionalLight(direction=(-toward[0], -toward[1], 0), intensity=1.0)
    made = fotismos.Material(**material)
    value = fotismos.shade(Array3f(0), Array3f(0, 1, 0), view, made, [light])
    return np.broadcast_to(np.array(value, np.float64), VIEWS.shape)


def halves(titles: Sequence[str], found: Sequence[Images]) -> Figure:
    """Draw three rows of pictures: heuristic, reference, and their difference with its legend."""
    return sheet(titles, [*zip(*map(panels, found), strict=True)], ROWS)


def pictures(titles: Sequence[str], rows: Sequence[Sequence[NDArray]]) -> Figure:
    """Draw rows of linear pictures (H, W, 3), with a title above each column."""
    return sheet(titles, [[images.tonemap(picture) for picture in row] for row in rows])


def sheet(
    titles: Sequence[str],
    rows: Sequence[Sequence[Image.Image]],
    labels: Sequence[str] = (),
    size: tuple[float, float] = (INCH, INCH),
    maps: int = 1,
) -> Figure:
    """Draw rows of pictures, each of a size in inches: columns have titles, rows may have labels.

    With labels, the last ``maps`` rows end with a map of errors, and have its legend.
    """
    left, right = (0.3, 0.62) if labels else (0.0, 0.0)
    width = len(titles) * size[0] + left + right
    height = len(rows) * size[1] + 0.3
    with rc_context(STYLE):
        figure = Figure(figsize=(width, height), facecolor=GROUND)
        grid = figure.subplots(len(rows), len(titles), squeeze=False)
        figure.subplots_adjust(
            left / width, 0, 1 - right / width, 1 - 0.3 / height, wspace=0.03, hspace=0.03
        )
        for line, pictures in zip(grid, rows, strict=True):
            for axes, picture in zip(line, pictures, strict=True):
                axes.imshow(picture, interpolation="none")
                axes.axis("off")
        for axes, title in zip(grid[0], titles, strict=True):
            axes.set_title(title, pad=4)
        for axes, label in zip(grid[:, 0], labels, strict=bool(labels)):
            axes.text(-0.03, 0.5, label, rotation=90, ha="right", va="center",
                      transform=axes.transAxes)  # fmt: skip
        if labels:
            box = (width - 0.56) / width, 0.02, 0.1 / width, maps * size[1] / height - 0.04
            figures.legend(figure, figure.add_axes(box))
    return figure


def quiet(axes: Axes) -> None:
    """Give axes the ground of the pages, a faint grid, and no frame."""
    axes.set_facecolor(GROUND)
    axes.grid(alpha=0.25)
    axes.spines[["top", "right"]].set_visible(False)


def _panel(axes: Axes, title: str) -> None:
    axes.set(xlim=(-1.25, 1.25), ylim=(-0.4, 1.2), aspect="equal", title=title)
    axes.axis("off")
    axes.plot((-1.1, 1.1), (0, 0), color=FAINT, linewidth=1)


def lobe(axes: Axes, radius: NDArray[np.float64], colour: str, label: str) -> None:
    """Draw values at :data:`VIEWS` as the distances of a curve from the origin."""
    x, y = at(VIEWS, radius)
    axes.fill(x, y, facecolor=colour + "22", edgecolor=colour, linewidth=1.4, label=label)


def arrow(axes: Axes, letter: str, angle: float) -> None:
    """Draw a unit vector at the origin, at an angle from the normal."""
    vector(axes, letter, at(angle))


def vector(axes: Axes, label: str, tip: Place, tail: Place = (0.0, 0.0), size: float = 15) -> None:
    """Draw an arrow, and its label beyond the tip."""
    colour = COLOURS.get(label, OTHER)
    style = {"arrowstyle": "-|>", "color": colour, "linewidth": 1.8, "shrinkA": 0, "shrinkB": 0}
    axes.annotate("", tip, tail, arrowprops=style)
    (x, y), (u, v) = tip, tail
    beyond = 0.12 / np.hypot(x - u, y - v)
    axes.text(x + beyond * (x - u), y + beyond * (y - v), f"${label}$", color=colour,
              ha="center", va="center", size=size, path_effects=HALO)  # fmt: skip


def at(angle: float | NDArray[np.float64], radius: float | NDArray[np.float64] = 1.0) -> Any:
    """Return x and y of an angle from the normal, in degrees to the right."""
    return radius * np.sin(np.radians(angle)), radius * np.cos(np.radians(angle))
