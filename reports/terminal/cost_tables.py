"""The tables of ``fotismos cost`` on a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeAlias

from reports.glossary import meanings
from reports.terminal.tables import printed

if TYPE_CHECKING:
    from comparisons.cost.cost_record import (
        AskedPrice,
        Cheapest,
        Cost,
        Estimated,
        Interval,
        Measured,
        Prediction,
        Range,
        Reached,
    )

Rows: TypeAlias = Iterator[Sequence[str]]


def lines(record: Cost) -> Iterator[str]:
    """Yield the lines of a study: rungs, equal time, equal error, prices, and parts."""
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
    yield from _section("Error and time of each method", _rungs(record))
    yield from _meanings(record)
    for method in record.left_out:
        yield f"left out: {method.name}: {method.reason}"
    yield from _section("Best within a time", _equal_time(record))
    yield from _section("Time to reach an error (mean ΔE2000)", _equal_error(record))
    if record.prices.effects:
        yield from _section("Price of an effect", _prices(record))
        yield "removed: Shapley value, the mean over all orders of adding the effects"
        yield "alone, last: added first, added last"
        yield noise(record)
        yield closure(record)
    if len(record.objects) > 1 and record.prices.effects:
        yield from _section("Mean ΔE2000 removed on each shape", _objects(record))
    yield from _section("Parts of the departure, linear", _parts(record))
    if record.prediction:
        yield from predicted(record.prediction)


SHOWN_SPP = (1, 4, 16, 64, 256, 1024, 4096)
"""Sample counts whose forecasts are shown, besides the measured ones."""


def predicted(prediction: Prediction) -> Iterator[str]:
    """Yield the lines of a prediction at a size."""
    width, height = prediction.resolution
    sizes = ", ".join("x".join(map(str, size)) for size in prediction.fitted)
    yield from _section(f"Predicted at {width}x{height}", _forecasts(prediction))
    yield f"{prediction.level:.0%} intervals, from {sizes}. Times are of later frames."
    yield ""
    for row in prediction.cheapest:
        yield _cheapest(row)
    if prediction.prices:
        yield from _section(f"Price of an effect at {width}x{height}", _asked(prediction.prices))


def _forecasts(prediction: Prediction) -> Rows:
    is_measured = any(forecast.measured for forecast in prediction.forecasts)
    measured = ("measured time", "measured error") if is_measured else ()
    yield "method", "samples", "time", "interval", "mean ΔE2000", "interval", *measured
    for row in prediction.forecasts:
        if row.spp in SHOWN_SPP or row.measured:
            found = row.measured
            seen = (_time(found.seconds.median), f"{found.error:.3f}") if found else ("", "")
            yield (
                row.method,
                f"{row.spp}",
                *_timed(row.seconds.value, row.seconds),
                f"{row.error.value:.3f}",
                f"{row.error.low:.3f} to {row.error.high:.3f}",
                *(seen if is_measured else ()),
            )


def _asked(prices: Iterable[AskedPrice]) -> Rows:
    yield "effect", "removed", "interval", "adds", "interval"
    for price in prices:
        removes = price.removes
        interval = f"{removes.low:.3f} to {removes.high:.3f}"
        yield (
            price.effect,
            f"{removes.value:.3f}",
            interval,
            *_timed(price.adds_s.value, price.adds_s),
        )


def _cheapest(row: Cheapest) -> str:
    if row.seconds is None:
        return f"ΔE2000 = {row.error:g}: no method reaches it."
    time, interval = _timed(row.seconds.value, row.seconds)
    return f"ΔE2000 = {row.error:g}: {row.method}, {row.spp} samples, {time} ({interval})."


def noise(record: Cost) -> str:
    """Return the noise that was subtracted from the prices, in a sentence."""
    return f"Noise alone gives ΔE2000 = {record.prices.floor:.2g}; it is subtracted."


def closure(record: Cost) -> str:
    """Return the sum of the prices, and whether the rest is more than noise."""
    left, departure = record.closure, record.prices.departure
    closes = left.low <= 0
    judged = "they close" if closes else "more than noise: some effect has no price"
    return (
        f"With all effects simulated ΔE2000 = {left.mean:.2g} is left ({left.low:.2g} to"
        f" {left.high:.2g}; {judged}). Prices and what is left add up to the departure,"
        f" ΔE2000 = {departure:.4g}."
    )


def _rungs(record: Cost) -> Rows:
    first = "first run (preparing)"
    yield "method", "samples", "median", "interval", first, "mean ΔE2000", "RMSE", ""
    for point in record.points:
        yield (
            _all_names(record, point.rung),
            f"{point.spp}",
            *_timed(point.seconds.median, point.seconds),
            _first(point),
            f"{point.error:.3f} ± {point.error_stderr:.3f}",
            f"{max(point.mse, 0) ** 0.5:.2g}",
            "front" if point.pareto else "",
        )


def _meanings(record: Cost) -> Iterator[str]:
    """Yield what the physical methods leave out; the names of the others say it."""
    known = meanings()
    for rung in record.rungs:
        if rung.family == "physical" and rung.name in known:
            yield f"{rung.name}: {known[rung.name]}"


def _first(point: Measured) -> str:
    prepared = f" ({_time(point.prepare_s)})" if point.prepare_s else ""
    return f"{_time(point.first_s)}{prepared}"


def _equal_time(record: Cost) -> Rows:
    yield "within", "method", "samples", "mean ΔE2000", "takes", "interval"
    for row in record.equal_time:
        best = row.best
        yield (
            _time(row.seconds),
            *(_point(best) if best else ("none is as fast", "", "", "", "")),
        )


def _point(point: Measured) -> tuple[str, ...]:
    error = f"{point.error:.3f} ± {point.error_stderr:.3f}"
    return point.rung, f"{point.spp}", error, *_timed(point.seconds.median, point.seconds)


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


def _prices(record: Cost) -> Rows:
    yield "effect", "removed", "95 % interval", "alone", "last", "adds", "95 % interval"
    for price in record.prices.effects:
        removes = price.removes
        yield (
            price.effect,
            f"{removes.value:.3f}",
            f"{removes.low:.3f} to {removes.high:.3f}",
            f"{price.alone:.3f}",
            f"{price.last:.3f}",
            *_timed(price.adds_s.value, price.adds_s),
        )


def _objects(record: Cost) -> Rows:
    effects = (price.effect for price in record.prices.effects)
    yield "shape", "of the departure", "mean ΔE2000", *effects
    for row in record.objects:
        removes = (f"{each.value:.3f} ± {each.high - each.value:.3f}" for each in row.removes)
        yield row.name, f"{row.share:.1%}", f"{row.departure:.3f}", *removes


def _parts(record: Cost) -> Rows:
    yield "part", "mean", "standard error", "RMS", "mean ΔE2000"
    for part in (*record.split.parts, record.split.departure):
        numbers = f"{part.mean:+.3g}", f"{part.mean_stderr:.1g}", f"{part.rms:.3g}"
        yield part.name, *numbers, f"{part.dE2000:.3g}"


def _all_names(record: Cost, name: str) -> str:
    """Return a rung's name, with the methods that give the same image in this scene."""
    (names,) = [rung.names for rung in record.rungs if rung.name == name]
    others = ", ".join(other for other in names if other != name)
    return f"{name} (= {others})" if others else name


def _time(seconds: float) -> str:
    return f"{seconds:.3g} s" if abs(seconds) >= 1 else f"{seconds * 1e3:.3g} ms"


def _timed(seconds: float, interval: Interval | Range | Estimated) -> tuple[str, str]:
    return _time(seconds), f"{_time(interval.low)} to {_time(interval.high)}"


def _section(title: str, rows: Rows) -> Iterator[str]:
    yield ""
    yield title
    yield from printed(rows)
