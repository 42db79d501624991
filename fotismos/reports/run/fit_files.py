"""The page and record of one fit, and its tables."""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from fotismos.comparisons.departure.criterion import TOLERANCE, decide
from fotismos.comparisons.departure.metrics import LEADING, drawn
from fotismos.comparisons.fit.fit import Fit
from fotismos.comparisons.records.fit import FitRecord, FittedParameter, FormFit
from fotismos.reference.pairing.factors import alpha_of, exponent_of
from fotismos.reference.records import to_json
from fotismos.reports.files import images, results
from fotismos.reports.page.templating import head, rendered
from fotismos.reports.terminal import tables
from fotismos.reports.terminal.words import difference, percent
from fotismos.reports.verdict import EXACT

Cells = Sequence[str]
"""One row of a table."""


def write(folder: Path, fit: Fit) -> None:
    """Write ``index.html`` and ``fit.json`` to a folder; the record comes last."""
    results.own(folder)
    results.write(folder / results.PAGE, page(fit, folder))
    results.write(folder / "fit.json", to_json(fit.record))


def page(fit: Fit, folder: Path | None = None) -> str:
    """Return the page of a fit in a folder: pictures, the error left, parameters; without scripts.

    The pictures are tone-mapped; the map has the metric's fixed range.
    """
    record = fit.record
    best = fit.record.nearest
    exposure = record.viewing.exposure
    high = LEADING.map_range[1]
    error = best.departure[LEADING.name]
    scale = f"{LEADING.label} from 0 to {high:g}"
    before = LEADING(fit.before, fit.reference, record.viewing)
    shown = {
        "physical": images.tonemap(fit.reference, exposure),
        "textbook, paired": images.tonemap(fit.before, exposure),
        f"textbook, fitted ({best.form})": images.tonemap(fit.after, exposure),
        f"error before, mean {difference(error.before)} ({scale})": images.error_map(before, high),
        f"error after, mean {difference(error.after)} ({scale})": images.error_map(
            fit.maps[LEADING.name], high
        ),
    }
    return rendered(
        "fit_page.html.j2",
        title=headline(record),
        head=head("fit", folder, record.scene),
        judgement=judgement(record),
        r=record,
        pictures={name: images.webp(picture, lossless=True) for name, picture in shown.items()},
        errors=list(_errors(record)),
        parameters=list(_parameters(best)),
        sentences=list(_notes(best)),
    )


def headline(record: FitRecord) -> str:
    """Return how much of the error that was minimised better parameters remove."""
    best = record.nearest
    if best.departure[LEADING.name].before <= EXACT:
        return f"{record.scene}: the paired parameters show no visible difference"
    removed = percent(best.parameter_error / (best.loss + best.parameter_error))
    return f"{record.scene}: the best parameters remove {removed} of the error"


def judgement(record: FitRecord) -> str:
    """Return whether the paired and the fitted parameters pass the criterion."""
    before, after = record.nearest.differ
    paired = f"{percent(before.value)} ({decide([before])})"
    fitted = f"{percent(after.value)} ({decide([after])})"
    best = record.nearest
    left = f"{difference(best.left.low)} to {difference(best.left.high)}"
    model = {
        "wrong": f"The model is wrong: mean {LEADING.label} {left} is left beyond noise.",
        "right within noise": f"The model is right within noise: mean {LEADING.label} {left} is"
        " left.",
        "undecided": f"Noise hides whether the model is right: mean {LEADING.label} {left} is left."
        " More samples decide.",
    }
    return (
        f"{model[best.judgement]} At most 5 % of the pixels may differ by more than {LEADING.label}"
        f" {TOLERANCE:g}: paired {paired}, fitted {fitted}."
    )


def lines(record: FitRecord) -> Iterator[str]:
    """Yield the lines of a fit: errors by form, then the parameters of the best form."""
    best = record.nearest
    yield f"{headline(record)}; {best.form} comes nearest"
    yield judgement(record)
    yield ""
    yield from tables.printed(_errors(record))
    yield ""
    yield from tables.printed(_parameters(best))
    yield from _notes(best)
    yield ""


def _notes(fit: FormFit) -> Iterator[str]:
    """Yield what explains the parameters: another form's exponents, and the physical materials."""
    exponents = {
        parameter.paired
        for material in fit.materials
        for parameter in material.parameters
        if fit.form == "blinn" and parameter.name == "n"
    }
    for n in sorted(exponents):
        phong = exponent_of(alpha_of(n, "blinn"))
        yield f"paired n {n:.4g} of blinn: its lobe is as wide as that of n {phong:.4g} of phong"
    for material in fit.materials:
        if material.reference:
            yield f"physical {material.name}: {described(material.reference)}"


def _errors(record: FitRecord) -> Iterator[Cells]:
    def row(name: str, form: FormFit, field: str, loss: float | str = "") -> Cells:
        means = [f"{getattr(form.departure[metric], field):.3f}" for metric in drawn()]
        unsigned = (mean.replace("-0.000", "0.000") for mean in means)
        return name, *unsigned, loss if isinstance(loss, str) else f"{loss:.4g}"

    yield (
        "mean error",
        *(metric.label for metric in drawn().values()),
        f"minimised: {record.loss['unit']}",
    )
    nearest = record.nearest
    first = record.fits[0]
    yield row("paired", first, "before", nearest.loss + nearest.parameter_error)
    for fit in record.fits:
        yield row(fit.form, fit, "after", fit.loss)
    yield row("noise alone", first, "noise_floor")
    blank = [""] * len(drawn())
    yield "parameter error", *blank, f"{nearest.parameter_error:.4g}"
    yield "model error", *blank, f"{nearest.loss:.4g}"


def _parameters(fit: FormFit) -> Iterator[Cells]:
    yield "material", "parameter", "paired", "fitted", "95 %, by noise alone", "note"
    owned = [
        (material.name, parameter)
        for material in fit.materials
        for parameter in material.parameters
    ]
    for owner, parameter in owned:
        name = f"{parameter.name} {parameter.channel}".strip()
        if parameter.is_factor:
            name += " (factor)"
        note = "at its bound" if parameter.at_bound else ""
        if parameter.reason:
            partners = f" ({', '.join(parameter.partners)})" if parameter.partners else ""
            note = f"not identifiable: {parameter.reason}{partners}"
        yield (
            owner,
            name,
            f"{parameter.paired:.4g}",
            "–" if parameter.fitted is None else f"{parameter.fitted:.4g}",
            _interval(parameter),
            note,
        )


def _interval(parameter: FittedParameter) -> str:
    """Return the interval of a parameter, or that it is narrower than the value's last digit."""
    if not parameter.interval:
        return ""
    low = f"{parameter.interval[0]:.4g}"
    high = f"{parameter.interval[1]:.4g}"
    return "below the last digit" if low == high else f"{low} to {high}"


def described(reference: Mapping[str, Any]) -> str:
    """Return the plugin and the leading parameters of a material in the reference."""

    def number(value: Any) -> str:
        if isinstance(value, list):
            return f"({', '.join(map(number, value))})"
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    names = ("alpha", "int_ior", "diffuse_reflectance", "reflectance")
    changes = [f"{name} {number(reference[name])}" for name in names if name in reference]
    return f"{reference['plugin']} {', '.join(changes)}".strip()
