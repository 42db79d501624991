"""What a run found, in sentences: how many scenes look right, what is missing, and what is needed.

One quantity decides everything here, see :mod:`fotismos.comparisons.departure.criterion`: the share
of the pixels that differ visibly, by more than a tolerance.
"""

from __future__ import annotations

import shlex
from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import ceil
from pathlib import Path
from statistics import median
from typing import TYPE_CHECKING

from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE, decide, share_above
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.ladder.front import cheapest
from fotismos.comparisons.records.comparison import (
    MOST_SPP,
    TIED,
    ComparisonRecord,
    Price,
    SamplesThatPass,
)
from fotismos.comparisons.records.departure import Verdict, VisibleShare
from fotismos.heuristic import program
from fotismos.reference.planning.effects import EFFECTS, MICROFACETS
from fotismos.reports.terminal.words import number, parameter, percent, seconds

if TYPE_CHECKING:
    from fotismos.comparisons.records.cost import Cost, Point
    from fotismos.reference.rendering.passes import Size

NAMED = 3
"""Number of effects that the sentence on a run names."""

NOISE = 2.0
"""Noise floors by which pixels must pass at the best exposure, where no interval is known."""

EXACT = 0.01
"""ΔE2000: smaller means are rounding, or noise that nobody sees."""

CHOICES = ("--heuristic", "--pairing", "--interpolation")
"""Options that a command repeats only where they differ from the scene's defaults."""

TEXTBOOK = ("phong", "blinn")
"""The heuristics of the chapters."""

SAME_NOISE = 0.05
"""Share by which two noises differ at most that are called the same."""

CHEAP = 1.5
"""Times of the textbook's time that count as no more."""


@dataclass(frozen=True)
class HalfNames:
    """The names of a half.

    ``subject`` begins a sentence, such as "Textbook shading"; ``title`` heads a row or column, such
    as "Textbook"; ``name`` stands within a sentence, such as "textbook".
    """

    subject: str
    title: str
    name: str


def judged(record: ComparisonRecord) -> HalfNames:
    """Return the names of what is compared; a shader in a file is called as its file."""
    if record.picture:
        return HalfNames(subject="The picture", title="Picture", name="picture")
    if record.heuristic in TEXTBOOK:
        return HalfNames(subject="Textbook shading", title="Textbook", name="textbook")
    name = Path(record.heuristic).name
    return HalfNames(subject=name, title=name, name=name)


def truth(record: ComparisonRecord) -> HalfNames:
    """Return the names of what it is compared with."""
    if record.reference_picture:
        return HalfNames(subject="Reference picture", title="Reference", name="reference")
    return HalfNames(subject="Physical picture", title="Physical", name="physical")


def given_pictures(record: ComparisonRecord) -> Iterator[str]:
    """Yield what given pictures are: their files, where their content is, and how strong.

    Their mistakes are part of the verdict.
    """
    found = record.agreement
    if found is None:
        return
    sides = [(record.picture, judged(record)), (record.reference_picture, truth(record))]
    for half, names in sides:
        if half is not None:
            yield f"The {names.name} is {'; '.join((', '.join(half.files), *half.notes))}."
            if half.tone_map:
                yield (
                    f"The reference is shown by the tone map {half.tone_map}, as the picture was."
                )
    # What was placed is the picture, or else the reference.
    (_, placed), (_, other) = sorted(sides, key=lambda side: side[0] is None)[:2]
    if found.shift is None:
        position = f"Edges do not tell whether the {placed.name} is aligned; its"
    elif round(found.shift[0], 1) == round(found.shift[1], 1) == 0:
        position = f"The content of the {placed.name} is not moved; its"
    else:
        moved = "{:z.1f}, {:z.1f}".format(*found.shift)
        position = f"The content of the {placed.name} is moved by {moved} pixels, and its"
    ratio = ", ".join(f"{value:.3g}" for value in found.ratio)
    yield f"{position} red, green and blue are {ratio} times those of the {other.name}."
    yield from found.odd


def is_searched(record: ComparisonRecord) -> bool:
    """Return whether a method may be looked for: of a scene whose shader has no mistakes."""
    return bool(record.command and record.plan and not record.mistakes)


# --- One scene -------------------------------------------------------------------------------


def share(record: ComparisonRecord, threshold: float = TOLERANCE) -> VisibleShare:
    """Return the share of a scene's pixels that differ visibly, with its interval."""
    return share_above(record.metrics[LEADING.name].visible, threshold)


def decision(
    record: ComparisonRecord, threshold: float = TOLERANCE, bound: float = LIMIT
) -> Verdict:
    """Return whether a scene passes, fails, or is undecided: at most ``bound`` may differ.

    While its numbers may mean nothing, it is undecided.
    """
    if record.caution:
        return "undecided"
    visible = record.metrics[LEADING.name].visible
    return decide(visible, threshold, bound)


def shows_only_noise(record: ComparisonRecord, threshold: float = TOLERANCE) -> bool:
    """Return whether no difference is certain, and noise may make all that are visible."""
    return not record.significant.certain and share(record, threshold).low == 0


def missing(record: ComparisonRecord) -> dict[str, float]:
    """Return ``{effect: its share of what all surely remove}``, the largest first."""
    sure = record.why.sure if record.why else {}
    total = sum(removes.value for removes in sure.values())
    return {effect: removes.value / total for effect, removes in sure.items()}


def foremost(record: ComparisonRecord) -> str:
    """Return what a scene lacks most, as a noun, with what is tied; empty if that is unknown."""
    return noun(TIED.join(record.why.foremost)) if record.why else ""


def cause(record: ComparisonRecord) -> str:
    """Return why a scene differs, as a sentence; empty if that is unknown, or the shader wrong."""
    if record.picture_mistakes:
        return " ".join(record.picture_mistakes)
    if record.mistakes:
        return ""
    if _is_of_materials(record) and (albedo := _impossible_albedo(record)):
        amount = f"{number(albedo)} times the light that it receives"
        return f"A material reflects {amount}; no physical material does."
    return _mostly(foremost(record))


def _is_of_materials(record: ComparisonRecord) -> bool:
    """Return whether a scene lacks nothing more than microfacets."""
    return bool(record.why and MICROFACETS.label in record.why.foremost)


def _impossible_albedo(record: ComparisonRecord) -> float:
    """Return the largest albedo above 1 that a textbook material has; 0 if none has."""
    misses = record.pairing.misses if record.pairing else ()
    wanted = [miss.wanted for miss in misses if "albedo" in miss.what]
    return max([albedo for albedo in wanted if albedo > 1], default=0.0)


def sentence(
    record: ComparisonRecord, cost: Cost | None = None, threshold: float = TOLERANCE
) -> str:
    """Return what makes a scene look right at a tolerance.

    In this order: nothing, brightness, the effects that are needed, and the samples with their
    time. A study of cost names the cheapest method in place of the last two.
    """
    if record.caution:
        return record.caution
    lead = record.metrics[LEADING.name]
    looks = decision(record, threshold)
    if record.mistakes and looks != "pass":
        return "Correct the shader first."
    match looks:
        case "pass":
            return "No visible difference." if lead.high <= EXACT else "Nothing to do."
        case "undecided" if not record.picture_mistakes:
            if shows_only_noise(record, threshold):
                hidden = percent(share(record, threshold).high)
                doubt = f"Noise may hide a difference in up to {hidden} of the pixels."
            else:
                doubt = f"At most {parameter(100 * LIMIT)} % may differ."
            parts = [doubt, decisive(record, threshold), _samples_needed(record, threshold)]
            return " ".join(filter(None, parts))
    if record.picture_mistakes:
        return ""
    if _brightness_suffices(record, threshold):
        factor = lead.after_exposure.exposure
        change = "Brightening" if factor > 1 else "Darkening"
        return f"{change} the picture is enough: ×{number(factor)} makes it pass."
    if cost is not None:
        return _remedy(record, cost, threshold)
    parts = [_effects_needed(record, threshold), _samples_needed(record, threshold)]
    return " ".join(filter(None, parts)) or _where(record)


def leaning(record: ComparisonRecord, threshold: float = TOLERANCE) -> str:
    """Return which way an undecided scene leans, with the share of pixels and its interval."""
    found = share(record, threshold)
    if shows_only_noise(record, threshold):
        return "no difference beyond noise was found"
    lean = "probably right" if found.value <= LIMIT else "probably not"
    interval = f"[{percent(found.low)}, {percent(found.high)}]"
    return f"{lean}: {percent(found.value)} {interval} of the pixels differ visibly"


def decisive(record: ComparisonRecord, threshold: float = TOLERANCE) -> str:
    """Return what would decide an undecided scene, as a sentence.

    The interval shrinks with the root of the samples, until the limit is outside of it.
    """
    if record.given:
        return "More repeats of the pictures decide."
    found = share(record, threshold)
    end = found.low if found.value > LIMIT else found.high
    apart = abs(found.value - LIMIT)
    times = ceil((end - found.value) ** 2 / max(apart, 1e-9) ** 2)
    spp = record.plan.spp if record.plan else 0
    needed = spp << (times - 1).bit_length()
    if not 0 < spp < needed <= MOST_SPP:
        return "More samples (--spp) decide."
    return f"About `--spp {needed}` decides."


def _where(record: ComparisonRecord) -> str:
    """Return the shape with the largest part of the error, if shapes are known."""
    if not record.objects:
        return "The map shows where the pictures differ."
    worst = record.objects[0]
    return f"{percent(worst.share)} of the error is on {worst.name}."


def _brightness_suffices(record: ComparisonRecord, threshold: float) -> bool:
    """Return whether the best exposure makes a scene pass."""
    # If 5 % may differ, the 95th percentile decides.
    lead = record.metrics[LEADING.name]
    return lead.after_exposure.p95 + NOISE * lead.noise_floor <= threshold


def _effects_that_pass(record: ComparisonRecord, threshold: float) -> tuple[str, ...]:
    """Return the effects that make a scene look right; none if they are not known."""
    needed = record.price and record.price.needed_at(threshold)
    if not needed or not record.why or _impossible_albedo(record):
        return ()
    # What may remove nothing is not needed.
    return tuple(effect for effect in needed.effects if effect in record.why.sure)


def _effects_needed(record: ComparisonRecord, threshold: float) -> str:
    """Return which effects a scene needs, and which may be left out; empty if that is unknown."""
    needed = _effects_that_pass(record, threshold)
    if not needed or not record.why:
        return ""
    all_effects = [contribution.effect for contribution in record.why.effects]
    rest = [effect for effect in all_effects if effect not in needed]
    sentence = f"It needs {_joined(needed, 'and')}"
    return f"{sentence}, but not {_joined(rest, 'or')}." if rest else f"{sentence}."


def _joined(effects: Sequence[str], word: str) -> str:
    """Return effects as a list within a sentence."""
    *first, last = map(noun, effects)
    return f"{', '.join(first)} {word} {last}" if first else last


def _samples_needed(record: ComparisonRecord, threshold: float) -> str:
    """Return with how many samples physics passes, and what they take; empty if it is unknown."""
    price = record.price
    found = price and price.samples_at(threshold)
    if not price or not found:
        return ""
    if found.value is None:
        return f"More than {MOST_SPP:,} samples per pixel pass."
    count = f"{found.value:,} samples per pixel"
    if found.high is None:
        count = f"{count}, or more,"
    elif found.low != found.high:
        count = f"{count} ({found.low:,} to {found.high:,})"
    time = _time_of(price, found.value)
    return f"{count} pass{time}."


# What a row of a table says of a scene, in a few words.


def because(record: ComparisonRecord, threshold: float = TOLERANCE) -> str:
    """Return what a scene lacks most if it does not look right; empty if that is not known."""
    if record.caution or record.picture_mistakes or decision(record, threshold) == "pass":
        return ""
    if record.mistakes:
        return "mistakes of the shader"
    if _is_of_materials(record) and _impossible_albedo(record):
        return "an impossible material"
    return foremost(record)


def needs(record: ComparisonRecord, threshold: float = TOLERANCE) -> str:
    """Return what makes a scene look right; empty if that is not known."""
    looks = decision(record, threshold)
    if record.caution:
        return "a look at the pictures"
    if looks == "pass":
        return "nothing"
    if record.mistakes:
        return "a correct shader"
    if record.picture_mistakes:
        return ""
    if looks == "undecided":
        return "more repeats" if record.given else "more samples"
    if _brightness_suffices(record, threshold):
        factor = record.metrics[LEADING.name].after_exposure.exposure
        return f"brightness × {number(factor)}"
    return ", ".join(map(noun, _effects_that_pass(record, threshold)))


def _samples_that_pass(record: ComparisonRecord, threshold: float) -> SamplesThatPass | None:
    """Return the samples of a physical picture that passes, of a scene that needs one."""
    needs_none = decision(record, threshold) == "pass" or _brightness_suffices(record, threshold)
    if needs_none or record.caution or record.mistakes or not record.price:
        return None
    return record.price.samples_at(threshold)


def samples(record: ComparisonRecord, threshold: float = TOLERANCE) -> str:
    """Return with how many samples physics passes; empty if it is not known, or not needed."""
    found = _samples_that_pass(record, threshold)
    if not found:
        return ""
    if found.value is None:
        return f"> {MOST_SPP:,}"
    if found.high is None:
        return f"≥ {found.value:,}"
    return f"{found.low:,}" if found.low == found.high else f"{found.low:,} to {found.high:,}"


def time(record: ComparisonRecord, threshold: float = TOLERANCE) -> str:
    """Return the time of the picture with these samples; empty if it is not known."""
    found = _samples_that_pass(record, threshold)
    if not found or found.value is None or not record.price:
        return ""
    taken = record.price.seconds(found.value)
    return "" if taken is None else seconds(taken)


def _time_of(price: Price, spp: int) -> str:
    """Return the time of a physical picture, as the end of a sentence; empty if it is unknown."""
    parts = []
    if (times := price.times(spp)) is not None:
        parts.append(f"{number(times)} times the textbook's time")
    if (taken := price.seconds(spp)) is not None:
        parts.append(seconds(taken))
    return f": {', '.join(parts)}" if parts else ""


def saving(record: ComparisonRecord) -> str:
    """Return what the plan leaves out, and what that saves, as a sentence; empty if nothing."""
    price = record.price
    if not price or not price.left_out:
        return ""
    sentence = f"Left out, since it changes nothing: {', '.join(price.left_out)}"
    if price.saved is None:
        return f"{sentence}."
    costs = f"With it, a sample takes {number(price.saved.time)} times as long"
    if price.saved.noise is not None and abs(price.saved.noise - 1) > SAME_NOISE:
        costs = f"{costs} and has {number(price.saved.noise)} times the noise"
    return f"{sentence}. {costs}."


def savings(records: Sequence[ComparisonRecord]) -> str:
    """Return what the plans of a run save, as a sentence; empty for a single scene."""
    factors = [record.price.saved.time for record in records if record.price and record.price.saved]
    if len(records) < 2 or not factors:
        return ""
    return (
        f"In {len(factors)} of {len(records)} scenes the plan leaves out what changes nothing; with"
        f" it, a sample takes {number(median(factors))} times as long (median)."
    )


def price_at(record: ComparisonRecord, threshold: float = TOLERANCE) -> float | None:
    """Return the time of what makes a scene look right, over that of its textbook picture.

    1 if that passes, or would if it were brighter; None if it is not known, or the shader wrong.
    """
    if decision(record, threshold) == "pass" or _brightness_suffices(record, threshold):
        return 1.0
    if record.mistakes:
        return None
    price = record.price
    found = price and price.samples_at(threshold)
    if not price or not found or found.value is None:
        return None
    return price.times(found.value)


def costs(records: Sequence[ComparisonRecord], threshold: float = TOLERANCE) -> str:
    """Return in how many scenes looking right costs little, as a sentence; empty if none tells."""
    prices = [price_at(record, threshold) for record in records]
    known = [price for price in prices if price is not None]
    if len(records) < 2 or not known:
        return ""
    cheap = sum(price <= CHEAP for price in known)
    return (
        f"In {cheap} of {len(records)} scenes, looking right takes at most {CHEAP:g} times the"
        " textbook's time."
    )


def _remedy(record: ComparisonRecord, cost: Cost, threshold: float) -> str:
    """Return the cheapest method of a study that passes, at the scene's own size if it can."""
    found = answer(
        cost.points,
        textbook=cost.methods[0].name,
        size=cost.at or cost.resolution,
        tolerance=threshold,
        stopped=cost.stopped,
    )
    if cheapest(cost.points, threshold):
        return found
    nearest = min(cost.points, key=lambda point: point.tolerance.value)
    return f"{found} To try more samples: `{search(record, threshold, 4 * nearest.spp)}`."


def answer(
    points: Sequence[Point],
    textbook: str,
    size: Size,
    tolerance: float = TOLERANCE,
    stopped: str = "",
) -> str:
    """Return the cheapest method that looks right, and the best in the time of the textbook kernel.

    ``points`` have their times at a size, and ``textbook`` is the kernel's name. If no method looks
    right, the nearest is named, and why no more samples were taken, if that is why it ``stopped``.
    """
    looks = "looks right"
    if tolerance != TOLERANCE:
        looks = f"passes at {LEADING.label} {parameter(tolerance)}"
    best = cheapest(points, tolerance)
    if best is None:
        nearest = min(points, key=lambda point: point.tolerance.value)
        more = f" More samples may help, but {stopped}." if stopped else ""
        return f"No method {looks} at {sized(size)}. The nearest is {offered(nearest)}.{more}"
    found = f"{capitalised(best.method)} with {best.spp:,} samples is the cheapest that {looks}"
    found = f"{found}: {seconds(best.seconds.value)} at {sized(size)}"
    if best.method == textbook:
        return f"{found}."
    # The kernel has no noise but that of edges: its picture with the most samples counts.
    kernel = [point for point in points if point.method == textbook][-1]
    as_fast = [point for point in points if point.seconds.value <= kernel.seconds.value]
    near = min(as_fast, key=lambda point: point.tolerance.value)
    return (
        f"{found}. In the textbook's time, {seconds(kernel.seconds.value)}, {near.method} reaches"
        f" {LEADING.label} {number(near.tolerance.value)}."
    )


def offered(point: Point) -> str:
    """Return a method with its samples and time, and the error that 5 % of its pixels exceed."""
    return (
        f"{point.method} with {point.spp:,} samples in {seconds(point.seconds.value)}, of which 5 %"
        f" of the pixels exceed {LEADING.label} {number(point.tolerance.value)}"
    )


def capitalised(text: str) -> str:
    """Return a text that begins with a capital letter."""
    return f"{text[:1].upper()}{text[1:]}"


def sized(resolution: Size) -> str:
    """Return a size as options have it."""
    return "x".join(map(str, resolution))


def search(record: ComparisonRecord, threshold: float, spp: int | None = None) -> str:
    """Return the command that finds the cheapest method for a scene at a tolerance."""
    # The record's command has the options that the user chose, after the scene.
    arguments = shlex.split(record.command)
    scene, *rest = arguments[arguments.index("compare") + 1 :]
    known = SCENES.get(scene)
    default = ("phong", "matched", (known and known.interpolation) or "phong")
    # Each word with the one after it; the blank is the partner of the last.
    kept = [
        word
        for option, value in pairwise([*rest, ""])
        if option in ("-D", "--sensor")
        or (option in CHOICES and value != default[CHOICES.index(option)])
        for word in (option, value)
    ]
    more = ["--spp", spp] if spp else []
    return program.command("plan", scene, "--within", f"{threshold:g}", *kept, *more)


def about(record: ComparisonRecord) -> str:
    """Return a scene's verdict, what is mostly missing, and what is needed, in a few sentences."""
    parts = [headline([record]), *record.mistakes]
    if not record.caution and decision(record) != "pass":
        parts += [cause(record), sentence(record)]
    return " ".join(dict.fromkeys(filter(None, parts)))


def _mostly(effects: str) -> str:
    return f"Mostly missing: {effects}." if effects else ""


def noun(effect: str) -> str:
    """Return what a picture without an effect lacks, in words; of several, in their order."""
    alike = effect.split(TIED)
    if len(alike) > 1:
        return f"{_joined(alike, 'and')} alike"
    nouns = {each.label: each.noun or each.label for each in EFFECTS}
    return ", then ".join(nouns.get(part, part) for part in effect.split(", then "))


# --- A run -----------------------------------------------------------------------------------

Studied = tuple[ComparisonRecord, "Cost | None"]
"""A scene's record, and its study of cost if there is one."""


def headline(records: Sequence[ComparisonRecord], threshold: float = TOLERANCE) -> str:
    """Return how many scenes look right at a tolerance; of a single one, how much is wrong."""
    if not records:
        return "No scene was compared."
    subjects = {judged(record).subject for record in records}
    subject = subjects.pop() if len(subjects) == 1 else "Shading"
    decisions = Counter(decision(record, threshold) for record in records)
    if len(records) > 1:
        doubtful = sum(bool(record.caution) for record in records)
        undecided = decisions["undecided"] - doubtful
        said = f"{subject} looks right in {decisions['pass']} of {len(records)} scenes"
        for count, state in ((undecided, "undecided"), (doubtful, "in doubt")):
            if count:
                said += f"; {count} {'is' if count == 1 else 'are'} {state}"
        return f"{said}."
    (record,) = records
    if record.caution:
        return f"{record.scene}: {record.caution}"
    if decisions["undecided"]:
        return f"{record.scene}: undecided, {leaning(record, threshold)}."
    wrong = percent(share(record, threshold).value)
    if record.reference_picture:
        if decisions["pass"]:
            return f"{record.scene}: {subject} looks like the reference."
        said = f"{subject} differs visibly from the reference"
        return f"{record.scene}: {said} in {wrong} of the pixels."
    if decisions["pass"]:
        return f"{subject} looks right in {record.scene}."
    return f"{subject} differs visibly in {wrong} of the pixels of {record.scene}."


def most_missing(records: Sequence[ComparisonRecord], threshold: float = TOLERANCE) -> str:
    """Return what the scenes that fail lack most, by pixels; empty if that is unknown."""
    pixels: Counter[str] = Counter()
    for record in records:
        if decision(record, threshold) == "fail" and not record.mistakes:
            wrong = share(record, threshold).value
            parts = missing(record)
            # There microfacets are not at fault: `cause` names the material instead.
            if _impossible_albedo(record):
                parts.pop(MICROFACETS.label, None)
            pixels.update({effect: wrong * part for effect, part in parts.items()})
    return _mostly(", ".join(noun(effect) for effect, _ in pixels.most_common(NAMED)))


def advice(scenes: Sequence[Studied], threshold: float = TOLERANCE) -> Iterator[str]:
    """Yield a line for each scene that does not pass, or is in doubt.

    It says what is missing, and what is needed, or the mistakes of a picture.
    """
    for record, cost in scenes:
        is_right = decision(record, threshold) == "pass"
        # The headline of a single scene is its doubt.
        doubt = record.caution if len(scenes) > 1 else ""
        wanted = "" if is_right or record.caution else sentence(record, cost, threshold)
        why = cause(record) if record.picture_mistakes or wanted else ""
        if said := " ".join(filter(None, (doubt, why, wanted))):
            yield f"{record.scene}: {said}"
