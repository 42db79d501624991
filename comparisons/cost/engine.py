"""Settings of another renderer: the error of each picture, and a front with their given times.

A picture is compared with the reference that all methods of a study are compared with. Its error is
that of one picture, like a method's: the noise of a picture counts, and that of the reference does
not (:mod:`fotismos.comparisons.departure.noise`). The interval holds what is left of the
reference's noise, and Student's interval of the repeats; both are independent, so squares add up. A
single picture does not show its own noise.

Given times are of another machine, program and load than measured ones. So the settings have a
front of their own, and no measured time is compared with theirs. If the kernel's own time on that
machine is given, each has the ratio to it, as methods have theirs.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import hypot

import numpy as np
from msgspec import structs

from fotismos.comparisons.alignment import picture_edges
from fotismos.comparisons.comparison import Images, MeanError
from fotismos.comparisons.cost.cost_record import Engine, EngineSetting
from fotismos.comparisons.cost.front import fronted
from fotismos.comparisons.cost.measure import Measurements
from fotismos.comparisons.cost.methods import all_methods
from fotismos.comparisons.cost.timed_pictures import EngineTimes, TimedPicture
from fotismos.comparisons.departure.criterion import decide
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.departure.noise import VisibleShare
from fotismos.comparisons.departure.statistics import Summary, summarise
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import matching, read_file
from fotismos.comparisons.picture_mistakes import Names
from fotismos.comparisons.pictures import (
    TEMPLATE_SPP,
    GivenPictures,
    Pictures,
    agreement,
    at_size_of_pictures,
    unknown_noise,
)
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.records import Interval
from fotismos.reference.rendering.sums import student
from fotismos.reference.scene.source import Source


@dataclass(frozen=True)
class Repeated:
    """A setting whose picture is read: its files, one for each repeat."""

    given: TimedPicture
    pictures: Pictures

    @property
    def images(self) -> list[Floats]:
        """The repeats, each (H, W, 3)."""
        return [file.image for file in self.pictures.files]


def read(times: EngineTimes, options: Options) -> tuple[Repeated, ...]:
    """Read the pictures of all settings; InputError if they cannot be put on one front."""
    known = {name for method in all_methods() for name in (method.name, *method.names)}
    settings = []
    for given in times.pictures:
        if given.name in known:
            raise InputError(f"{given.name!r} is a method of the study: give another name.")
        names = matching([given.pattern])
        files = tuple(read_file(name, options.transfer, options.over) for name in names)
        found = Pictures(names=names, files=files, transfer=options.transfer)
        settings.append(Repeated(given=given, pictures=found))
    _require_one_size(settings)
    for setting in settings:
        count = len({image.tobytes() for image in setting.images})
        # As many as there are: noise. One: a renderer without noise. Else a seed came twice.
        if 1 < count < len(setting.images):
            raise InputError(
                f"{setting.given.pattern}: {len(setting.images)} repeats, of which only {count}"
                " differ. Give each its own seed."
            )
    return tuple(settings)


def _require_one_size(settings: Sequence[Repeated]) -> None:
    first = settings[0]
    height, width = first.images[0].shape[:2]
    for setting in settings:
        for name, image in zip(setting.pictures.names, setting.images, strict=True):
            rows, columns = image.shape[:2]
            if (rows, columns) != (height, width):
                raise InputError(
                    f"{name} has {columns}x{rows} pixels, and {first.pictures.names[0]}"
                    f" {width}x{height}: give pictures of one size."
                )


def at_their_size(source: Source, options: Options, settings: Sequence[Repeated]) -> Options:
    """Return options whose resolution is that of the pictures, as the scene's film allows it."""
    given = GivenPictures(image=settings[0].pictures)
    film = film_size(source.parse(), options.sensor)
    return at_size_of_pictures(film, given, options)


def judged(settings: Sequence[Repeated], times: EngineTimes, found: Measurements) -> Engine:
    """Return the settings with their errors, on a front of their own."""
    textbook = np.array(found.ready.heuristic.sampled(TEMPLATE_SPP).render(0), float)
    edges = [found.ready.geometry_edges(), picture_edges(textbook)]
    judged = [_setting(setting, times, found, edges, textbook) for setting in settings]
    return Engine(
        settings=fronted(judged),
        machine=times.machine,
        kernel_s=times.kernel_s,
    )


def _setting(
    setting: Repeated,
    times: EngineTimes,
    found: Measurements,
    edges: Sequence[Floats],
    textbook: Floats,
) -> EngineSetting:
    """Return a setting with its error; ``edges`` and ``textbook`` are as for `agreement`."""
    seconds = setting.given.seconds
    summaries = [_summary(image, found) for image in setting.images]
    error = of_repeats(
        [Interval(value=one.debiased, low=one.low, high=one.high) for one in summaries]
    )
    # For each threshold, the shares of all repeats.
    shares = zip(*(one.visible for one in summaries), strict=True)
    visible = tuple(_share(of_threshold) for of_threshold in shares)
    passing = [share.threshold for share in visible if decide(visible, share.threshold) == "pass"]
    images = Images(
        heuristic=setting.pictures.mean,
        reference=found.reference.mean,
        reference_stderr=found.reference.standard_error,
        maps={},
        significant=np.zeros_like(found.ready.counted),
        counted=found.ready.counted,
    )
    given = GivenPictures(image=setting.pictures)
    agreed = agreement(setting.pictures, images, edges, Names(), textbook)
    agreed = structs.replace(agreed, odd=(*agreed.odd, *unknown_noise(given)))
    return EngineSetting(
        method=setting.given.name,
        seconds=Interval(value=seconds, low=seconds, high=seconds),
        error=MeanError(value=error.value, low=max(error.low, 0.0), high=error.high),
        visible=visible,
        passes_at=min(passing, default=None),
        p95=float(np.mean([one.p95 for one in summaries])),
        ratio=None if times.kernel_s is None else seconds / times.kernel_s,
        picture=setting.pictures.record(),
        agreement=agreed,
    )


def _summary(image: Floats, found: Measurements) -> Summary:
    """Return the ΔE2000 of one picture to the reference, whose noise is taken out."""
    reference = found.reference
    # The groups hold means of the reference's passes; wanted are differences from it.
    places = reference.grouped.places
    means = image.reshape(-1, 3)[places] - reference.grouped.means
    summary, _ = summarise(
        LEADING,
        image,
        reference.mean,
        found.ready.counted,
        viewing=found.options.viewing,
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
