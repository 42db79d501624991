"""The tables of ``fotismos cost`` on a terminal."""

from reports.terminal.tables import printed, ruled


def lines(record):
    """Yield the lines of a study: rungs, equal time, equal error, prices, and parts."""
    reference = record.reference
    yield (
        f"{record.scene}, {record.resolution[0]}x{record.resolution[1]}, {record.rounds} rounds"
        f" on {record.machine.cores} cores of {record.machine.processor}"
    )
    yield (
        f"reference: {reference.integrator}, {reference.spp} samples a pixel; its noise alone"
        f" gives ΔE2000 = {reference.noise_floor:.3g}"
    )
    yield from _section("Error and time of each method", _rungs(record))
    yield from _section("Best within a time", _equal_time(record))
    yield from _section("Time to reach an error (mean ΔE2000)", _equal_error(record))
    if record.prices.effects:
        yield from _section("Price of an effect", _prices(record))
        yield "removed: Shapley value, the mean over all orders of adding the effects; the sum is"
        yield f"the departure, ΔE2000 = {record.prices.departure:.4g}."
        yield "alone, last: added first, added last."
        yield noise(record)
    yield from _section("Parts of the departure, linear", _parts(record))


def noise(record):
    """Say how much of the prices is noise."""
    floor, count = record.prices.floor, len(record.prices.effects)
    return (
        f"Noise alone gives ΔE2000 = {floor:.2g}. It is charged to whichever effect comes last:"
        f" {floor:.2g} of what each removes last, about {floor / count:.2g} of its price."
    )


def _rungs(record):
    table = ruled("method", "samples", "median", "interval", "first run", "mean ΔE2000", "RMSE", "")
    for point in record.points:
        seconds = point.seconds
        error = f"{point.error:.3f} ± {point.error_stderr:.3f}"
        table.add_row(
            _all_names(record, point.rung),
            f"{point.spp}",
            _time(seconds.median),
            f"{_time(seconds.low)} to {_time(seconds.high)}",
            _time(point.first_s),
            error,
            f"{max(point.mse, 0) ** 0.5:.2g}",
            "front" if point.pareto else "",
        )
    return table


def _equal_time(record):
    table = ruled("within", "method", "samples", "mean ΔE2000", "takes")
    for row in record.equal_time:
        best = row.best
        if best is None:
            table.add_row(_time(row.seconds), "none is as fast", "", "", "")
        else:
            table.add_row(
                _time(row.seconds),
                best.method,
                f"{best.spp}",
                f"{best.error:.3f}",
                _time(best.seconds),
            )
    return table


def _equal_error(record):
    errors = list(dict.fromkeys(row.error for row in record.equal_error))
    table = ruled("method", *(f"{error:g}" for error in errors))
    for method in dict.fromkeys(row.method for row in record.equal_error):
        cells = [
            "not reached"
            if row.seconds is None
            else f"{'at most ' if row.at_most else ''}{_time(row.seconds)}"
            for row in record.equal_error
            if row.method == method
        ]
        table.add_row(method, *cells)
    return table


def _prices(record):
    table = ruled("effect", "removed", "95 % interval", "alone", "last", "adds", "95 % interval")
    for price in record.prices.effects:
        removes, adds = price.removes, price.adds_s
        table.add_row(
            price.effect,
            f"{removes.value:.3f}",
            f"{removes.low:.3f} to {removes.high:.3f}",
            f"{price.alone:.3f}",
            f"{price.last:.3f}",
            _time(adds.value),
            f"{_time(adds.low)} to {_time(adds.high)}",
        )
    return table


def _parts(record):
    table = ruled("part", "mean", "standard error", "RMS", "mean ΔE2000")
    for part in (*record.split.parts, record.split.departure):
        table.add_row(
            part.name,
            f"{part.mean:+.3g}",
            f"{part.mean_stderr:.1g}",
            f"{part.rms:.3g}",
            f"{part.dE2000:.3g}",
        )
    return table


def _all_names(record, name):
    """Return a rung's name, with those of the methods that the scene cannot tell from it."""
    (names,) = [rung.names for rung in record.rungs if rung.name == name]
    others = ", ".join(other for other in names if other != name)
    return f"{name} (= {others})" if others else name


def _time(seconds):
    return f"{seconds:.3g} s" if abs(seconds) >= 1 else f"{seconds * 1e3:.3g} ms"


def _section(title, table):
    yield ""
    yield title
    yield from printed(table)
