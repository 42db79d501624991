"""The files of a study of cost, and its part of a page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from PIL.Image import Resampling

from fotismos.comparisons.departure.blocks import shrunk
from fotismos.comparisons.departure.criterion import TOLERANCE, share_above
from fotismos.comparisons.records.engine import Engine, EngineCost
from fotismos.heuristic.convention import Floats
from fotismos.reference import records
from fotismos.reports import glossary
from fotismos.reports.charts import cost_charts, vega
from fotismos.reports.files import images, results
from fotismos.reports.page.scene_view import EFFECT_COLOURS, CostView, EngineView, Figure
from fotismos.reports.page.templating import HELP, head, rendered
from fotismos.reports.terminal.cost_tables import (
    OWN_FRONT,
    answer,
    answer_of_pictures,
    busy,
    closure,
    judgements,
    left_out,
    oddities,
    reference_of,
    stated,
    together,
)
from fotismos.reports.terminal.words import as_typed

if TYPE_CHECKING:  # pictures without a scene need no Mitsuba
    from fotismos.comparisons.cost.engine import Study
    from fotismos.comparisons.records.cost import Cost

    AnyStudy = Study[Cost] | Study[EngineCost]

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
    by = ", judged by" if shown.judged else " on"
    page = rendered(
        "cost_page.html.j2",
        HELP,
        title=f"What accuracy costs{by} {study.record.scene}",
        head=head("cost", folder, study.record.scene),
        data={"terms": glossary.meanings()},
        cost=shown,
        r=study.record,
        figure=figure(study.record),
    )
    results.write(folder / results.PAGE, page)
    for name, content in made.items():
        results.write(folder / name, content)


def figure(record: Cost | EngineCost) -> Figure:
    """Return the chart of a study: error against time."""
    families = [] if isinstance(record, EngineCost) else [FAMILIES]
    note = "; ".join([*families, *cost_charts.reading(record)]) + "."
    note = note[0].upper() + note[1:]
    return vega.figure("Error against time", cost_charts.error_over_time(record), note)


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower()).replace("--", "-")


def view_of_pictures(study: Study[EngineCost], within: float) -> CostView:
    """Return the view of settings without a scene; pixels differ visibly above a ΔE2000."""
    record = study.record
    return CostView(
        record=record,
        images=_strip(study),
        engine=_engine(record.engine, within),
        answer=answer_of_pictures(record, within),
        reference=_small(study.reference, record.viewing.exposure),
        judged=reference_of(record),
    )


def _strip(study: AnyStudy) -> dict[str, bytes]:
    exposure = study.record.viewing.exposure
    named = {**study.methods, **study.settings}
    return {name: _small(image, exposure) for name, image in named.items()}


def _small(image: Floats, exposure: float) -> bytes:
    """Return an image (H, W, 3) as a WebP file for a strip."""
    picture = images.tonemap(image, exposure)
    return images.webp(picture.resize(shrunk(picture.size, STRIP), Resampling.BOX))


def _engine(engine: Engine, within: float = TOLERANCE, more: str = "") -> EngineView:
    return EngineView(
        judgements=tuple(judgements(engine)),
        stated=stated(engine) + more,
        odd=tuple(oddities(engine)),
        within=within,
        shares=tuple(share_above(one.visible, within) for one in engine.settings),
    )


def view(study: Study[Cost]) -> CostView:
    """Return the :class:`CostView` of a study of a scene."""
    record = study.record
    effects = record.attribution.effects
    said = [together(record), closure(record)] if effects else []
    return CostView(
        record=record,
        images=_strip(study),
        engine=_engine(record.engine, more=OWN_FRONT) if record.engine else None,
        said=re.sub(r"(?<!\d)-(?=\d)", "−", " ".join(said)),
        busy=busy(record) if record.is_busy else "",
        answer=as_typed(answer(record)),
        left_out=tuple(map(as_typed, left_out(record))),
        reference=_small(study.reference, record.viewing.exposure),
        colours=tuple(EFFECT_COLOURS[effect.effect] for effect in effects),
    )
