"""The tables of ``fotismos cost``, and its lines on a terminal."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, Any

from fotismos.comparisons.departure.criterion import TOLERANCE, share_above
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.ladder.front import cheapest
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
    stated,
    together,
)
from fotismos.reports.terminal.table import Column, Piece, Table, printed
from fotismos.reports.terminal.words import given_time, number, parameter, percent, seconds
from fotismos.reports.verdict import sized

if TYPE_CHECKING:
    from fotismos.comparisons.records.cost import Cost, EffectCost, Point, TimedMethod
    from fotismos.comparisons.records.departure import VisibleShare
    from fotismos.comparisons.records.engine import Engine, EngineCost, EngineSetting, FrontPoint
    from fotismos.reference.records import Interval


def lines(record: Cost) -> Iterator[str]:
    """Yield the lines of a study: methods, points, attribution, the answer."""
    reference = record.reference
    size = sized(record.resolution)
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
    # The answer stands last, where it is seen.
    yield ""
    if record.engine:
        yield from judgements(record.engine)
    yield answer(record)


def lines_of_pictures(record: EngineCost, within: float) -> Iterator[str]:
    """Yield the lines of settings without a scene; pixels differ visibly above a ΔE2000."""
    yield f"{record.scene}, {sized(record.resolution)}: {reference_of(record)}"
    yield from _pictures(record.engine, within=within)
    yield ""
    yield from judgements(record.engine)
    yield answer_of_pictures(record, within)


def times(record: Cost) -> Table:
    """Return the time of each method."""
    columns = (
        Column("method", _called),
        Column("x kernel", "ratio.value", "{:.2f}".format),
        Column("interval", "ratio", "{:.2f}".format),
        Column("per sample", "per_sample_s.value", seconds),
        Column("overhead", "overhead_s.value", seconds),
        Column("first image", _first, seconds, detail="(preparing)"),
    )
    return Table(columns, record.methods)


def _called(method: TimedMethod) -> str:
    others = ", ".join(other for other in method.names if other != method.name)
    return f"{method.name} (= {others})" if others else method.name


def _first(method: TimedMethod) -> tuple[Any, ...]:
    return method.first_s, (" (", method.prepare_s, ")") if method.prepare_s else ""


def points(record: Cost) -> Table:
    """Return error and time of one image by each method, with each number of samples."""
    best = cheapest(record.points, TOLERANCE)

    def notes(point: Point) -> str:
        is_cheapest = best and (point.method, point.spp) == (best.method, best.spp)
        more = ", cheapest that looks right" if is_cheapest else ""
        return f"{_front(point) if point.front else ''}{more}".removeprefix(", ")

    where = f"at {sized(record.at)}" if record.at else ""
    columns = (
        Column("method", "method"),
        Column("samples", "spp", str),
        Column("time", "seconds.value", short_time, detail=where),
        Column("interval", "seconds", short_time),
        Column(f"mean {LEADING.label}", lambda point: _spread(point.error, 3), "{:.3f}".format),
        Column("passes at", lambda point: _spread(point.tolerance, 2), "{:.2f}".format),
        Column("front", notes),
    )
    return Table(columns, record.points)


def _spread(error: Interval, digits: int) -> tuple[float, str, float] | float:
    """Return an error and half of its interval, unless it has no digit that is printed."""
    half = error.high - error.value
    return (error.value, " ± ", half) if half >= 0.5 * 10.0**-digits else error.value


def _front(point: FrontPoint) -> str:
    """Return whether a point is on the front, and with which others."""
    close = f"too close to call: {', '.join(point.ties)}" if point.ties else ""
    return ", ".join(filter(None, ("front" if point.front else "", close)))


def settings(engine: Engine, within: float = TOLERANCE) -> Table:
    """Return the settings of another renderer; pixels differ visibly above a ΔE2000."""

    def share(setting: EngineSetting) -> VisibleShare:
        return share_above(setting.visible, within)

    def ends(setting: EngineSetting) -> Any:
        # The sign follows the other end.
        low = Piece(share(setting).low, number(100 * share(setting).low))
        return (low, " to ", share(setting).high) if setting.has_noise else "unknown"

    columns = [
        Column("setting", "method"),
        Column("files", "picture.repeats", str),
        Column("time", "seconds.value", given_time),
        Column(f"mean {LEADING.label}", "error.value", number),
        Column(
            "95 % interval",
            lambda setting: setting.error if setting.has_noise else "unknown",
            number,
        ),
        Column("above", lambda setting: share(setting).value, percent, detail=f"{within:g}"),
        Column("95 % interval", ends, percent),
        Column(
            "passes at",
            lambda setting: "none" if setting.passes_at is None else setting.passes_at,
            parameter,
        ),
        Column("front", _front),
    ]
    if engine.kernel_s:
        columns.insert(3, Column("x kernel there", "ratio", number))
    return Table(columns, engine.settings)


def attribution(record: Cost, named: Callable[[str], str] = str) -> Table:
    """Return what each effect removes and adds; ``named`` says how to call it."""
    whole = record.attribution

    def added(effect: EffectCost) -> float | str:
        # An interval with 0 in it leaves even the sign open.
        is_open = effect.adds_s.low <= 0 <= effect.adds_s.high
        return "no measurable time" if is_open else effect.adds_s.value

    columns = (
        Column("effect", lambda effect: named(effect.effect)),
        Column("removed", "removes.value", "{:.3f}".format),
        Column("95 % interval", "removes", "{:.3f}".format),
        Column("alone", "alone", "{:.3f}".format),
        Column("last", "last", "{:.3f}".format),
        Column(
            "adds", added, short_time, detail=f"at {sized(whole.resolution)}, {whole.spp} samples"
        ),
        Column("95 % interval", "adds_s", short_time),
    )
    return Table(columns, whole.effects)


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
