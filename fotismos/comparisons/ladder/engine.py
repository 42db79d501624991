"""Settings of another renderer: each picture is compared, and a front has their given times.

A setting is a comparison of its picture with the scene's physical picture, or without a scene with
reference pictures (:func:`front_of_pictures`).

Given times are of another machine, program and load than measured ones. So the settings have a
front of their own, and no measured time is compared with theirs. If the kernel's own time on that
machine is given, each has the ratio to it, as methods have theirs.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Generic, TypeVar

from msgspec import structs

from fotismos.comparisons.compare import look
from fotismos.comparisons.departure.criterion import decide
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.halves import Halves
from fotismos.comparisons.ladder.front import fronted
from fotismos.comparisons.ladder.timed_pictures import EngineTimes, TimedPicture
from fotismos.comparisons.names import matching, with_files
from fotismos.comparisons.options import Options
from fotismos.comparisons.pictures import (
    GivenPictures,
    Pictures,
    read_all,
    require_no_scene,
    unknown_noise,
)
from fotismos.comparisons.records.engine import Engine, EngineCost, EngineSetting
from fotismos.comparisons.records.images import Comparison
from fotismos.comparisons.steps import PICTURES
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.program import PICTURE_LIBRARIES, versions
from fotismos.reference.records import Interval, Pixels

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
    where = given.where()

    def halves(picture: TimedPicture, pictures: Pictures) -> Halves:
        both = replace(given, image=pictures, settings=())
        # All settings are judged at the same pixels.
        return replace(both.as_halves(picture.name, options), where=where)

    compared = compare_all(given, times, halves)
    floors = [
        comparison.record.metrics[LEADING.name].noise_floor for comparison in compared.values()
    ]
    record = EngineCost(
        scene=name,
        resolution=reference.size,
        reference_picture=reference.record(),
        noise_floor=None if reference.most_passes is None else min(floors),
        engine=engine(compared, times),
        viewing=options.viewing,
        pixels=Pixels(counted=int(where.sum()), total=where.size),
        warnings=tuple(unknown_noise(GivenPictures(reference=reference))),
        versions=versions(PICTURE_LIBRARIES),
        command=command,
    )
    shown = next(iter(compared.values())).images.reference
    return Study(record=record, reference=shown, settings=first_pictures(given, times))


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


def first_pictures(given: GivenPictures, times: EngineTimes) -> dict[str, Floats]:
    """Return the first picture of each setting, by its name."""
    settings = zip(times.pictures, given.settings, strict=True)
    return {picture.name: pictures.files[0].image for picture, pictures in settings}


def compare_all(
    given: GivenPictures, times: EngineTimes, halves: Callable[[TimedPicture, Pictures], Halves]
) -> dict[str, Comparison]:
    """Return the comparison of each setting, by its name, from the halves of its pictures."""
    compared = {}
    for picture, pictures in zip(times.pictures, given.settings, strict=True):
        both = halves(picture, pictures)
        compared[picture.name] = PICTURES.add(look(both), both, None)
    return compared


def engine(compared: Mapping[str, Comparison], times: EngineTimes) -> Engine:
    """Return the compared settings with their times, on a front of their own."""
    settings = [
        setting(compared[picture.name], picture, times.kernel_s) for picture in times.pictures
    ]
    return Engine(settings=fronted(settings), machine=times.machine, kernel_s=times.kernel_s)


def setting(comparison: Comparison, picture: TimedPicture, kernel_s: float | None) -> EngineSetting:
    """Return a setting with its error and its time."""
    record = comparison.record
    lead = record.metrics[LEADING.name]
    assert record.agreement is not None, "pictures were compared"
    assert record.picture is not None, "pictures were compared"
    passing = [
        share.threshold for share in lead.visible if decide(lead.visible, share.threshold) == "pass"
    ]
    doubts = (record.caution,) if record.caution else ()
    agreed = structs.replace(record.agreement, odd=(*doubts, *record.agreement.odd))
    return EngineSetting(
        method=picture.name,
        seconds=Interval(value=picture.seconds, low=picture.seconds, high=picture.seconds),
        error=Interval(value=lead.debiased, low=lead.low, high=lead.high),
        visible=lead.visible,
        passes_at=min(passing, default=None),
        p95=lead.p95,
        ratio=None if kernel_s is None else picture.seconds / kernel_s,
        picture=record.picture,
        agreement=agreed,
    )
