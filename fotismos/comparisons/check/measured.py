"""What a check compares: passes of both halves of a scene, or repeats of a picture.

A baseline keeps the same, in a file.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from time import perf_counter

import numpy as np
from numpy.typing import NDArray

from fotismos.comparisons.case import Case
from fotismos.comparisons.compare import finish, look
from fotismos.comparisons.departure.blocks import shrunk
from fotismos.comparisons.departure.metrics import METRICS, RATIO, log2_luminance_ratio
from fotismos.comparisons.names import matching
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import read_file
from fotismos.comparisons.pictures import GivenPictures, Pictures, require_one_size
from fotismos.comparisons.prepared import guarded
from fotismos.comparisons.records.check import HALVES, PICTURE
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.departure import Viewing
from fotismos.heuristic.errors import InputError
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.rendering.gbuffer import ObjectIds
from fotismos.reference.rendering.passes import Progress, passes
from fotismos.reference.scene.source import Source

PASSES = 8
"""Passes of a scene's halves: fourteen degrees of freedom for a difference."""

LONGEST_SIDE = 64
"""Default number of pixels along the longer side of a scene."""

Halves = Mapping[str, Pictures]
"""Sources of passes by their names: the halves of a scene, or a picture."""


@dataclass(frozen=True)
class Measured:
    """What there is now: its halves, and of a scene the pixels that count, and their shapes.

    ``spp`` are the samples per pixel of all passes, and ``caution`` says why the numbers may mean
    nothing.
    """

    halves: Halves
    counted: NDArray[np.bool_] | None = None
    shapes: ObjectIds | None = None
    viewing: Viewing = field(default_factory=Viewing)
    spp: int = 0
    seconds: float = 0.0
    caution: str = ""

    @property
    def mask(self) -> NDArray[np.bool_] | None:
        """The pixels that count; None for all, also where a scene shows none that count."""
        return self.counted if self.counted is not None and self.counted.any() else None

    def compared(self, name: str, options: Options) -> ComparisonRecord:
        """Return the comparison of both halves of a scene, by all metrics."""
        halves = self.halves
        given = GivenPictures(
            image=halves["heuristic"], reference=halves["reference"], mask=self.mask
        )
        pictures = given.as_halves(name, options.changed(allow_empty=True))
        return finish(look(pictures), pictures, then=()).record

    def metrics(self, halves: Halves) -> dict[str, float] | None:
        """Return the error of a scene's textbook half by all metrics, for these halves of it.

        They are of the mean images over the pixels that count; None of a picture.
        """
        if self.counted is None:
            return None
        if not self.counted.any():
            return dict.fromkeys((*METRICS, RATIO.name), 0.0)
        test = halves["heuristic"].mean.astype(float)
        reference = halves["reference"].mean.astype(float)
        errors = {
            name: float(metric.mean(metric.against(reference, self.counted, self.viewing)(test)))
            for name, metric in METRICS.items()
        }
        stops = log2_luminance_ratio(test[self.counted], reference[self.counted])
        return errors | {RATIO.name: float(stops.mean())}


def made_small(case: Case) -> Case:
    """Return a case with its film reduced to `LONGEST_SIDE`, unless it sets a resolution."""
    if case.options.resolution is not None:
        return case
    sides = film_size(case.source.parse(), case.options.sensor)
    return case.changed(resolution=shrunk(sides, LONGEST_SIDE))


def measure_scene(
    source: Source, options: Options, count: int = PASSES, progress: Progress | None = None
) -> Measured:
    """Render a scene in the current variant, in so many independent passes.

    ``spp`` of the options counts all passes, and is the plan's if omitted.
    """
    begin = perf_counter()
    options.require_model("a check of a scene")
    ready = guarded(source, options)
    pass_spp = max(1, (options.spp or ready.spp) // count)
    sources = ready.heuristic.sampled(pass_spp), ready.reference.sampled(pass_spp)
    rendered = [
        [np.array(image) for image in images]
        for images in passes(sources, options.seed, count, progress=progress)
    ]
    halves = {
        name: Pictures.of(name, images)
        for name, images in zip(HALVES, zip(*rendered, strict=True), strict=True)
    }
    means = [half.mean for half in halves.values()]
    return Measured(
        halves=halves,
        counted=ready.counted,
        shapes=ready.traced().shape,
        viewing=options.viewing,
        spp=pass_spp * count,
        seconds=perf_counter() - begin,
        caution=ready.require_light(*means),
    )


def read_repeats(pattern: str, options: Options) -> Measured:
    """Read the repeats that match a pattern, ``render_*.exr`` or ``render_*.exr:LAYER``.

    ``transfer`` and ``over`` of the options say how.
    """
    begin = perf_counter()
    names = matching([pattern])
    files = [read_file(name, options.transfer, options.over) for name in names]
    require_one_size((file.image for file in files), names)
    repeats = Pictures(names=names, files=tuple(files), transfer=options.transfer)
    return picture(repeats, seconds=perf_counter() - begin)


def picture(repeats: Pictures, seconds: float = 0.0) -> Measured:
    """Return repeats of a picture, which must differ, unless all are equal: it has no noise."""
    images = [file.image for file in repeats.files]
    # Two of one seed would hide noise.
    if 1 < len({image.tobytes() for image in images}) < len(images):
        raise InputError("some repeats are equal: give each its own seed.")
    return Measured(halves={PICTURE: repeats}, seconds=seconds)
