"""Makes the generated parts of the documentation: ``./run docs``; ``--all`` also measures again.

``./run docs --site`` only builds the site.

Pictures and tables come from renderings with fixed seeds. Marked parts of pages are replaced; the
rest is written by hand.
"""

import sys
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import nbformat
from nbclient import NotebookClient

from docs.figures import (
    accuracy,
    audits,
    charts,
    commands,
    density,
    engines,
    examples,
    guarantees,
    hero,
    lessons,
    light_counts,
    measured,
    model_figures,
    other_tools,
    photograph,
    prices,
    renderers,
    rooms,
    schemes,
    two_pictures,
)
from docs.figures.from_tests import ROOT, fact
from docs.website import build
from fotismos.comparisons import atomic
from fotismos.comparisons.compare import compare
from fotismos.comparisons.comparison import Images
from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.options import Options
from fotismos.heuristic import plugins
from fotismos.heuristic.heuristics import Interpolation
from fotismos.reference.planning.rules import RULES
from fotismos.reference.scene.graph import set_variant
from fotismos.reports.charts import figures, vega
from fotismos.reports.charts.cost_charts import titled
from fotismos.reports.files import images
from fotismos.reports.run import audit_files

DOCS = ROOT / "docs"
SIDE, SAMPLES = 192, 64

SHEETS = {
    "ambient": ("fig-8-5a", "fig-8-5b", "fig-8-5c"),
    "diffuse": ("fig-8-6a", "fig-8-6b", "fig-8-6c"),
    "specular": ("fig-8-7a", "fig-8-7b", "fig-8-7c"),
    "sum": ("fig-8-8a", "fig-8-8c", "fig-8-9", "fig-8-11-n9"),
    "spots": ("fig-6-5-m1", "fig-6-5-m40"),
}
"""Pictures of docs/models.md: heuristic, reference and difference below each other."""

POLYGONS = (
    ("fig-6-10", Interpolation.FLAT),
    ("fig-6-10", Interpolation.GOURAUD),
    ("fig-6-10", Interpolation.PHONG),
    ("fig-6-14", Interpolation.GOURAUD),
    ("fig-6-14", Interpolation.PHONG),
)


def main(words: Sequence[str]) -> None:
    """Make everything; ``--all`` adds the slow parts.

    ``--accuracy`` and ``--engines`` make only one page, ``--prices`` only the first part of one.
    """
    if not set(words) <= {"--all", "--accuracy", "--engines", "--prices", "--site"}:
        sys.exit(__doc__)
    if words == ["--site"]:
        return _site()
    set_variant("llvm_ad_rgb")
    if words == ["--accuracy"]:
        return _accuracy()
    if words == ["--engines"]:
        return _engines()
    if words == ["--prices"]:
        return _prices()
    if words == ["--all"]:
        _measurements()
        _accuracy()
        _engines()
        _prices()
    _guarantees()
    replace("plans.md", "rules", rules())
    _hero()
    _page()
    _study()
    _models()
    _architecture()
    _witnesses()
    _charts()
    _shaders()
    _renderers()
    _audits()
    _lessons()
    _pictures()
    _other_tools()
    _notebook()


def replace(page: str, part: str, lines: Iterable[str]) -> None:
    """Replace the text between the marks of a part of a page."""
    path = DOCS / page
    text = path.read_text(encoding="utf-8")
    begin, end = marks(part)
    head, rest = text.split(begin)
    _, tail = rest.split(end)
    atomic.write(path, "\n".join([head + begin, "", *lines, "", end + tail]))


def _pictures() -> None:
    """Make the picture of two pictures, and its sentences."""
    comparison = two_pictures.made()
    atomic.write(DOCS / "pictures.webp", two_pictures.picture(comparison))
    replace("pictures.md", "two pictures", two_pictures.lines(comparison))


def _other_tools() -> None:
    """Ask three tools about the same pairs of pictures."""
    found = other_tools.made()
    atomic.write(DOCS / "other-tools.svg", figures.drawn(other_tools.chart(found), "svg"))
    replace("checks.md", "other tools", other_tools.lines(found))


def marks(part: str) -> tuple[str, str]:
    """Return the marks at the beginning and end of a part of a page."""
    return f"<!-- {part}: made by ./run docs -->", f"<!-- end of {part} -->"


def rules() -> Iterator[str]:
    """Yield the rules of pruning: what each leaves out, and its premises, numbered once."""
    numbers: dict[str, int] = {}
    for rule in RULES:
        known = ", ".join(str(numbers[p.sentence]) for p in rule.premises if p.sentence in numbers)
        if rule is not RULES[0]:
            yield ""
        yield f"### {rule.name[0].upper()}{rule.name[1:]}"
        yield from ("", f"*Left out:* {rule.omits}, because {rule.absent}.", "")
        yield f"*Premises*{' ' * bool(known)}{known}:"
        yield ""
        for premise in rule.premises:
            if premise.sentence not in numbers:
                numbers[premise.sentence] = len(numbers) + 1
                yield f"{len(numbers)}. {premise.sentence}"


def _images(name: str, interpolation: Interpolation | None = None) -> Images:
    scene = builtin(name)
    options = Options(
        spp=SAMPLES,
        resolution=(SIDE, SIDE),
        interpolation=(interpolation or Interpolation(scene.interpolation)).value,
        tessellation=scene.tessellation,
        vertex_weights=scene.vertex_weights,
    )
    return compare(scene.source(), options).images


def _models() -> None:
    """Draw the pictures of docs/models.md."""
    drawn: dict[str, Any] = {name: schemes.sheet(panels) for name, panels in schemes.SHEETS.items()}
    for name, figure in (drawn | {"lobes": model_figures.lobes()}).items():
        atomic.write(DOCS / f"models-{name}.svg", figures.drawn(figure, "svg"))
    for name, scenes in SHEETS.items():
        found = model_figures.compared(scenes, [_images(scene) for scene in scenes])
        atomic.write(DOCS / f"models-{name}.png", figures.drawn(found, "png", 100))
    shaded = [_images(scene, kind).heuristic for scene, kind in POLYGONS]
    _sheet("models-polygons.png", [f"{s}, {kind.value}" for s, kind in POLYGONS], [shaded])


def _sheet(name: str, titles: Sequence[str], rows: Sequence[Sequence[Any]]) -> None:
    """Write rows of pictures, with a title above each column."""
    shown = [[images.tonemap(picture) for picture in row] for row in rows]
    atomic.write(DOCS / name, figures.drawn(model_figures.sheet(titles, shown), "png", 100))


def _hero() -> None:
    """Draw the picture of docs/reading.md, and write README's caption, which has its numbers."""
    found = hero.made()
    atomic.write(DOCS / "hero.webp", hero.encoded(hero.picture(found)))
    replace("../README.md", "hero", hero.caption(found))


def _site() -> None:
    """Build the site from what is there, in out/site, with a page for the lessons' scenes."""
    folder = ROOT / "out/site"
    if build.build(folder):
        raise SystemExit(f"The site in {folder} is not whole: mend the faults above.")
    # The lessons' scenes, with live shading: nothing has to be installed to move the sliders.
    size = f"{lessons.SIDE}x{lessons.SIDE}"
    live = str(folder / "live")
    commands.run("compare", *lessons.scenes(), "--resolution", size, "--output", live)
    print(folder / "index.html")


def _measurements() -> None:
    """Measure all errors and times in the documents again."""
    found = density.measured()
    atomic.write(DOCS / "models-density.svg", figures.drawn(density.chart(found), "svg"))
    replace("models.md", "density", density.sentences(found))
    shading = light_counts.measured()
    atomic.write(
        DOCS / "models-light-counts.svg", figures.drawn(light_counts.chart(shading), "svg")
    )
    replace("models.md", "light counts", light_counts.sentences(shading))
    for measure in (measured.baselines, measured.findings):
        measure()
    charts.write("noise", fact("intervals_in_noise"))
    charts.write("fits", measured.fits())
    replace("../README.md", "cost", measured.attribution())
    replace("plans.md", "gains", measured.gains())
    replace("speed.md", "speed", measured.speed())


def _accuracy() -> None:
    """Study what accuracy costs over many scenes."""
    records = accuracy.measured()
    for part in ("setting", "findings", "attribution", "pictures"):
        replace("accuracy.md", part, getattr(accuracy, part)(records))
    charts.write("methods", accuracy.methods(records))
    charts.write("fronts", accuracy.fronts(records))
    replace("accuracy.md", "predictions", accuracy.predictions())
    _charts()
    for record, path in accuracy.charts(records):
        atomic.write(DOCS / path, vega.paper(titled(record)))


def _engines() -> None:
    """Measure what approximations of engines lose and cost."""
    found = engines.measured()
    engines.write(found, DOCS)
    for part in ("lead", "table", "bias"):
        replace("engines.md", part, getattr(engines, part)(found))
    atomic.write(DOCS / "engines.webp", hero.encoded(engines.chart(found)))


def _prices() -> None:
    """Compare many scenes, and write what looking right takes in each."""
    records = prices.measured()
    atomic.write(DOCS / "prices.svg", figures.drawn(prices.chart(records), "svg"))
    for page in ("accuracy.md", "../README.md"):
        replace(page, "prices", prices.sentences(records))
    charts.write("prices", prices.table(records))
    replace("models.md", "complexity", prices.complexity(records))


def _guarantees() -> None:
    """List what the tests guarantee."""
    charts.write("guarantees", guarantees.rows())
    replace("guarantees.md", "guarantees", guarantees.summary())


def _architecture() -> None:
    """Draw the rooms that one comparison passes through."""
    found = rooms.rooms(rooms.way())
    atomic.write(DOCS / "architecture.svg", figures.drawn(rooms.picture(found), "svg"))


def _charts() -> None:
    """Draw the charts of measured tables, and the sentence on intervals in noise."""
    for name, chart in charts.CHARTS.items():
        atomic.write(DOCS / f"{name}.svg", figures.drawn(chart(), "svg"))
    replace("witnesses.md", "noise", charts.intervals())


def _page() -> None:
    """Photograph the page of the README's scene."""
    atomic.write(DOCS / "page.webp", photograph.of_page())


def _study() -> None:
    """Keep the contact sheet that the example study makes."""
    with TemporaryDirectory() as folder:
        commands.run("study", "studies/lamp-and-roughness.toml", "-o", folder)
        (sheet,) = Path(folder).glob("study/*/figures/sheet-*.webp")
        atomic.write(DOCS / "study.webp", sheet.read_bytes())


def _witnesses() -> None:
    """Run the cases of docs/witnesses.md, and write their results."""
    found = fact("witnesses")
    charts.write("closed-forms", found.pop("closed forms"))
    for part, lines in found.items():
        replace("witnesses.md", part, lines)


def _audits() -> None:
    """Audit the shaders and some BSDFs."""
    plugins.register()
    found = audits.audits()
    replace("audit.md", "audits", audits.table(found))
    atomic.write(DOCS / "audit.svg", vega.paper(audit_files.lobes(found[audits.PICTURED])))
    engines = audits.engines()
    replace("audit.md", "engines", audits.argued(engines))
    replace("audit.md", "threads", audits.threads(engines, found))


def _shaders() -> None:
    """Compare the shaders of docs/shaders."""
    found = examples.comparisons()
    replace("shaders.md", "shaders", examples.table(found))
    replace("shaders.md", "lamp", examples.lamp())
    replace("shaders.md", "mistakes", examples.mistakes())
    shown = examples.pictures(found)
    _sheet("shaders.png", list(shown), [list(shown.values())])
    spheres = examples.spheres()
    replace("shaders.md", "spheres", examples.table_of_spheres(spheres))
    drawn = hero.encoded(examples.picture_of_spheres(spheres))
    atomic.write(DOCS / "shaders-spheres.webp", drawn)


def _renderers() -> None:
    """Render scenes with four programs."""
    found = renderers.rendered()
    replace("renderers.md", "renderers", renderers.table(found))
    programs = next(iter(found.values())).images
    rows = [[one.images[program] for one in found.values()] for program in programs]
    _sheet("renderers.png", list(found), rows)


def _lessons() -> None:
    """Render the pictures and pixels of docs/lessons.md."""
    for lesson in lessons.LESSONS:
        atomic.write(DOCS / lessons.file(lesson), lessons.picture(lesson))
        replace("lessons.md", lesson, lessons.lines(lesson))


def _notebook() -> None:
    """Execute the tutorial; keep the output of its cells, but not their times.

    Of a comparison only the picture is kept: hosts of code do not show frames.
    """
    path = DOCS / "tutorial.ipynb"
    notebook = nbformat.read(path, as_version=4)
    NotebookClient(notebook, resources={"metadata": {"path": str(ROOT)}}).execute()
    for cell in notebook.cells:
        cell.metadata.pop("execution", None)
        for output in cell.get("outputs", ()):
            if "image/png" in output.get("data", ()):
                output.data.pop("text/html", None)
    atomic.write(path, nbformat.writes(notebook) + "\n")


if __name__ == "__main__":
    main(sys.argv[1:])
