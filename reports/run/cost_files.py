"""The files of a study of cost, and its part of a page."""

from __future__ import annotations

import re
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from comparisons import records
from comparisons.effects.dominance import dominating
from reports.charts import theme, vega
from reports.files import images, ownership, sheets
from reports.page.costs import point_pictures
from reports.page.embedding import embed_colours
from reports.page.scene_view import CostView, EffectMap, picture_name
from reports.run.places import PAGE
from reports.terminal.cost_tables import closure, noise

if TYPE_CHECKING:
    from comparisons.cost.cost import Study
    from comparisons.cost.cost_record import Cost

DIGITS = "0123456789"
"""Codes of the effects in the page's map, by their places."""

NO_EFFECT, UNCOUNTED = ".", "-"

FAMILIES = "Squares: the kernel; triangles: the phong BSDF; circles: physical BSDFs"

SHARE_DIGITS = 2
"""Significant digits of the share of light from between surfaces."""


def documents(study: Study) -> dict[str, bytes]:
    """Return the named files of a study: chart, pictures of rungs, parts and effects.

    Pictures of rungs have the record's exposure; parts are signed, red where the later image is
    brighter, over the range in the record's ``pictures``; effects are errors removed.
    """
    from reports.charts import prediction_chart
    from reports.charts.error_over_time import error_over_time

    record = study.record
    exposed = partial(images.tonemap, exposure=record.viewing.exposure)
    limits = record.pictures
    pictures = {picture_name("rung", name): exposed(image) for name, image in study.rungs.items()}
    pictures["cost-reference"] = exposed(study.reference)
    for name, signed in study.parts.items():
        shown = images.signed_map(signed.mean(axis=2), limits.part_limit)
        pictures[picture_name("part", name)] = shown
    for name, values in study.effects.items():
        pictures[picture_name("effect", name)] = images.signed_map(values, limits.effect_limit)
    made = {f"{name}.png": images.png(picture) for name, picture in pictures.items()}
    made["cost.svg"] = vega.paper(error_over_time(record))
    if record.prediction:
        made["prediction.svg"] = vega.paper(prediction_chart.standing_alone(record))
    made["cost.json"] = records.to_json(record).encode()
    return made


def write(place: Path, study: Study) -> None:
    """Write the files and the page of a study to a folder, each atomically; other files stay.

    The record comes last, so its pictures are never those of another study.
    """
    from reports.page.costs import cost_page

    ownership.folder(place)
    made = documents(study)
    page = cost_page.render(view(study, made), figures(study.record))
    ownership.write(place / PAGE, page)
    for name, content in made.items():
        ownership.write(place / name, content)


def figures(record: Cost) -> list[vega.Figure]:
    """Return the charts of a :class:`Cost`: error against time, and the prices of effects."""
    from reports.charts import error_over_time, price_chart

    made = [
        vega.figure(
            "Error against time",
            error_over_time.plot(record),
            "; ".join([FAMILIES, *error_over_time.reading(record)]) + ".",
        )
    ]
    if record.prices.effects:
        note = "Circle: error removed if added first; stroke: if added last."
        made.append(vega.figure("Price of an effect", price_chart.price_chart(record), note))
    return made


def view(study: Study, made: dict[str, bytes]) -> CostView:
    """Return the :class:`CostView` of a study, with its files ``made`` by :func:`documents`."""
    return CostView(
        record=study.record,
        images={
            name.removesuffix(".png"): content
            for name, content in made.items()
            if name.endswith(".png")
        },
        noise=" ".join(_typeset(each(study.record)) for each in (noise, closure) if study.effects),
        effects=_effect_map(study),
        sheet=sheets.sheet(
            [
                images.tonemap(study.previews[corner.effects], study.record.viewing.exposure)
                for corner in study.record.prices.corners
            ]
        ),
        points=point_pictures.sheet(study),
        between=embed_colours(_between_surfaces(study), SHARE_DIGITS),
    )


def _typeset(text: str) -> str:
    return re.sub(r"-(?=\d)", "−", text)


def _between_surfaces(study: Study) -> NDArray[np.float64]:
    """Return the part (H, W, 3) of the reference that all light adds to direct light."""
    seen = study.reference > 0
    shares = np.divide(study.parts["transport"], study.reference, where=seen, out=0.0 * seen)
    return np.clip(shares, 0, 1)


def _effect_map(study: Study) -> EffectMap:
    places = dominating(study.effects, study.counted)
    letters = {-1: NO_EFFECT, -2: UNCOUNTED} | dict(enumerate(DIGITS))
    return EffectMap(
        width=places.shape[1],
        height=places.shape[0],
        names=tuple(study.effects),
        colours=tuple(theme.EFFECT_COLOURS[name] for name in study.effects),
        map="".join(letters[int(place)] for place in places.ravel()),
    )
