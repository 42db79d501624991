"""Possible causes of a change, from the numbers of a check."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from comparisons.check.check import Check
from comparisons.check.measurement import HALVES
from comparisons.check.moved import Move
from comparisons.departure.spaces import luminance

ALIKE = 0.02
"""Relative spread of the blocks' factors below which they count as one factor."""

LIT = 1e-3
"""Luminance from which a block has a meaningful factor."""

_SUSPECTS = {
    (): "The colours of neither half moved, only their difference: look at the noise, the samples,"
    " or how metrics are computed.",
    ("heuristic",): "Only the textbook half moved: look at its shading, or at how materials and"
    " lights are paired.",
    ("reference",): "Only the reference moved: look at the physical materials and lights, the"
    " integrator, or the version of Mitsuba.",
    HALVES: "Both halves moved: look at what they share, such as geometry, camera, materials or"
    " lights.",
}


def causes(check: Check) -> list[str]:
    """Return sentences on which half moved, where and how."""
    halves = tuple(half for half in HALVES if any(move.half == half for move in check.moved))
    said = [_SUSPECTS[halves]]
    for half in halves:
        said += _of_half(check, half)
    return said


def _of_half(check: Check, half: str) -> Iterator[str]:
    name = "textbook half" if half == "heuristic" else half
    factor = _factor(check, half)
    if factor is not None:
        yield f"The {name} has {factor:.3g} times the light everywhere: its level moved."
    else:
        yield f"The {name} moved {_where([m for m in check.moved if m.half == half], check, half)}."
    letters = {move.quantity.removeprefix(half)[1] for move in check.moved if move.half == half}
    if len(letters) < 3:
        colours = {"R": "red", "G": "green", "B": "blue"}
        found = " and ".join(colours[letter] for letter in "RGB" if letter in letters)
        yield f"Only {found} moved in the {name}: look at a colour."


def _factor(check: Check, half: str) -> float | None:
    """Return the common factor on all lit blocks; None if they have none."""
    before, after = (luminance(m.colours[half].blocks) for m in (check.before, check.after))
    lit = before > LIT
    ratios = after[lit] / before[lit]
    is_one = lit.any() and np.ptp(ratios) <= ALIKE * abs(ratios.mean())
    moved = abs(ratios.mean() - 1.0) > ALIKE if is_one else False
    return float(ratios.mean()) if moved else None


def _where(moved: Sequence[Move], check: Check, half: str) -> str:
    blocks = {move.block for move in moved if move.block}
    total = check.after.colours[half].blocks.shape[:2]
    if not blocks:
        return "in the mean of the image, but in no single block"
    change = np.abs(check.change(half)).sum(axis=-1)
    row, column = np.unravel_index(change.argmax(), change.shape)
    most = f"most in row {row + 1}, column {column + 1}"
    return f"in {len(blocks)} of {total[0] * total[1]} blocks, {most}"
