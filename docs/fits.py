"""The page of fits: departures of scenes before and after, and their parameters."""

from collections.abc import Iterator, Sequence

from comparisons.departure.metrics import drawn
from comparisons.fit.fit_record import FitRecord
from reports.run.fit_files import Cells, described, three_decimals, value_of
from reports.terminal import tables


def page(records: Sequence[FitRecord]) -> Iterator[str]:
    """Yield the lines of a Markdown page: departures of scenes before and after their fits."""
    yield "# Fits: departure before and after"
    yield ""
    yield f"Fits of `./run fit {' '.join(record.scene for record in records)}`."
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
        best, seconds = record.nearest, sum(record.time.values())
        departures = [best.departure[name] for name in drawn()]
        cells = [f"{d.before:.3f} → {d.after:.3f} ({d.noise_floor:.3f})" for d in departures]
        parts = three_decimals(best.parameter_error), three_decimals(best.loss)
        yield record.scene, best.form, *cells, *parts, f"{seconds:.1f}"


def _material_rows(records: Sequence[FitRecord]) -> Iterator[Cells]:
    names = ("k_a", "k_d", "k_s", "n")
    yield "scene", "form", *names, "reference"
    for record in records:
        for fit in record.fits:
            for material in fit.materials:
                found = {p.name: f"{p.paired:.3g} → {value_of(p)}" for p in material.parameters}
                reference = described(material.reference or {"plugin": ""})
                yield record.scene, fit.form, *(found.get(name, "") for name in names), reference
