"""Fits as tables for a terminal and in Markdown, and the files of one fit."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib
from PIL import Image, ImageDraw, ImageFont

from comparisons.departure.metrics import LEADING, drawn
from comparisons.records import to_json
from reports.files import images, ownership
from reports.terminal import tables

if TYPE_CHECKING:
    from comparisons.fit.fit_record import FitRecord, Fitted, FittedMaterial, FormFit
    from comparisons.fit.summary import Fit

Cells = Sequence[str]
"""One row of a table."""

SMALLEST_TILE = 256
"""Pixels; smaller images are enlarged by a whole factor, so each pixel stays square."""

GAP, CAPTION = 8, 22
FONT = Path(matplotlib.get_data_path(), "fonts/ttf/DejaVuSans.ttf")
"""Matplotlib's, since Pillow's has no Greek."""


def write(folder: Path, fit: Fit) -> None:
    """Write ``fit.json`` and ``fit.png`` to a folder."""
    ownership.folder(folder)
    ownership.write(folder / "fit.png", picture(fit))
    ownership.write(folder / "fit.json", to_json(fit.record))


def picture(fit: Fit) -> bytes:
    """Return the PNG of a fit: paired, reference, fitted, and the error left.

    The pictures are tone-mapped; the map has the metric's fixed range.
    """
    exposure = fit.record.viewing.exposure
    high, residual = LEADING.map_range[1], fit.images.maps[LEADING.name]
    tiles = {
        "paired": images.tonemap(fit.images.before, exposure),
        "reference": images.tonemap(fit.images.reference, exposure),
        f"fitted ({_form(fit.record.nearest)})": images.tonemap(fit.images.after, exposure),
        f"{LEADING.label} left, 0 to {high:g}": images.error_map(residual, high),
    }
    width, height = next(iter(tiles.values())).size
    factor = max(1, -(-SMALLEST_TILE // min(width, height)))
    width, height = width * factor, height * factor
    sheet = Image.new("RGB", (4 * width + 5 * GAP, height + CAPTION + 2 * GAP), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.truetype(FONT, 14)
    for place, (caption, tile) in enumerate(tiles.items()):
        left = GAP + place * (width + GAP)
        draw.text((left, GAP), caption, "black", font)
        enlarged = tile.convert("RGB").resize((width, height), Image.Resampling.NEAREST)
        sheet.paste(enlarged, (left, GAP + CAPTION))
    buffer = BytesIO()
    sheet.save(buffer, "PNG")
    return buffer.getvalue()


def lines(record: FitRecord) -> Iterator[str]:
    """Yield the lines of a fit: departures by form, then the parameters of the best form."""
    best = record.nearest
    yield f"{record.scene}: {record.loss.name} loss, {_form(best)} comes nearest"
    yield ""
    yield from tables.printed(_departures(record))
    yield ""
    yield from tables.printed(_parameters(best))
    for material in best.materials:
        if material.reference:
            yield f"reference of {material.name}: {_described(material.reference)}"
    yield ""


def markdown(records: Sequence[FitRecord], scenes: Sequence[str]) -> Iterator[str]:
    """Yield the lines of a Markdown page: departures of scenes before and after their fits."""
    names = " ".join(scenes)
    yield "# Fits: departure before and after"
    yield ""
    yield f"Made by `./run fit {names} --markdown docs/fit-figures.md`."
    yield ""
    yield (
        "Mean colour difference from the reference with the paired parameters (*before*), with the"
        " best parameters of the best form (*after*), and from the reference's noise alone"
        " (*floor*). *Parameter error* and *model error* are the parts of the minimised loss that"
        " the best parameters remove and leave. Metrics are not minimised: other parameters may"
        " leave less of them."
    )
    yield ""
    yield from tables.markdown(_scene_rows(records), right=2)
    yield ""
    yield "Paired → fitted parameters; a dash if the image does not determine them."
    yield ""
    yield from tables.markdown(_material_rows(records), right=7)


def _scene_rows(records: Sequence[FitRecord]) -> Iterator[Cells]:
    labels = (f"{metric.label}: before → after (floor)" for metric in drawn().values())
    errors = ("parameter error (loss)", "model error (loss)")
    yield "scene", "best form", *labels, *errors, "seconds"
    for record in records:
        departures = [record.nearest.departure[name] for name in drawn()]
        cells = [f"{d.before:.3f} → {d.after:.3f} ({d.noise_floor:.3f})" for d in departures]
        parts = _three(record.nearest.parameter_error), _three(record.nearest.loss)
        yield record.scene, record.nearest.form, *cells, *parts, f"{record.time.total:.1f}"


def _material_rows(records: Sequence[FitRecord]) -> Iterator[Cells]:
    yield "scene", "form", "k_a", "k_d", "k_s", "n", "reference"
    for record in records:
        for fit in record.fits:
            for material in () if fit.normalised else fit.materials:
                yield record.scene, fit.form, *_material_cells(material)


def _material_cells(material: FittedMaterial) -> Cells:
    found = {p.name: f"{p.paired:.3g} → {_value(p)}" for p in material.parameters}
    reference = _described(material.reference or {"plugin": ""})
    return [*(found.get(name, "") for name in ("k_a", "k_d", "k_s", "n")), reference]


def _form(fit: FormFit) -> str:
    return fit.form + (" (normalised)" if fit.normalised else "")


def _departures(record: FitRecord) -> Iterator[Cells]:
    def row(name: str, form: FormFit, field: str, loss: str = "") -> Cells:
        means = (getattr(form.departure[metric], field) for metric in drawn())
        return name, *map(_three, means), loss

    yield "mean of", *(metric.label for metric in drawn().values()), "loss"
    nearest = record.nearest
    paired = nearest.loss + nearest.parameter_error
    yield row("paired", record.fits[0], "before", f"{paired:.4g}")
    for fit in record.fits:
        yield row(_form(fit), fit, "after", f"{fit.loss:.4g}")
    yield row("noise floor", record.fits[0], "noise_floor")
    blank = [""] * len(drawn())
    yield "parameter error", *blank, f"{nearest.parameter_error:.4g}"
    yield "model error", *blank, f"{nearest.loss:.4g}"


def _parameters(fit: FormFit) -> Iterator[Cells]:
    yield "material or light", "parameter", "paired", "fitted", "95 %, by noise", ""
    for owner in fit.materials:
        for parameter in owner.parameters:
            yield owner.name, *_parameter_cells(parameter)
    for parameter in fit.own:
        yield fit.form, *_parameter_cells(parameter)
    for light in fit.lights:
        yield light.light, *_parameter_cells(light)


def _parameter_cells(parameter: Fitted) -> Cells:
    interval = parameter.interval
    note = parameter.reason and f"not identifiable: {parameter.reason}"
    if parameter.partners:
        note += f" ({', '.join(parameter.partners)})"
    if parameter.at_bound and not note:
        note = "at its bound"
    factor = " (factor)" if parameter.is_factor else ""
    return (
        f"{parameter.name} {parameter.channel}".strip() + factor,
        f"{parameter.paired:.4g}",
        _value(parameter),
        f"{interval[0]:.4g} to {interval[1]:.4g}" if interval else "",
        note,
    )


def _value(parameter: Fitted) -> str:
    return "–" if parameter.fitted is None else f"{parameter.fitted:.4g}"


def _described(reference: Mapping[str, Any]) -> str:
    words = [
        f"{key} {_number(value)}"
        for key, value in reference.items()
        if key in ("alpha", "int_ior", "diffuse_reflectance", "reflectance")
    ]
    return " ".join([reference["plugin"], ", ".join(words)]).strip()


def _three(value: float) -> str:
    """Three decimals, without a sign if all are 0."""
    return f"{value:.3f}".replace("-0.000", "0.000")


def _number(value: Any) -> str:
    if isinstance(value, list):
        return "(" + ", ".join(f"{component:.3g}" for component in value) + ")"
    return f"{value:.3g}" if isinstance(value, float) else str(value)
