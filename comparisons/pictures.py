"""Pictures of other renderers as the heuristic half, and what is odd in them.

They are read by :mod:`fotismos.comparisons.picture_files`.

The position is found by edges: a shift looks like wrong shading. Geometric edges, where the normal
or the hit changes, are in any picture of the same scene, however it is shaded. The heuristic half
mostly shares its edges too: it shows where light ends. The picture's edges are correlated with both
at all shifts up to :data:`REACH`, and the better agreement counts; a parabola through the highest
values gives the fraction of a pixel. A shift counts only if it improves the agreement by more than
a shift of the reference itself, which is in its place: noise and shading explain that much. Each
half of the repeats must show it, too.
"""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from math import pi
from time import perf_counter

import mitsuba as mi
import numpy as np
from msgspec import structs
from scipy.optimize import minimize_scalar

from fotismos.comparisons.comparison import Images, PictureRecord
from fotismos.comparisons.departure.colour import from_srgb, luminance, to_srgb
from fotismos.comparisons.departure.mapped_sums import Light
from fotismos.comparisons.departure.tone_maps import TONE_MAPS, ToneMap
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import PictureFile, read_file
from fotismos.heuristic.errors import InputError
from fotismos.reference.pairing.settings import film_size
from fotismos.reference.rendering.gbuffer import gbuffer
from fotismos.reference.rendering.renderer import Renderer, Times
from fotismos.reference.scene.source import Source


class PictureHalf:
    """Pictures (H, W, 3) as the passes of a heuristic half, one after another.

    Several are repeats, whose spread gives the noise; a single one serves for every pass. ``half``
    is the renderer that they replace; ``notes`` say how the files were read.
    """

    def __init__(self, files: Sequence[PictureFile], half: Renderer) -> None:
        self.images = [file.image for file in files]
        self.notes = tuple(dict.fromkeys(note for file in files for note in file.notes))
        self.half = half
        self.variant = half.variant
        self.times: list[float] = []
        self.compilation = 0.0

    def render(self, seed: int) -> mi.TensorXf:
        """Return the next picture; the seed is ignored."""
        begin = perf_counter()
        image = mi.TensorXf(self.images[len(self.times) % len(self.images)])
        self.times.append(perf_counter() - begin)
        return image

    def pass_times(self) -> Times:
        """Return the times of reading the pictures."""
        return Times.of(self.times, 0.0)


def read_all(options: Options) -> list[PictureFile]:
    """Return the pictures that options name: all of one size, and one or an even number."""
    files = [read_file(word, options.transfer, options.over) for word in options.image]
    require_one_size(file.image for file in files)
    if len(files) > 1 and options.noise is not None:
        raise InputError(
            f"noise = {options.noise:g} and {len(files)} repeats: a noise target may need more"
            " passes than there are pictures. Give `spp` instead of `noise`."
        )
    if len(files) > 1 and len(files) % 2:
        raise InputError(
            f"{len(files)} repeats: give one, or an even number, whose halves give the noise."
        )
    return files


def require_one_size(images: Iterable[np.ndarray]) -> None:
    """Ensure that pictures are of one size."""
    sizes = {image.shape[:2] for image in images}
    if len(sizes) > 1:
        shown = ", ".join(f"{width}x{height}" for height, width in sorted(sizes))
        raise InputError(f"pictures of {shown}: give repeats of one size.")


def at_size_of_pictures(source: Source, options: Options) -> Options:
    """Return options with the resolution of their pictures, which must be the film's in shape."""
    height, width = read_all(options)[0].image.shape[:2]
    film_sides = film_size(source.parse(), options.sensor)
    film = options.resolution or film_sides
    if options.resolution and film != (width, height):
        raise InputError(
            f"{options.image[0]}: it has {width}x{height} pixels, and"
            f" `resolution={film[0]}x{film[1]}` is requested. Omit the option."
        )
    if abs(width * film[1] - height * film[0]) > max(film):  # more than a pixel
        raise InputError(
            f"{options.image[0]}: it has {width}x{height} pixels, an aspect ratio of"
            f" {width / height:.4g}, and the scene's film {film[0]}x{film[1]},"
            f" {film[0] / film[1]:.4g}. Render the picture with the scene's camera, or ignore the"
            f" film's size with `resolution={width}x{height}`."
        )
    return options.changed(resolution=(width, height))


def read(word: str, transfer: str | None = None, over: str | None = None) -> np.ndarray:
    """Return a picture as linear RGB, (H, W, 3), float32; see :func:`picture_files.read_file`."""
    return read_file(word, transfer, over).image


# --- Position ----------------------------------------------------------------------------------

TEMPLATE_SPP = 16
"""Samples per pixel of the image whose edges are compared with a picture's."""

REACH = 8
FINER = 4
"""Largest shift considered in pixels, at most a quarter of the picture's smaller side; and rays
along each side of a pixel."""

LEAST = 0.08
"""Correlation below which edges are uninformative."""

DOUBTFUL = 2.0
"""A shift improves the agreement by more than this times what noise does."""
AGREEMENT = 1.0
"""Pixels by which the shifts of halves of the repeats may differ from that of all."""


@dataclass(frozen=True)
class Place:
    """Where a picture's content is.

    ``shift`` is by how many pixels (x, y) it is too far right and too low, None if its edges do not
    show it; ``correlation`` is that of the edges there, and ``gain`` by how much it is larger than
    without the shift.
    """

    shift: tuple[float, float] | None
    correlation: float
    gain: float


def geometry_edges(scene: mi.Scene, width: int, height: int) -> np.ndarray:
    """Return how much the geometry changes at each pixel, (H, W)."""
    surface = gbuffer(scene, (FINER * width, FINER * height))
    layers = np.concatenate([surface.normal, surface.hit[..., None]], axis=-1)
    # Means over the rays of a pixel, (H, W, 4).
    return _edges(layers.reshape(height, FINER, width, FINER, 4).mean(axis=(1, 3)))


def picture_edges(image: np.ndarray) -> np.ndarray:
    """Return how much an image changes at each pixel, in stops, up to 1."""
    light = np.maximum(luminance(image), 0)
    least = 0.02 * np.percentile(light, 95) + 1e-6
    return _edges(np.log2(light + least)[..., None])


def measure(image: np.ndarray, expected: Sequence[np.ndarray]) -> Place:
    """Return the position of an image (H, W, 3), encoded in any way.

    ``expected`` are maps (H, W) of edges that it may contain; the best agreement counts.
    """
    seen = picture_edges(image)
    return max((_shift(edges, seen) for edges in expected), key=lambda place: place.correlation)


def _edges(layers: np.ndarray) -> np.ndarray:
    """Return the size of the gradient, on a scale that is 1/2 at 1/4 and ends at 1."""
    size = np.sqrt((np.array(np.gradient(layers, axis=(0, 1))) ** 2).sum(axis=(0, -1)))
    strength: np.ndarray = size / (size + 0.25)
    return strength


def _shift(edges: np.ndarray, seen: np.ndarray) -> Place:
    reach = max(1, min(REACH, min(edges.shape) // 4))
    shifts = range(-reach, reach + 1)
    table = np.array([[_correlation(seen, edges, down=y, right=x) for x in shifts] for y in shifts])
    y, x = map(int, np.unravel_index(np.argmax(table), table.shape))
    highest = float(table[y, x])
    gain = highest - float(table[reach, reach])
    if highest < LEAST:
        return Place(shift=None, correlation=highest, gain=gain)
    down = y - reach + _vertex(table[:, x], y)
    right = x - reach + _vertex(table[y], x)
    return Place(shift=(float(right), float(down)), correlation=highest, gain=gain)


def _correlation(seen: np.ndarray, edges: np.ndarray, down: int, right: int) -> float:
    """Return the correlation of two maps where they overlap after a shift of the first."""
    height, width = edges.shape
    a = seen[max(down, 0) : height + down, max(right, 0) : width + right]
    b = edges[max(-down, 0) : height - down, max(-right, 0) : width - right]
    a = a - a.mean()
    b = b - b.mean()
    size = np.sqrt((a * a).sum() * (b * b).sum())
    return float((a * b).sum() / size) if size > 0 else 0.0


def _vertex(values: np.ndarray, peak: int) -> float:
    """Return the offset of the vertex of a parabola through a maximum and its neighbours."""
    if not 0 < peak < len(values) - 1:
        return 0.0
    before, top, after = values[peak - 1 : peak + 2]
    bend = before - 2 * top + after
    return 0.0 if bend >= 0 else float(0.5 * (before - after) / bend)


# --- Encoding ----------------------------------------------------------------------------------


CHANNELS = ("red", "green", "blue")


MISREADINGS: dict[str, Callable[[np.ndarray], np.ndarray]] = {
    "values look sRGB-encoded": from_srgb,
    "values look decoded twice": to_srgb,
    **{
        f"channels look like {', '.join(CHANNELS[channel] for channel in order)}": partial(
            np.take, indices=order, axis=-1
        )
        for order in permutations(range(3))
        if order != (0, 1, 2)
    },
}
"""Mistakes in encoding colours: their symptoms, and their inverses."""

TURNED = {
    "upside down": lambda image: image[::-1],
    "mirrored left to right": lambda image: image[:, ::-1],
    "turned by 180 degrees": lambda image: image[::-1, ::-1],
}

CURES = {
    "values look sRGB-encoded": ": give `transfer=srgb`, or write linear values",
    "values look decoded twice": ": give `transfer=linear`",
}

NEAR_PI = 0.05
"""Relative distance within which a level counts as a factor of pi."""


def factor_of_pi(level: float) -> str:
    """Name the factor of pi that a level is close to; empty if none."""
    if abs(level / pi - 1) < NEAR_PI:
        return "a missing division by pi"
    return "a division by pi too many" if abs(level * pi - 1) < NEAR_PI else ""


# --- Sentences ---------------------------------------------------------------------------------

SHIFT = 0.5
LEVEL = 2.0
TINT = 0.05
"""Smallest shift in pixels, factor of brightness, and relative difference of the channels' factors
that are reported."""

BLOCK = 8
EVEN = 0.2
"""A tint is the white's if it spreads by this share at most over blocks of this side in pixels."""

BETTER = 0.5
"""Largest share of the difference that a credible other reading of the values leaves."""


def picture_record(
    half: PictureHalf, scene: mi.Scene, options: Options, images: Images
) -> PictureRecord:
    """Return the record of the pictures that replace a heuristic half, with its warnings."""
    shown = images.heuristic[images.counted]
    reference = images.reference[images.counted]
    template = np.array(half.half.sampled(TEMPLATE_SPP).render(0), float)
    height, width = images.counted.shape
    # Edges that it may contain: of the geometry, of the textbook half, of the reference.
    expected = [geometry_edges(scene, width, height)]
    expected += [picture_edges(image) for image in (template, images.reference)]
    place = measure(np.mean(half.images, axis=0), expected)
    # The reference is in its place: what a shift gains there, noise and shading make.
    by_noise = measure(images.reference, expected[:2])
    is_gain_of_noise = place.gain > 0 and place.gain <= DOUBTFUL * by_noise.gain
    is_doubtful = is_gain_of_noise or not _halves_agree(half.images, expected, place)
    files = options.image
    ratio = ratios(shown, reference)
    record = PictureRecord(
        files=files,
        transfer=options.transfer,
        tone_map=options.tone_map,
        notes=half.notes,
        repeats=len(files),
        shift=None if is_doubtful else place.shift,
        edges=place.correlation,
        ratio=ratio,
    )
    linear = Light(mean=images.reference, standard_error=images.reference_stderr)
    odd = describe(
        record,
        images.heuristic,
        images.reference,
        counted=images.counted,
        light=images.light or linear,
    )
    return structs.replace(record, odd=tuple(odd))


def _halves_agree(
    repeats: Sequence[np.ndarray], expected: Sequence[np.ndarray], place: Place
) -> bool:
    """Return whether each half of the repeats (H, W, 3) shows the shift; True for one picture.

    Shifts that noise makes differ from half to half.
    """
    if place.shift is None or len(repeats) == 1:
        return True
    for first in range(2):
        shift = measure(np.mean(repeats[first::2], axis=0), expected).shift
        if shift is None or np.abs(np.subtract(shift, place.shift)).max() > AGREEMENT:
            return False
    return True


def ratios(picture: np.ndarray, reference: np.ndarray) -> tuple[float, float, float]:
    """Return the means of a picture's channels over those of the reference, both (N, 3)."""
    if picture.max() <= 1:  # clipped at display white, as a PNG is: a lamp would decide
        reference = np.minimum(reference, 1)
    least = 1e-6
    red, green, blue = (picture.mean(axis=0) + least) / (reference.mean(axis=0) + least)
    return float(red), float(green), float(blue)


def describe(
    record: PictureRecord,
    picture: np.ndarray,
    reference: np.ndarray,
    counted: np.ndarray,
    light: Light,
) -> Iterator[str]:
    """Yield what is odd about a picture: how it is read, else its position first.

    Images are linear, (H, W, 3); ``counted`` (H, W) is where the scene has a surface. ``light`` is
    the reference before the tone map of the record, if there is one.
    """
    curves = Curves.of(picture, light, counted)
    given = curves.fit(record.tone_map)
    if reading := _other_reading(picture, reference, counted=counted, curves=curves, given=given):
        yield f"The picture is misread. {reading}"
        return
    if record.shift is None:
        yield "The picture's edges do not show whether it is aligned with the scene's camera."
    elif max(map(abs, record.shift)) >= SHIFT:
        across = _in_pixels(record.shift[0], "to the right", "to the left")
        down = _in_pixels(record.shift[1], "down", "up")
        yield (
            f"The picture's edges are shifted by {' and '.join(filter(None, (across, down)))},"
            " which looks like wrong shading. Check the camera, the crop and the pixel centres"
            " first."
        )
    if record.repeats == 1:
        yield (
            "The picture is one file, so its noise is unknown and counts as departure. Give"
            " repeats of other seeds to separate the two."
        )
    level = given.exposure if record.tone_map else float(np.mean(record.ratio))
    if (mistake := factor_of_pi(level)) or not 1 / LEVEL < level < LEVEL:
        yield (
            f"The picture is {level:.3g} times as bright as the reference:"
            f" {mistake or 'another exposure'}?"
        )
    yield from _white(picture, reference, counted)


def _in_pixels(shift: float, ahead: str, back: str) -> str:
    """Return a shift in words, to half a pixel, which is what edges can tell; less is none."""
    if abs(shift) < SHIFT:
        return ""
    size = round(abs(shift) / SHIFT) * SHIFT
    return f"{size:g} pixel{'' if size == 1 else 's'} {ahead if shift > 0 else back}"


def _white(picture: np.ndarray, reference: np.ndarray, counted: np.ndarray) -> Iterator[str]:
    """Yield a tint that is the same everywhere; wrong shading varies over the picture."""
    shown = _blocks(picture, counted)
    expected = _blocks(reference, counted)
    logs = np.log(shown / expected)
    # Without the level of each block, the balance of its channels is left.
    logs -= logs.mean(axis=1, keepdims=True)
    tint = np.median(logs, axis=0)
    spread = np.median(np.abs(logs - tint), axis=0).max()
    if np.ptp(tint) > TINT and spread < EVEN * np.abs(tint).max():
        relative = ", ".join(f"{value:.3g}" for value in np.exp(tint))
        yield f"Its red, green and blue are relatively {relative} times as strong: another white?"


def _blocks(image: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Return the mean colours (B, 3) of blocks, over the pixels that count; never quite black."""
    height = counted.shape[0] // BLOCK * BLOCK
    width = counted.shape[1] // BLOCK * BLOCK
    weighted = np.where(counted[..., None], image, 0)[:height, :width].astype(float)
    sums = weighted.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).sum(axis=(1, 3))
    # Both images count the same pixels and only ratios are used, so sums serve as means.
    sums = sums.reshape(-1, 3)
    means: np.ndarray = np.maximum(sums, 1e-3 * max(sums.mean(), 1e-9))
    return means


def _other_reading(
    picture: np.ndarray,
    reference: np.ndarray,
    counted: np.ndarray,
    curves: "Curves",
    given: "FittedCurve",
) -> str:
    """Describe the other reading of its values that brings the picture near the reference."""
    readings = {
        f"Its {misreading}{CURES.get(misreading, '')}.": undo
        for misreading, undo in MISREADINGS.items()
    }
    readings |= {f"It looks {how}, or lit from the other side.": turn
                 for how, turn in TURNED.items()}  # fmt: skip
    # What each reading leaves of the difference, as a share of the most that is credible.
    left: dict[str, float] = {}
    plain = min(_distance(picture[counted], reference[counted]), curves.left_by(given))
    if plain >= 1e-3:
        for description, undo in readings.items():
            distance = _distance(undo(picture)[counted], reference[counted])
            left[description] = distance / plain / BETTER
    if given.distance >= LEAST_CURVE:
        for curve in map(curves.fit, CURVES):
            if curve.name != given.name:
                left[curve.sentence] = curve.distance / given.distance / BETTER_CURVE
    description = min(left, key=left.__getitem__, default="")
    return description if left and left[description] <= 1 else ""


CURVES: dict[str | None, ToneMap] = {None: lambda light: np.clip(light, 0, 1)}
CURVES.update(TONE_MAPS.items())
"""The curves that a picture may show light by; without a name, linearly, up to display white."""

STOPS = np.arange(-8.0, 9.0)
"""Exposures, in stops, from which the search for a picture's own begins."""

CURVE_PIXELS = 4096
"""Pixels at which curves are tried, at most."""

LEAST_CURVE = 1 / 255
BETTER_CURVE = 0.3
"""Mean difference of sRGB-encoded values from which another curve is looked for, and the largest
share of it that a credible one leaves: curves resemble each other, and some wrong shading."""


@dataclass(frozen=True)
class FittedCurve:
    """A curve at the exposure at which it shows light most like a picture.

    ``distance`` is the mean difference of sRGB-encoded values that is left and is not noise, if the
    picture has as much as the reference.
    """

    name: str | None
    exposure: float
    distance: float

    @property
    def sentence(self) -> str:
        """What it says of the picture."""
        if self.name is None:
            return "Its values look linear: omit `tone_map`."
        return (
            f"Its values look tone-mapped: give `tone_map={self.name}`. It was given"
            f" {self.exposure:.3g} times the reference's light."
        )


@dataclass(frozen=True)
class Curves:
    """Pixels of a picture and of the light of the reference, to fit curves to; all (N, 3)."""

    picture: np.ndarray
    light: np.ndarray
    standard_error: np.ndarray

    @classmethod
    def of(cls, picture: np.ndarray, light: Light, counted: np.ndarray) -> "Curves":
        """Draw counted pixels of images (H, W, 3), always the same."""
        places = np.flatnonzero(counted)
        some = np.random.default_rng(0).permutation(places)[:CURVE_PIXELS]
        images = (picture, light.mean, light.standard_error)
        drawn = [image.reshape(-1, 3)[some].astype(float) for image in images]
        return cls(picture=drawn[0], light=drawn[1], standard_error=drawn[2])

    def fit(self, name: str | None) -> FittedCurve:
        """Return a curve at its best exposure."""
        encoded = to_srgb(self.picture)

        def shown(stops: float, light: np.ndarray) -> np.ndarray:
            return to_srgb(CURVES[name](2.0**stops * light))

        def distance(stops: float) -> float:
            return float(np.abs(encoded - shown(stops, self.light)).mean())

        start = min(STOPS, key=distance)
        bounds = (start - 1, start + 1)
        finest = minimize_scalar(distance, bounds=bounds, method="bounded")
        # Two images whose noise is normal and alike are 2 / √π of their standard error apart.
        above = shown(finest.x, self.light + self.standard_error)
        below = shown(finest.x, self.light - self.standard_error)
        noise = np.abs(above - below).mean() / np.sqrt(np.pi)
        return FittedCurve(
            name=name,
            exposure=float(2.0**finest.x),
            distance=float(np.sqrt(max(finest.fun**2 - noise**2, 0.0))),
        )

    def left_by(self, curve: FittedCurve) -> float:
        """Return the relative RMS difference of the picture from light shown by a curve."""
        return _distance(self.picture, CURVES[curve.name](curve.exposure * self.light))


def _distance(image: np.ndarray, reference: np.ndarray) -> float:
    """Return the relative RMS difference after the best factor on an image."""
    image = np.asarray(image, float)
    reference = np.asarray(reference, float)
    # Clipped near display white, or highlights alone would decide.
    image = np.minimum(image, 4 * image.mean() + 1e-9)
    reference = np.minimum(reference, 4 * reference.mean() + 1e-9)
    factor = np.sum(image * reference) / max(np.sum(image * image), 1e-30)
    return float(
        np.sqrt(np.mean((factor * image - reference) ** 2) / np.mean(reference**2 + 1e-12))
    )
