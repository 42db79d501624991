"""The tables of ``fotismos cost`` on a terminal, and the sentence of ``fotismos plan --within``."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeAlias

from fotismos.comparisons.cost.front import beats, is_below, reach, sufficient
from fotismos.comparisons.departure.criterion import TOLERANCE, decide, share_above
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.records.engine import Reach
from fotismos.reports.glossary import meanings
from fotismos.reports.terminal.tables import printed
from fotismos.reports.terminal.words import given_time, number, parameter, percent, seconds

if TYPE_CHECKING:
    from fotismos.comparisons.records.cost import Choice, Cost, Point
    from fotismos.comparisons.records.engine import Engine, EngineCost, EngineSetting
    from fotismos.reference.records import Interval

Rows: TypeAlias = Iterator[Sequence[str]]

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
    yield from _section("Time of each method: overhead + samples x time per sample", _times(record))
    bent = [method.name for method in record.methods if abs(method.bend) > BENT]
    if bent:
        yield (
            f"Time per sample is unsteady in {', '.join(bent)}, as on a busy machine: predicted"
            " times are rough."
        )
    # The names of the others say what they are.
    yield from _explained(method.name for method in record.methods if method.family == "physical")
    yield from left_out(record)
    if record.engine:
        yield from _pictures(record.engine, OWN_FRONT)
    # Errors, and what each effect contributes.
    yield from _section(f"Error and time of one image at {size}", _points(record.points))
    if record.attribution.effects:
        yield from _section("What each effect removes and adds", _attribution(record))
        measured = sized(record.attribution.size)
        yield f"removed, at {measured}: Shapley value, the mean over all orders of adding effects"
        yield "alone, last: added first, added last"
        yield together(record)
        yield closure(record)
    # Another size, if one was requested.
    if record.at:
        title = f"Predicted times at {sized(record.at)}; errors are not predicted"
        yield from _section(title, _predicted(record))
    if record.measured:
        yield from _section("Predicted and measured there, fewest samples", _off(record))


def lines_of_pictures(record: EngineCost, within: float) -> Iterator[str]:
    """Yield the lines of settings without a scene; pixels differ visibly above a ΔE2000."""
    yield answer_of_pictures(record, within)
    yield from judgements(record.engine)
    yield ""
    yield f"{record.scene}, {sized(record.resolution)}: {reference_of(record)}"
    yield from _pictures(record.engine, within=within)


def answer_of_pictures(record: EngineCost, within: float) -> str:
    """Return the fastest setting that looks right, and what is odd about the reference."""
    settings = record.engine.settings
    passing = [one for one in settings if decide(one.visible, within) == "pass"]
    if passing:
        best = min(passing, key=lambda one: (one.seconds.value, one.error.value))
        found = f"Fastest that looks right: {best.method}, {given_time(best.seconds.value)}"
    else:
        found = "No setting is sure to look right"
    limit = f"at most 5 % of the pixels exceed {LEADING.label} {parameter(within)}"
    return " ".join([f"{found} ({limit}).", *record.warnings])


def reference_of(record: EngineCost) -> str:
    """Return what a reference is made of, and its noise."""
    if record.noise_floor is None:
        return "judged by one reference picture, whose noise is unknown"
    return (
        f"judged by {record.reference_picture.repeats} reference pictures; the noise of their mean"
        f" gives {LEADING.label} {number(record.noise_floor)}"
    )


def left_out(record: Cost) -> Iterator[str]:
    """Yield a line for each reason why methods were left out."""
    names: dict[str, list[str]] = {}
    for name, reason in record.left_out.items():
        names.setdefault(reason, []).append(name)
    return (f"Left out: {', '.join(named)}, {reason}" for reason, named in names.items())


def sized(resolution: tuple[int, int]) -> str:
    """Return a size as options have it."""
    return "x".join(map(str, resolution))


def busy(record: Cost) -> str:
    """Return what a busy machine means for the times of a study."""
    return (
        f"The machine was busy: samples got {record.processor_share:.0%} of the processor time of"
        f" {record.threads} threads. Seconds are too long; their ratios hold."
    )


def together(record: Cost) -> str:
    """Return the sum of what the effects add, in times of the kernel."""
    whole = record.attribution
    kernel = whole.kernel_s.value
    added = sum(effect.adds_s.value for effect in whole.effects)
    return (
        f"A sample with all effects takes {number(whole.plan_s.value / kernel)} times as long as"
        f" the kernel's: 1, {number(added / kernel)} for the effects, and"
        f" {number(whole.renderer_s.value / kernel)} for Mitsuba's integrator in place of the"
        " kernel."
    )


def answer(record: Cost) -> str:
    """Return the cheapest method that looks right, at the size that was asked for.

    If none does, whether more samples would.
    """
    points = record.predicted or record.points
    size = sized(record.resolution)
    # Times can be predicted for another size, and errors cannot.
    at = f" at {sized(record.at)}" if record.at and record.predicted else ""
    best = sufficient(points, TOLERANCE)
    if best is None:
        advice = beyond(reach(points, TOLERANCE))
        return f"No measured method looks right at {size}. {advice}"
    time = seconds(best.seconds.value)
    method = f"{best.method} with {best.spp} samples"
    sentence = f"Cheapest that looks right at {size}: {method}, {time}{at}"
    # The ladder begins with the textbook kernel.
    kernel = next(point for point in points if point.method == record.methods[0].name)
    if kernel.method == best.method:
        return f"{sentence}."
    outcome = "looks right, too" if kernel.tolerance.high <= TOLERANCE else "fails"
    return f"{sentence}; the textbook kernel takes {seconds(kernel.seconds.value)} and {outcome}."


def judgements(engine: Engine) -> Iterator[str]:
    """Yield for each setting where it passes, and which other setting does better."""
    return (f"{one.method} {_passing(one)}; {_rivals(one, engine)}." for one in engine.settings)


def _passing(setting: EngineSetting) -> str:
    if setting.passes_at is None:
        most = parameter(setting.visible[-1].threshold)
        return (
            f"does not pass at {LEADING.label} {most}, as 5 % of its pixels exceed"
            f" {number(setting.p95)}"
        )
    return f"passes at {LEADING.label} {parameter(setting.passes_at)}"


def _rivals(setting: EngineSetting, engine: Engine) -> str:
    """Return which given setting is clearly better, at what time."""
    others = [other for other in engine.settings if other is not setting]
    winners = [other for other in others if beats(other, setting)]
    if winners:
        best = min(winners, key=lambda other: other.error.value)
        if not is_below(best.seconds, setting.seconds):
            return f"{best.method} takes as long and is better"
        is_better = is_below(best.error, setting.error)
        return f"{best.method} is faster and {'better' if is_better else 'no worse'}"
    # What is better without beating it takes longer.
    better = [other.seconds.value for other in others if is_below(other.error, setting.error)]
    if not better:
        return "nothing given does better"
    return f"nothing given under {given_time(min(better))} does better"


OWN_FRONT = "; the front is their own"
"""What to add where measured methods have a front, too."""


def stated(engine: Engine) -> str:
    """Return what the times of settings are of."""
    return f"times as given, on {engine.machine}" if engine.machine else "times as given"


def oddities(engine: Engine) -> list[str]:
    """Return what is odd about the pictures and how they were read, each once, with the names."""
    named: dict[str, list[str]] = {}
    for setting in engine.settings:
        found = setting.agreement
        for sentence in (*found.mistakes, *found.odd, *setting.picture.notes):
            named.setdefault(sentence, []).append(setting.method)
    return [f"{', '.join(names)}: {sentence}" for sentence, names in named.items()]


def closure(record: Cost) -> str:
    """Return the sum of the attribution, and whether the rest is more than noise."""
    left = record.closure
    departure = record.attribution.departure
    closes = left.low <= 0
    verdict = "no more than noise" if closes else "more than noise: some effect is missing"
    return (
        f"With all effects simulated, an error of ΔE2000 = {left.value:.2g} is left"
        f" ({left.low:.2g} to {left.high:.2g}; {verdict}). What the effects remove and"
        f" what is left add up to the error of the textbook picture, ΔE2000 = {departure:.4g}."
    )


def choice_lines(choice: Choice) -> Iterator[str]:
    """Yield the method to take, its error and time, and the method that it replaces.

    Then what each method in the sentence is.
    """
    size = sized(choice.resolution)
    within = f"{LEADING.label} {parameter(choice.within)}"
    chosen = choice.chosen
    full = choice.full
    is_smaller = choice.measured != choice.resolution
    measured = f"measured at {sized(choice.measured)}, " if is_smaller else ""
    if chosen is None:
        yield (
            f"At {size} no method passes at {within} with the samples measured here. The nearest is"
            f" {_offer(choice.best, measured)}. {beyond(choice.reach)}"
        )
    elif chosen.method == full.method:
        yield f"At {size}: {_offer(chosen, measured)}. Nothing faster passes at {within}."
    else:
        yield f"At {size}: {_offer(chosen, measured)}, in place of {_offer(full, measured)}."
    if chosen and chosen.ties:
        yield f"Too close to call: {', '.join(chosen.ties)}."
    yield from _explained(dict.fromkeys(((chosen or choice.best).method, full.method)))


def _explained(methods: Iterable[str]) -> Iterator[str]:
    known = meanings()
    return (f"{method}: {known[method]}" for method in methods if method in known)


def beyond(need: Reach | None) -> str:
    """Return what more samples than measured would do at a tolerance that no method passes at."""
    if need is None:
        return "More samples (--spp) decide."
    if need.spp is None:
        return (
            f"More samples cannot help: even without noise, 5 % of the pixels of {need.method}, the"
            f" nearest, exceed {LEADING.label} {number(need.left)}. That may be the noise of the"
            " picture it is compared with; a larger --spp shows it."
        )
    return (
        f"About {need.spp:,} samples per pixel with {need.method} would pass; a larger --spp"
        " measures that."
    )


def _offer(point: Point, measured: str) -> str:
    """Return a method, its time, and the error that 5 % exceed, at the size ``measured``."""
    return (
        f"{point.method} with {point.spp} samples per pixel in {seconds(point.seconds.value)}:"
        f" {measured}5 % of the pixels exceed {LEADING.label} {number(point.tolerance.value)}"
    )


def _times(record: Cost) -> Rows:
    yield "method", "x kernel", "interval", "per sample", "overhead", "first image (preparing)"
    for method in record.methods:
        others = ", ".join(other for other in method.names if other != method.name)
        prepared = f" ({seconds(method.prepare_s)})" if method.prepare_s else ""
        yield (
            f"{method.name} (= {others})" if others else method.name,
            f"{method.ratio.value:.2f}",
            f"{method.ratio.low:.2f} to {method.ratio.high:.2f}",
            seconds(method.per_sample_s.value),
            seconds(method.overhead_s.value),
            f"{seconds(method.first_s)}{prepared}",
        )


def _points(points: Sequence[Point]) -> Rows:
    yield "method", "samples", "time", "interval", "mean ΔE2000", "passes at", "front"
    cheapest = sufficient(points, TOLERANCE)
    for point in points:
        notes = ["front"] if point.front else []
        if point.front and point.ties:
            notes.append(f"too close to call: {', '.join(point.ties)}")
        if cheapest and (point.method, point.spp) == (cheapest.method, cheapest.spp):
            notes.append("cheapest that looks right")
        yield (
            point.method,
            f"{point.spp}",
            *timed(point.seconds),
            f"{point.error.value:.3f} ± {point.error.high - point.error.value:.3f}",
            f"{point.tolerance.value:.2f} ± {point.tolerance.high - point.tolerance.value:.2f}",
            ", ".join(notes),
        )


def _pictures(engine: Engine, more: str = "", within: float = TOLERANCE) -> Iterator[str]:
    """Yield the table of settings, and what is odd about their pictures."""
    title = f"Given pictures: {stated(engine)}{more}"
    yield from _section(title, _settings(engine, within))
    yield from oddities(engine)


def _settings(engine: Engine, within: float) -> Rows:
    ratio = ("x kernel there",) if engine.kernel_s else ()
    above = f"above {within:g}"
    ends = "95 % interval"
    yield "setting", "files", "time", *ratio, "mean ΔE2000", ends, above, ends, "passes at", "front"
    for one in engine.settings:
        share = share_above(one.visible, within)
        notes = ["front"] if one.front else []
        if one.ties:
            notes.append(f"too close to call: {', '.join(one.ties)}")
        yield (
            one.method,
            f"{one.picture.repeats}",
            given_time(one.seconds.value),
            *((number(one.ratio),) if one.ratio else ()),
            number(one.error.value),
            f"{number(one.error.low)} to {number(one.error.high)}" if one.has_noise else "unknown",
            percent(share.value),
            f"{number(100 * share.low)} to {percent(share.high)}" if one.has_noise else "unknown",
            "none" if one.passes_at is None else parameter(one.passes_at),
            ", ".join(notes),
        )


def _predicted(record: Cost) -> Rows:
    yield "method", "samples", "time", "interval"
    for point in record.predicted:
        yield point.method, f"{point.spp}", *timed(point.seconds)


def _off(record: Cost) -> Rows:
    """Yield how far off the predicted times are, and errors at both sizes."""
    at = sized(record.resolution)
    yield "method", "time", "predicted", "off", "mean ΔE2000", f"at {at}"
    forecasts = {(point.method, point.spp): point for point in record.predicted}
    for point in record.measured:
        forecast = forecasts[point.method, point.spp]
        time = point.seconds.value
        yield (
            point.method,
            seconds(time),
            seconds(forecast.seconds.value),
            f"{forecast.seconds.value / time - 1:+.0%}",
            f"{point.error.value:.3f}",
            f"{forecast.error.value:.3f}",
        )


def _attribution(record: Cost) -> Rows:
    whole = record.attribution
    adds = f"adds at {sized(whole.resolution)}, {whole.spp} samples"
    yield "effect", "removed", "95 % interval", "alone", "last", adds, "95 % interval"
    for effect in whole.effects:
        time, interval = timed(effect.adds_s)
        yield (
            effect.effect,
            f"{effect.removes.value:.3f}",
            f"{effect.removes.low:.3f} to {effect.removes.high:.3f}",
            f"{effect.alone:.3f}",
            f"{effect.last:.3f}",
            # An interval with 0 in it leaves even the sign open.
            "no measurable time" if effect.adds_s.low <= 0 <= effect.adds_s.high else time,
            interval,
        )


def timed(time: Interval) -> tuple[str, str]:
    """Return a time, which may be below 0, and its interval."""
    return _seconds(time.value), f"{_seconds(time.low)} to {_seconds(time.high)}"


def _seconds(time: float) -> str:
    return f"{time:.3g} s" if abs(time) >= 1 else f"{time * 1e3:.3g} ms"


def _section(title: str, rows: Rows) -> Iterator[str]:
    yield ""
    yield title
    yield from printed(rows)
