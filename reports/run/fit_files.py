"""Fits as tables for a terminal and in Markdown, and the files of one fit."""

from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from pathlib import Path
from typing import Any

import matplotlib
from PIL import Image, ImageDraw, ImageFont

from comparisons.departure.metrics import LEADING, drawn
from comparisons.fit.fit import Fit
from comparisons.fit.fit_record import FitRecord, FittedParameter, FormFit
from reference.records import to_json
from reports.files import images
from reports.run import results
from reports.terminal import tables

Cells = Sequence[str]
"""One row of a table."""

SMALLEST_TILE = 256
"""Pixels; smaller images are enlarged by a whole factor, so each pixel stays square."""

GAP, CAPTION = 8, 22
FONT = Path(matplotlib.get_data_path(), "fonts/ttf/DejaVuSans.ttf")
"""Matplotlib's, since Pillow's has no Greek."""


def write(folder: Path, fit: Fit) -> None:
    """Write ``fit.json`` and ``fit.png`` to a folder."""
    results.own(folder)
    results.write(folder / "fit.png", picture(fit))
    results.write(folder / "fit.json", to_json(fit.record))


def picture(fit: Fit) -> bytes:
    """Return the PNG of a fit: paired, reference, fitted, and the error left.

    The pictures are tone-mapped; the map has the metric's fixed range.
    """
    exposure = fit.record.viewing.exposure
    high, residual = LEADING.map_range[1], fit.images.maps[LEADING.name]
    tiles = {
        "paired": images.tonemap(fit.images.before, exposure),
        "reference": images.tonemap(fit.images.reference, exposure),
        f"fitted ({fit.record.nearest.form})": images.tonemap(fit.images.after, exposure),
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
    yield f"{record.scene}: {record.loss.name} loss, {best.form} comes nearest"
    yield ""
    yield from tables.printed(_departures(record))
    yield ""
    yield from tables.printed(_parameters(best))
    for material in best.materials:
        if material.reference:
            yield f"reference of {material.name}: {described(material.reference)}"
    yield ""


def _departures(record: FitRecord) -> Iterator[Cells]:
    def row(name: str, form: FormFit, field: str, loss: str = "") -> Cells:
        means = (getattr(form.departure[metric], field) for metric in drawn())
        return name, *map(three_decimals, means), loss

    yield "mean of", *(metric.label for metric in drawn().values()), "loss"
    nearest, first = record.nearest, record.fits[0]
    yield row("paired", first, "before", f"{nearest.loss + nearest.parameter_error:.4g}")
    for fit in record.fits:
        yield row(fit.form, fit, "after", f"{fit.loss:.4g}")
    yield row("noise floor", first, "noise_floor")
    blank = [""] * len(drawn())
    yield "parameter error", *blank, f"{nearest.parameter_error:.4g}"
    yield "model error", *blank, f"{nearest.loss:.4g}"


def _parameters(fit: FormFit) -> Iterator[Cells]:
    yield "material or light", "parameter", "paired", "fitted", "95 %, by noise", ""
    for material in fit.materials:
        for parameter in material.parameters:
            yield material.name, *_parameter_cells(parameter)
    for parameter in fit.own:
        yield fit.form, *_parameter_cells(parameter)
    for light in fit.lights:
        yield light.light, *_parameter_cells(light)


def _parameter_cells(parameter: FittedParameter) -> Cells:
    interval = parameter.interval
    note = "at its bound" if parameter.at_bound else ""
    if parameter.reason:
        partners = f" ({', '.join(parameter.partners)})" if parameter.partners else ""
        note = f"not identifiable: {parameter.reason}{partners}"
    factor = " (factor)" if parameter.is_factor else ""
    return (
        f"{parameter.name} {parameter.channel}".strip() + factor,
        f"{parameter.paired:.4g}",
        value_of(parameter),
        f"{interval[0]:.4g} to {interval[1]:.4g}" if interval else "",
        note,
    )


def value_of(parameter: FittedParameter) -> str:
    """Return the fitted value, a dash if the image does not determine it."""
    return "–" if parameter.fitted is None else f"{parameter.fitted:.4g}"


def described(reference: Mapping[str, Any]) -> str:
    """Return the plugin and the leading parameters of a material in the reference."""

    def number(value: Any) -> str:
        if isinstance(value, list):
            return f"({', '.join(map(number, value))})"
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    names = ("alpha", "int_ior", "diffuse_reflectance", "reflectance")
    words = [f"{name} {number(reference[name])}" for name in names if name in reference]
    return " ".join([reference["plugin"], ", ".join(words)]).strip()


def three_decimals(value: float) -> str:
    """Three decimals, without a sign if all are 0."""
    return f"{value:.3f}".replace("-0.000", "0.000")
