"""Sentences on studies of cost, on fits, audits, plans and checks, for the terminal and all pages.

Those on comparisons are in :mod:`fotismos.reports.verdict`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from fotismos.comparisons.departure.criterion import TOLERANCE, decide
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.ladder.front import beats, is_below
from fotismos.reports import verdict
from fotismos.reports.glossary import meanings
from fotismos.reports.terminal.words import (
    difference,
    given_time,
    number,
    parameter,
    percent,
)

if TYPE_CHECKING:  # few commands need all
    from fotismos.comparisons.audit.checks import Audit
    from fotismos.comparisons.records.comparison import ComparisonRecord
    from fotismos.comparisons.records.cost import Choice, Cost
    from fotismos.comparisons.records.engine import Engine, EngineCost, EngineSetting
    from fotismos.comparisons.records.fit import FitRecord

# --- What accuracy costs ---------------------------------------------------------------------


def answer(record: Cost) -> str:
    """Return the cheapest method that looks right, at the size that was asked for."""
    return verdict.answer(
        record.points,
        textbook=record.methods[0].name,
        size=record.at or record.resolution,
        stopped=record.stopped,
    )


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


def left_out(record: Cost) -> Iterator[str]:
    """Yield a line for each reason why methods were left out."""
    names: dict[str, list[str]] = {}
    for name, reason in record.left_out.items():
        names.setdefault(reason, []).append(name)
    return (f"Left out: {', '.join(named)}, {reason}" for reason, named in names.items())


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
    renderer = whole.renderer_s.value / kernel
    return (
        f"A sample with all effects takes {number(whole.plan_s.value / kernel)} times as long as"
        f" the kernel's: the effects add {number(added / kernel)} times the kernel's time, and"
        f" Mitsuba's integrator in place of the kernel {'adds' if renderer > 0 else 'saves'}"
        f" {number(abs(renderer))} times."
    )


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
    """Yield the cheapest method that passes, what is too close to call, and what it is."""
    yield verdict.answer(
        choice.points,
        textbook=choice.textbook,
        size=choice.resolution,
        tolerance=choice.within,
        stopped=choice.stopped,
    )
    if choice.measured != choice.resolution:
        yield f"Errors are measured at {verdict.sized(choice.measured)}."
    if choice.chosen is None:
        return
    if choice.chosen.ties:
        yield f"Too close to call: {', '.join(choice.chosen.ties)}."
    yield from explained([choice.chosen.method])


def explained(methods: Iterable[str]) -> Iterator[str]:
    """Yield what methods are, if the glossary says it, each meaning once."""
    known = meanings()
    named: dict[str, list[str]] = {}
    for method in methods:
        if method in known:
            named.setdefault(known[method], []).append(method)
    return (f"{', '.join(names)}: {meaning}" for meaning, names in named.items())


# --- Fits, audits and plans -------------------------------------------------------------------


def of_fit(record: FitRecord) -> str:
    """Return how much of the error that was minimised better parameters remove."""
    best = record.nearest
    if best.departure[LEADING.name].before <= verdict.EXACT:
        return f"{record.scene}: the paired parameters show no visible difference"
    removed = percent(best.parameter_error / (best.loss + best.parameter_error))
    return f"{record.scene}: the best parameters remove {removed} of the error"


def judgement_of_fit(record: FitRecord) -> str:
    """Return whether the paired and the fitted parameters pass the criterion."""
    before, after = record.nearest.differ
    paired = f"{percent(before.value)} ({decide([before])})"
    fitted = f"{percent(after.value)} ({decide([after])})"
    best = record.nearest
    left = f"{difference(best.left.low)} to {difference(best.left.high)}"
    model = {
        "wrong": f"The model is wrong: mean {LEADING.label} {left} is left beyond noise.",
        "right within noise": f"The model is right within noise: mean {LEADING.label} {left} is"
        " left.",
        "undecided": f"Noise hides whether the model is right: mean {LEADING.label} {left} is left."
        " More samples decide.",
    }
    return (
        f"{model[best.judgement]} At most 5 % of the pixels may differ by more than {LEADING.label}"
        f" {TOLERANCE:g}: paired {paired}, fitted {fitted}."
    )


def of_audit(record: Audit) -> str:
    """Return the subject with its parameters, and which checks failed."""
    from fotismos.heuristic.heuristics import in_file  # loaded late: it loads Mitsuba

    name = record.subject
    if located := in_file(name):
        file = Path(located[0]).name
        name = f"{located[1]} ({file})" if located[1] else file
    title = ", ".join([name, *(f"{key} {value}" for key, value in record.parameters.items())])
    failed = [check.name for check in record.checks if check.verdict == "does not hold"]
    if not failed:
        return f"{title}: all checks hold"
    return f"{title}: {', '.join(failed)} {'does' if len(failed) == 1 else 'do'} not hold"


def price_lines(record: ComparisonRecord, within: float) -> Iterator[str]:
    """Yield whether a scene passes, what makes it look right, and what its plan leaves out."""
    outcome = {"pass": "passes", "fail": "fails"}.get(verdict.decision(record, within))
    judged = verdict.judged(record).subject
    what = f"{judged} {outcome or 'is undecided'} at {LEADING.label} {parameter(within)}"
    size = verdict.sized(record.resolution)
    yield f"At {size}: {what}. {verdict.sentence(record, threshold=within)}"
    yield from record.mistakes
    if saving := verdict.saving(record):
        yield saving
