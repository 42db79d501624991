"""The files of a study of cost, and its part of a page."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from reference import records
from reports import glossary
from reports.charts import theme, vega
from reports.files import images
from reports.page import templating
from reports.page.scene_view import CostView, picture_name
from reports.run import results
from reports.run.results import PAGE
from reports.terminal.cost_tables import closure

if TYPE_CHECKING:
    from comparisons.cost.cost import Study
    from comparisons.cost.cost_record import Cost

FAMILIES = "Squares: the kernel; triangles: the phong BSDF; circles: physical BSDFs"


def documents(study: Study) -> dict[str, bytes]:
    """Return the named files of a study: chart, pictures of methods and effects.

    Pictures of methods have the record's exposure; effects are errors removed, over the range in
    the record's ``pictures``.
    """
    from reports.charts import cost_charts  # Altair takes half a second to import

    record = study.record
    exposed = partial(images.tonemap, exposure=record.viewing.exposure)
    limits = record.pictures
    pictures = {picture_name("method", n): exposed(image) for n, image in study.methods.items()}
    pictures["cost-reference"] = exposed(study.reference)
    for name, values in study.causes.maps.items():
        pictures[picture_name("effect", name)] = images.signed_map(values, limits.effect_limit)
    made = {f"{name}.png": images.png(picture) for name, picture in pictures.items()}
    made["cost.svg"] = vega.paper(cost_charts.titled(record))
    if record.prediction:
        chart = cost_charts.prediction_chart(record, record.prediction)
        made["prediction.svg"] = vega.paper(chart)
    made["cost.json"] = records.to_json(record).encode()
    return made


def write(place: Path, study: Study) -> None:
    """Write the files and the page of a study to a folder, each atomically; other files stay.

    The record comes last, so its pictures are never those of another study.
    """
    results.own(place)
    made = documents(study)
    page = templating.environment().get_template("cost_page.html.j2")
    results.write(
        place / PAGE,
        page.render(
            style=templating.style(("base", "page", "print")),
            scripts=templating.scripts(("page", "help")),
            cost=view(study, made),
            r=study.record,
            charts=figures(study.record),
            terms=glossary.meanings(),
        ),
    )
    for name, content in made.items():
        results.write(place / name, content)


def figures(record: Cost) -> list[vega.Figure]:
    """Return the charts of a study: error against time, and what each effect removes."""
    from reports.charts import cost_charts  # Altair takes half a second to import

    made = [
        vega.figure(
            "Error against time",
            cost_charts.error_over_time(record),
            "; ".join([FAMILIES, *cost_charts.reading(record)]) + ".",
        )
    ]
    if record.attribution.effects:
        note = "Circle: error removed if added first; stroke: if added last."
        chart = cost_charts.attribution_chart(record)
        made.append(vega.figure("What each effect removes", chart, note))
    return made


def view(study: Study, made: dict[str, bytes]) -> CostView:
    """Return the :class:`CostView` of a study, with its files ``made`` by :func:`documents`."""
    record, causes = study.record, study.causes
    said = closure(record) if causes.maps else ""
    return CostView(
        record=record,
        images={
            name.removesuffix(".png"): content
            for name, content in made.items()
            if name.endswith(".png")
        },
        noise=re.sub(r"-(?=\d)", "−", said),
        colours=tuple(theme.EFFECT_COLOURS[name] for name in causes.maps),
    )
