"""Check a scene against its baseline: the numbers that moved by more than both sides' uncertainty.

Welch's t-test, many at once. Before and after are independent measurements. If they share a seed,
unchanged numbers differ by even less than the test allows for.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons.check.measurement import LINEAR_ROUNDING, MeasuredScene, measure_scene
from fotismos.comparisons.departure.colour import Array, luminance
from fotismos.comparisons.departure.metrics import METRICS, RATIO
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.check import HALVES, READERS, Measurement, Move
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering.passes import Progress
from fotismos.reference.scene.source import Source

LEVEL = 0.01
"""Chance of a false alarm, over all quantities that one check tests."""

RELATIVE_ROUNDING = 1e-5
"""Share of a value that rounding can change: other machines order float32 sums otherwise."""

ALIKE = 0.02
"""Relative spread of the blocks' factors below which they count as one factor."""

DARK = 1e-3
"""Luminance below which a block has no meaningful factor."""

CAUSES = {
    (): "The colours of neither half moved, only the error between them: look at the noise, the"
    " samples, or how metrics are computed.",
    ("heuristic",): "Only the textbook half moved: look at its shading, or at how materials and"
    " lights are paired.",
    ("reference",): "Only the physical half moved: look at its materials and lights, the"
    " integrator, or the version of Mitsuba.",
    HALVES: "Both halves moved: look at what they share, such as geometry, camera, materials or"
    " lights.",
}
"""Where to look, by the halves that moved."""


def differences(before: Measurement, after: Measurement) -> tuple[Move, ...]:
    """Compare all quantities of two measurements of the same kind.

    ::

        t = (x₂ − x₁) / √(e₁² + e₂²)
        ν = (n − 1) (e₁² + e₂²)² / (e₁⁴ + e₂⁴)

    with standard errors e over n passes on each side (Welch 1947; Satterthwaite 1946). A difference
    within rounding has p = 1. A larger one has p = 0 if neither side has any spread. Šidák's
    correction treats the quantities as independent; they nearly are, and alarms get rarer.

    ``ValueError`` for different quantities, or different numbers of passes: Welch's test is then
    wrong in the far tails, which a correction for many tests needs.
    """
    from scipy.stats import ttest_ind_from_stats  # half a second, for those who check

    pairs = list(zip(before.quantities(), after.quantities(), strict=True))
    if before.passes != after.passes or any(old.name != new.name for old, new in pairs):
        raise ValueError("measurements with different passes or quantities cannot be compared")
    count = before.passes
    x = np.array([[old.value, new.value] for old, new in pairs])
    errors = np.array([[old.error, new.error] for old, new in pairs])
    difference = x[:, 1] - x[:, 0]
    total = (errors**2).sum(axis=1)
    known = {name: metric.rounding for name, metric in METRICS.items()}
    known[RATIO.name] = RATIO.rounding
    rounding = np.array([known.get(old.name, LINEAR_ROUNDING) for old, _ in pairs])
    rounding = np.maximum(rounding, RELATIVE_ROUNDING * np.abs(x).max(axis=1))
    spread = total > (1e-6 * rounding) ** 2  # sums of equal numbers differ in their last bits
    # Deviations of single passes, as SciPy takes them; where there are none, t is not used.
    deviations = np.where(spread[:, None], errors, 1.0) * np.sqrt(count)
    t, p = ttest_ind_from_stats(
        x[:, 1], deviations[:, 1], count, x[:, 0], deviations[:, 0], count, equal_var=False
    )
    p = np.where(np.abs(difference) <= rounding, 1.0, np.where(spread, p, 0.0))
    corrected = sidak(p, len(pairs))
    return tuple(
        Move(
            quantity=old.name,
            half=old.half,
            block=old.block,
            before=old.value,
            after=new.value,
            error=float(np.sqrt(total[i])),
            standard_errors=float(t[i]) if spread[i] else None,
            p=float(p[i]),
            p_corrected=float(corrected[i]),
        )
        for i, (old, new) in enumerate(pairs)
    )


def sidak(p: ArrayLike, tests: int) -> NDArray[np.float64]:
    """Return the chance of a p-value as small as `p` among this many independent tests."""
    # `1 − (1 − p)^n`, in a form that keeps its digits for small p.
    with np.errstate(divide="ignore"):  # p = 1
        chances: NDArray[np.float64] = -np.expm1(tests * np.log1p(-np.asarray(p, float)))
        return chances


def level_of_each(level: float, checks: int) -> float:
    """Return the level of each of several checks, so that together they have `level`."""
    return float(-np.expm1(np.log1p(-level) / checks))


def moved(moves: Sequence[Move], level: float = LEVEL) -> list[Move]:
    """Return those that moved: metrics, then whole images, then blocks, the largest move first."""

    def order(move: Move) -> tuple[int, float]:
        part = (move.half is not None) + (move.block is not None)
        return part, -np.nan_to_num(move.size, nan=np.inf)

    # A NaN does not pass.
    return sorted((move for move in moves if not move.p_corrected >= level), key=order)


def where_moved(before: Array, after: Array, count: int) -> str:
    """Return how many blocks (rows, columns, 3) moved, ``count``, where most and by how much."""
    if not count:
        return "moved in the mean of the image, but in no single block"
    change = np.abs(after - before).sum(axis=-1)
    row, column = np.unravel_index(change.argmax(), change.shape)
    old = float(luminance(before[row, column]))
    new = float(luminance(after[row, column]))
    most = f"most in row {row + 1}, column {column + 1}, from luminance {old:.3g} to {new:.3g}"
    return f"moved in {count} of {change.size} blocks, {most}"


@dataclass(frozen=True)
class Check:
    """A scene compared with its baseline: every quantity tested, and those that moved.

    ``level`` is the chance of a false alarm.
    """

    before: Measurement
    now: MeasuredScene
    moves: tuple[Move, ...]
    moved: tuple[Move, ...]
    level: float

    @property
    def passed(self) -> bool:
        """Whether nothing moved."""
        return not self.moved

    def blocks(self, half: str) -> tuple[Array, Array]:
        """Return the colours of a half's blocks before and now, (rows, columns, 3)."""
        before = getattr(self.before, half)
        after = getattr(self.now.measurement, half)
        return before.means(), after.means()

    def causes(self) -> list[str]:
        """Return sentences on which half moved, where and how."""
        halves = tuple(half for half in HALVES if any(move.half == half for move in self.moved))
        sentences = [CAUSES[halves]]
        for half in halves:
            moves = [move for move in self.moved if move.half == half]
            sentences.append(f"The {READERS[half]} half {self._where(half, moves)}.")
        return sentences

    def _where(self, half: str, moves: Sequence[Move]) -> str:
        old, new = self.blocks(half)
        before = luminance(old)
        after = luminance(new)
        ratios = after[before > DARK] / before[before > DARK]
        is_one = ratios.size and np.ptp(ratios) <= ALIKE * abs(ratios.mean())
        if is_one and abs(ratios.mean() - 1) > ALIKE:
            return f"has {ratios.mean():.3g} times the light everywhere: its level moved"
        return where_moved(old, new, len({move.block for move in moves if move.block}))


def check(
    source: Source,
    options: Options,
    before: Measurement,
    level: float = LEVEL,
    progress: Progress | None = None,
) -> Check:
    """Measure a scene as before, and return what moved.

    ``options`` are the baseline's. With its seed, an unchanged scene gives the same images on the
    same machine; the test also holds for other seeds. Metrics that the baseline lacks are not
    tested. ``level`` is the chance of a false alarm, over all quantities of this scene.
    """
    now = measure_scene(source, options, count=before.passes, progress=progress)
    after = now.measurement.of(before.metrics)
    old = before.reference.means().shape
    new = after.reference.means().shape
    if old != new:
        raise InputError(
            f"{source.name}: the baseline has {old[0]} by {old[1]} blocks, but the scene {new[0]}"
            f" by {new[1]}. Write it again with `update`."
        )
    moves = differences(before, after)
    return Check(before=before, now=now, moves=moves, moved=tuple(moved(moves, level)), level=level)
