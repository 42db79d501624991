"""What moved since a baseline: each half now is compared with the half as it was.

Both are sources of passes, so this is a comparison of two pictures. Whether a mean moved is judged
by :mod:`fotismos.comparisons.departure.drift`: that of the whole picture, of each block, and of
each shape of a scene. These kinds of parts, and the halves, share the chance of a false alarm.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import floor, log10
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.check.measured import Halves, Measured
from fotismos.comparisons.compare import look
from fotismos.comparisons.departure.colour import Array, luminance
from fotismos.comparisons.departure.drift import (
    POWER,
    Drift,
    Run,
    blocks,
    drift,
    level_of_each,
    sidak,
    whole,
)
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.pictures import GivenPictures, require_one_size
from fotismos.comparisons.records.check import (
    CHANNELS,
    HALVES,
    PICTURE,
    READERS,
    Move,
    SmallestChanges,
    part_of,
)
from fotismos.comparisons.records.departure import Colour
from fotismos.comparisons.records.images import Comparison
from fotismos.heuristic.convention import Floats
from fotismos.reference.rendering.gbuffer import ObjectIds

LEVEL = 0.01
"""Chance of a false alarm, over all that one check tests."""

ALIKE = 0.1
"""Relative difference up to which changes are told as one."""

DARK = 1e-3
"""Display-linear: a change of what is darker has no percentage worth showing."""

SHAPES = "shapes"
BLOCKS = "blocks"
WHOLE = "whole"
KINDS = (SHAPES, BLOCKS, WHOLE)
"""Kinds of parts, those that say most about a local change first."""

CAUSES = {
    ("heuristic",): "Only the textbook half moved: look at its shading, or at how materials and"
    " lights are paired.",
    ("reference",): "Only the physical half moved: look at its materials and lights, the"
    " integrator, or the version of Mitsuba.",
    HALVES: "Both halves moved: look at what they share, such as geometry, camera, materials or"
    " lights.",
}
"""Where to look, by the halves that moved."""


@dataclass(frozen=True)
class Parts:
    """Parts of a picture: their numbers by pixel (H, W), and the fields of each in a record."""

    numbers: NDArray[np.int_]
    fields: Sequence[Mapping[str, Any]]

    @cached_property
    def pixels(self) -> NDArray[np.int_]:
        """The number of pixels of each."""
        return np.bincount(self.numbers[self.numbers >= 0], minlength=len(self.fields))


def parts_of(shape: Sequence[int], shapes: ObjectIds | None) -> dict[str, Parts]:
    """Return the kinds of parts of a picture (H, W, 3), and of what its pixels see."""
    numbers = blocks(shape)
    across = int(numbers[0, -1]) + 1
    cells = [divmod(number, across) for number in range(int(numbers.max()) + 1)]
    kinds = {
        WHOLE: Parts(whole(shape), [{}]),
        BLOCKS: Parts(numbers, [{"block": (row + 1, column + 1)} for row, column in cells]),
    }
    if shapes is not None and (shapes.places >= 0).any():
        present, order = np.unique(shapes.places, return_inverse=True)
        seen = present[present >= 0]
        numbers = order.reshape(shapes.places.shape) - (len(present) - len(seen))
        kinds[SHAPES] = Parts(numbers, [{"shape": shapes.names[index]} for index in seen])
    return kinds


@dataclass(frozen=True)
class HalfCheck:
    """A half now, and as it was: the comparison of both, and the drift of its parts by kind.

    ``level`` is the chance of a false alarm in this half.
    """

    name: str
    comparison: Comparison
    before: Run
    after: Run
    parts: Mapping[str, Parts]
    level: float

    @property
    def error(self) -> Floats:
        """The ΔE2000 between before and now, (H, W); 0 in shapes and blocks that did not move."""
        error = self.comparison.images.maps[LEADING.name]
        moved = np.zeros(error.shape, bool)
        for kind, are_moved in self.moved.items():
            numbers = self.parts[kind].numbers
            if kind != WHOLE:
                moved |= (numbers >= 0) & np.asarray(are_moved.any(axis=-1))[numbers]
        return np.where(moved, error, 0.0) if moved.any() else error

    @cached_property
    def drifts(self) -> dict[str, Drift]:
        """The means of parts before and now, by kind."""
        return {
            kind: drift(self.before, self.after, parts.numbers)
            for kind, parts in self.parts.items()
        }

    @property
    def level_of_kind(self) -> float:
        """The chance of a false alarm among the parts of a kind."""
        return level_of_each(self.level, len(self.parts))

    @cached_property
    def moved(self) -> dict[str, NDArray[np.bool_]]:
        """Which means (N, 3) moved, by kind."""
        return {kind: means.moved(self.level_of_kind) for kind, means in self.drifts.items()}

    def moves(self) -> Iterator[Move]:
        """Yield what moved."""
        for kind, means in self.drifts.items():
            p = means.p()
            corrected = sidak(p, means.tests)
            errors = means.error
            for part, channel in np.argwhere(self.moved[kind]).tolist():
                index = part, channel
                before = float(means.before[index])
                after = float(means.after[index])
                error = float(errors[index])
                yield Move(
                    half=self.name,
                    channel="RGB"[channel],
                    **self.parts[kind].fields[part],
                    before=before,
                    after=after,
                    error=error,
                    standard_errors=(after - before) / error if error > 0 else None,
                    p=float(p[index]),
                    p_corrected=float(corrected[index]),
                )

    def smallest_changes(self) -> SmallestChanges:
        """Return the smallest changes that the check catches."""
        limits = self.drifts[BLOCKS].limit(self.level_of_kind)
        return SmallestChanges(
            power=POWER,
            mean=colour(self.drifts[WHOLE].limit(self.level_of_kind)[0]),
            block=colour(np.median(limits, axis=0)),
            noisiest=colour(limits.max(axis=0)),
        )

    @cached_property
    def constants(self) -> list[str]:
        """The constant changes that each explain all that moved, in words.

        Over the blocks' means x before and y now, with weights w of 1 / error², the offset of a
        channel is ``Σ w (y − x) / Σ w``, and its factor ``1 + Σ w z (y − x) / Σ w z x``, where z is
        the mean of all passes. If the baseline, changed alike, agrees everywhere, it explains all.
        """
        m = self.before.count
        n = self.after.count
        means = self.drifts[BLOCKS]
        old = means.before
        new = means.after
        weight = 1.0 / np.maximum(means.error, means.rounding) ** 2
        level = weight * (m * old + n * new) / (m + n)
        words = []
        for name, start, weights, base, image in (
            ("factor", 1.0, level, old, self.before.mean),
            ("offset", 0.0, weight, np.ones_like(old), np.ones(3)),
        ):
            size = np.maximum((weights * base).sum(axis=0), 1e-30)
            value = (weights * (new - old)).sum(axis=0) / size
            change = partial(np.add, value * image)
            shifted = replace(self, before=self.before.changed(change))
            if not any(moved.any() for moved in shifted.moved.values()):
                shown = map(_interval, start + value, 2.0 / np.sqrt(size))
                words.append(f"a constant {name} of {', '.join(shown)} in R, G, B")
        return words

    def cause(self) -> str:
        """Return the sentence on factors or offsets that leave nothing moved, or else on where."""
        subject = "The whole picture" if self.name == PICTURE else f"The {READERS[self.name]} half"
        if self.constants:
            return f"{subject} moved by {' or by '.join(self.constants)}. Nothing else moved."
        means = self.drifts[BLOCKS]
        count = int(self.moved[BLOCKS].any(axis=-1).sum())
        where = "moved in no single block, but in larger parts"
        if count:
            change = np.abs(means.after - means.before).sum(axis=-1)
            most = int(change.argmax())
            row, column = self.parts[BLOCKS].fields[most]["block"]
            old = float(luminance(means.before[most]))
            new = float(luminance(means.after[most]))
            where = (
                f"moved in {count} of {change.size} blocks, most in row {row}, column {column},"
                f" from luminance {old:.3g} to {new:.3g}"
            )
        return f"No factor or offset explains it: {subject[0].lower()}{subject[1:]} {where}."


@dataclass(frozen=True)
class Check:
    """A scene or a picture now, compared with its baseline half by half."""

    now: Measured
    halves: Sequence[HalfCheck]
    level: float

    @cached_property
    def moves(self) -> tuple[Move, ...]:
        """What moved: the kind of the headline, then others; of each the largest first."""
        kinds = [self.telling, *KINDS]

        def order(move: Move) -> tuple[int, float]:
            kind = WHOLE if move.block is None else BLOCKS
            kind = kind if move.shape is None else SHAPES
            return kinds.index(kind), -abs(move.after - move.before)

        return tuple(sorted((m for half in self.halves for m in half.moves()), key=order))

    @property
    def tested(self) -> int:
        """How many means were tested."""
        return sum(means.before.size for half in self.halves for means in half.drifts.values())

    @property
    def are_moved(self) -> list[HalfCheck]:
        """The halves that moved."""
        return [half for half in self.halves if any(m.any() for m in half.moved.values())]

    @cached_property
    def telling(self) -> str:
        """The kind of parts that tells most about what moved."""
        halves = self.are_moved
        if all(half.constants and half.moved[WHOLE].any() for half in halves):
            return WHOLE
        return next(k for k in KINDS if any(h.moved[k].any() for h in halves if k in h.moved))

    def causes(self) -> list[str]:
        """Return sentences on which half moved, where and how."""
        names = tuple(half.name for half in self.are_moved)
        first = [CAUSES[names]] if names in CAUSES else []
        return first + [half.cause() for half in self.are_moved]

    def headline(self) -> str:
        """Return what moved most: the part, by how much, and in which half; empty for nothing."""
        halves = self.are_moved
        if not halves:
            return ""
        kind = self.telling
        most = int(np.argmax(sum(_light(half, kind) for half in halves)))
        amounts = {
            half.name: _amounts(half.drifts[kind], half.moved[kind], most)
            for half in halves
            if half.moved[kind][most].any()
        }
        part = part_of(**halves[0].parts[kind].fields[most])
        return f"{f'`{part}`' if kind == SHAPES else part}: {_told(amounts)}"


def check(
    before: Halves, now: Measured, level: float = LEVEL, options: Options | None = None
) -> Check:
    """Compare what there is now with what a baseline kept.

    With the baseline's seed, an unchanged scene gives the same images on the same machine; the
    test also holds for other seeds. ``level`` is the chance of a false alarm.
    """
    sides = [half.files[0].image for halves in (before, now.halves) for half in halves.values()]
    require_one_size(sides)
    options = (options or Options()).changed(allow_empty=True)
    checked = []
    for name, half in now.halves.items():
        given = GivenPictures(image=half, reference=before[name], mask=now.mask)
        comparison = look(given.as_halves(READERS[name], options))
        after = Run.of(file.image for file in half.files)
        checked.append(
            HalfCheck(
                name=name,
                comparison=comparison,
                before=Run.of(file.image for file in before[name].files),
                after=after,
                parts=parts_of(after.mean.shape, now.shapes),
                level=level_of_each(level, len(now.halves)),
            )
        )
    return Check(now=now, halves=tuple(checked), level=level)


def colour(values: Array) -> Colour:
    """Return an array (3,) as a colour."""
    red, green, blue = values
    return float(f"{red:.8g}"), float(f"{green:.8g}"), float(f"{blue:.8g}")


# --- In words ------------------------------------------------------------------------------------


def _light(half: HalfCheck, kind: str) -> Array:
    """Return how much light moved in each part (N,) of a kind; 0 if it may be noise."""
    means = half.drifts[kind]
    change = np.abs(luminance(means.after - means.before)) * half.parts[kind].pixels
    return np.where(half.moved[kind].any(axis=-1), change, 0.0)


def _amounts(means: Drift, moved: NDArray[np.bool_], part: int) -> dict[str, tuple[float, str]]:
    """Return by how much a part moved, by the names of channels: numbers and their unit.

    Channels that moved less than half as much as another are left out, and three that moved alike
    are ``light``.
    """
    change = (means.after - means.before)[part]
    unit = ""
    if means.before[part][moved[part]].min() >= DARK:
        change = 100.0 * change / np.maximum(means.before[part], DARK)
        unit = " %"
    size = np.abs(change)
    if moved[part].all() and np.ptp(change) <= ALIKE * size.max():
        return {"light": (float(change.mean()), unit)}
    return {
        name: (float(change[channel]), unit)
        for channel, name in enumerate(CHANNELS.values())
        if moved[part, channel] and size[channel] >= size[moved[part]].max() / 2
    }


def _told(amounts: Mapping[str, Mapping[str, tuple[float, str]]]) -> str:
    """Return amounts by half as words; halves that moved alike are told as one."""
    if len(amounts) == len(HALVES):
        first, second = amounts.values()
        if first.keys() == second.keys() and all(_are_alike(first[n], second[n]) for n in first):
            mean = {
                name: ((value + second[name][0]) / 2, unit) for name, (value, unit) in first.items()
            }
            return f"{_listed(mean)} in both halves"
    return ", ".join(
        _listed(half) + ("" if name == PICTURE else f" in the {READERS[name]} half")
        for name, half in amounts.items()
    )


def _are_alike(first: tuple[float, str], second: tuple[float, str]) -> bool:
    """Return whether two amounts have one unit, and numbers that are told as one."""
    return first[1] == second[1] and abs(first[0] - second[0]) <= ALIKE * abs(first[0])


def _listed(amounts: Mapping[str, tuple[float, str]]) -> str:
    return ", ".join(f"{name} {value:+.2g}{unit}" for name, (value, unit) in amounts.items())


def _interval(value: float, half: float) -> str:
    return f"{value:.{min(7, max(2, 1 - floor(log10(half))))}f} ± {half:.1g}"
