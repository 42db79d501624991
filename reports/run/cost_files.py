"""The files of a study of cost, and its part of a page."""

from __future__ import annotations

import re
from pathlib import Path
from typing import TYPE_CHECKING

from fotismos.comparisons.departure.criterion import share_above
from fotismos.reference import records
from fotismos.reports import glossary
from fotismos.reports.charts import cost_charts, theme, vega
from fotismos.reports.files import images, results
from fotismos.reports.page.head import head
from fotismos.reports.page.scene_view import CostView, EngineView
from fotismos.reports.page.templating import HELP, rendered
from fotismos.reports.terminal.cost_tables import (
    answer,
    busy,
    closure,
    judgements,
    left_out,
    oddities,
    stated,
    together,
)
from fotismos.reports.terminal.words import as_typed

if TYPE_CHECKING:
    from fotismos.comparisons.cost.cost import Study
    from fotismos.comparisons.cost.cost_record import Cost

FAMILIES = "Squares: the kernel; triangles: the phong BSDF; circles: physical BSDFs"


def documents(study: Study) -> dict[str, bytes]:
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


def write(folder: Path, study: Study) -> None:
    """Write the files and the page of a study to a folder, each atomically; other files stay.

    The record comes last, so its pictures are never those of another study.
    """
    results.own(folder)
    made = documents(study)
    page = rendered(
        "cost_page.html.j2",
        HELP,
        title=f"What accuracy costs on {study.record.scene}",
        head=head("cost", folder, study.record.scene),
        data={"terms": glossary.meanings()},
        cost=view(study),
        r=study.record,
        figure=figure(study.record),
    )
    results.write(folder / results.PAGE, page)
    for name, content in made.items():
        results.write(folder / name, content)


def figure(record: Cost) -> theme.Figure:
    """Return the chart of a study: error against time."""
    note = "; ".join([FAMILIES, *cost_charts.reading(record)]) + "."
    return vega.figure("Error against time", cost_charts.error_over_time(record), note)


def _plain(name: str) -> str:
    return "".join(c if c.isalnum() else "-" for c in name.lower()).replace("--", "-")


def view(study: Study) -> CostView:
    """Return the :class:`CostView` of a study."""
    record = study.record
    exposure = record.viewing.exposure
    effects = record.attribution.effects
    engine = None
    if record.engine:
        engine = EngineView(
            judgements=tuple(judgements(record.engine)),
            stated=stated(record.engine),
            odd=tuple(oddities(record.engine)),
            shares=tuple(share_above(one.visible) for one in record.engine.settings),
        )
    said = [together(record), closure(record)] if effects else []
    return CostView(
        record=record,
        images={
            name: images.webp(images.tonemap(image, exposure))
            for name, image in {**study.methods, **study.settings}.items()
        },
        engine=engine,
        said=re.sub(r"(?<!\d)-(?=\d)", "−", " ".join(said)),
        busy=busy(record) if record.is_busy else "",
        answer=as_typed(answer(record)),
        left_out=tuple(map(as_typed, left_out(record))),
        reference=images.webp(images.tonemap(study.reference, exposure)),
        colours=tuple(theme.EFFECT_COLOURS[effect.effect] for effect in effects),
    )
