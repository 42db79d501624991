"""Comparing two pictures without a scene: neither has a plan, a price, effects or terms."""

from time import perf_counter

from fotismos.comparisons import pictures
from fotismos.comparisons.caution import caution
from fotismos.comparisons.comparison import (
    PICTURE_LIBRARIES,
    Comparison,
    ComparisonRecord,
    TimeSpent,
    versions,
)
from fotismos.comparisons.estimates import PassSums, measure
from fotismos.comparisons.options import Options
from fotismos.heuristic.errors import InputError


def compare_pictures(options: Options, name: str, command: str = "") -> Comparison:
    """Compare the pictures that options name: ``image`` with ``reference``.

    Both may be repeats, whose spread gives their noise. ``name`` is that of the comparison, and
    ``command`` repeats it. Raises `InputError` if a picture cannot be read, if they differ in size,
    or if both are black.
    """
    stages: dict[str, float] = {}
    begin = perf_counter()
    given = pictures.read_all(options)
    if given.image is None or given.reference is None:
        raise InputError("two pictures are needed: give `image` and `reference`.")
    pictures.require_no_scene(options)
    stages["reading"] = perf_counter() - begin

    begin = perf_counter()
    counted = given.where()
    passes = given.passes or pictures.FEWEST
    first = pictures.PictureHalf(given.image, passes)
    second = pictures.PictureHalf(given.reference, passes)
    sums = PassSums(counted, options.tone_map)
    for number in range(passes):
        sums.add(first.render(number), second.render(number))
    estimates = sums.estimates()
    numbers, images = measure(estimates, counted, options, is_random=given.passes is not None)
    stages["metrics"] = perf_counter() - begin

    record = ComparisonRecord(
        scene=name,
        heuristic=options.first_half,
        seed=options.seed,
        resolution=given.image.size,
        time=TimeSpent(heuristic=first.pass_times(), reference=second.pass_times(), stages=stages),
        versions=versions(PICTURE_LIBRARIES),
        command=command,
        caution=caution(
            images.heuristic[counted],
            images.reference[counted],
            name=name,
            allow_empty=options.allow_empty,
            is_picture=True,
        ),
        **numbers,
    )
    return pictures.with_records(Comparison(record=record, images=images), given)
