"""A run's findings in sentences and bars: how many scenes look right, and what the others lack.

A scene looks right at a tolerance if at most :data:`SHARE` of its pixels depart by more. The prices
of effects, from a study of cost, say what it lacks.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from comparisons.comparison import ComparisonRecord
from comparisons.departure.metrics import LEADING
from comparisons.effects.nearness import Nearest
from reference.effects import EFFECTS
from reports.charts.theme import EFFECT_COLOURS
from reports.terminal.nearest_lines import told
from reports.terminal.printing import seconds

if TYPE_CHECKING:
    from comparisons.cost.cost_record import Cost

SHARE = 0.05
"""Share of the pixels that may depart by more than the tolerance."""

TOLERANCES = tuple(LEADING.visible)
USUAL = 2.0
"""The tolerance shown first: visible side by side."""

EXACT = 0.01
"""ΔE2000: smaller means are rounding, or noise that nobody sees."""

WITH_CAUSES = "--why"
"""The option of ``compare`` that finds causes and remedies; it is on by default."""

NAMED = 3
"""Number of effects that the sentence names."""

NO_REMEDY = "none at the small size of the study; `cost SCENE` tries more"
"""What stands in place of a method if none of the study's is within the tolerance."""

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
class Part:
    """One effect's part of a bar: ΔE2000, scaled to the scene's mean."""

    effect: str
    colour: str
    size: float


@dataclass(frozen=True)
class Remedy:
    """The cheapest method of a study whose mean error stays within a tolerance.

    The kernel without shadows is none: it is what was judged.
    """

    method: str
    seconds: float


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
    nearest
        The rendering that a picture is nearest to; None if it is unknown, or not a picture.
    """

    scene: str
    mean: float
    beyond: dict[float, float]
    parts: tuple[Part, ...]
    remedies: dict[float, Remedy | None]
    is_exact: bool
    subject: str = "Textbook shading"
    nearest: Nearest | None = None

    def is_right(self, tolerance: float) -> bool:
        """Return whether the scene looks right at one of :data:`TOLERANCES`."""
        return self.beyond[tolerance] <= SHARE

    @property
    def cause(self) -> str | None:
        """The effect that causes most of the departure; None if unknown."""
        return self.parts[0].effect if self.parts else None


def finding(record: ComparisonRecord, cost: Cost | None = None) -> Finding:
    """Return the finding of a scene."""
    metric, picture = record.metrics[LEADING.name], record.picture
    return Finding(
        scene=record.scene,
        mean=metric.mean,
        beyond={limit: metric.visible[f"{limit:g}"] for limit in TOLERANCES},
        parts=_parts(metric.mean, cost) if cost else (),
        remedies={limit: _remedy(cost, limit) for limit in TOLERANCES} if cost else {},
        is_exact=metric.high <= EXACT,
        subject=judged(record).subject,
        nearest=picture.nearest if picture else None,
    )


def _parts(mean: float, cost: Cost) -> tuple[Part, ...]:
    """Scale the prices that are surely above 0 to the mean, which was measured at full size."""
    sure = [price for price in cost.prices.effects if price.removes.low > 0]
    total = sum(price.removes.value for price in sure)
    ordered = sorted(sure, key=lambda price: -price.removes.value)
    return tuple(
        Part(price.effect, EFFECT_COLOURS[price.effect], mean * price.removes.value / total)
        for price in ordered
    )


def _remedy(cost: Cost, tolerance: float) -> Remedy | None:
    from comparisons.cost.front import cheapest  # only with a study of cost
    from comparisons.cost.rungs import KERNELS, Kernel

    is_judged = {
        rung.name for rung in KERNELS if isinstance(rung.method, Kernel) and not rung.method.shadows
    }
    best = cheapest((point for point in cost.points if point.rung not in is_judged), tolerance)
    return Remedy(best.rung, best.seconds.median) if best else None


def sentences(findings: Sequence[Finding], tolerance: float = USUAL) -> list[str]:
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
    lacking = ranked([found for found in findings if not found.is_right(tolerance)])
    if lacking:
        said.append(f"What it lacks most is {', then '.join(map(_noun, lacking[:NAMED]))}.")
    return said


def about(found: Finding, tolerance: float = USUAL) -> str:
    """Return one scene's finding: how much is wrong, mostly why, and a remedy."""
    if found.is_exact:
        return f"{found.subject} is exact here, as far as can be seen."
    share = found.beyond[tolerance]
    wrong = f"is visibly wrong in {100 * share:.0f} % of the pixels"
    said = [f"{found.subject} {'looks right here' if found.is_right(tolerance) else wrong}."]
    if found.nearest:
        said.append(f"It {told(found.nearest)}.")
    if found.cause:
        said.append(f"It lacks mostly {_noun(found.cause)}.")
    remedy = found.remedies.get(tolerance)
    if remedy and not found.is_right(tolerance):
        said.append(
            f"The cheapest method tried within a mean of {LEADING.label} {tolerance:g}:"
            f" {remedy.method}, {seconds(remedy.seconds)} at the small size of the study."
        )
    return " ".join(said)


def advice(findings: Sequence[Finding], tolerance: float = USUAL) -> list[str]:
    """Return a line for each scene that does not look right: what it lacks, and a remedy."""
    if not any(found.remedies or found.nearest for found in findings):
        return [f"For causes and remedies, give the same command with {WITH_CAUSES}."]
    lines = []
    for found in findings:
        if found.is_right(tolerance) or not found.remedies:
            continue
        remedy = found.remedies[tolerance]
        cause = f"mostly {_noun(found.cause)}" if found.cause else "no cause is known"
        way = f"{remedy.method} in {seconds(remedy.seconds)}" if remedy else NO_REMEDY
        lines.append(f"{found.scene}: {cause}; mean within {LEADING.label} {tolerance:g}: {way}")
    return lines


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
