"""The files of a study of cost, and its part of a page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, TypeAlias

from PIL.Image import Resampling

from fotismos.comparisons.departure.blocks import shrunk
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.records.engine import EngineCost
from fotismos.heuristic.convention import Floats
from fotismos.reference import records
from fotismos.reports import cost_tables, glossary, sentences
from fotismos.reports.charts import cost_charts, vega
from fotismos.reports.files import images, results
from fotismos.reports.page.scene_view import CostView, Figure
from fotismos.reports.page.templating import HELP, head, rendered

if TYPE_CHECKING:  # pictures without a scene need no Mitsuba
    from fotismos.comparisons.ladder.engine import Study
    from fotismos.comparisons.records.cost import Cost

    AnyStudy: TypeAlias = Study[Cost] | Study[EngineCost]

FAMILIES = "Squares: the kernel; triangles: the phong BSDF; circles: physical BSDFs"

STRIP = 320
"""Pixels of the longer side of a page's pictures, at most."""


def documents(study: AnyStudy) -> dict[str, bytes]:
    """Return the named files of a study: charts, and pictures of methods with its exposure."""
    record = study.record
    pictures = {f"cost-method-{_plain(name)}": image for name, image in study.methods.items()}
    # A name may be anything: files have numbers.
    pictures |= {
        f"cost-picture-{number}": image for number, image in enumerate(study.settings.values(), 1)
    }
    pictures["cost-reference"] = study.reference
    made = {
        f"{name}.png": images.png(images.tonemap(image, exposure=record.viewing.exposure))
        for name, image in pictures.items()
    }
    # The record stays last: `write` keeps this order.
    made["cost.svg"] = vega.paper(cost_charts.titled(record))
    made["cost.json"] = records.to_json(record).encode()
    return made


def write(folder: Path, study: AnyStudy, shown: CostView) -> None:
    """Write the files of a study, and the page of its view, to a folder, each atomically.

    Other files stay. The record comes last, so its pictures are never those of another study.
    """
    results.own(folder)
    made = documents(study)
    page = rendered(
        "cost_page.html.j2",
        HELP,
        title=title(study.record, shown.within),
        head=head("cost", folder, study.record.scene),
        data={"terms": glossary.meanings()},
        cost=shown,
        r=study.record,
        figure=figure(study.record),
    )
    results.write(folder / results.PAGE, page)
    for name, content in made.items():
        results.write(folder / name, content)


def title(record: Cost | EngineCost, within: float) -> str:
    """Return the title of a study's page: what it found."""
    if isinstance(record, EngineCost):
        return f"{record.scene}: {sentences.answer_of_pictures(record, within)}"
    return f"{record.scene}: {sentences.answer(record)}"


def lines(record: Cost | EngineCost, within: float) -> Iterator[str]:
    """Yield the lines of a study of a scene, or of pictures without one."""
    if isinstance(record, EngineCost):
        return cost_tables.lines_of_pictures(record, within)
    return cost_tables.lines(record)


def figure(record: Cost | EngineCost) -> Figure:
    """Return the chart of a study: error against time."""
    families = [] if isinstance(record, EngineCost) else [FAMILIES]
    note = "; ".join([*families, *cost_charts.reading(record)]) + "."
    note = note[0].upper() + note[1:]
    return vega.figure("Error against time", cost_charts.error_over_time(record), note)


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower()).replace("--", "-")


def view(study: AnyStudy, within: float = TOLERANCE) -> CostView:
    """Return the :class:`CostView` of a study; pixels differ visibly above a ΔE2000."""
    exposure = study.record.viewing.exposure
    named = {**study.methods, **study.settings}
    return CostView(
        record=study.record,
        images={name: _small(image, exposure) for name, image in named.items()},
        reference=_small(study.reference, exposure),
        within=within,
    )


def _small(image: Floats, exposure: float) -> bytes:
    """Return an image (H, W, 3) as a WebP file for a strip."""
    picture = images.tonemap(image, exposure)
    return images.webp(picture.resize(shrunk(picture.size, STRIP), Resampling.BOX))
