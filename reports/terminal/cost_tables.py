"""The tables of ``fotismos cost`` on a terminal, and the sentence of ``fotismos plan --within``."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, TypeAlias

from comparisons.departure.metrics import METRICS
from reports.glossary import meanings
from reports.terminal.tables import printed
from reports.terminal.words import number, parameter, seconds

if TYPE_CHECKING:
    from comparisons.cost.cost_record import Cost, Measured, Prediction, Reached, Seconds
    from comparisons.cost.front import Choice
    from reference.records import Estimated

Rows: TypeAlias = Iterator[Sequence[str]]

SHOWN_SPP = (1, 4, 16, 64, 256, 1024, 4096)
"""Sample counts whose forecasts are shown, besides the measured ones."""


def lines(record: Cost) -> Iterator[str]:
    """Yield the lines of a study: methods, equal error, attribution, and parts."""
    reference = record.reference
    yield (
        f"{record.scene}, {record.resolution[0]}x{record.resolution[1]}, {record.rounds} rounds"
        f" on {record.machine.cores} cores of {record.machine.processor}"
    )
    yield (
        f"reference: {reference.integrator}, {reference.spp} samples per pixel; its noise alone"
        f" gives ΔE2000 = {reference.noise_floor:.3g}"
    )
    if record.guard and record.guard.state == "disagreed":
        yield "a probe disagreed with the plan, so everything is simulated: please report it"
    yield from _section("Error and time of each method", _methods(record))
    known = meanings()
    for method in record.methods:  # the names of the others say what they are
        if method.family == "physical" and method.name in known:
            yield f"{method.name}: {known[method.name]}"
    for left_out in record.left_out:
        yield f"left out: {left_out.name}: {left_out.reason}"
    yield from _section("Time to reach an error (mean ΔE2000)", _equal_error(record))
    if record.attribution.effects:
        yield from _section("What each effect removes", _attribution(record))
        yield "removed: Shapley value, the mean over all orders of adding the effects"
        yield "alone, last: added first, added last"
        yield closure(record)
    if len(record.objects) > 1 and record.attribution.effects:
        yield from _section("Mean ΔE2000 removed on each shape", _objects(record))
    if record.prediction:
        yield from _predicted(record.prediction)


def closure(record: Cost) -> str:
    """Return the sum of the attribution, and whether the rest is more than noise."""
    left, departure = record.closure, record.attribution.departure
    closes = left.low <= 0
    verdict = "no more than noise" if closes else "more than noise: some effect is missing"
    return (
        f"With all effects simulated ΔE2000 = {left.mean:.2g} is left ({left.low:.2g} to"
        f" {left.high:.2g}; {verdict}). What the effects remove and what is left add up to the"
        f" departure, ΔE2000 = {departure:.4g}."
    )


def choice_lines(choice: Choice) -> Iterator[str]:
    """Yield the method to take, its error and time, and the method that it replaces.

    Then what each method in the sentence is.
    """
    label = METRICS[choice.metric].label
    size = "x".join(map(str, choice.resolution))
    within = parameter(choice.within)
    chosen, full = choice.chosen, choice.full
    if chosen is None:
        yield (
            f"At {size} no measured method stays within {label} {within}. The nearest is"
            f" {_offer(choice.best, label)}. Give more samples with --spp, or a larger tolerance."
        )
    elif chosen.method == full.method:
        yield f"At {size}: {_offer(chosen, label)}. Nothing cheaper stays within {within}."
    else:
        yield f"At {size}: {_offer(chosen, label)}, in place of {_offer(full, label)}."
    known = meanings()
    for method in dict.fromkeys(((chosen or choice.best).method, full.method)):
        if method in known:
            yield f"{method}: {known[method]}"


def _offer(point: Measured, label: str) -> str:
    once = f" and once {seconds(point.prepare_s)} to prepare" if point.prepare_s else ""
    return (
        f"{point.method} with {point.spp} samples per pixel: {label} {number(point.error.mean)} at"
        f" {seconds(point.seconds.value)}{once}"
    )


def _predicted(prediction: Prediction) -> Iterator[str]:
    width, height = prediction.resolution
    sizes = ", ".join("x".join(map(str, size)) for size in prediction.fitted)
    yield from _section(f"Predicted at {width}x{height}", _forecasts(prediction))
    yield f"{prediction.level:.0%} intervals, from {sizes}. Times are of later frames."
    yield ""
    for row in prediction.cheapest:
        if row.seconds is None:
            yield f"ΔE2000 = {row.error:g}: no method reaches it."
        else:
            time, interval = _timed(row.seconds.value, row.seconds)
            yield f"ΔE2000 = {row.error:g}: {row.method}, {row.spp} samples, {time} ({interval})."


def _forecasts(prediction: Prediction) -> Rows:
    is_measured = any(forecast.measured for forecast in prediction.forecasts)
    measured = ("measured time", "measured error") if is_measured else ()
    yield "method", "samples", "time", "interval", "mean ΔE2000", "interval", *measured
    for row in prediction.forecasts:
        if row.spp in SHOWN_SPP or row.measured:
            point = row.measured
            found = (_time(point.seconds.value), f"{point.error.mean:.3f}") if point else ("", "")
            yield (
                row.method,
                f"{row.spp}",
                *_timed(row.seconds.value, row.seconds),
                f"{row.error.mean:.3f}",
                f"{row.error.low:.3f} to {row.error.high:.3f}",
                *(found if is_measured else ()),
            )


def _methods(record: Cost) -> Rows:
    first = "first run (preparing)"
    yield "method", "samples", "median", "interval", first, "mean ΔE2000", "RMSE", ""
    names = {method.name: method.names for method in record.methods}
    for point in record.points:
        others = ", ".join(other for other in names[point.method] if other != point.method)
        prepared = f" ({_time(point.prepare_s)})" if point.prepare_s else ""
        yield (
            f"{point.method} (= {others})" if others else point.method,
            f"{point.spp}",
            *_timed(point.seconds.value, point.seconds),
            f"{_time(point.first_s)}{prepared}",
            _error(point),
            f"{max(point.mse, 0) ** 0.5:.2g}",
            "front" if point.pareto else "",
        )


def _equal_error(record: Cost) -> Rows:
    aims = record.reached_by(record.equal_error[0].method) if record.equal_error else ()
    yield "method", *(f"{aim.error:g}" for aim in aims)
    for method in dict.fromkeys(row.method for row in record.equal_error):
        yield method, *map(_reached, record.reached_by(method))


def _reached(row: Reached) -> str:
    if row.seconds is None:
        return "not reached"
    time, interval = _timed(row.seconds.value, row.seconds)
    return f"{'at most ' if row.at_most else ''}{time} ({interval})"


def _attribution(record: Cost) -> Rows:
    yield "effect", "removed", "95 % interval", "alone", "last"
    for one in record.attribution.effects:
        yield (
            one.effect,
            f"{one.removes.value:.3f}",
            f"{one.removes.low:.3f} to {one.removes.high:.3f}",
            f"{one.alone:.3f}",
            f"{one.last:.3f}",
        )


def _objects(record: Cost) -> Rows:
    effects = (one.effect for one in record.attribution.effects)
    yield "shape", "of the departure", "mean ΔE2000", *effects
    for row in record.objects:
        removes = (f"{each.value:.3f} ± {each.high - each.value:.3f}" for each in row.removes)
        yield row.name, f"{row.share:.1%}", f"{row.departure:.3f}", *removes


def _time(value: float) -> str:
    return f"{value:.3g} s" if abs(value) >= 1 else f"{value * 1e3:.3g} ms"


def _error(point: Measured) -> str:
    return f"{point.error.mean:.3f} ± {point.error.high - point.error.mean:.3f}"


def _timed(value: float, interval: Seconds | Estimated) -> tuple[str, str]:
    return _time(value), f"{_time(interval.low)} to {_time(interval.high)}"


def _section(title: str, rows: Rows) -> Iterator[str]:
    yield ""
    yield title
    yield from printed(rows)
