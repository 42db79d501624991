"""The picture of docs/reading.md, and README's caption: halves of a scene, the error, its causes.

It is drawn from the files and the record of `./run compare SCENE`, so its numbers are the page's.
"""

from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib import rc_context
from matplotlib.figure import Figure
from PIL import Image

from docs.figures.documents import draw, replace
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.reports import verdict
from fotismos.reports.charts import figures
from fotismos.reports.files.results import TABLES
from fotismos.reports.jobs import Job
from fotismos.reports.page.scene_view import EFFECT_COLOURS
from fotismos.reports.run import scene
from fotismos.reports.terminal.words import number, percent

SCENE = "cornell-box"
GROUND, INK = "#fcfcfb", "#1c1e21"
"""Colours of the page in light."""

PANELS = {"heuristic": "Textbook shading", "reference": "Physical", LEADING.name: ""}
"""Files of a comparison, and their titles; the map's title holds its mean."""

WIDTH, HEIGHT = 9.1, 4.3
"""Inches; at 100 dots per inch the picture has the size at which the README shows it."""

BAR = 8.21
"""Inches: the bar of effects is as wide as the panels."""


def write() -> None:
    """Compare the scene as the command does, and write the picture and its caption."""
    job = Job(Options(), with_causes=True)
    with TemporaryDirectory() as folder:
        Path(folder, TABLES).mkdir()  # where processes of a command wait for their turn
        view, _ = scene.compared(SCENE, Path(folder), SCENE, job, lambda *_: None)
        files = {name: Path(folder, SCENE, f"{name}.png") for name in PANELS}
        pictures = {name: Image.open(file).convert("RGB") for name, file in files.items()}
    record = view.record
    mean = record.metrics[LEADING.name].mean
    missing = verdict.missing(record)
    parts = {effect: mean * share for effect, share in missing.items()}
    draw("hero.webp", _picture(pictures, mean, parts))
    listed = ", ".join(f"{effect} {number(part)}" for effect, part in parts.items())
    caption = (
        f"*`./run compare {SCENE}`: {percent(verdict.share(record).value)} of the pixels differ"
        f" visibly, by more than {LEADING.label} {TOLERANCE:g}; the mean is {number(mean)}. Missing"
        f" effects make up the mean: {listed}. The box has no ambient light.*"
    )
    replace("../README.md", "hero", [caption])


def _picture(pictures: dict[str, Image.Image], mean: float, parts: dict[str, float]) -> Figure:
    """Return the labelled panels, the legend of the map, and the bar of effects."""
    titles = {**PANELS, LEADING.name: f"{LEADING.label}, mean {number(mean)}"}
    with rc_context({"font.size": 12, "text.color": INK, "font.family": "sans-serif"}):
        figure = Figure(figsize=(WIDTH, HEIGHT), facecolor=GROUND)
        for column, (name, title) in enumerate(titles.items()):
            axes = figure.add_axes(_box(0.1 + 2.77 * column, 1.2, 2.67, 2.67))
            axes.imshow(pictures[name], interpolation="none", aspect="auto")
            axes.set_title(title, loc="left", pad=6, fontsize=14)
            axes.axis("off")
        figures.legend(figure, figure.add_axes(_box(8.39, 1.2, 0.12, 2.67)))
        _draw_effects(figure, mean, parts)
    return figure


def _draw_effects(figure: Figure, mean: float, parts: dict[str, float]) -> None:
    """Draw the bar on the scale of the mean, and a label for each effect below it."""
    axes = figure.add_axes(_box(0.1, 0.16, BAR, 0.92), xlim=(0, BAR), ylim=(0, 0.92))
    axes.axis("off")
    axes.text(0, 0.74, "What is missing", fontsize=14)
    left = 0.0
    for effect, part in parts.items():
        wide, colour = BAR * part / mean, EFFECT_COLOURS[effect]
        axes.barh(0.47, wide, 0.24, left, color=colour, edgecolor=GROUND, linewidth=0.6)
        left += wide
    place = 0.0
    for effect, part in parts.items():
        axes.barh(0.12, 0.15, 0.15, place, color=EFFECT_COLOURS[effect])
        words = axes.text(place + 0.23, 0.12, f"{effect} {number(part)}", va="center")
        box = words.get_window_extent()
        place = axes.transData.inverted().transform((box.x1, 0))[0] + 0.35


def _box(left: float, bottom: float, width: float, height: float) -> tuple[float, ...]:
    return left / WIDTH, bottom / HEIGHT, width / WIDTH, height / HEIGHT
