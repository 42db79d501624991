"""The page and record of one fit, and its tables."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from fotismos.comparisons.departure.metrics import LEADING, drawn
from fotismos.comparisons.fit.fit import Fit
from fotismos.comparisons.records.fit import FitRecord, FittedParameter, FormFit
from fotismos.reference.pairing.factors import alpha_of, exponent_of
from fotismos.reference.records import to_json
from fotismos.reports.files import images, results
from fotismos.reports.page.templating import head, rendered
from fotismos.reports.sentences import judgement_of_fit, of_fit
from fotismos.reports.terminal.table import Column, Table, printed
from fotismos.reports.terminal.words import difference


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
    best = record.nearest
    exposure = record.viewing.exposure
    high = LEADING.map_range[1]
    error = best.departure[LEADING.name]
    scale = f"{LEADING.label} from 0 to {high:g}"
    before = LEADING(fit.before, fit.reference, record.viewing)
    after = LEADING(fit.after, fit.reference, record.viewing)
    shown = {
        "physical": images.tonemap(fit.reference, exposure),
        "textbook, paired": images.tonemap(fit.before, exposure),
        f"textbook, fitted ({best.form})": images.tonemap(fit.after, exposure),
        f"error before, mean {difference(error.before)} ({scale})": images.error_map(before, high),
        f"error after, mean {difference(error.after)} ({scale})": images.error_map(after, high),
    }
    return rendered(
        "fit_page.html.j2",
        title=of_fit(record),
        head=head("fit", folder, record.scene),
        judgement=judgement_of_fit(record),
        r=record,
        pictures={name: images.webp(picture, lossless=True) for name, picture in shown.items()},
        errors=_errors(record),
        parameters=_parameters(best),
        sentences=list(_notes(best)),
    )


def lines(record: FitRecord) -> Iterator[str]:
    """Yield the lines of a fit: errors by form, then the parameters of the best form."""
    best = record.nearest
    yield f"{of_fit(record)}; {best.form} comes nearest"
    yield judgement_of_fit(record)
    yield ""
    yield from printed(_errors(record))
    yield ""
    yield from printed(_parameters(best))
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


def _errors(record: FitRecord) -> Table:
    """Return the errors of the paired and the fitted parameters, by form."""
    metrics = drawn()

    def row(name: str, form: FormFit, field: str, loss: float | None = None) -> list[str]:
        means = [f"{getattr(form.departure[metric], field):z.3f}" for metric in metrics]
        return [name, *means, "" if loss is None else f"{loss:.4g}"]

    labels = [metric.label for metric in metrics.values()]
    nearest = record.nearest
    first = record.fits[0]
    blank = [""] * len(metrics)
    rows = [
        ["mean error", *labels, f"minimised: {record.loss['unit']}"],
        row("paired", first, "before", nearest.loss + nearest.parameter_error),
        *(row(form.form, form, "after", form.loss) for form in record.fits),
        row("noise alone", first, "noise_floor"),
        ["parameter error", *blank, f"{nearest.parameter_error:.4g}"],
        ["model error", *blank, f"{nearest.loss:.4g}"],
    ]
    return Table.of(rows, right=len(rows[0]))


def _parameters(fit: FormFit) -> Table:
    """Return the parameters before and after, and how certain they are."""
    columns = (
        Column("material", lambda row: row[0]),
        Column("parameter", lambda row: _called(row[1])),
        Column("paired", lambda row: row[1].paired, "{:.4g}".format),
        Column("fitted", lambda row: row[1].fitted, "{:.4g}".format),
        Column("95 %, by noise alone", lambda row: _interval(row[1])),
        Column("note", lambda row: _note(row[1])),
    )
    owned = [
        (material.name, parameter)
        for material in fit.materials
        for parameter in material.parameters
    ]
    return Table(columns, owned)


def _called(parameter: FittedParameter) -> str:
    name = f"{parameter.name} {parameter.channel}".strip()
    return f"{name} (factor)" if parameter.is_factor else name


def _note(parameter: FittedParameter) -> str:
    if parameter.reason:
        partners = f" ({', '.join(parameter.partners)})" if parameter.partners else ""
        return f"not identifiable: {parameter.reason}{partners}"
    return "at its bound" if parameter.at_bound else ""


def _interval(parameter: FittedParameter) -> str:
    """Return the interval of a parameter, or that it is narrower than the value's last digit."""
    if not parameter.interval:
        return ""
    low, high = parameter.interval
    if f"{low:.4g}" == f"{high:.4g}":
        return "below the last digit"
    return f"{low:.4g} to {high:.4g}"


def described(reference: Mapping[str, Any]) -> str:
    """Return the plugin and the leading parameters of a material in the reference."""

    def number(value: Any) -> str:
        if isinstance(value, list):
            return f"({', '.join(map(number, value))})"
        return f"{value:.3g}" if isinstance(value, float) else str(value)

    names = ("alpha", "int_ior", "diffuse_reflectance", "reflectance")
    changes = [f"{name} {number(reference[name])}" for name in names if name in reference]
    return f"{reference['plugin']} {', '.join(changes)}".strip()
