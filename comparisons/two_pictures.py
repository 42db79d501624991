"""Comparing two pictures without a scene: neither has a plan, a price, effects or terms."""

from dataclasses import dataclass, replace
from time import perf_counter

import numpy as np
from msgspec import structs

from fotismos.comparisons import pictures
from fotismos.comparisons.comparison import (
    PICTURE_LIBRARIES,
    Comparison,
    ComparisonRecord,
    TimeSpent,
    versions,
)
from fotismos.comparisons.departure.colour import BLACK
from fotismos.comparisons.departure.metrics import LEADING, METRICS, declared
from fotismos.comparisons.estimates import Estimates, PassSums, measure, summarised
from fotismos.comparisons.options import Options
from fotismos.heuristic.errors import InputError

FEWEST = 2
"""Passes of two single pictures, which are equal."""

USED = {
    "image", "reference", "mask", "transfer", "over", "tone_map", "pixels_per_degree",
    "colour_science", "allow_empty", "seed",
}  # fmt: skip
"""Options that serve pictures; the others are of a scene."""


@dataclass(frozen=True)
class FirstLook:
    """Two pictures, of which only what a page shows first is measured.

    ``comparison`` has the leading metric and the declared ones, and no mistakes.
    """

    options: Options
    given: pictures.GivenPictures
    estimates: Estimates
    comparison: Comparison


def compare_pictures(options: Options, name: str, command: str = "") -> Comparison:
    """Compare the pictures that options name: ``image`` with ``reference``.

    Both may be repeats, whose spread gives their noise. ``name`` is that of the comparison, and
    ``command`` repeats it. Raises `InputError` if a picture cannot be read, if they differ in size,
    or if both are black.
    """
    return finish(look(options, name, command))


def look(options: Options, name: str, command: str = "") -> FirstLook:
    """Read two pictures, and measure what a page shows first; see :func:`compare_pictures`."""
    stages: dict[str, float] = {}
    begin = perf_counter()
    given = pictures.read_all(options)
    if given.image is None or given.reference is None:
        raise InputError("two pictures are needed: give `image` and `reference`.")
    if others := sorted(set(options.stated()) - USED - {"pairing"}):
        raise InputError(
            f"{', '.join(others)}: this needs a scene, and two pictures have none. Omit it, or give"
            " a scene."
        )
    stages["reading"] = perf_counter() - begin

    begin = perf_counter()
    counted = given.where()
    passes = given.passes or FEWEST
    first = pictures.PictureHalf(given.image, passes)
    second = pictures.PictureHalf(given.reference, passes)
    sums = PassSums(counted, options.tone_map)
    for number in range(passes):
        sums.add(first.render(number), second.render(number))
    estimates = sums.estimates()
    numbers, images = measure(
        estimates,
        counted,
        options,
        is_random=given.passes is not None,
        names=(LEADING.name, *declared()),
    )
    stages["metrics"] = perf_counter() - begin

    record = ComparisonRecord(
        scene=name,
        heuristic=options.first_half,
        seed=options.seed,
        resolution=given.image.size,
        time=TimeSpent(heuristic=first.pass_times(), reference=second.pass_times(), stages=stages),
        versions=versions(PICTURE_LIBRARIES),
        command=command,
        caution=_caution(images.heuristic[counted], images.reference[counted], options),
        picture=given.image.record(),
        reference_picture=given.reference.record(),
        **numbers,
    )
    return FirstLook(
        options=options,
        given=given,
        estimates=estimates,
        comparison=Comparison(record=record, images=images),
    )


def finish(first: FirstLook) -> Comparison:
    """Return the whole comparison: with all metrics, and what is odd about the pictures."""
    begin = perf_counter()
    record = first.comparison.record
    images = first.comparison.images
    rest = [name for name in METRICS if name not in record.metrics]
    summaries, maps = summarised(first.estimates, images.counted, first.options, rest)
    summaries |= record.metrics
    record = structs.replace(record, metrics={name: summaries[name] for name in METRICS})
    whole = Comparison(record=record, images=replace(images, maps=images.maps | maps))
    spent = record.time.stages["metrics"] + perf_counter() - begin
    return pictures.with_records(whole.timed("metrics", spent), first.given)


def _caution(image: np.ndarray, reference: np.ndarray, options: Options) -> str:
    """Return what makes the difference of two pictures (N, 3) meaningless; often empty."""
    black = [bool(np.abs(values).max() < BLACK) for values in (image, reference)]
    if all(black) and not options.allow_empty:
        raise InputError(
            f"both pictures are black: no pixel that counts is brighter than {BLACK} of display"
            " white. Check the files, or allow it with `allow_empty`."
        )
    if any(black):
        return f"The {'picture' if black[0] else 'reference'} is black."
    if all(np.ptp(values, axis=0).max() == 0 for values in (image, reference)):
        return "Each picture is one colour, so nothing shows whether they belong together."
    return ""
