"""Comparing two pictures without a scene: neither has a plan, a price, effects or terms."""

from dataclasses import dataclass, replace
from time import perf_counter

from msgspec import structs

from fotismos.comparisons import pictures
from fotismos.comparisons.departure.criterion import caution, decide
from fotismos.comparisons.departure.metrics import LEADING, METRICS, declared
from fotismos.comparisons.estimates import Estimates, measure, summarised
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.comparison import ComparisonRecord, TimeSpent
from fotismos.comparisons.records.images import Comparison
from fotismos.comparisons.versions import PICTURE_LIBRARIES, versions
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering.passes import passes


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
    pictures.require_no_scene(options)
    stages["reading"] = perf_counter() - begin

    begin = perf_counter()
    counted = given.where()
    count = given.passes or pictures.FEWEST
    first = pictures.PictureHalf(given.image, count)
    second = pictures.PictureHalf(given.reference, count)
    sums = given.pass_sums(counted)
    for images_of_pass in passes((first, second), options.seed, count):
        sums.add(*images_of_pass.images)
    estimates = sums.estimates()
    numbers, images = measure(
        estimates,
        counted,
        options,
        noise_shown=given.noise_shown,
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
        caution=caution(
            images.heuristic[counted],
            images.reference[counted],
            name=name,
            allow_empty=options.allow_empty,
            is_picture=True,
            exposure=options.viewing.exposure,
        ),
        picture=given.image.record(),
        reference_picture=given.reference.record(),
        **numbers,
    )
    comparison = Comparison(record=record, images=images)
    shares = record.metrics[LEADING.name].visible
    if decide(shares, is_certain=record.significant.certain) == "undecided":
        significant = pictures.with_records(comparison, given).record.significant
        record = structs.replace(record, significant=significant)  # a mistake may decide
        comparison = replace(comparison, record=record)
    return FirstLook(options=options, given=given, estimates=estimates, comparison=comparison)


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
