"""The figures of docs/models.md that the kernel computes: its lobes, and sheets of pictures."""

from collections.abc import Sequence
from typing import Any

import fotismos  # isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np
from drjit.auto import Array3f
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from numpy.typing import NDArray
from PIL import Image

from fotismos.comparisons.comparison import Images
from fotismos.comparisons.departure.metrics import LEADING
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


def compared(titles: Sequence[str], found: Sequence[Images]) -> Figure:
    """Draw three rows of pictures: heuristic, reference, and their difference with its legend."""
    top = LEADING.map_range[1]
    rows = [
        [images.tonemap(one.heuristic) for one in found],
        [images.tonemap(one.reference) for one in found],
        [images.error_map(one.maps[LEADING.name], top).convert("RGB") for one in found],
    ]
    return sheet(titles, rows, ROWS)


def sheet(
    titles: Sequence[str], rows: Sequence[Sequence[Image.Image]], labels: Sequence[str] = ()
) -> Figure:
    """Draw rows of pictures, a title above each column and a label before each row.

    With labels, the last row is a map of errors, and has its legend.
    """
    left, right = (0.3, 0.62) if labels else (0.0, 0.0)
    width, height = len(titles) * INCH + left + right, len(rows) * INCH + 0.3
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
            _legend(figure, width, height)
    return figure


def _legend(figure: Figure, width: float, height: float) -> None:
    axes = figure.add_axes(((width - 0.56) / width, 0.02, 0.1 / width, INCH / height - 0.04))
    figures.legend(figure, axes)


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
