"""The files of one fit, and fits as tables for a terminal and in Markdown."""

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
from reports.files import images, results
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
    exposure, high = fit.record.viewing.exposure, LEADING.map_range[1]
    tiles = {
        "paired": images.tonemap(fit.before, exposure),
        "reference": images.tonemap(fit.reference, exposure),
        f"fitted ({fit.record.nearest.form})": images.tonemap(fit.after, exposure),
        f"{LEADING.label} left, 0 to {high:g}": images.error_map(fit.maps[LEADING.name], high),
    }
    factor = max(1, -(-SMALLEST_TILE // min(fit.before.shape[:2])))
    height, width = (side * factor for side in fit.before.shape[:2])
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
    yield f"{record.scene}: {record.loss['name']} loss, {best.form} comes nearest"
    yield ""
    yield from tables.printed(_departures(record))
    yield ""
    yield from tables.printed(_parameters(best))
    for material in best.materials:
        if material.reference:
            yield f"reference of {material.name}: {described(material.reference)}"
    yield ""


def _departures(record: FitRecord) -> Iterator[Cells]:
    def row(name: str, form: FormFit, field: str, loss: float | str = "") -> Cells:
        means = (three_decimals(getattr(form.departure[metric], field)) for metric in drawn())
        return name, *means, loss if isinstance(loss, str) else f"{loss:.4g}"

    yield "mean of", *(metric.label for metric in drawn().values()), "loss"
    nearest, first = record.nearest, record.fits[0]
    yield row("paired", first, "before", nearest.loss + nearest.parameter_error)
    for fit in record.fits:
        yield row(fit.form, fit, "after", fit.loss)
    yield row("noise floor", first, "noise_floor")
    blank = [""] * len(drawn())
    yield "parameter error", *blank, f"{nearest.parameter_error:.4g}"
    yield "model error", *blank, f"{nearest.loss:.4g}"


def _parameters(fit: FormFit) -> Iterator[Cells]:
    yield "material", "parameter", "paired", "fitted", "95 %, by noise", ""
    owned = [(each.name, parameter) for each in fit.materials for parameter in each.parameters]
    for owner, parameter in owned:
        interval, note = parameter.interval, "at its bound" if parameter.at_bound else ""
        if parameter.reason:
            partners = f" ({', '.join(parameter.partners)})" if parameter.partners else ""
            note = f"not identifiable: {parameter.reason}{partners}"
        yield (
            owner,
            f"{parameter.name} {parameter.channel}".strip() + " (factor)" * parameter.is_factor,
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
    return f"{reference['plugin']} {', '.join(words)}".strip()


def three_decimals(value: float) -> str:
    """Three decimals, without a sign if all are 0."""
    return f"{value:.3f}".replace("-0.000", "0.000")
