"""The tables of ``fotismos cost``, and its lines on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import TYPE_CHECKING

from fotismos.comparisons.cost.front import sufficient
from fotismos.comparisons.departure.criterion import TOLERANCE, share_above
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.reports.sentences import (
    OWN_FRONT,
    answer,
    answer_of_pictures,
    busy,
    closure,
    explained,
    judgements,
    left_out,
    oddities,
    reference_of,
    sized,
    stated,
    together,
)
from fotismos.reports.terminal.table import Column, Piece, Table, printed
from fotismos.reports.terminal.words import given_time, number, parameter, percent, seconds

if TYPE_CHECKING:
    from fotismos.comparisons.cost.cost_record import Cost
    from fotismos.comparisons.cost.engine_record import Engine, EngineCost

BENT = 0.1
"""Share by which a time is off its method's straight line: more is mentioned."""


def lines(record: Cost) -> Iterator[str]:
    """Yield the lines of a study: methods, points, attribution, and what is predicted."""
    reference = record.reference
    size = sized(record.resolution)
    yield answer(record)
    if record.engine:
        yield from judgements(record.engine)
    yield ""
    yield (
        f"{record.scene}, {size}, {record.rounds} rounds with {record.threads} threads on"
        f" {record.machine.processor}"
    )
    if record.is_busy:
        yield busy(record)
    yield (
        f"compared with: {reference.integrator}, {reference.spp} samples per pixel; its noise alone"
        f" gives ΔE2000 = {reference.noise_floor:.3g}"
    )
    if record.guard and record.guard.state == "disagreed":
        yield "a probe disagreed with the plan, so everything is simulated: please report it"
    # Methods with their times, and what is odd or absent among them.
    yield from _section("Time of each method: overhead + samples x time per sample", times(record))
    bent = [method.name for method in record.methods if abs(method.bend) > BENT]
    if bent:
        yield (
            f"Time per sample is unsteady in {', '.join(bent)}, as on a busy machine: predicted"
            " times are rough."
        )
    # The names of the others say what they are.
    yield from explained(method.name for method in record.methods if method.family == "physical")
    yield from left_out(record)
    if record.engine:
        yield from _pictures(record.engine, OWN_FRONT)
    # Errors, and what each effect contributes.
    yield from _section(f"Error and time of one image at {size}", points(record))
    if record.attribution.effects:
        yield from _section("What each effect removes and adds", attribution(record))
        measured = sized(record.attribution.size)
        yield f"removed, at {measured}: Shapley value, the mean over all orders of adding effects"
        yield "alone, last: added first, added last"
        yield together(record)
        yield closure(record)
    # Another size, if one was requested.
    if record.at:
        title = f"Predicted times at {sized(record.at)}; errors are not predicted"
        yield from _section(title, predicted(record))
    if record.measured:
        yield from _section("Predicted and measured there, fewest samples", off(record))


def lines_of_pictures(record: EngineCost, within: float) -> Iterator[str]:
    """Yield the lines of settings without a scene; pixels differ visibly above a ΔE2000."""
    yield answer_of_pictures(record, within)
    yield from judgements(record.engine)
    yield ""
    yield f"{record.scene}, {sized(record.resolution)}: {reference_of(record)}"
    yield from _pictures(record.engine, within=within)


def times(record: Cost) -> Table:
    """Return the time of each method."""
    columns = (
        Column("method"),
        Column("x kernel", "{:.2f}".format),
        Column("interval", "{:.2f}".format),
        Column("per sample", seconds),
        Column("overhead", seconds),
        Column("first image", seconds, "(preparing)"),
    )
    rows = []
    for method in record.methods:
        others = ", ".join(other for other in method.names if other != method.name)
        preparing = (" (", method.prepare_s, ")") if method.prepare_s else ()
        rows.append(
            (
                f"{method.name} (= {others})" if others else method.name,
                method.ratio.value,
                method.ratio,
                method.per_sample_s.value,
                method.overhead_s.value,
                (method.first_s, preparing),
            )
        )
    return Table(columns, rows)


def points(record: Cost) -> Table:
    """Return error and time of one image by each method, with each number of samples."""
    columns = (
        Column("method"),
        Column("samples", str),
        Column("time", short_time),
        Column("interval", short_time),
        Column(f"mean {LEADING.label}", "{:.3f}".format),
        Column("passes at", "{:.2f}".format),
        Column("front"),
    )
    cheapest = sufficient(record.points, TOLERANCE)
    rows = []
    for point in record.points:
        is_cheapest = cheapest and (point.method, point.spp) == (cheapest.method, cheapest.spp)
        rows.append(
            (
                point.method,
                point.spp,
                point.seconds.value,
                point.seconds,
                (point.error.value, " ± ", point.error.high - point.error.value),
                (point.tolerance.value, " ± ", point.tolerance.high - point.tolerance.value),
                _front(
                    point.front,
                    point.ties if point.front else (),
                    "cheapest that looks right" if is_cheapest else "",
                ),
            )
        )
    return Table(columns, rows)


def _front(is_on: bool, ties: Sequence[str], more: str = "") -> str:
    """Return whether a point is on the front, and with which others."""
    close = f"too close to call: {', '.join(ties)}" if ties else ""
    return ", ".join(filter(None, ("front" if is_on else "", close, more)))


def settings(engine: Engine, within: float = TOLERANCE) -> Table:
    """Return the settings of another renderer; pixels differ visibly above a ΔE2000."""
    ratio = [Column("x kernel there", number)] if engine.kernel_s else []
    columns = [
        Column("setting"),
        Column("files", str),
        Column("time", given_time),
        *ratio,
        Column(f"mean {LEADING.label}", number),
        Column("95 % interval", number),
        Column("above", percent, f"{within:g}"),
        Column("95 % interval", percent),
        Column("passes at", parameter),
        Column("front"),
    ]
    rows = []
    for one in engine.settings:
        share = share_above(one.visible, within)
        shown = [one.ratio] if ratio else []
        low = Piece(share.low, number(100 * share.low))  # the sign follows the other end
        rows.append(
            (
                one.method,
                one.picture.repeats,
                one.seconds.value,
                *shown,
                one.error.value,
                one.error if one.has_noise else "unknown",
                share.value,
                (low, " to ", share.high) if one.has_noise else "unknown",
                "none" if one.passes_at is None else one.passes_at,
                _front(one.front, one.ties),
            )
        )
    return Table(columns, rows)


def predicted(record: Cost) -> Table:
    """Return the times that are predicted for another size."""
    columns = (
        Column("method"),
        Column("samples", str),
        Column("time", short_time),
        Column("interval", short_time),
    )
    rows = [
        (point.method, point.spp, point.seconds.value, point.seconds) for point in record.predicted
    ]
    return Table(columns, rows)


def off(record: Cost) -> Table:
    """Return how far off the predicted times are, and errors at both sizes."""
    columns = (
        Column("method"),
        Column("time", seconds),
        Column("predicted", seconds),
        Column("off", "{:+.0%}".format),
        Column(f"mean {LEADING.label}", "{:.3f}".format),
        Column("at", "{:.3f}".format, sized(record.resolution)),
    )
    forecasts = {(point.method, point.spp): point for point in record.predicted}
    rows = []
    for point in record.measured:
        forecast = forecasts[point.method, point.spp]
        time = point.seconds.value
        rows.append(
            (
                point.method,
                time,
                forecast.seconds.value,
                forecast.seconds.value / time - 1,
                point.error.value,
                forecast.error.value,
            )
        )
    return Table(columns, rows)


def attribution(record: Cost, named: Callable[[str], str] = str) -> Table:
    """Return what each effect removes and adds; ``named`` says how to call it."""
    whole = record.attribution
    columns = (
        Column("effect"),
        Column("removed", "{:.3f}".format),
        Column("95 % interval", "{:.3f}".format),
        Column("alone", "{:.3f}".format),
        Column("last", "{:.3f}".format),
        Column("adds", short_time, f"at {sized(whole.resolution)}, {whole.spp} samples"),
        Column("95 % interval", short_time),
    )
    rows = []
    for effect in whole.effects:
        # An interval with 0 in it leaves even the sign open.
        is_open = effect.adds_s.low <= 0 <= effect.adds_s.high
        rows.append(
            (
                named(effect.effect),
                effect.removes.value,
                effect.removes,
                effect.alone,
                effect.last,
                "no measurable time" if is_open else effect.adds_s.value,
                effect.adds_s,
            )
        )
    return Table(columns, rows)


def short_time(time: float) -> str:
    """Return a time, which may be below 0."""
    return f"{time:.3g} s" if abs(time) >= 1 else f"{time * 1e3:.3g} ms"


def _section(title: str, table: Table) -> Iterator[str]:
    yield ""
    yield title
    yield from printed(table)


def _pictures(engine: Engine, more: str = "", within: float = TOLERANCE) -> Iterator[str]:
    """Yield the table of settings, and what is odd about their pictures."""
    title = f"Given pictures: {stated(engine)}{more}"
    yield from _section(title, settings(engine, within))
    yield from oddities(engine)
