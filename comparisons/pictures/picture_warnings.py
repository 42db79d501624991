"""What seems wrong with a picture as a whole: its position, exposure, white, encoding, channels.

The position is found by edges: a shift looks like wrong shading. Geometric edges, where the normal
or the hit changes, are in any picture of the same scene, however it is shaded. The heuristic half
mostly shares its edges too: it shows where light ends. The picture's edges are correlated with both
at all shifts up to :data:`REACH`, and the better agreement counts; a parabola through the highest
values gives the fraction of a pixel. A flipped picture correlates better once it is flipped back.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from math import pi

import mitsuba as mi
import numpy as np
from msgspec import structs

from comparisons.comparison import Images, PictureRecord
from comparisons.departure.colour import from_srgb, to_srgb
from comparisons.options import Options
from comparisons.pictures.picture_files import PictureHalf
from heuristic.errors import InputError
from reference.rendering.gbuffer import gbuffer

TURNED = {
    "upside down": lambda image: image[::-1],
    "mirrored left to right": lambda image: image[:, ::-1],
    "turned by 180 degrees": lambda image: image[::-1, ::-1],
}

# --- Position ----------------------------------------------------------------------------------

TEMPLATE_SPP = 16
"""Samples per pixel of the image whose edges are compared with a picture's."""

REACH = 8
"""Largest shift considered in pixels, at most a quarter of the picture's smaller side."""

FINER = 4
"""Rays along each side of a pixel."""

LEAST = 0.08
"""Correlation below which edges are uninformative."""

CLEARLY = 1.5
"""A picture counts as flipped if flipping it raises the correlation by this factor."""


Place = tuple[tuple[float, float] | None, float]
"""By how many pixels (x, y) a picture's content is too far right and too low, if its edges show it,
and the correlation of the edges there."""


def located(half: PictureHalf, scene: mi.Scene) -> Place:
    """Return the position of pictures relative to a scene's camera; refuse flipped ones."""
    mean = np.mean(half.images, axis=0)
    half.half.spp = TEMPLATE_SPP
    template = np.array(half.half.render(0), float)
    edges = geometry_edges(scene, mean.shape[1], mean.shape[0])
    return measure(mean, [edges, picture_edges(template)])


def geometry_edges(scene: mi.Scene, width: int, height: int) -> np.ndarray:
    """Return how much the geometry changes at each pixel, (H, W)."""
    surface = gbuffer(scene, FINER * width, FINER * height)
    layers = np.concatenate([surface.normal, surface.hit[..., None]], axis=-1)
    return _edges(layers.reshape(height, FINER, width, FINER, 4).mean(axis=(1, 3)), 0.25)


def picture_edges(image: np.ndarray) -> np.ndarray:
    """Return how much an image changes at each pixel, in stops, up to 1."""
    luminance = np.maximum(np.asarray(image, float) @ (0.2126, 0.7152, 0.0722), 0)
    least = 0.02 * np.percentile(luminance, 95) + 1e-6
    return _edges(np.log2(luminance + least)[..., None], 0.25)


def measure(image: np.ndarray, expected: Sequence[np.ndarray]) -> Place:
    """Return the position of an image (H, W, 3), encoded in any way; refuse a flipped one.

    ``expected`` are maps (H, W) of edges that it may contain; the best agreement counts.
    """
    seen = picture_edges(image)
    best = _best(seen, expected)
    for how, turn in TURNED.items():
        other = _best(turn(seen), expected)
        if other[1] > max(CLEARLY * best[1], 2 * LEAST):
            raise InputError(
                f"the picture is {how}: corrected, its edges would correlate with the scene's by"
                f" {other[1]:.2f} instead of {best[1]:.2f}. Correct it, and"
                " compare again."
            )
    return best


def _edges(layers: np.ndarray, half: float) -> np.ndarray:
    """Return the size of the gradient, on a scale that is 1/2 at ``half`` and ends at 1."""
    slopes = np.stack([np.gradient(layers, axis=axis) for axis in (0, 1)])
    size = np.sqrt((slopes**2).sum(axis=(0, -1)))
    return size / (size + half)


def _best(seen: np.ndarray, expected: Sequence[np.ndarray]) -> Place:
    return max((_shift(seen, edges) for edges in expected), key=lambda each: each[1])


def _shift(seen: np.ndarray, edges: np.ndarray) -> Place:
    reach = max(1, min(REACH, min(edges.shape) // 4))
    shifts = range(-reach, reach + 1)
    table = np.array([[_correlation(seen, edges, y, x) for x in shifts] for y in shifts])
    y, x = map(int, np.unravel_index(np.argmax(table), table.shape))
    highest = float(table[y, x])
    if highest < LEAST:
        return None, highest
    down, right = y - reach + _vertex(table[:, x], y), x - reach + _vertex(table[y], x)
    return (float(right), float(down)), highest


def _correlation(seen: np.ndarray, edges: np.ndarray, down: int, right: int) -> float:
    """Return the correlation of two maps where they overlap after a shift of the first."""

    def part(down: int, right: int) -> tuple[slice, slice]:
        rows = slice(down, None) if down >= 0 else slice(None, down)
        return rows, slice(right, None) if right >= 0 else slice(None, right)

    a, b = seen[part(down, right)], edges[part(-down, -right)]
    a, b = a - a.mean(), b - b.mean()
    size = np.sqrt((a * a).sum() * (b * b).sum())
    return float((a * b).sum() / size) if size > 0 else 0.0


def _vertex(values: np.ndarray, place: int) -> float:
    """Return the offset of the vertex of a parabola through a maximum and its neighbours."""
    if not 0 < place < len(values) - 1:
        return 0.0
    before, top, after = values[place - 1 : place + 2]
    bend = before - 2 * top + after
    return 0.0 if bend >= 0 else float(0.5 * (before - after) / bend)


# --- Encoding ----------------------------------------------------------------------------------


@dataclass(frozen=True)
class Misreading:
    """A mistake in encoding colours: its symptom, its inverse, and what to do about a picture."""

    symptom: str
    undo: Callable[[np.ndarray], np.ndarray]
    cure: str = ""


def _ordered(order: tuple[int, ...], image: np.ndarray) -> np.ndarray:
    return image[..., list(order)]


MISREADINGS = (
    Misreading(
        "values look sRGB-encoded", from_srgb, "give --transfer srgb, or write linear values"
    ),
    Misreading("values look decoded twice", to_srgb, "give --transfer linear"),
    *(
        Misreading(
            f"channels look like {', '.join(('red', 'green', 'blue')[place] for place in order)}",
            partial(_ordered, order),
        )
        for order in permutations(range(3))
        if order != (0, 1, 2)
    ),
)

NEAR_PI = 0.05
"""Relative distance within which a level counts as a factor of pi."""


def factor_of_pi(level: float) -> str:
    """Name the factor of pi that a level is close to; empty if none."""
    if abs(level / pi - 1) < NEAR_PI:
        return "a missing division by pi"
    return "a division by pi too many" if abs(level * pi - 1) < NEAR_PI else ""


# --- Sentences ---------------------------------------------------------------------------------

SHIFT = 0.5
"""Smallest shift in pixels that is reported."""

LEVEL = 2.0
"""Smallest factor of brightness that is reported."""

TINT = 0.05
"""Smallest relative difference of the channels' factors that is reported as a tint."""

BLOCK = 8
"""Side in pixels of the blocks whose mean colours are compared."""

EVEN = 0.2
"""Largest spread of a tint over the picture, relative to it, for it to be the white's."""

BETTER = 0.5
"""Largest share of the difference that a credible other reading of the values leaves."""


def picture_record(place: Place, options: Options, images: Images) -> PictureRecord:
    """Return the record of the pictures that replace a heuristic half, with its warnings."""
    shown, reference = (each[images.counted] for each in (images.heuristic, images.reference))
    shift, edges = place
    record = PictureRecord(
        files=options.image,
        transfer=options.transfer,
        repeats=len(options.image),
        shift=shift,
        edges=edges,
        ratio=ratios(shown, reference),
    )
    odd = describe(record, images.heuristic, images.reference, images.counted)
    return structs.replace(record, odd=tuple(odd))


def ratios(picture: np.ndarray, reference: np.ndarray) -> tuple[float, float, float]:
    """Return the means of a picture's channels over those of the reference, both (N, 3)."""
    if picture.max() <= 1:  # clipped at display white, as a PNG is: a lamp would decide
        reference = np.minimum(reference, 1)
    least = 1e-6
    red, green, blue = (picture.mean(axis=0) + least) / (reference.mean(axis=0) + least)
    return float(red), float(green), float(blue)


def describe(
    record: PictureRecord, picture: np.ndarray, reference: np.ndarray, counted: np.ndarray
) -> Iterator[str]:
    """Yield what is odd about a picture, its position first.

    Images are linear, (H, W, 3); ``counted`` (H, W) is where the scene has a surface.
    """
    if record.shift is None:
        yield "The picture's edges do not show whether it is aligned with the scene's camera."
    elif max(map(abs, record.shift)) >= SHIFT:
        x, y = record.shift
        yield (
            f"The picture's edges are shifted by {abs(x):.1f} pixels to the"
            f" {'right' if x > 0 else 'left'} and {abs(y):.1f} pixels {'down' if y > 0 else 'up'},"
            " which looks like wrong shading. Check the camera, the crop and the pixel centres"
            " first."
        )
    if record.repeats == 1:
        yield (
            "The picture is one file, so its noise is unknown and counts as departure. Give"
            " repeats of other seeds to separate the two."
        )
    if reading := _other_reading(picture, reference, counted):
        yield f"The picture is misread. {reading}"
        return
    level = float(np.mean(record.ratio))
    if (mistake := factor_of_pi(level)) or not 1 / LEVEL < level < LEVEL:
        yield (
            f"The picture is {level:.3g} times as bright as the reference:"
            f" {mistake or 'another exposure'}?"
        )
    yield from _white(picture, reference, counted)


def _white(picture: np.ndarray, reference: np.ndarray, counted: np.ndarray) -> Iterator[str]:
    """Yield a tint that is the same everywhere; wrong shading varies over the picture."""
    shown, expected = (_blocks(each, counted) for each in (picture, reference))
    logs = np.log(shown / expected)
    logs -= logs.mean(axis=1, keepdims=True)
    tint = np.median(logs, axis=0)
    spread = np.median(np.abs(logs - tint), axis=0).max()
    if np.ptp(tint) > TINT and spread < EVEN * np.abs(tint).max():
        relative = ", ".join(f"{value:.3g}" for value in np.exp(tint))
        yield f"Its red, green and blue are relatively {relative} times as strong: another white?"


def _blocks(image: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Return the mean colours (B, 3) of blocks, over the pixels that count; never quite black."""
    height, width = (side // BLOCK * BLOCK for side in counted.shape)
    weighted = np.where(counted[..., None], image, 0)[:height, :width].astype(float)
    sums = weighted.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).sum(axis=(1, 3))
    sums = sums.reshape(-1, 3)
    return np.maximum(sums, 1e-3 * max(sums.mean(), 1e-9))


def _other_reading(picture: np.ndarray, reference: np.ndarray, counted: np.ndarray) -> str:
    """Describe the other reading of its values that brings the picture near the reference."""
    plain = _distance(picture[counted], reference[counted])
    if plain < 1e-3:
        return ""
    readings = {
        f"Its {each.symptom}{each.cure and f': {each.cure}'}.": each.undo(picture)
        for each in MISREADINGS
    }
    for how, turn in TURNED.items():
        readings[f"It looks {how}, or lit from the other side."] = turn(picture)
    distances = {
        words: _distance(image[counted], reference[counted]) for words, image in readings.items()
    }
    words = min(distances, key=distances.__getitem__)
    return words if distances[words] <= BETTER * plain else ""


def _distance(image: np.ndarray, reference: np.ndarray) -> float:
    """Return the relative RMS difference after the best factor on an image."""
    image, reference = np.asarray(image, float), np.asarray(reference, float)
    # Clipped near display white, or highlights alone would decide.
    image, reference = (np.minimum(each, 4 * each.mean() + 1e-9) for each in (image, reference))
    factor = np.sum(image * reference) / max(np.sum(image * image), 1e-30)
    return float(
        np.sqrt(np.mean((factor * image - reference) ** 2) / np.mean(reference**2 + 1e-12))
    )
