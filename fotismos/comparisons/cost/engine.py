"""Settings of another renderer: the error of each picture, and a front with their given times.

A picture is compared with the reference that all methods of a study are compared with, or without a
scene with reference pictures (:func:`front_of_pictures`). Its error is that of one picture, like a
method's: the noise of a picture counts, and that of the reference does not
(:mod:`fotismos.comparisons.departure.noise`). The interval holds what is left of the reference's
noise, and Student's interval of the repeats; both are independent, so squares add up. A single
picture does not show its own noise, nor does a single reference, whose noise counts as error.

Given times are of another machine, program and load than measured ones. So the settings have a
front of their own, and no measured time is compared with theirs. If the kernel's own time on that
machine is given, each has the ratio to it, as methods have theirs.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from math import hypot
from typing import Generic, TypeVar

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from fotismos.comparisons.cost.front import fronted
from fotismos.comparisons.cost.timed_pictures import EngineTimes, TimedPicture
from fotismos.comparisons.departure.criterion import caution, decide
from fotismos.comparisons.departure.mapped_sums import MappedReference
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.departure.statistics import noise_floor, summarise
from fotismos.comparisons.departure.tone_maps import TONE_MAPS
from fotismos.comparisons.names import matching, with_files
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_mistakes import Names
from fotismos.comparisons.pictures import (
    FEWEST,
    GivenPictures,
    Pictures,
    agreement,
    read_all,
    require_no_scene,
    same_files,
    unknown_noise,
)
from fotismos.comparisons.records.departure import Summary, Viewing, VisibleShare
from fotismos.comparisons.records.engine import Engine, EngineCost, EngineSetting
from fotismos.comparisons.records.images import Images, Light
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.program import PICTURE_LIBRARIES, versions
from fotismos.reference.records import Interval, Pixels
from fotismos.reference.rendering.sums import DifferenceEstimate, DifferenceSums, student

AnyCost = TypeVar("AnyCost")


@dataclass(frozen=True)
class Study(Generic[AnyCost]):
    """Results of a study: its record, ``cost.json``, and its images.

    ``reference`` is (H, W, 3). ``settings`` are the given pictures, by the names of an engine's
    settings; ``methods`` are ``{method: (H, W, 3)}``, one rendering with the most samples of each.
    """

    record: AnyCost
    reference: Floats
    settings: Mapping[str, Floats] = field(default_factory=dict)
    methods: Mapping[str, Floats] = field(default_factory=dict)


@dataclass(frozen=True)
class Truth:
    """What settings are judged by: the passes of a reference, and the pixels (H, W) that count.

    ``reference.grouped`` holds groups of its passes, of which no other image is taken off.
    ``light`` is the reference before its tone map, if it has one. ``edges`` and ``textbook`` are as
    for :func:`fotismos.comparisons.pictures.agreement`.
    """

    reference: DifferenceEstimate
    counted: NDArray[np.bool_]
    viewing: Viewing
    light: Light | None = None
    edges: Sequence[Floats] = ()
    textbook: Floats | None = None


def front_of_pictures(
    options: Options, times: EngineTimes, name: str, command: str = ""
) -> Study[EngineCost]:
    """Judge the pictures of settings by reference pictures, without a scene.

    Options name the reference. ``name`` is that of the study, and ``command`` repeats it. Raises
    `InputError` if a picture cannot be read, if they differ in size, or if an option needs a scene.
    """
    require_no_scene(options)
    given = read(times, with_files(options))
    reference = given.reference
    if reference is None:
        raise InputError("pictures without a scene need a `reference`: give one, or a scene.")
    truth = _truth(reference, given.where(), options)
    engine = judged(given, times, truth, options.allow_empty)
    estimate = truth.reference
    floor = None
    if reference.most_passes is not None:
        floor = noise_floor(
            LEADING, estimate.mean, estimate.noise, mask=truth.counted, viewing=truth.viewing
        )
    record = EngineCost(
        scene=name,
        resolution=reference.size,
        reference_picture=reference.record(),
        noise_floor=floor,
        engine=engine,
        viewing=options.viewing,
        pixels=Pixels(counted=int(truth.counted.sum()), total=truth.counted.size),
        warnings=tuple(unknown_noise(GivenPictures(reference=reference))),
        versions=versions(PICTURE_LIBRARIES),
        command=command,
    )
    return Study(record=record, reference=truth.reference.mean, settings=shown(given, times))


def _truth(reference: Pictures, counted: NDArray[np.bool_], options: Options) -> Truth:
    """Return reference pictures as passes, shown by the tone map of the others."""
    sums: DifferenceSums
    if options.tone_map is None:
        sums = DifferenceSums(counted)
    else:
        sums = MappedReference(counted, TONE_MAPS[options.tone_map])
    count = reference.most_passes or FEWEST
    for picture in reference.passes(count):
        sums.add(picture)
    return Truth(
        reference=sums.estimate(),
        counted=counted,
        viewing=options.viewing,
        light=sums.light() if isinstance(sums, MappedReference) else None,
    )


def read(times: EngineTimes, options: Options) -> GivenPictures:
    """Read the pictures of all settings; InputError if they cannot be put on one front."""
    given = read_all(options, [matching(picture.patterns) for picture in times.pictures])
    for picture, pictures in zip(times.pictures, given.settings, strict=True):
        images = [file.image for file in pictures.files]
        count = len({image.tobytes() for image in images})
        # As many as there are: noise. One: a renderer without noise. Else a seed came twice.
        if 1 < count < len(images):
            raise InputError(
                f"{', '.join(picture.patterns)}: {len(images)} repeats, of which only {count}"
                " differ. Give each its own seed."
            )
    return given


def shown(given: GivenPictures, times: EngineTimes) -> dict[str, Floats]:
    """Return the first picture of each setting, by its name."""
    settings = zip(times.pictures, given.settings, strict=True)
    return {picture.name: pictures.files[0].image for picture, pictures in settings}


def judged(
    given: GivenPictures, times: EngineTimes, truth: Truth, allow_empty: bool = False
) -> Engine:
    """Return the settings with their errors, on a front of their own."""
    settings = [
        _setting(picture, GivenPictures(image=pictures, reference=given.reference), truth,
                 times.kernel_s, allow_empty)
        for picture, pictures in zip(times.pictures, given.settings, strict=True)
    ]  # fmt: skip
    return Engine(
        settings=fronted(settings),
        machine=times.machine,
        kernel_s=times.kernel_s,
    )


def _setting(
    picture: TimedPicture,
    given: GivenPictures,
    truth: Truth,
    kernel_s: float | None,
    allow_empty: bool,
) -> EngineSetting:
    """Return a setting with its error; ``given`` has its pictures, and the reference's if given."""
    pictures = given.image
    assert pictures is not None, "a setting has pictures"
    summaries = [_summary(file.image, truth) for file in pictures.files]
    error = of_repeats(
        [Interval(value=one.debiased, low=one.low, high=one.high) for one in summaries]
    )
    # For each threshold, the shares of all repeats.
    shares = zip(*(one.visible for one in summaries), strict=True)
    visible = tuple(_share(of_threshold) for of_threshold in shares)
    passing = [share.threshold for share in visible if decide(visible, share.threshold) == "pass"]
    images = Images(
        heuristic=pictures.mean,
        reference=truth.reference.mean,
        reference_stderr=truth.reference.standard_error,
        maps={},
        significant=np.zeros_like(truth.counted),
        counted=truth.counted,
        light=truth.light,
    )
    doubt = caution(
        images.heuristic[truth.counted],
        images.reference[truth.counted],
        name=picture.name,
        allow_empty=allow_empty,
        is_picture=True,
        exposure=truth.viewing.exposure,
    )
    agreed = agreement(pictures, images, truth.edges, Names(), truth.textbook)
    odd = [*agreed.odd, *same_files(given), *unknown_noise(GivenPictures(image=pictures))]
    agreed = structs.replace(agreed, odd=(*([doubt] if doubt else []), *odd))
    return EngineSetting(
        method=picture.name,
        seconds=Interval(value=picture.seconds, low=picture.seconds, high=picture.seconds),
        error=Interval(value=error.value, low=max(error.low, 0.0), high=error.high),
        visible=visible,
        passes_at=min(passing, default=None),
        p95=float(np.mean([one.p95 for one in summaries])),
        ratio=None if kernel_s is None else picture.seconds / kernel_s,
        picture=pictures.record(),
        agreement=agreed,
    )


def _summary(image: Floats, truth: Truth) -> Summary:
    """Return the ΔE2000 of one picture to the reference, whose noise is taken out."""
    reference = truth.reference
    # The groups hold means of the reference's passes; wanted are differences from it.
    places = reference.grouped.places
    means = image.reshape(-1, 3)[places] - reference.grouped.means
    summary, _ = summarise(
        LEADING,
        image,
        reference.mean,
        truth.counted,
        viewing=truth.viewing,
        noise=reference.noise,
        grouped=replace(reference.grouped, means=means),
    )
    return summary


def of_repeats(repeats: Sequence[Interval]) -> Interval:
    """Return the mean of a number over repeats, with an interval.

    The repeats' own intervals hold an error that all share. What they scatter comes on top.
    """
    value = float(np.mean([one.value for one in repeats]))
    below = value - float(np.mean([one.low for one in repeats]))
    above = float(np.mean([one.high for one in repeats])) - value
    scatter = 0.0
    if len(repeats) > 1:
        deviation = float(np.std([one.value for one in repeats], ddof=1))
        scatter = student(0.0, deviation / len(repeats) ** 0.5, len(repeats)).high
    return Interval(
        value=value, low=value - hypot(below, scatter), high=value + hypot(above, scatter)
    )


def _share(repeats: Sequence[VisibleShare]) -> VisibleShare:
    share = of_repeats(repeats)
    return VisibleShare(
        threshold=repeats[0].threshold,
        value=share.value,
        low=max(share.low, 0.0),
        high=min(share.high, 1.0),
    )
