"""Mistakes that pictures often have, named with the number that mends each, and what is left.

A picture is compared with the other half: the reference, or the textbook half if the picture is the
reference. A mistake is named where mending it removes the departure, which wrong shading does not:
it varies over a picture. Colours are compared as means of blocks, in which noise and edges matter
little.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import permutations
from math import pi

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fotismos.comparisons import alignment
from fotismos.comparisons.departure.blocks import averaged, block_sums, shrunk
from fotismos.comparisons.departure.colour import BLACK, Array, from_srgb, to_srgb
from fotismos.comparisons.departure.criterion import TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.departure.tone_maps import BETTER_CURVE, Curves, FittedCurve, Light

Mending = Callable[[Array], Array]
"""A function from a picture (H, W, 3) to the one without a mistake."""

BLOCK = 8
"""Side of the blocks whose means are compared, in pixels."""

LIT = 0.02
"""Blocks darker than this times the median tell no ratio."""

CLIPPED = 0.99
"""From here on the values of a picture that ends at display white may be clipped."""

HIGHLIGHTS = 95
"""Percentile of the values, above which they do not count for readings."""

BETTER = 0.5
"""Largest share of the difference that a credible other reading of the values leaves."""

EXPLAINED = 0.25
"""Largest share of the departure that a credible change of colours leaves."""

SIMPLER = 1.25
"""Times the departure that the best change leaves, which a simpler one may leave."""

SLIGHT = 0.03
"""Share of the departure in which two changes do not differ."""

FEWEST = 8
SLOPES = 400
CONTRAST = 0.5
POWERS = (0.1, 0.95)
"""Blocks from which a power or a tint follows, at least and at most; their range in powers of e,
and the range of a power or its inverse."""

NOTICED = 0.3
"""ΔE2000 of the blocks, below which nothing needs a reason."""

LEVEL = 2.0
TINT = 0.05
"""Factor of brightness, and relative difference of the channels' factors, that are named even if
they explain little."""

LEAST_RATIO = 1e-3
"""Factor of a channel that is missing, relative to the largest factor."""

EVEN = 0.2
"""A tint is the white's if it spreads by this share at most over the blocks."""

NEAR_PI = 0.05
"""Relative distance within which a level counts as a factor of pi, or of :data:`LUMENS`."""

LUMENS = 683.0
"""Lumens per watt at 555 nm (SI), by which programs take light from watts to lumens."""

SHIFT = 0.5
"""Smallest shift in pixels that is named, and the steps in which it is."""

MOVED = 0.25
"""Share of a shift at which the error is least, at least, if it is one."""

PLATEAU = 0.005
"""Share of the pixels that end at one value where a picture is clipped."""

ZOOMS = 1.25 ** np.linspace(-1.0, 1.0, 41)
"""Sizes of the content, relative to the other half's, that are tried."""

OTHER_SIZE = 0.02
"""Smallest relative change of size that is named."""

ZOOMED = 0.1
"""By how much the correlation of edges grows at another size, at least, that is named."""

SMALL = 160
"""Pixels of the longer side at which sizes are tried."""


@dataclass(frozen=True)
class Names:
    """How sentences call a picture, at their beginning, and the other half."""

    picture: str = "The picture"
    other: str = "the reference"


@dataclass(frozen=True)
class Mistake:
    """A mistake that a picture seems to have, as a sentence, and what mends it, if that is known.

    ``left`` is the share of the difference that is credible, and that is left; at most 1.
    """

    sentence: str
    mend: Mending | None
    left: float = 0.0


@dataclass(frozen=True)
class NoisyImage:
    """An image (H, W, 3), and two halves of its repeats, whose difference shows its noise."""

    mean: Array
    halves: tuple[Array, Array] | None = None

    def noise(self, mend: Mending) -> Array | float:
        """Return how far noise moves the pixels of the mended image, in ΔE2000, (H, W)."""
        if self.halves is None:
            return 0.0
        first, second = self.halves
        # The halves are twice as far apart as their mean is from the truth.
        apart: Array = LEADING(mend(first), mend(second)) / 2
        return apart


@dataclass(frozen=True)
class Blocks:
    """Mean colours (B, 3) of blocks of pixels: of a picture, and of the other half."""

    picture: Array
    other: Array

    @classmethod
    def of(cls, picture: Array, other: Array, counted: NDArray[np.bool_]) -> "Blocks":
        """Average over the pixels that count, in whole blocks if there are any."""
        weights = block_sums(counted.astype(float), BLOCK)[..., None]
        full = (weights[..., 0] >= 0.5 * weights.max()) & (weights[..., 0] > 0)
        means = [
            (block_sums(np.where(counted[..., None], image, 0.0), BLOCK) / np.maximum(weights, 1))[
                full
            ]
            for image in (picture, other)
        ]
        return cls(picture=means[0], other=means[1])

    def departure(self) -> float:
        """Return the mean ΔE2000 of the blocks."""
        return float(LEADING(self.picture, self.other).mean()) if self.picture.size else 0.0


def find(
    picture: NoisyImage,
    other: NoisyImage,
    counted: NDArray[np.bool_],
    place: alignment.Place,
    is_encoded: bool,
    names: Names,
    light: Light,
    tone_map: str | None = None,
) -> Iterator[str]:
    """Yield the mistakes of a picture in words, each mended before the next one is looked for.

    Images are linear; ``counted`` (H, W) are the pixels that count. ``is_encoded`` says that the
    file ends at display white, as a PNG does. ``light`` is that of the other image, before the tone
    map of that name.
    """
    if min(image.mean[counted].max(initial=0.0) for image in (picture, other)) < BLACK:
        return
    curves = Curves.of(picture.mean, light, counted)
    given = curves.fit(tone_map)
    truth = other.mean
    mends: list[Mending] = []

    def mended(image: Array) -> Array:
        for mend in mends:
            image = mend(image)
        return image

    def candidates() -> Iterator[Mistake | None]:
        pairs = [(picture.mean[counted], truth[counted])]
        if tone_map:
            pairs.append((curves.picture, curves.shown(given)))
        plain = min(_distance(*map(_below_highlights, pair)) for pair in pairs)
        reading = _other_reading(picture.mean, truth, counted, names, plain)
        curve = _other_curve(curves, given, names)
        if curve and (reading is None or curve.left < reading.left):
            yield curve
            return
        change = None if tone_map else _change_of_colours(picture.mean, truth, counted, names)
        if reading and not _explains_more(change, reading, picture.mean, truth, counted):
            yield reading  # where its content is, is not known then
        else:
            yield _moved(picture.mean, truth, place, names)
        if tone_map:
            yield _exposure(given, names)
            return
        yield _change_of_colours(mended(picture.mean), truth, counted, names) if mends else change
        if not is_encoded and not mends:
            yield _clipped(picture.mean, truth, counted, names)

    for mistake in candidates():
        if mistake is None:
            continue
        if mistake.mend is None:
            yield mistake.sentence
            continue
        mends.append(mistake.mend)
        apart = LEADING(mended(picture.mean), truth)
        noise = np.hypot(picture.noise(mended), other.noise(lambda image: image))
        without_noise = np.sqrt(np.maximum(apart**2 - noise**2, 0.0))
        left = _percent(float(np.mean(without_noise[counted] > TOLERANCE)))
        yield f"{mistake.sentence} After that, {left} of the pixels differ visibly."


def _percent(share: float) -> str:
    return f"{float(f'{100 * share:.2g}'):g} %"


def _explains_more(
    change: Mistake | None,
    reading: Mistake,
    picture: Array,
    other: Array,
    counted: NDArray[np.bool_],
) -> bool:
    """Return whether a change of colours leaves far less than a reading does, at its best level."""
    if change is None or change.mend is None or reading.mend is None:
        return False
    read = reading.mend(picture)
    blocks = Blocks.of(read, other, counted)
    # The medians of the light: dark blocks are the most distorted by a wrong reading.
    light = max(float(np.median(blocks.picture.mean(axis=1))), 1e-9)
    factor = float(np.median(blocks.other.mean(axis=1))) / light
    left = Blocks.of(read * factor, other, counted).departure()
    return Blocks.of(change.mend(picture), other, counted).departure() < BETTER * left


# --- Readings of the values --------------------------------------------------------------------

CHANNELS = ("red", "green", "blue")

MISREADINGS: dict[str, Mending] = {
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

CURES = {
    "values look sRGB-encoded": ": write linear values (`transfer=srgb` decodes all pictures)",
    "values look decoded twice": ": decode them once (`transfer=linear` decodes no picture)",
}
"""What mends a misreading: the option is for all pictures of a comparison."""

TURNED: dict[str, Mending] = {
    "upside down": lambda image: image[::-1],
    "mirrored left to right": lambda image: image[:, ::-1],
    "turned by 180 degrees": lambda image: image[::-1, ::-1],
}


def _other_curve(curves: Curves, given: FittedCurve, names: Names) -> Mistake | None:
    """Return another tone map than the given one, which a picture seems to have."""
    curve = curves.other(given)
    if curve is None:
        return None
    cure = "Its values look linear: omit `tone_map`."
    if curve.name is not None:
        cure = (
            f"Its values look tone-mapped: give `tone_map={curve.name}`. It was given"
            f" {curve.exposure:.3g} times the light of {names.other}."
        )
    return Mistake(
        sentence=f"{names.picture} is misread. {cure}",
        mend=None,
        left=curve.distance / given.distance / BETTER_CURVE,
    )


def _exposure(given: FittedCurve, names: Names) -> Mistake | None:
    """Return the factor of the light that a tone map shows; None if it is near 1."""
    level = given.exposure
    if not factor_of_pi(level) and 1 / LEVEL < level < LEVEL:
        return None
    return Mistake(
        sentence=(
            f"{names.picture}'s light is {level:.3g} times as bright as {names.other}:"
            f" {reason_of(level)}?"
        ),
        mend=None,
    )


def _other_reading(
    picture: Array,
    other: Array,
    counted: NDArray[np.bool_],
    names: Names,
    plain: float,
) -> Mistake | None:
    """Return the other reading of its values that brings a picture near the other half.

    ``plain`` is how far they are as they are read, by :func:`_distance`.
    """
    if plain < 1e-3:
        return None
    readings = {
        f"Its {misreading}{CURES.get(misreading, '')}.": undo
        for misreading, undo in MISREADINGS.items()
    }
    readings |= {
        f"It looks {how}, or lit from the other side.": turn for how, turn in TURNED.items()
    }
    truth = _below_highlights(other[counted])
    distances = {
        symptom: _distance(_below_highlights(undo(picture)[counted]), truth)
        for symptom, undo in readings.items()
    }
    symptom = min(distances, key=distances.__getitem__)
    if distances[symptom] > BETTER * plain:
        return None
    return Mistake(
        sentence=f"{names.picture} is misread. {symptom}",
        mend=readings[symptom],
        left=distances[symptom] / plain / BETTER,
    )


def _below_highlights(image: Array) -> Array:
    """Return an image clipped, or highlights would decide.

    It is at the same share of the pixels in any image, which no curve changes.
    """
    clipped: Array = np.minimum(image, np.percentile(image, HIGHLIGHTS))
    return clipped


def _distance(image: Array, other: Array) -> float:
    """Return the relative RMS difference after the best factor on an image."""
    factor = np.sum(image * other) / max(np.sum(image * image), 1e-30)
    return float(np.sqrt(np.mean((factor * image - other) ** 2) / np.mean(other**2 + 1e-12)))


# --- Position ----------------------------------------------------------------------------------


def _moved(picture: Array, other: Array, place: alignment.Place, names: Names) -> Mistake | None:
    """Return a shift or another size of the content; None if it is in its place."""
    # Where edges agree nearly wholly, no other size can agree far better.
    zoom = _zoom(picture, other) if place.correlation < 1 - ZOOMED else None
    if zoom is not None:
        return Mistake(
            sentence=(
                f"{names.picture}'s content is {zoom:.3g} times as large as in {names.other}. Check"
                " the field of view and the crop first."
            ),
            mend=lambda image: _zoomed(image, 1 / zoom),
        )
    shift = place.shift
    if shift is not None and max(map(abs, shift)) >= SHIFT:
        right = round(shift[0] / SHIFT) * SHIFT
        down = round(shift[1] / SHIFT) * SHIFT
        if not _is_moved(picture, other, right=right, down=down):
            return None
        across = _in_pixels(right, "to the right", "to the left")
        along = _in_pixels(down, "down", "up")
        amount = " and ".join(filter(None, (across, along)))
        return Mistake(
            sentence=(
                f"{names.picture}'s edges are shifted by {amount}, which looks like wrong shading."
                " Check the camera, the crop and the pixel centres first."
            ),
            mend=lambda image: _shifted(image, right=-right, down=-down),
        )
    return None


def _is_moved(picture: Array, other: Array, right: float, down: float) -> bool:
    """Return whether moving a picture back mends more than moving it on; else it is only smoother.

    A parabola through the squared errors of both and of none has its least one ``x = (on - back) /
    (2 (on + back - 2 error))`` of the way back: 1 for a picture that is moved, 0 for a blurred one.
    """
    error = np.mean((picture - other) ** 2)
    back = np.mean((_shifted(picture, right=-right, down=-down) - other) ** 2)
    on = np.mean((_shifted(picture, right=right, down=down) - other) ** 2)
    return bool(on - back > 2 * MOVED * abs(on + back - 2 * error))


def _in_pixels(shift: float, ahead: str, back: str) -> str:
    """Return a shift in words; none if it is 0."""
    if not shift:
        return ""
    size = abs(shift)
    return f"{size:g} pixel{'' if size == 1 else 's'} {ahead if shift > 0 else back}"


def _shifted(picture: Array, right: float, down: float) -> Array:
    """Return a picture whose content is moved; its edges repeat beyond them."""
    from scipy import ndimage  # loaded late: few pictures are shifted

    moved: Array = ndimage.shift(picture, (down, right, 0), order=1, mode="nearest")
    return moved


def _zoom(picture: Array, other: Array) -> float | None:
    """Return how much larger a picture's content is; None if no other size agrees far better."""
    height, width = picture.shape[:2]
    if min(height, width) < 2 * BLOCK:  # edges agree by chance
        return None
    shape = shrunk((height, width), SMALL)
    small = averaged(picture, shape)
    small_other = averaged(other, shape)
    agreement = []
    for zoom in ZOOMS:
        # The smaller one is enlarged, since nothing is known beyond its edges.
        shown = small if zoom > 1 else _zoomed(small, 1 / zoom)
        expected = _zoomed(small_other, zoom) if zoom > 1 else small_other
        agreement.append(_agreement(shown, expected))
    best = int(np.argmax(agreement))
    zoom = float(ZOOMS[best])
    # Resampling takes noise away, so edges agree better; half a pixel takes as much.
    shown = small if zoom > 1 else _shifted(small, right=0.5, down=0.5)
    expected = _shifted(small_other, right=0.5, down=0.5) if zoom > 1 else small_other
    unchanged = max(agreement[len(ZOOMS) // 2], _agreement(shown, expected))
    is_other = best not in (0, len(ZOOMS) - 1) and abs(zoom - 1) > OTHER_SIZE
    if not is_other or agreement[best] < unchanged + ZOOMED:
        return None
    return zoom


def _agreement(picture: Array, other: Array) -> float:
    """Return the highest correlation of the edges of two pictures over all cyclic shifts."""
    seen = alignment.picture_edges(picture)
    expected = alignment.picture_edges(other)
    a = seen - seen.mean()
    b = expected - expected.mean()
    size = np.sqrt((a * a).sum() * (b * b).sum())
    if not size:
        return 0.0
    products = np.fft.irfft2(np.fft.rfft2(a) * np.conj(np.fft.rfft2(b)), a.shape)
    return float(products.max() / size)


def _zoomed(picture: Array, zoom: float) -> Array:
    """Return a picture whose content is larger by a factor, about its centre."""
    height, width = picture.shape[:2]
    half_width = width / (2 * zoom)
    half_height = height / (2 * zoom)
    box = (
        width / 2 - half_width,
        height / 2 - half_height,
        width / 2 + half_width,
        height / 2 + half_height,
    )
    planes = []
    for c in range(3):
        plane = Image.fromarray(picture[..., c].astype(np.float32))
        affine = (1 / zoom, 0, box[0], 0, 1 / zoom, box[1])
        planes.append(
            plane.transform(
                (width, height), Image.Transform.AFFINE, affine, Image.Resampling.BILINEAR
            )
        )
    return np.stack([np.asarray(plane, float) for plane in planes], axis=-1)


# --- Colours -----------------------------------------------------------------------------------


def ratios(picture: Array, other: Array, counted: NDArray[np.bool_]) -> tuple[float, float, float]:
    """Return how many times as strong a picture's red, green and blue are as the other half's.

    They are medians over blocks that are lit in both, and not clipped. A channel that the other
    half lacks is as strong as all three together.
    """
    blocks = Blocks.of(picture, other, counted)
    lit = _lit(blocks)
    shown = blocks.picture[lit]
    truth = blocks.other[lit]
    if not truth.size:
        return 1.0, 1.0, 1.0
    level = float(np.median(shown.mean(axis=1) / truth.mean(axis=1)))
    least = LIT * float(np.median(truth.max(axis=1)))
    red, green, blue = (
        # Colours outside BT.709 have negative values.
        float(np.median(np.maximum(shown[told, channel], 0.0) / truth[told, channel]))
        if (told := truth[:, channel] > least).any()
        else level
        for channel in range(3)
    )
    return red, green, blue


def _lit(blocks: Blocks) -> NDArray[np.bool_]:
    """Return the blocks that tell a ratio."""
    lit: NDArray[np.bool_] = np.ones(len(blocks.picture), bool)
    for colours in (blocks.picture, blocks.other):
        light = colours.mean(axis=1)
        # The median, since a lamp would raise the mean.
        lit &= light > LIT * np.median(light[light > 0]) if (light > 0).any() else False
    if blocks.picture.size and blocks.picture.max() <= 1.0:
        free = lit & (blocks.picture.max(axis=1) < CLIPPED)
        lit = free if free.any() else lit
    return lit


def factor_of_pi(level: float) -> str:
    """Name the factor of pi that a level is close to; empty if none."""
    if abs(level / pi - 1) < NEAR_PI:
        return "a missing division by pi"
    return "a division by pi too many" if abs(level * pi - 1) < NEAR_PI else ""


def reason_of(level: float) -> str:
    """Name what a factor of the light may come from."""
    if abs(level * LUMENS - 1) < NEAR_PI:
        return "divided by 683 lumens per watt, as Blender's default import of glTF does"
    if abs(level / LUMENS - 1) < NEAR_PI:
        return "multiplied by 683 lumens per watt, as Blender's default export of glTF does"
    return factor_of_pi(level) or "another exposure"


def _change_of_colours(
    picture: Array, other: Array, counted: NDArray[np.bool_], names: Names
) -> Mistake | None:
    """Return the simplest change of colours that explains a picture; None if none does."""
    blocks = Blocks.of(picture, other, counted)
    before = blocks.departure()
    if before < NOTICED:
        return None
    ratio = np.array(ratios(picture, other, counted))
    ratio = np.maximum(ratio, LEAST_RATIO * ratio.max())
    changes = _changes(blocks, ratio, names)
    left = {
        kind: Blocks.of(change.mend(picture), other, counted).departure()
        for kind, change in changes.items()
        if change.mend is not None
    }
    allowed = SIMPLER * min(left.values()) + SLIGHT * before
    # The first of them is the simplest.
    chosen = next(kind for kind, departure in left.items() if departure <= allowed)
    if left[chosen] <= EXPLAINED * before:
        return changes[chosen]
    # A large factor, or a white that is the same everywhere, is named though more is wrong.
    level = _level(ratio)
    if factor_of_pi(level) or not 1 / LEVEL < level < LEVEL:
        return changes["level"]
    return changes.get("white") if _is_even_tint(blocks) else None


def _level(ratio: Array) -> float:
    """Return the factor of brightness among the factors of the channels."""
    return float(np.exp(np.log(ratio).mean()))


def _changes(blocks: Blocks, ratio: Array, names: Names) -> dict[str, Mistake]:
    """Return changes of colours by their kind, the simplest first."""
    level = _level(ratio)
    reason = reason_of(level)
    changes = {
        "level": Mistake(
            sentence=f"{names.picture} is {level:.3g} times as bright as {names.other}: {reason}?",
            mend=lambda image: image / level,
        )
    }
    tint = ratio / level
    if np.ptp(np.log(tint)) > TINT:
        relative = ", ".join(f"{value:.3g}" for value in tint)
        brighter = "" if abs(level - 1) < TINT else f", and it is {level:.3g} times as bright"
        changes["white"] = Mistake(
            sentence=(
                f"{names.picture}'s red, green and blue are relatively {relative} times as"
                f" strong{brighter}: another white?"
            ),
            mend=lambda image: image / ratio,
        )
    offset = float(np.median((blocks.picture - blocks.other).mean(axis=1)))
    side = "high" if offset > 0 else "low"
    changes["offset"] = Mistake(
        sentence=f"{names.picture}'s values are all {abs(offset):.3g} too {side}.",
        mend=lambda image: np.maximum(image - offset, 0.0),
    )
    if power := _power(blocks, names):
        changes["power"] = power
    return changes


def _power(blocks: Blocks, names: Names) -> Mistake | None:
    """Return the power and the factor that lead from the other half to a picture."""
    lit = _lit(blocks)
    shown = np.log(np.maximum(blocks.picture[lit], 1e-9)).mean(axis=1)
    truth = np.log(np.maximum(blocks.other[lit], 1e-9)).mean(axis=1)
    if len(shown) < FEWEST or np.ptp(truth) < CONTRAST:
        return None
    # Theil and Sen: the median of the slopes of pairs, to which blocks with edges do not matter.
    some = np.random.default_rng(0).permutation(len(shown))[:SLOPES]
    run = np.subtract.outer(truth[some], truth[some])
    rise = np.subtract.outer(shown[some], shown[some])
    far = run > CONTRAST / 2
    power = float(np.median(rise[far] / run[far]))
    scale = float(np.exp(np.median(shown - power * truth)))
    gamma = max(power, 1 / power)
    if not POWERS[0] < 1 / gamma < POWERS[1]:
        return None
    factor = "" if abs(scale - 1) < TINT else f" and multiplied by {scale:.3g}"
    return Mistake(
        sentence=(
            f"{names.picture}'s values look raised to the power {power:.3g}{factor}: a gamma of"
            f" {gamma:.3g}?"
        ),
        mend=lambda image: (np.maximum(image, 0.0) / scale) ** (1 / power),
    )


def _is_even_tint(blocks: Blocks) -> bool:
    """Return whether a tint is the same everywhere; wrong shading varies over the picture."""
    if len(blocks.other) < FEWEST:
        return False
    least = 1e-3 * max(float(blocks.other.mean()), 1e-9)
    logs = np.log(np.maximum(blocks.picture, least) / np.maximum(blocks.other, least))
    # Without the level of each block, the balance of its channels is left.
    logs -= logs.mean(axis=1, keepdims=True)
    tint = np.median(logs, axis=0)
    spread = np.median(np.abs(logs - tint), axis=0).max()
    return bool(np.ptp(tint) > TINT and spread < EVEN * np.abs(tint).max())


def _clipped(
    picture: Array, other: Array, counted: NDArray[np.bool_], names: Names
) -> Mistake | None:
    """Return where a picture ends at one value, and the other half does not."""
    largest = float(picture[counted].max(initial=0.0))
    at_end = (picture >= (1 - 1e-4) * largest).any(axis=-1) & counted
    brighter = at_end & (other.max(axis=-1) > (1 + TINT) * largest)
    share = brighter.sum() / max(counted.sum(), 1)
    if share < PLATEAU or brighter.sum() < 0.5 * at_end.sum():
        return None
    beyond = other.max(axis=-1)[brighter]
    if beyond.std() < TINT * beyond.mean():  # a lamp, say: it is one value in both
        return None
    return Mistake(
        sentence=(
            f"{names.picture}'s values end at {largest:.3g}, where {names.other} is brighter in"
            f" {_percent(share)} of the pixels: clipped?"
        ),
        mend=lambda image: np.where(brighter[..., None], other, image),
    )
