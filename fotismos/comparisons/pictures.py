"""Pictures of other renderers as a half: read, repeated as passes, and what is odd in them.

They are read by :mod:`fotismos.comparisons.picture_files`, placed by
:mod:`fotismos.comparisons.alignment`, and doubted by
:mod:`fotismos.comparisons.picture_mistakes`.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import repeat
from pathlib import Path
from time import perf_counter
from typing import Any, Self

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from fotismos.comparisons import alignment, picture_mistakes
from fotismos.comparisons.departure.criterion import decide
from fotismos.comparisons.departure.estimate import NoiseShown
from fotismos.comparisons.departure.mapped_sums import MappedDifference, MappedReference, shown_by
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.departure.tone_maps import TONE_MAPS, ToneMap
from fotismos.comparisons.halves import Halves, PassSums
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import PictureFile, read_file
from fotismos.comparisons.picture_mistakes import Mending, Names, NoisyImage
from fotismos.comparisons.records.comparison import Agreement, PictureFiles
from fotismos.comparisons.records.images import Comparison, Images, Light
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError
from fotismos.reference.records import Times
from fotismos.reference.rendering.passes import Size, Stream
from fotismos.reference.rendering.sums import without_noise

FEWEST = 2
"""Passes of single pictures, which are equal."""

USED = {
    "image", "reference", "mask", "transfer", "over", "tone_map", "pixels_per_degree",
    "colour_science", "allow_empty", "seed", "pairing",
}  # fmt: skip
"""Options that serve pictures, or are stated without being given; the others are of a scene."""

SAME = 0.01
"""ΔE2000 to which a picture equals the textbook half, away from edges."""

FLAT = 0.1
"""Largest edge, from 0 to 1, of a pixel away from edges."""


@dataclass(frozen=True)
class Pictures:
    """The pictures of a half, all of one size, as a source of passes: one after another.

    Several are repeats, whose spread gives the noise: each pass is the mean of one or more of them,
    as many in all passes as possible. A single picture serves for every pass. ``names`` are those
    of the files. ``transfer`` is the function that was stated for their values, None for the files'
    own; ``tone_map`` the curve by which they show light.
    """

    names: tuple[str, ...]
    files: tuple[PictureFile, ...]
    transfer: str | None = None
    tone_map: str | None = None
    times: list[float] = field(default_factory=list)
    variant: str = ""
    preparation: float = 0.0

    @classmethod
    def of(cls, name: str, images: Iterable[NDArray[Any]]) -> Self:
        """Return linear images (H, W, 3) that are in no file of their own, such as passes."""
        files = tuple(map(PictureFile.of, images))
        return cls(names=tuple(f"{name} {number}" for number in range(len(files))), files=files)

    @property
    def size(self) -> Size:
        """Width and height in pixels."""
        height, width = self.files[0].image.shape[:2]
        return width, height

    @property
    def most_passes(self) -> int | None:
        """The most passes that they give, an even number; None for one, which shows no noise."""
        count = len(self.files)
        return None if count == 1 else count - count % 2

    @property
    def shows_noise(self) -> bool:
        """Whether they show their noise: they are repeats, and not copies of one picture."""
        return len({file.digest for file in self.files}) > 1

    def active(self) -> AbstractContextManager[None]:
        """Return a context that does nothing."""
        return nullcontext()

    def passes(
        self, count: int, size: Size | None = None, stream: Stream = Stream.COMPARED, seed: int = 0
    ) -> Iterator[np.ndarray]:
        """Yield ``count`` passes (H, W, 3), which are the same for all streams and seeds."""
        groups = min(count, len(self.files))
        means = [_mean(self.files[number::groups]) for number in range(groups)]
        for number in range(count):
            self.times.append(0.0)  # they were read before
            yield means[number % groups]

    def pass_times(self) -> Times:
        """Return the times of the passes, which are read already."""
        return Times.of(self.times, 0.0)

    @cached_property
    def mean(self) -> Floats:
        """Their mean, (H, W, 3)."""
        return _mean(self.files)

    @property
    def two_halves(self) -> tuple[Floats, Floats] | None:
        """The means of two halves, whose difference shows the noise; None for one picture."""
        if len(self.files) == 1:
            return None
        return _mean(self.files[0::2]), _mean(self.files[1::2])

    @property
    def opaque(self) -> NDArray[np.bool_]:
        """Where all of them are opaque, (H, W)."""
        opaque: NDArray[np.bool_] = np.all([file.opaque for file in self.files], axis=0)
        return opaque

    def record(self) -> PictureFiles:
        """Return the record of the files."""
        return PictureFiles(
            files=self.names,
            digests=tuple(file.digest for file in self.files),
            transfer=self.transfer,
            tone_map=self.tone_map,
            notes=tuple(dict.fromkeys(note for file in self.files for note in file.notes)),
            repeats=len(self.files),
        )


def _mean(files: Sequence[PictureFile]) -> Floats:
    """Return the mean of pictures, (H, W, 3); of one it is the picture itself."""
    if len(files) == 1:
        return files[0].image
    mean: Floats = np.mean([file.image for file in files], axis=0)
    return mean


class MappedPassSums(PassSums):
    """Running sums of passes, of which the reference is shown by a tone map."""

    def __init__(self, counted: NDArray[np.bool_], tone_map: ToneMap) -> None:
        super().__init__(counted)
        self._mapped = MappedReference(counted, tone_map)
        self._reference = self._mapped
        self._difference = MappedDifference(counted, self._mapped)

    def images(self) -> Images:
        """Return the means so far, in single precision, like the files; nothing is marked yet."""
        return replace(super().images(), light=self._mapped.light())


class StillSums(PassSums):
    """Sums of two single pictures, whose passes are all alike: they show no noise.

    The reference is shown by a tone map, if one is given.
    """

    def __init__(self, counted: NDArray[np.bool_], tone_map: ToneMap | None) -> None:
        self.counted = counted
        self.passes = 0
        self._tone_map = tone_map
        self._pictures: tuple[Floats, ...] = ()

    def add(self, heuristic: Any, reference: Any) -> None:
        """Count a pass; all are the first one."""
        self._pictures = (heuristic, reference)
        self.passes += 1

    def noise_percentile(self, distance: Callable[[np.ndarray, np.ndarray], np.ndarray]) -> float:
        """Return 0: no noise is seen."""
        return 0.0

    def images(self) -> Images:
        """Return the pictures; nothing is marked yet."""
        picture, light = self._pictures
        none = np.broadcast_to(np.float32(0.0), light.shape)
        shown = light if self._tone_map is None else shown_by(self._tone_map, light)
        return Images(
            heuristic=picture,
            reference=shown,
            reference_stderr=none,
            difference=without_noise(picture - shown, self.counted, passes=self.passes),
            maps={},
            significant=np.zeros(self.counted.shape),
            counted=self.counted,
            light=None if self._tone_map is None else Light(mean=light, standard_error=none),
        )


# --- Reading -----------------------------------------------------------------------------------


@dataclass(frozen=True)
class GivenPictures:
    """The pictures that options name for either half, and for the pixels that count.

    ``settings`` are those of an engine's settings, which stand side by side in place of ``image``.
    """

    image: Pictures | None = None
    reference: Pictures | None = None
    mask: NDArray[np.bool_] | None = None
    settings: tuple[Pictures, ...] = ()

    @property
    def halves(self) -> tuple[Pictures, ...]:
        """Those of the halves, and of the settings."""
        halves = (self.image, self.reference, *self.settings)
        return tuple(half for half in halves if half is not None)

    @property
    def passes(self) -> int | None:
        """The passes of both halves; None if each is one picture, or rendered."""
        halves = (self.image, self.reference)
        counts = [half.most_passes for half in halves if half is not None]
        return min((count for count in counts if count is not None), default=None)

    @property
    def noise_shown(self) -> NoiseShown:
        """Whether the repeats show the noise of all pictures, of a part of them, or of none."""
        shown = [half.shows_noise for half in self.halves]
        if all(shown):
            return "all"
        return "part" if any(shown) else "none"

    def pass_sums(self, counted: NDArray[np.bool_]) -> PassSums:
        """Return sums of passes, in which the reference is shown as the pictures show light."""
        name = self.image.tone_map if self.image else None
        tone_map = None if name is None else TONE_MAPS[name]
        halves = [self.image, self.reference]
        if all(half is not None and len(half.files) == 1 for half in halves):
            return StillSums(counted, tone_map)
        return PassSums(counted) if tone_map is None else MappedPassSums(counted, tone_map)

    def where(self) -> NDArray[np.bool_]:
        """Return the pixels (H, W) that count: in the mask, and opaque in all pictures."""
        counted: NDArray[np.bool_] = np.all([half.opaque for half in self.halves], axis=0)
        if self.mask is not None:
            counted &= self.mask
        if not counted.any():
            raise InputError(
                "no pixel counts: the mask is black, or the pictures are transparent, everywhere."
                " Check the mask, or give the colour behind the pictures with `over`."
            )
        return counted

    def as_halves(self, name: str, options: Options, seconds: float = 0.0) -> Halves:
        """Return ``image`` and ``reference`` as halves; they were read within some seconds."""
        assert self.image is not None, "the test image is missing"
        assert self.reference is not None, "the reference is missing"
        return Halves(
            name=name,
            options=options,
            first=self.image,
            second=self.reference,
            passes=self.passes or FEWEST,
            has=frozenset({"pictures"}),
            noise_shown=self.noise_shown,
            seconds={"reading": seconds},
            **self.parts(),
        )

    def sized(self, film: Size, options: Options) -> Options:
        """Return options with the resolution of the pictures, which must be the film's in shape.

        ``film`` is the width and height of the scene's film, in pixels.
        """
        if not self.halves:
            return options
        width, height = self.halves[0].size
        name = self.halves[0].names[0]
        if options.resolution and options.resolution != (width, height):
            raise InputError(
                f"{name}: it has {width}x{height} pixels, and"
                f" `resolution={_by(options.resolution)}` is requested. Omit the option."
            )
        if not options.resolution and abs(width * film[1] - height * film[0]) > max(film):
            raise InputError(  # more than a pixel apart
                f"{name}: it has {width}x{height} pixels, an aspect ratio of"
                f" {width / height:.4g}, and the scene's film {_by(film)},"
                f" {film[0] / film[1]:.4g}. Render the picture with the scene's camera, or ignore"
                f" the film's size with `resolution={width}x{height}`."
            )
        return options.changed(resolution=(width, height))

    def require_size_of_mask(self, options: Options, size: Size) -> None:
        """Ensure that the mask, if there is one, has a width and height."""
        if self.mask is not None and self.mask.shape[::-1] != size:
            height, width = self.mask.shape
            raise InputError(
                f"{options.mask}: the mask has {width}x{height} pixels, and the pictures"
                f" {_by(size)}. Give a mask of that size."
            )

    def parts(self) -> dict[str, Any]:
        """Return what halves have of the pictures, by the fields of :class:`Halves`."""
        named = {"picture": self.image, "reference_picture": self.reference}
        return {
            "pictures": {name: half.record() for name, half in named.items() if half is not None},
            "judge": self.judged,
            "where": self.where(),
            "sums": self.pass_sums,
        }

    def judged(
        self,
        comparison: Comparison,
        expected: Sequence[np.ndarray] = (),
        textbook: np.ndarray | None = None,
    ) -> Comparison:
        """Return a comparison with what is odd about the pictures, which it warns of first.

        ``expected`` and ``textbook`` are as for :func:`agreement`. Where a mistake is certain, so
        is a difference: without the mistake the pictures agree, so noise made none of it.
        """
        record = comparison.record
        images = comparison.images
        if self.image is not None:
            found = agreement(self.image, images, expected, Names(), textbook)
        else:
            assert self.reference is not None
            swapped = replace(
                images,
                heuristic=images.reference,
                reference=images.heuristic,
                reference_stderr=np.zeros_like(images.reference_stderr),
            )
            found = agreement(self.reference, swapped, expected, REFERENCE)
        found = structs.replace(found, odd=(*same_files(self), *found.odd, *unknown_noise(self)))
        is_certain = record.significant.certain or found.certain
        metrics = record.metrics
        if found.certain and decide(metrics[LEADING.name].visible) == "undecided":
            metrics = {**metrics, LEADING.name: metrics[LEADING.name].as_measured()}
        record = structs.replace(
            record,
            agreement=found,
            metrics=metrics,
            significant=structs.replace(record.significant, certain=is_certain),
            warnings=(*found.mistakes, *found.odd, *record.warnings),
        )
        return replace(comparison, record=record)


def two_pictures(options: Options, name: str) -> Halves:
    """Return the two pictures that options name, ``image`` and ``reference``, as halves."""
    begin = perf_counter()
    given = read_all(options)
    if given.image is None or given.reference is None:
        raise InputError("two pictures are needed: give `image` and `reference`.")
    require_no_scene(options)
    return given.as_halves(name, options, perf_counter() - begin)


def require_no_scene(options: Options, others: Iterable[str] = ()) -> None:
    """Raise `InputError` if options, or ``others`` that were given, need a scene."""
    if needed := sorted({*options.stated(), *others} - USED):
        shown = ", ".join(f"`{name}`" for name in needed)
        raise InputError(
            f"{shown}: this needs a scene, and pictures have none. Omit it, or give a scene."
        )


def read_all(options: Options, settings: Iterable[Sequence[str]] = ()) -> GivenPictures:
    """Return the pictures that options name, and those of settings, by the names of their files.

    All are of one size, and repeats of different names. With a scene that has settings, their
    pictures must be opaque.
    """
    image = _read(options.image, options, options.tone_map) if options.image else None
    reference = _read(options.reference, options) if options.reference else None
    shots = tuple(
        _read(names, options, options.tone_map, is_mask=reference is not None) for names in settings
    )
    mask = None
    if options.mask is not None:
        mask = np.any(read_file(options.mask, "linear", "black").image > 0, axis=-1)
    given = GivenPictures(image=image, reference=reference, mask=mask, settings=shots)
    if options.noise is not None and given.passes is not None:
        raise InputError(
            f"noise = {options.noise:g} and {given.passes} repeats: a noise target may need more"
            " passes than there are pictures. Give `spp` instead of `noise`."
        )
    require_one_size(
        (file.image for half in given.halves for file in half.files),
        [name for half in given.halves for name in half.names],
    )
    if given.halves:
        given.require_size_of_mask(options, given.halves[0].size)
    return given


def _read(
    names: Sequence[str], options: Options, tone_map: str | None = None, is_mask: bool = True
) -> Pictures:
    files = [read_file(name, options.transfer, options.over, is_mask=is_mask) for name in names]
    places = [str(Path(name).resolve()) for name in names]
    for name, place in zip(names, places, strict=True):
        if places.count(place) > 1:
            raise InputError(
                f"{name} is given {places.count(place)} times. Give each repeat once: they must"
                " differ in their noise."
            )
    return Pictures(
        names=tuple(names), files=tuple(files), transfer=options.transfer, tone_map=tone_map
    )


def require_one_size(images: Iterable[np.ndarray], names: Sequence[str] = ()) -> None:
    """Ensure that pictures are of one size; ``names`` are those of their files, if known."""
    known: dict[tuple[int, int], str] = {}
    for image, name in zip(images, names or repeat(""), strict=False):
        known.setdefault((image.shape[1], image.shape[0]), name)
    sizes = sorted(known)
    if len(sizes) > 1:
        (width, height), (wider, higher) = sizes[0], sizes[-1]
        shown = ", ".join(
            f"{_by(size)} ({known[size]})" if known[size] else _by(size) for size in sizes
        )
        sides = {"wide": wider / width, "high": higher / height}
        differing = [f"{by:.3g} times as {side}" for side, by in sides.items() if by != 1]
        larger = f"the last is {' and '.join(differing)} as the first"
        if (width, height) == (higher, wider):
            larger = "one of them looks turned by 90 degrees"
        raise InputError(
            f"pictures of {shown}: {larger}. Give pictures of one size; none is scaled."
        )


def _by(size: tuple[int, int]) -> str:
    return f"{size[0]}x{size[1]}"


# --- What is odd -------------------------------------------------------------------------------


REFERENCE = Names(picture="The reference picture", other="the other picture")


def agreement(
    pictures: Pictures,
    images: Images,
    expected: Sequence[np.ndarray],
    names: Names,
    textbook: np.ndarray | None = None,
) -> Agreement:
    """Return how pictures, the first of two images, agree with the other, and their mistakes.

    ``expected`` are maps (H, W) of edges that they may contain, besides those of the other image.
    ``textbook`` is the textbook half that they replace, (H, W, 3).
    """
    picture = images.heuristic
    other = images.reference
    counted = images.counted
    edges = [*expected, alignment.picture_edges(other)]
    # The other half is in its place: what a shift gains there, noise and shading make.
    by_noise = alignment.measure(other, expected) if expected else None

    def locate(mend: Mending) -> alignment.Place:
        """Return where the content is after a mending; without a shift if noise may make it."""
        place = alignment.measure(mend(pictures.mean), edges)
        files = pictures.files
        repeats = [mend(file.image) for file in files] if len(files) > 1 else []
        if alignment.is_doubtful(place, by_noise, repeats, edges):
            return replace(place, shift=None)
        return place

    place = locate(lambda image: image)
    error = images.reference_stderr
    mistakes = list(
        picture_mistakes.find(
            NoisyImage(picture, pictures.two_halves),
            NoisyImage(other, (other + error, other - error) if error.any() else None),
            counted,
            in_place=place,
            locate=locate,
            is_encoded=any(file.is_encoded for file in pictures.files),
            names=names,
            light=images.light or Light(mean=other, standard_error=error),
            tone_map=pictures.tone_map,
        )
    )
    odd = []
    if place.shift is None:
        odd.append(f"{names.picture}'s edges do not show whether it is aligned.")
    if textbook is not None and (equal := _equals(picture, textbook, counted)):
        odd.append(equal)
    return Agreement(
        shift=place.shift,
        edges=place.correlation,
        ratio=picture_mistakes.ratios(picture, other, counted),
        mistakes=tuple(mistake.sentence for mistake in mistakes),
        certain=any(mistake.is_certain for mistake in mistakes),
        odd=tuple(odd),
    )


def same_files(given: GivenPictures) -> Iterator[str]:
    """Yield which file of one half is also one of the other, byte for byte."""
    if given.image is None or given.reference is None:
        return
    ours = zip(given.image.files, given.image.names, strict=True)
    theirs = list(zip(given.reference.files, given.reference.names, strict=True))
    for file, name in ours:
        for other, other_name in theirs:
            if name == other_name:
                yield f"{name} is also the reference."
            elif file.digest == other.digest:
                yield f"{name} and {other_name} are the same file, byte for byte."


def unknown_noise(given: GivenPictures) -> Iterator[str]:
    """Yield which pictures do not show their noise, since there is one, or since all are equal."""
    named = {"The picture": given.image, "The reference": given.reference}
    single = [name for name, half in named.items() if half is not None and len(half.files) == 1]
    if single:
        subject = f"{single[0]} is" if len(single) == 1 else "Each picture is"
        yield (
            f"{subject} one file, so its noise is unknown and counts as a difference. Give repeats"
            " of other seeds to separate the two."
        )
    for name, half in named.items():
        if half is None or len(half.files) == 1:
            continue
        different = len({file.digest for file in half.files})
        if different == 1:
            yield (
                f"{name}'s repeats are the same file, byte for byte: if its renderer is random,"
                " give each its own seed."
            )
        elif different < len(half.files):
            yield (
                f"Of {name[0].lower()}{name[1:]}'s {len(half.files)} repeats, only {different}"
                " differ, so noise is taken for smaller than it is. Give each its own seed."
            )


def _equals(picture: np.ndarray, textbook: np.ndarray, counted: NDArray[np.bool_]) -> str:
    """Return that a picture equals the textbook half, away from edges; empty if it does not."""
    flat = counted & (alignment.picture_edges(textbook) < FLAT)
    if not flat.any():
        return ""
    apart = float(LEADING(picture, textbook)[flat].mean())
    if apart > SAME:
        return ""
    return f"The picture equals the textbook half to {LEADING.label} {SAME:g}, away from edges."
