"""The page of fits: departures of scenes before and after, and their parameters."""

from collections.abc import Iterator, Sequence

from comparisons.departure.metrics import LEADING
from comparisons.fit.fit_record import FitRecord, FittedParameter
from reports.run.fit_files import Cells
from reports.terminal import tables

NAMES = "k_a", "k_d", "k_s", "n"


def page(records: Sequence[FitRecord]) -> Iterator[str]:
    """Yield the lines of a Markdown page: departures of scenes before and after their fits."""
    yield "# Fits: departure before and after"
    yield ""
    yield (
        "`./run fit` on the figures of chapter 8: the mean ΔE2000 and the parameters, as paired and"
        " with the best form of the lobe. *Parameter* and *model error* are the parts of the"
        " minimised loss that the best parameters remove and leave. A dash: the image does not"
        " determine the parameter."
    )
    yield ""
    yield from tables.markdown(_rows(records), right=2)


def _rows(records: Sequence[FitRecord]) -> Iterator[Cells]:
    yield "scene", "form", LEADING.label, "parameter error", "model error", *NAMES
    for record in records:
        best = record.nearest
        departure = best.departure[LEADING.name]
        errors = departure.before, departure.after, best.parameter_error, best.loss
        before, after, *parts = (f"{each:.2f}" for each in errors)
        cells = {p.name: _change(p) for each in best.materials for p in each.parameters}
        found = (cells.get(name, "") for name in NAMES)
        yield record.scene, best.form, f"{before}→{after}", *parts, *found


def _change(parameter: FittedParameter) -> str:
    fitted = "–" if parameter.fitted is None else f"{parameter.fitted:.3g}"
    return f"{parameter.paired:.3g}→{fitted}"
