"""What a run of comparisons prints, and its tables as CSV."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.comparison import (
    ComparisonRecord,
    NoiseTarget,
)
from fotismos.reference.pairing.pairing_record import Pairing
from fotismos.reference.planning.plan_record import Plan
from fotismos.reference.records import plain
from fotismos.reports import verdict
from fotismos.reports.files import results
from fotismos.reports.terminal.table import Column, Table, comma_separated, printed, room
from fotismos.reports.terminal.words import difference, number, percent, seconds

if TYPE_CHECKING:  # only checks load it
    from fotismos.comparisons.records.check import CheckRecord, Move

SHOWN = 12
"""Quantities of a check that are listed; all are in the record."""


#: Fields of the shapes and materials in ``carriers.csv``.
SHARES = ("name", "material", "pixels", "share", "mean_dE2000", "effect")


def write(folder: Path, records: Sequence[ComparisonRecord]) -> None:
    """Write a run's ``metrics.csv`` and ``carriers.csv`` to a folder of ours."""
    results.write(folder / "metrics.csv", metrics_csv(records))
    results.write(folder / "carriers.csv", comma_separated(_shares(records)))


def metrics_csv(records: Iterable[ComparisonRecord]) -> str:
    """Return a line for each scene and metric, with every number of the record in full.

    Columns are named as in ``comparison.json``; the shape's begin with ``after_exposure.``.
    """
    rows = [
        {"scene": record.scene, "metric": name}
        | dict(_flat(plain(summary)))
        | {"significant": record.significant.fraction}
        for record in records
        for name, summary in record.metrics.items()
    ]
    headings = list(dict.fromkeys(key for row in rows for key in row))
    return comma_separated(
        Table.of([headings, *([row.get(key, "") for key in headings] for row in rows)])
    )


def _flat(record: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in record.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        # A list of shares becomes three columns for each threshold.
        elif key == "visible":
            for share in value:
                name = f"visible.{share['threshold']:g}"
                yield name, share["value"]
                yield from ((f"{name}.{end}", share[end]) for end in ("low", "high"))
        else:
            yield prefix + key, value


# --- Lines on a run ----------------------------------------------------------------------------


def summary(records: Sequence[ComparisonRecord], threshold: float = TOLERANCE) -> Iterator[str]:
    """Yield a line for each scene, worst first, and what is special about single ones."""
    said = []
    for record in records:
        of_scene = f"{record.scene}: " if len(records) > 1 else ""
        said += [f"{of_scene}{sentence}" for sentence in verdict.given_pictures(record)]
    yield from said and (*said, "")
    yield from printed(scenes(records, threshold), room())
    decisions = {verdict.decision(record, threshold) for record in records}
    doubt = "; ?: undecided" if "undecided" in decisions else ""
    yield f"differs visibly: above {LEADING.label} {threshold:g}{doubt}; mean: {LEADING.label}"
    if any(verdict.samples(record, threshold) for record in records):
        yield "samples, time: of a physical picture that looks right"
    # What is special about single scenes.
    for record in records:
        if record.caution and len(records) > 1:
            yield f"{record.scene}: {record.caution}"
        if record.shader:
            line = f"{record.scene}: shading {record.shader}"
            if record.textbook is not None:
                own = number(record.metrics[LEADING.name].mean)
                line += f" {own}, Phong {number(record.textbook)} (mean {LEADING.label})"
            yield line
            yield from (*record.mistakes, *record.broken_laws)
        if record.noise_target:
            yield _noise(record, record.noise_target)
        if count := len(record.warnings):
            noun = "warning" if count == 1 else "warnings"
            yield f"{record.scene}: {count} {noun}, which -v and the page show"
        guard = record.plan and record.plan.guard
        if guard and guard.state == "disagreed":
            yield (
                f"{record.scene}: a probe disagreed with the plan by {guard.departure:+.1%} of the"
                " light, so everything was simulated. Please report this scene."
            )


def line_of_pictures(record: ComparisonRecord, threshold: float, bound: float) -> str:
    """Return the line for scripts on two pictures: share, mean and decision, with tabs between.

    The share of pixels that differ by more than a threshold is 0 to 1, and the decision is whether
    it is at most ``bound``.
    """
    mean = record.metrics[LEADING.name].mean
    decision = verdict.decision(record, threshold, bound)
    return f"{verdict.share(record, threshold).value:.6g}\t{mean:.6g}\t{decision}"


CELLS: dict[str, Callable[[ComparisonRecord, float], str]] = {
    "because of": verdict.because,
    "needs": verdict.needs,
    "samples": verdict.samples,
    "time": verdict.time,
}
"""What the table of scenes says at a threshold, by its headings."""


def scenes(records: Sequence[ComparisonRecord], threshold: float = TOLERANCE) -> Table:
    """Return the table of scenes, worst first: how far they are, why, and what they take.

    It is the same on a terminal and on a page.
    """

    def at(heading: str) -> Callable[[ComparisonRecord], str]:
        return lambda record: CELLS[heading](record, threshold)

    columns = (
        Column("scene", "scene", fold=24),
        Column("differs visibly", partial(_differs, threshold), percent, is_right=True),
        Column("mean", lambda r: r.metrics[LEADING.name].mean, difference, is_right=True, rank=1),
        Column("because of", at("because of"), rank=2, fold=24),
        Column("needs", at("needs"), rank=5, fold=24),
        Column("samples", at("samples"), is_right=True, rank=3),
        Column("time", at("time"), is_right=True, rank=4),
    )
    return Table(columns, sorted(records, key=partial(extent, threshold=threshold), reverse=True))


def extent(record: ComparisonRecord, threshold: float = TOLERANCE) -> tuple[float, float]:
    """Return by what scenes are ordered: the share of pixels that differ, then the mean error."""
    return verdict.share(record, threshold).value, record.metrics[LEADING.name].mean


def _differs(threshold: float, record: ComparisonRecord) -> tuple[Any, ...]:
    """Return the share of the pixels that differ visibly, with a mark if it is undecided."""
    is_undecided = verdict.decision(record, threshold) == "undecided"
    return "? " if is_undecided else "", verdict.share(record, threshold).value


def details(record: ComparisonRecord) -> Iterator[str]:
    """Yield the verbose lines of a scene: simulation, pairing, losses, warnings, times."""
    yield f"{record.scene}:{_simulation(record.plan) if record.plan else ''}"
    lead = record.metrics[LEADING.name]
    noise = number(lead.noise_floor) if record.is_noise_known else "not known"
    at_best = f"at the best exposure {number(lead.after_exposure.mean)}"
    yield f"  mean {LEADING.label} {number(lead.mean)}, noise {noise}, {at_best}"
    if record.price:
        ratio = record.price.ratio
        times = f"{number(ratio.value)} times the textbook's" if ratio else record.price.reason
        yield f"  time of a physical sample: {times}"
    if record.pairing:
        yield from _pairing(record.pairing)
    for loss in record.unrepresentable:
        yield f"  lost: {loss.name} ({loss.plugin}): {loss.lost}; {loss.nearest}"
    for setting in record.overridden:
        yield f"  not used: {setting.what} {setting.given}, but {setting.used}"
    for warning in record.warnings:
        yield f"  warning: {warning}"
    if compared := record.colour_science:
        apart = ", ".join(f"{name} {most:.1e}" for name, most in compared.largest.items())
        yield f"  largest deviations from colour-science, at {compared.pixels} pixels: {apart}"
    stages = record.time.stages
    yield "  " + ", ".join(f"{name} {seconds(value)}" for name, value in stages.items())


def _simulation(plan: Plan) -> str:
    samples = f"{plan.spp} samples per pixel in {plan.passes} passes"
    return f" {plan.simulation}, {samples}, {plan.sampler}"


def _pairing(pairing: Pairing) -> Iterator[str]:
    for light in pairing.emitters:
        note = f" ({light.note})" if light.note else ""
        yield f"  {light.name}: {light.given} as {light.derived}{note}"
    for material in pairing.bsdfs:
        if material.note:
            yield f"  {material.name}: {material.given} as {material.derived} ({material.note})"
    for miss in pairing.misses:
        yield f"  missed: {miss.what}, {miss.wanted:.3g} requested, {miss.reached:.3g} reached"


def _noise(record: ComparisonRecord, stop: NoiseTarget) -> str:
    """Return the noise that was reached, and what stopped the run."""
    asked = f"target {stop.target:g}"
    if stop.stopped_by == "samples":
        asked += f" not reached: stopped by the limit of {stop.limit_spp} samples per pixel"
    # A reference that is a picture has no samples.
    after = f" after {record.plan.spp} samples per pixel" if record.plan else ""
    noise = f"95 % of pixels have noise under {LEADING.label} = {stop.reached:.3g}"
    return f"{record.scene}: {noise}{after} ({asked})"


def _shares(records: Iterable[ComparisonRecord]) -> Table:
    """Return the table of shapes and materials by their share of the error."""
    rows: list[list[Any]] = [["scene", "kind", *SHARES]]
    for record in records:
        for kind, carriers in (("shape", record.objects), ("material", record.materials)):
            for carrier in carriers:
                values = [getattr(carrier, name) for name in SHARES]
                texts = ["" if value is None else value for value in values]
                rows.append([record.scene, kind, *texts])
    return Table.of(rows)


# --- What moved since a baseline ---------------------------------------------------------------


def moved(made: CheckRecord) -> Table:
    """Return the table of what moved most: by how much, from, to, and how certain that is."""
    columns = (
        Column("what moved", "name"),
        Column("change", "change", is_right=True),
        Column("baseline", lambda move: f"{move.before:.6g}"),
        Column("now", "after", "{:.6g}".format, is_right=True),
        Column("standard errors", certainty, "{:+.1f}".format, is_right=True),
        Column("p", "p_corrected", "{:.1g}".format, is_right=True),
    )
    return Table(columns, (made.moved or ())[:SHOWN])


def certainty(move: Move) -> float | str:
    """Return by how many standard errors a quantity moved."""
    return "no noise" if move.standard_errors is None else move.standard_errors
