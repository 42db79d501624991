"""Check one scene against its baseline."""

from dataclasses import dataclass

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.case import Case
from comparisons.check.measurement import PASSES, Measurement, Pictures, block_edges, measure
from comparisons.check.moved import LEVEL, Move, differences, moved
from comparisons.compare import guarded
from comparisons.departure.objects import shares
from comparisons.departure.spaces import Array, luminance
from comparisons.options import Options
from heuristic.errors import InputError
from reference.rendering.gbuffer import Owners, gbuffer, image_size
from reference.rendering.passes import Progress
from reference.scene.preparation import film_size
from reference.scene.source import Source

LONGEST = 64
"""Default number of pixels along the longer side of a measured scene."""


@dataclass(frozen=True)
class Check:
    """A scene compared with its baseline.

    Attributes
    ----------
    before, after
        Measurements of the baseline, and of now with the same options.
    moves
        Every quantity tested.
    moved
        Those that moved by more than chance and rounding explain.
    level
        Chance of a false alarm.
    pictures
        Both halves now.
    seen
        The objects of the scene, if something moved.
    """

    before: Measurement
    after: Measurement
    moves: tuple[Move, ...]
    moved: tuple[Move, ...]
    level: float
    pictures: Pictures
    seen: Owners | None = None

    @property
    def passed(self) -> bool:
        """Whether nothing moved."""
        return not self.moved

    def change(self, half: str) -> Array:
        """Return the change of a half's blocks, (rows, columns, 3) linear RGB."""
        return self.after.colours[half].blocks - self.before.colours[half].blocks

    def objects(self, half: str, before: NDArray[np.floating] | None = None) -> dict[str, float]:
        """Return each object's share of a half's change, the largest first.

        ``before`` is the half's picture when the baseline was made. If it is omitted, or of another
        size, each block's change is spread evenly over its pixels.
        """
        if self.seen is None:
            return {}
        now = getattr(self.pictures, half)
        if before is None or before.shape != now.shape:
            change = luminance(np.abs(self.change(half)))
            rows, columns = (np.diff(block_edges(side)) for side in now.shape[:2])
            spread = change.repeat(rows, axis=0).repeat(columns, axis=1)
        else:
            spread = luminance(np.abs(now - before))
        return shares(spread, self.seen)

    def p_values(self, half: str) -> Array:
        """Return the smallest corrected p-value of each block of a half."""
        values = np.ones(self.after.colours[half].blocks.shape[:2])
        for move in self.moves:
            if move.half == half and move.block:
                block = move.block[0] - 1, move.block[1] - 1
                values[block] = min(values[block], move.p_corrected)
        return values


@dataclass(frozen=True)
class Measured:
    """A scene just measured: the measurement, pictures, samples per pixel, and the scene."""

    measurement: Measurement
    pictures: Pictures
    spp: int
    scene: mi.Scene


def measure_scene(
    source: Source, options: Options, passes: int = PASSES, progress: Progress | None = None
) -> Measured:
    """Measure a scene in the current variant.

    Parameters
    ----------
    source
        The scene.
    options
        What is rendered; ``spp`` counts all passes, and is the plan's if omitted.
    passes
        Independent passes.
    progress
        See :func:`comparisons.compare.compare`.
    """
    ready = guarded(source, options)
    spp = options.spp or ready.reference.spp * ready.passes
    for half in (ready.heuristic, ready.reference):
        half.spp = max(1, spp // passes)
    found, pictures = measure(ready, options.seed, passes, options.viewing, progress)
    return Measured(found, pictures, spp, ready.scene)


def check(
    source: Source,
    options: Options,
    before: Measurement,
    level: float = LEVEL,
    progress: Progress | None = None,
) -> Check:
    """Measure a scene as before, and return what moved.

    Parameters
    ----------
    source, options, progress
        See :func:`measure_scene`; ``options`` are the baseline's. With its seed, an unchanged scene
        gives the same images on the same machine; the test also holds for other seeds.
    before
        The baseline's measurement; metrics that it lacks are not tested.
    level
        Chance of a false alarm, over all quantities of this scene.
    """
    now = measure_scene(source, options, before.passes, progress)
    after = now.measurement.of(before.metrics)
    shapes = [m.colours["reference"].blocks.shape for m in (before, after)]
    if shapes[0] != shapes[1]:
        raise InputError(
            f"{source.name}: the baseline has {shapes[0][0]} by {shapes[0][1]} blocks, but the"
            f" scene {shapes[1][0]} by {shapes[1][1]}. Write it again with --update."
        )
    moves = differences(before, after)
    found = tuple(moved(moves, level))
    objects = gbuffer(now.scene, *image_size(now.scene)).shape if found else None
    return Check(before, now.measurement, moves, found, level, now.pictures, objects)


def made_small(case: Case) -> Case:
    """Return a case with its film reduced to `LONGEST`, unless it sets a resolution."""
    if case.request.resolution is not None:
        return case
    sides = film_size(case.source.parse(), case.options.sensor)
    scale = min(1.0, LONGEST / max(sides))
    return case.asking(resolution=tuple(max(1, round(side * scale)) for side in sides))
