"""A run's findings in sentences and bars: how many scenes look right, and what the others lack.

A scene looks right at a tolerance if at most 5 % of its pixels depart by more
(:mod:`comparisons.departure.criterion`). The attribution of a study of cost says what it lacks.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from comparisons.comparison import ComparisonRecord
from comparisons.departure import criterion
from comparisons.departure.metrics import LEADING
from heuristic.heuristics import Interpolation
from reference.planning.effects import EFFECTS
from reports.charts.theme import EFFECT_COLOURS
from reports.terminal.words import seconds

if TYPE_CHECKING:
    from comparisons.cost.cost_record import Cost

TOLERANCES = (1.0, 2.0, 5.0)
"""The tolerances that can be chosen."""

EXACT = 0.01
"""ΔE2000: smaller means are rounding, or noise that nobody sees."""

WITH_CAUSES = "--why"
"""The option of ``compare`` that finds causes and remedies; it is on by default."""

NAMED = 3
"""Number of effects that the sentence names."""

NO_REMEDY = "none at the small size of the study; `cost SCENE` tries more"
"""What stands in place of a method if none of the study's is within the tolerance."""

KERNEL_NAMES = {
    Interpolation.FLAT: "flat kernel",
    Interpolation.GOURAUD: "Gouraud kernel",
    Interpolation.PHONG: "Phong kernel",
}
"""The method that is judged, by its interpolation."""

TEXTBOOK = ("phong", "blinn")
"""The heuristics of the chapters."""


@dataclass(frozen=True)
class Judged:
    """The names of a first half.

    Attributes
    ----------
    subject
        The first words of a sentence, such as "Textbook shading".
    title
        Of a row or column, such as "Textbook".
    name
        Within a sentence, such as "textbook".
    """

    subject: str
    title: str
    name: str


def judged(record: ComparisonRecord) -> Judged:
    """Return the names of a comparison's first half; a shader in a file is called as its file."""
    if record.picture:
        return Judged("The picture", "Picture", "picture")
    if record.heuristic in TEXTBOOK:
        return Judged("Textbook shading", "Textbook", "textbook")
    name = Path(record.heuristic).name
    return Judged(name, name, name)


@dataclass(frozen=True)
class BarPart:
    """One effect's part of a bar: ΔE2000, scaled to the scene's mean."""

    effect: str
    colour: str
    size: float


@dataclass(frozen=True)
class Remedy:
    """The cheapest method of a study whose mean error stays within a tolerance.

    ``is_judged`` tells that it is the judged method itself: its mean is within the tolerance,
    though too many of its pixels are not.
    """

    method: str
    seconds: float
    is_judged: bool = False


@dataclass(frozen=True)
class Finding:
    """One scene of a run.

    Attributes
    ----------
    scene, mean
        Its name, and its mean departure.
    beyond
        ``{tolerance: share of the pixels that depart by more}``.
    parts
        The effects' parts of the mean, largest first; empty without a study of cost.
    remedies
        ``{tolerance: cheapest method, or None}``; empty without a study of cost.
    is_exact
        Whether the mean is at most :data:`EXACT`.
    subject
        What is judged, as the first words of a sentence.
    """

    scene: str
    mean: float
    beyond: dict[float, float]
    parts: tuple[BarPart, ...]
    remedies: dict[float, Remedy | None]
    is_exact: bool
    subject: str = "Textbook shading"
    caution: str = ""

    def is_right(self, tolerance: float) -> bool:
        """Return whether the scene looks right at one of :data:`TOLERANCES`."""
        return self.beyond[tolerance] <= criterion.LIMIT

    @property
    def cause(self) -> str | None:
        """The effect that causes most of the departure; None if unknown."""
        return self.parts[0].effect if self.parts else None


def finding(record: ComparisonRecord, cost: Cost | None = None) -> Finding:
    """Return the finding of a scene."""
    metric = record.metrics[LEADING.name]
    return Finding(
        scene=record.scene,
        mean=metric.mean,
        beyond={limit: criterion.share_above(metric.visible, limit).value for limit in TOLERANCES},
        parts=_parts(metric.mean, cost) if cost else (),
        remedies={limit: _remedy(cost, limit) for limit in TOLERANCES} if cost else {},
        is_exact=metric.high <= EXACT,
        subject=judged(record).subject,
        caution=record.caution,
    )


def _parts(mean: float, cost: Cost) -> tuple[BarPart, ...]:
    """Scale what effects surely remove to the mean, which was measured at full size."""
    sure = [one for one in cost.attribution.effects if one.removes.low > 0]
    total = sum(one.removes.value for one in sure)
    ordered = sorted(sure, key=lambda one: -one.removes.value)
    return tuple(
        BarPart(one.effect, EFFECT_COLOURS[one.effect], mean * one.removes.value / total)
        for one in ordered
    )


def _remedy(cost: Cost, tolerance: float) -> Remedy | None:
    from comparisons.cost.front import cheapest  # only with a study of cost

    best = cheapest(cost.points, tolerance)
    if best is None:
        return None
    names = next(method.names for method in cost.methods if method.name == best.method)
    judged_name = KERNEL_NAMES[cost.interpolation]
    # Another heuristic than Phong's stands behind a colon.
    is_judged = any(name.partition(":")[0] == judged_name for name in names)
    return Remedy(best.method, best.seconds.value, is_judged)


def sentences(findings: Sequence[Finding], tolerance: float = criterion.TOLERANCE) -> list[str]:
    """Return a run's findings, in one or two sentences."""
    right = sum(found.is_right(tolerance) for found in findings)
    if len(findings) == 1:
        (only,) = findings
        share = only.beyond[tolerance]
        said = [
            f"{only.subject} looks right in {only.scene}."
            if right
            else f"{only.subject} is visibly wrong in {100 * share:.0f} % of the pixels of"
            f" {only.scene}."
        ]
    else:
        subjects = {found.subject for found in findings}
        subject = subjects.pop() if len(subjects) == 1 else "The first half"
        said = [f"{subject} looks right in {right} of {len(findings)} scenes."]
    doubts = [(found.scene, found.caution) for found in findings if found.caution]
    if doubts:
        said[0] = " ".join([*(f"{scene}: {caution}" for scene, caution in doubts), said[0]])
    lacking = ranked([found for found in findings if not found.is_right(tolerance)])
    if lacking:
        said.append(f"What it lacks most is {', then '.join(map(_noun, lacking[:NAMED]))}.")
    return said


def about(found: Finding, tolerance: float = criterion.TOLERANCE) -> str:
    """Return one scene's finding: how much is wrong, mostly why, and a remedy."""
    if found.caution:
        return found.caution
    if found.is_exact:
        return f"{found.subject} is exact here, as far as can be seen."
    share = found.beyond[tolerance]
    wrong = f"is visibly wrong in {100 * share:.0f} % of the pixels"
    said = [f"{found.subject} {'looks right here' if found.is_right(tolerance) else wrong}."]
    if found.cause:
        said.append(f"It lacks mostly {_noun(found.cause)}.")
    remedy = found.remedies.get(tolerance)
    if remedy and remedy.is_judged and not found.is_right(tolerance):
        said.append(f"Its mean is within {LEADING.label} {tolerance:g} all the same.")
    elif remedy and not found.is_right(tolerance):
        said.append(
            f"The cheapest method tried within a mean of {LEADING.label} {tolerance:g}:"
            f" {remedy.method}, {seconds(remedy.seconds)} at the small size of the study."
        )
    return " ".join(said)


def advice(findings: Sequence[Finding], tolerance: float = criterion.TOLERANCE) -> list[str]:
    """Return a line for each scene that does not look right: what it lacks, and a remedy."""
    if not any(found.remedies for found in findings):
        return [f"For causes and remedies, give the same command with {WITH_CAUSES}."]
    lines = []
    for found in findings:
        if found.is_right(tolerance) or not found.remedies:
            continue
        remedy = found.remedies[tolerance]
        cause = f"mostly {_noun(found.cause)}" if found.cause else "no cause is known"
        way = _way(remedy)
        lines.append(f"{found.scene}: {cause}; mean within {LEADING.label} {tolerance:g}: {way}")
    return lines


def _way(remedy: Remedy | None) -> str:
    if remedy is None:
        return NO_REMEDY
    return "as it is" if remedy.is_judged else f"{remedy.method} in {seconds(remedy.seconds)}"


def _noun(label: str) -> str:
    """Return what an image without an effect lacks."""
    return next(effect.noun or label for effect in EFFECTS if effect.label == label)


def ranked(findings: Sequence[Finding]) -> list[str]:
    """Return the effects by their total departure over some scenes, largest first."""
    sizes: dict[str, float] = defaultdict(float)
    for found in findings:
        for part in found.parts:
            sizes[part.effect] += part.size
    return sorted(sizes, key=lambda effect: -sizes[effect])
