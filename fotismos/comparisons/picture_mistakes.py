"""Mistakes that pictures often have, named with the number that mends each, and what is left.

A picture is compared with the other half: the reference, or the textbook half if the picture is the
reference. A mistake is named where mending it removes the departure, which wrong shading does not:
it varies over a picture. Colours are compared as means of blocks, in which noise and edges matter
little.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import permutations
from math import pi

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from fotismos.comparisons import alignment, colour_spaces
from fotismos.comparisons.departure.blocks import averaged, block_sums, shrunk
from fotismos.comparisons.departure.colour import (
    BLACK,
    from_srgb,
    to_srgb,
)
from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.departure.tone_maps import Curves, FittedCurve
from fotismos.comparisons.records.images import Light
from fotismos.heuristic.convention import Floats

Mending = Callable[[Floats], Floats]
"""A function from a picture (H, W, 3) to the one without a mistake."""

BLOCK = 8
ALONG = 8
MOST_BLOCKS = 4096
"""Side of the blocks whose means are compared, in pixels; how many there are along a side, for
which smaller ones are taken; and at how many of them changes of colours are tried."""

LIT = 0.02
"""Blocks darker than this times the median tell no ratio."""

CLIPPED = 0.99
"""From here on the values of a picture that ends at display white may be clipped."""

EXPLAINED = 0.25
WHOLLY = 0.1
BETTER = 0.5
"""Largest share of the departure that a credible change of colours leaves, that a reading leaves
which is the only one beside a factor, and that a factor leaves which is named beside others."""

SIMPLER = 1.25
"""Times the departure that the best change leaves, which a simpler one may leave."""

SLIGHT = 0.03
"""Share of the departure in which two changes do not differ."""

RIVAL = 0.67
"""Share of the departure that one explanation leaves, from which another is as good."""

ROUNDING = 0.25 / 255
ROUNDING_LEFT = 0.02
"""What rounding to 8 bits leaves: of encoded values, and of the blocks' ΔE2000."""

OTHER_EDGES = 0.35
OTHER_ORDER = 0.5
STRUCTURE = 16.0
MOSTLY = 0.5
"""Correlations of edges, and of the order of brightness, below which pictures are of different
scenes, if their blocks differ this many times as much as noise within them would make them, and
a smaller share of the pixels is clipped."""

LACKING = 0.02
TURNED_BACK = 0.25
"""What the order of brightness lacks to agree where a picture may be turned, at least; and the
largest share of it that a credible turn leaves."""


FEWEST = 8
SLOPES = 400
CONTRAST = 0.5
POWERS = (0.1, 0.95)
"""Blocks from which a power or a tint follows, at least and at most; their range in powers of e,
and the range of a power or its inverse."""

NOTICED = 0.3
NOTICED_THEN = 1.0
"""ΔE2000 of the blocks, below which nothing needs a reason; and none beside the first."""

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

LEAST_PRECISION = 1e-3
"""Relative precision to which factors are known at best: half floats have half of it."""

SHIFT = 0.5
"""Smallest shift in pixels that is named, and the steps in which it is."""

MOVED = 0.55
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

    ``show`` makes the mistake, so it leads from the other half to the picture. If the mistake
    ``is_certain``, noise cannot be all of the difference.
    """

    sentence: str
    mend: Mending | None = None
    show: Mending | None = None
    is_certain: bool = False


@dataclass(frozen=True)
class Factor:
    """A factor of brightness, and relatively how far the true one may be from it."""

    value: float
    precision: float

    @property
    def rounded(self) -> float:
        """The factor with the fewest digits within its precision, three at most."""
        precision = max(self.precision, LEAST_PRECISION)
        for digits in (1, 2):
            value = float(f"{self.value:.{digits}g}")
            if abs(value / self.value - 1) <= precision:
                return value
        return float(f"{self.value:.3g}")

    @property
    def is_known(self) -> bool:
        """Whether it is close to a factor with a name, and no round number more exactly."""
        apart = min(abs(self.value / factor - 1) for factor in (pi, 1 / pi, LUMENS, 1 / LUMENS))
        is_round = self.rounded == float(f"{self.rounded:.1g}")
        return apart < NEAR_PI and not (is_round and apart > max(self.precision, LEAST_PRECISION))

    @property
    def reason(self) -> str:
        """What it may come from."""
        return reason_of(self.value) if self.is_known else "another exposure"

    def __str__(self) -> str:
        return f"{self.value if self.is_known else self.rounded:.3g}"


@dataclass(frozen=True)
class NoisyImage:
    """An image (H, W, 3), and two halves of its repeats, whose difference shows its noise."""

    mean: Floats
    halves: tuple[Floats, Floats] | None = None

    def noise(self, mend: Mending) -> Floats | float:
        """Return how far noise moves the pixels of the mended image, in ΔE2000, (H, W)."""
        if self.halves is None:
            return 0.0
        first, second = self.halves
        # The halves are twice as far apart as their mean is from the truth.
        apart: Floats = LEADING(mend(first), mend(second)) / 2
        return apart


@dataclass(frozen=True)
class Blocks:
    """Mean colours (B, 3) of blocks of pixels: of a picture, and of the other half."""

    picture: Floats
    other: Floats

    @classmethod
    def of(cls, picture: Floats, other: Floats, counted: NDArray[np.bool_]) -> "Blocks":
        """Average over the pixels that count, in whole blocks if there are any."""
        side, weights = _blocks(counted)
        full = weights > 0
        means = [
            block_sums(np.where(counted[..., None], image, 0.0), side)[full] / weights[full, None]
            for image in (picture, other)
        ]
        return cls(picture=means[0], other=means[1])

    def departure(self) -> float:
        """Return the mean ΔE2000 of the blocks."""
        return float(LEADING(self.picture, self.other).mean()) if self.picture.size else 0.0


def _blocks(counted: NDArray[np.bool_]) -> tuple[int, Floats]:
    """Return the side of blocks, and the counted pixels (h, w) of each that is whole, else 0."""
    side = max(1, min(BLOCK, min(counted.shape) // ALONG))
    pixels = block_sums(counted.astype(float), side)
    return side, np.where(pixels >= 0.5 * pixels.max(), pixels, 0.0)


@dataclass(frozen=True)
class Tiles:
    """The pixels (B, n, 3) of whole blocks, :data:`MOST_BLOCKS` at most: changes are tried there.

    ``shares`` (B, n, 1) are those of the pixels in the mean of their block.
    """

    picture: Floats
    other: Floats
    shares: Floats

    @classmethod
    def of(cls, picture: Floats, other: Floats, counted: NDArray[np.bool_]) -> "Tiles":
        """Draw blocks as :class:`Blocks` has them, always the same."""
        side, weights = _blocks(counted)
        whole = np.flatnonzero(weights)
        chosen = np.sort(np.random.default_rng(0).permutation(whole)[:MOST_BLOCKS])
        down, right = np.divmod(chosen, weights.shape[1])
        # Beyond the edge the last pixel repeats, and has no share.
        y, x = np.divmod(np.arange(side * side), side)
        rows = side * down[:, None] + y
        columns = side * right[:, None] + x
        inside = (rows < counted.shape[0]) & (columns < counted.shape[1])
        at = np.minimum(rows, counted.shape[0] - 1), np.minimum(columns, counted.shape[1] - 1)
        shares = (inside & counted[at]) / weights.ravel()[chosen, None]
        return cls(
            picture=picture[at].astype(float),
            other=other[at].astype(float),
            shares=shares[..., None],
        )

    @cached_property
    def other_blocks(self) -> Floats:
        """The mean colours (B, 3) of the other half's blocks."""
        return self._means(self.other)

    def blocks(self, mend: Mending) -> Blocks:
        """Return the mean colours of the blocks of a mended picture, and the other half's."""
        return Blocks(picture=self._means(mend(self.picture)), other=self.other_blocks)

    def left(self, change: Mistake) -> float:
        """Return the departure that the blocks have after a change is mended."""
        return np.inf if change.mend is None else self.blocks(change.mend).departure()

    def _means(self, pixels: Floats) -> Floats:
        means: Floats = np.where(self.shares > 0, pixels * self.shares, 0.0).sum(axis=1)
        return means


def find(
    picture: NoisyImage,
    other: NoisyImage,
    counted: NDArray[np.bool_],
    in_place: alignment.Place,
    locate: Callable[[Mending], alignment.Place],
    is_encoded: bool,
    names: Names,
    light: Light,
    tone_map: str | None = None,
) -> Iterator[Mistake]:
    """Yield the mistakes of a picture, each mended before the next one is looked for.

    Images are linear; ``counted`` (H, W) are the pixels that count. ``in_place`` is where the
    content of the picture is, and ``locate`` tells where it is after a mending. ``is_encoded`` says
    that the file ends at display white, as a PNG does. ``light`` is that of the other image, before
    the tone map of that name.
    """
    if min(_largest(image.mean, counted) for image in (picture, other)) < BLACK:
        return
    truth = other.mean
    mends: list[Mending] = []

    def mended(image: Floats) -> Floats:
        for mend in mends:
            image = mend(np.asarray(image, float))
        return image

    def candidates() -> Iterator[Mistake | None]:
        # Codes of a bright picture may be equal, and their order says nothing.
        if _share_that_differs(Tiles.of(picture.mean, truth, counted)) > LIMIT:
            yield _turned(picture.mean, truth, counted, names)
        place = locate(mended) if mends else in_place
        if _is_of_other_scene(mended(picture.mean), truth, counted, place):
            yield Mistake(
                sentence=(
                    f"{names.picture} and {names.other} show different scenes, or different views:"
                    " neither their edges nor what is bright and dark agree."
                ),
                is_certain=True,
            )
            return
        yield _moved(mended(picture.mean), truth, place, names)
        before = len(mends)
        yield from _other_values(mended(picture.mean), truth, counted, names, light, tone_map)
        if tone_map is None and len(mends) > before:
            yield _change_of_colours(
                mended(picture.mean), truth, counted, names, noticed=NOTICED_THEN
            )
        if not is_encoded and not mends and tone_map is None:
            yield _clipped(picture.mean, truth, counted, names)

    for mistake in candidates():
        if mistake is None:
            continue
        if mistake.mend is None:
            yield mistake
            continue
        mends.append(mistake.mend)
        apart = LEADING(mended(picture.mean), truth)
        noise = np.hypot(picture.noise(mended), other.noise(lambda image: image))
        without_noise = np.sqrt(np.maximum(apart**2 - noise**2, 0.0))
        left = float(np.mean(without_noise[counted] > TOLERANCE))
        after = f"After that, {_percent(left)} of the pixels differ visibly."
        # No noise is a turn, a factor or a power.
        yield replace(mistake, sentence=f"{mistake.sentence} {after}", is_certain=left <= LIMIT)


def _share_that_differs(tiles: Tiles) -> float:
    """Return the share of the counted pixels of blocks that differ visibly."""
    if not tiles.shares.size:
        return 0.0
    differs = LEADING(tiles.picture, tiles.other) > TOLERANCE
    return float(differs[tiles.shares[..., 0] > 0].mean())


def _largest(image: Floats, counted: NDArray[np.bool_]) -> float:
    """Return the largest value of the pixels that count, 0 at least."""
    return float(_brightest(image)[counted].max(initial=0.0))


def _brightest(image: Floats) -> Floats:
    """Return the largest channel of each pixel, (H, W): faster than by a maximum of three."""
    red, green, blue = np.moveaxis(image, -1, 0)
    brightest: Floats = np.maximum(np.maximum(red, green), blue)
    return brightest


def _percent(share: float) -> str:
    return f"{float(f'{100 * share:.2g}'):g} %"


# --- Readings of the values --------------------------------------------------------------------

CHANNELS = ("red", "green", "blue")

PRIMARIES = ("BT.2020", "Display P3")
"""Colour spaces with the white of BT.709, whose values may have been read as those of BT.709."""


def _times(matrix: Floats, image: Floats) -> Floats:
    """Return the colours of an image, each multiplied by a matrix (3, 3)."""
    product: Floats = image @ matrix.T
    return product


MISREADINGS: dict[str, tuple[Mending, Mending]] = {
    "values look sRGB-encoded": (from_srgb, to_srgb),
    "values look decoded twice": (to_srgb, from_srgb),
    **{
        f"channels look like {', '.join(CHANNELS[channel] for channel in order)}": (
            partial(np.take, indices=order, axis=-1),
            partial(np.take, indices=np.argsort(order), axis=-1),
        )
        for order in permutations(range(3))
        if order != (0, 1, 2)
    },
    **{
        f"colours look like those of {name}": (
            partial(_times, matrix),
            partial(_times, np.linalg.inv(matrix)),
        )
        for name in PRIMARIES
        if (matrix := colour_spaces.of_primaries(colour_spaces.PRIMARIES[name]).matrix) is not None
    },
}
"""Mistakes in encoding colours: their symptoms, what undoes them, and what makes them."""

CURVED = ("values look sRGB-encoded", "values look decoded twice", "offset", "power")
"""Changes of values that resemble each other, and tone maps."""

CURES = {
    **{f"colours look like those of {name}": ": convert them to BT.709" for name in PRIMARIES},
    "values look sRGB-encoded": ": write linear values (`transfer=srgb` decodes all pictures)",
    "values look decoded twice": ": decode them once (`transfer=linear` decodes no picture)",
}
"""What mends a misreading: the option is for all pictures of a comparison."""


def _other_values(
    picture: Floats,
    other: Floats,
    counted: NDArray[np.bool_],
    names: Names,
    light: Light,
    tone_map: str | None,
) -> Iterator[Mistake | None]:
    """Yield by what other values a picture shows its light: another tone map, or other colours."""
    curves = Curves.of(picture, light, counted)
    given = curves.fit(tone_map)
    expected = other if tone_map is None else given.shown(light.mean)
    change = _change_of_colours(picture, expected, counted, names, is_mapped=tone_map is not None)
    curve = curves.other(given)
    if curve is not None:
        # Both are pixels as they are shown, and rounding makes no difference.
        left = curve.distance + ROUNDING
        change_left = np.inf
        if change is not None and change.show is not None:
            show = change.show
            change_left = ROUNDING + curves.distance(
                lambda light: show(light if tone_map is None else given.shown(light))
            )
        if left < RIVAL * change_left:
            yield Mistake(sentence=f"{names.picture} is misread. {_cure(curve, names)}")
            return
        if change is not None and change_left >= RIVAL * left:
            sentence = f"{change.sentence} Or it is another curve: {_cure(curve, names)}"
            change = replace(change, sentence=sentence)
    yield change
    if tone_map is not None:
        yield _exposure(given, names)


def _cure(curve: FittedCurve, names: Names) -> str:
    """Return what to give for a picture that shows light by another curve."""
    if curve.name is None:
        return "Its values look linear: omit `tone_map`."
    return (
        f"Its values look tone-mapped: give `tone_map={curve.name}`. It was given"
        f" {curve.exposure:.3g} times the light of {names.other}."
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
    )


# --- Position ----------------------------------------------------------------------------------


TURNED: dict[str, Mending] = {
    "upside down": lambda image: image[::-1],
    "mirrored left to right": lambda image: image[:, ::-1],
    "turned by 180 degrees": lambda image: image[::-1, ::-1],
    "turned by 90 degrees clockwise": lambda image: np.rot90(image, 1),
    "turned by 90 degrees anticlockwise": lambda image: np.rot90(image, -1),
    "mirrored at the diagonal from top left": lambda image: image.transpose(1, 0, 2),
    "mirrored at the diagonal from top right": lambda image: np.rot90(image, 2).transpose(1, 0, 2),
}
"""How a picture may be turned, and what turns it back."""


def _turned(
    picture: Floats, other: Floats, counted: NDArray[np.bool_], names: Names
) -> Mistake | None:
    """Return how a picture is turned; None if it is not, or if turning it back mends too little.

    What is brighter than what stays, whatever the values are.
    """
    lacking = {
        how: 1.0 - _order_agreement(light, _light(other), counted)
        for how, light in _views(picture, other.shape).items()
    }
    how = min(lacking, key=lacking.__getitem__)
    before = 1.0 - _order_agreement(_light(picture), _light(other), counted)
    if before < LACKING or lacking[how] > TURNED_BACK * before:
        return None
    return Mistake(
        sentence=f"{names.picture} looks {how}, or lit from the other side.", mend=TURNED[how]
    )


def _views(picture: Floats, shape: tuple[int, ...]) -> dict[str, Floats]:
    """Return the brightness (H, W, 1) of a picture turned in each way that leads to a shape."""
    views = {how: turn(_light(picture)) for how, turn in TURNED.items()}
    return {how: view for how, view in views.items() if view.shape[:2] == shape[:2]}


def _light(image: Floats) -> Floats:
    """Return the mean (H, W, 1) of the channels of an image."""
    light: Floats = image @ np.full((3, 1), 1 / 3, image.dtype)
    return light


def _order_agreement(light: Floats, other: Floats, counted: NDArray[np.bool_]) -> float:
    """Return Spearman's correlation of the mean brightness of small blocks; 1 if one is even.

    Both are of pixels, (H, W, 1).
    """
    blocks = Blocks.of(light, other, counted)
    first = _ranks(blocks.picture[:, 0])
    second = _ranks(blocks.other[:, 0])
    first = first - first.mean()
    second = second - second.mean()
    size = float(np.sqrt((first**2).sum() * (second**2).sum()))
    return float((first * second).sum()) / size if size else 1.0


def _ranks(values: Floats) -> Floats:
    """Return the ranks of values (N,); equal ones share theirs."""
    _, places, counts = np.unique(values, return_inverse=True, return_counts=True)
    ranks: Floats = (np.cumsum(counts) - (counts - 1) / 2)[places]
    return ranks


def _is_of_other_scene(
    picture: Floats, other: Floats, counted: NDArray[np.bool_], place: alignment.Place
) -> bool:
    """Return whether two pictures share neither edges nor, however turned, what is bright.

    Both must show much.
    """
    if place.correlation > OTHER_EDGES:
        return False
    brightest = _brightest(picture)[counted]
    if np.mean(brightest >= CLIPPED * brightest.max()) > MOSTLY:
        return False
    if not all(_has_structure(image, counted) for image in (picture, other)):
        return False
    views = [_light(picture), *_views(picture, other.shape).values()]
    return max(_order_agreement(view, _light(other), counted) for view in views) < OTHER_ORDER


def _has_structure(image: Floats, counted: NDArray[np.bool_]) -> bool:
    """Return whether blocks differ by far more than the pixels within them let expect of noise.

    That is the ratio of variances of an analysis of variance; it is 1 for independent noise.
    """
    light = np.where(counted, image.mean(axis=-1), 0.0)[..., None]
    blocks = Blocks.of(light, light**2, counted)
    within = float((blocks.other - blocks.picture**2).mean())
    size = counted.sum() / max(len(blocks.picture), 1)
    return bool(blocks.picture.var() * size > STRUCTURE * within)


def _moved(picture: Floats, other: Floats, place: alignment.Place, names: Names) -> Mistake | None:
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
    if place.shift is None or max(map(abs, place.shift)) < SHIFT:
        return None
    right = round(place.shift[0] / SHIFT) * SHIFT
    down = round(place.shift[1] / SHIFT) * SHIFT
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


def _is_moved(picture: Floats, other: Floats, right: float, down: float) -> bool:
    """Return whether moving a picture back mends more than moving it on; else it is only smoother.

    A parabola through the squared errors of both and of none has its least one ``x = (on - back) /
    (2 (on + back - 2 error))`` of the way back: 1 for a picture that is moved, 0 for a blurred one.
    Brightness counts by its rank, or a brighter one of two smooth pictures would look moved.
    """
    alike = _image_of_ranks(picture)
    expected = _image_of_ranks(other)
    error = np.mean((alike - expected) ** 2)
    back = np.mean((_shifted(alike, right=-right, down=-down) - expected) ** 2)
    on = np.mean((_shifted(alike, right=right, down=down) - expected) ** 2)
    return bool(on - back > 2 * MOVED * abs(on + back - 2 * error))


def _image_of_ranks(image: Floats) -> Floats:
    """Return the rank of each pixel's brightness, (H, W, 1)."""
    return _ranks(image.mean(axis=-1, dtype=float).ravel()).reshape(*image.shape[:2], 1)


def _in_pixels(shift: float, ahead: str, back: str) -> str:
    """Return a shift in words; none if it is 0."""
    if not shift:
        return ""
    size = abs(shift)
    return f"{size:g} pixel{'' if size == 1 else 's'} {ahead if shift > 0 else back}"


def _shifted(picture: Floats, right: float, down: float) -> Floats:
    """Return a picture whose content is moved; its edges repeat beyond them."""
    for axis, by in ((0, down), (1, right)):
        last = picture.shape[axis] - 1
        place = np.clip(np.arange(last + 1) - by, 0, last)
        below = place.astype(int)
        share = (place - below)[:, None] if axis else (place - below)[:, None, None]
        before = np.take(picture, below, axis)
        after = np.take(picture, np.minimum(below + 1, last), axis)
        picture = before + share * (after - before)
    return picture


def _zoom(picture: Floats, other: Floats) -> float | None:
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


def _agreement(picture: Floats, other: Floats) -> float:
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


def _zoomed(picture: Floats, zoom: float) -> Floats:
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


def ratios(
    picture: Floats, other: Floats, counted: NDArray[np.bool_]
) -> tuple[float, float, float]:
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

    def of_channel(channel: int) -> float:
        told = truth[:, channel] > least
        if not told.any():
            return level
        # Colours outside BT.709 have negative values.
        shares = np.maximum(shown[told, channel], 0.0) / truth[told, channel]
        return float(np.median(shares))

    return of_channel(0), of_channel(1), of_channel(2)


def _lit(blocks: Blocks) -> NDArray[np.bool_]:
    """Return the blocks that tell a ratio."""
    lit: NDArray[np.bool_] = np.ones(len(blocks.picture), bool)
    for colours in (blocks.picture, blocks.other):
        light = colours.mean(axis=1)
        # The median, since a lamp would raise the mean.
        lit &= light > LIT * np.median(light[light > 0]) if (light > 0).any() else False
    for colours in (blocks.picture, blocks.other):
        if colours.size and colours.max() <= 1.0:
            free = lit & (colours.max(axis=1) < CLIPPED)
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
    picture: Floats,
    other: Floats,
    counted: NDArray[np.bool_],
    names: Names,
    is_mapped: bool = False,
    noticed: float = NOTICED,
) -> Mistake | None:
    """Return the simplest change of colours that explains a picture; None if none does.

    If both ``is_mapped``, only readings of the values count: other colours are the light's.
    """
    blocks = Blocks.of(picture, other, counted)
    before = blocks.departure()
    if before < noticed:
        return None
    tiles = Tiles.of(picture, other, counted)
    changes = dict(_readings(tiles, names, before))
    ratio = np.array(ratios(picture, other, counted))
    ratio = np.maximum(ratio, LEAST_RATIO * ratio.max())
    if not is_mapped:
        changes = _changes(blocks, ratio, names, changes)
        # Blocks have less noise, and pixels no edges within.
        pixels = _some_pixels(picture, other, counted)
        if powers := list(filter(None, (_power(blocks, names), _power(pixels, names)))):
            changes["power"] = min(powers, key=tiles.left)
    left = {kind: tiles.left(change) for kind, change in changes.items()}
    if not is_mapped and min(left.values()) > SLIGHT * before:
        pairs = {change: tiles.left(change) for change in _pairs_of_changes(blocks, names)}
        both = min(pairs, key=pairs.__getitem__, default=None)
        if both is not None and pairs[both] < min(WHOLLY * before, BETTER * min(left.values())):
            return both
    allowed = SIMPLER * min(left.values()) + SLIGHT * before
    # The first of them is the simplest.
    chosen = next(kind for kind, departure in left.items() if departure <= allowed)
    if left[chosen] <= EXPLAINED * before:
        return _with_rivals(chosen, changes, left)
    if is_mapped or left["level"] > BETTER * before:
        return None
    # A large factor, or a white that is the same everywhere, is named though more is wrong.
    level = _brightness(blocks)
    if level.is_known or not 1 / LEVEL < level.value < LEVEL:
        return changes["level"]
    return changes.get("white") if _is_even_tint(blocks) else None


def _some_pixels(picture: Floats, other: Floats, counted: NDArray[np.bool_]) -> Blocks:
    """Return the colours of pixels that count, at most as many as blocks of them have."""
    places = np.flatnonzero(counted)
    most = MOST_BLOCKS * BLOCK**2
    if len(places) > most:
        places = np.sort(np.random.default_rng(0).choice(places, most, replace=False))
    drawn = [image.reshape(-1, 3)[places].astype(float) for image in (picture, other)]
    return Blocks(picture=drawn[0], other=drawn[1])


def _with_rivals(chosen: str, changes: dict[str, Mistake], left: dict[str, float]) -> Mistake:
    """Return a change, or the curve that is far nearer, with the others that are as near."""
    if chosen not in CURVED:
        return changes[chosen]
    curved = {kind: left[kind] + ROUNDING_LEFT for kind in CURVED if kind in left}
    best = min(curved, key=curved.__getitem__)
    if curved[best] < RIVAL * curved[chosen]:
        chosen = best
    sentences = [changes[chosen].sentence]
    for kind, departure in curved.items():
        if kind != chosen and RIVAL * departure <= curved[chosen]:
            sentences.append(f"Or: {changes[kind].sentence}")
    return replace(changes[chosen], sentence=" ".join(sentences))


def _readings(tiles: Tiles, names: Names, before: float) -> Iterator[tuple[str, Mistake]]:
    """Yield other readings of a picture's values by their names, with a factor if that is all.

    ``before`` is the departure of the blocks.
    """
    for misreading, (undo, redo) in MISREADINGS.items():
        reading = Mistake(
            sentence=f"{names.picture} is misread. Its {misreading}{CURES.get(misreading, '')}.",
            mend=undo,
            show=redo,
        )
        brightness = _brightness(tiles.blocks(undo))
        brighter = replace(
            reading,
            sentence=f"{reading.sentence} It is then {brightness} times as bright.",
            mend=partial(_undone, undo, brightness.value),
            show=partial(_redone, redo, brightness.value),
        )
        is_all = tiles.left(brighter) < WHOLLY * before
        yield misreading, brighter if is_all and abs(brightness.value - 1) > TINT else reading


def _undone(undo: Mending, factor: float, image: Floats) -> Floats:
    return undo(image) / factor


def _redone(redo: Mending, factor: float, image: Floats) -> Floats:
    return redo(factor * image)


def _brightness(blocks: Blocks) -> Factor:
    """Return how many times as bright a picture is as the other half, over its lit blocks."""
    lit = _lit(blocks)
    shown = np.maximum(blocks.picture[lit].mean(axis=1), 0.0)
    factors = shown / np.maximum(blocks.other[lit].mean(axis=1), BLACK**2)
    value = float(np.median(factors)) if factors.size else 0.0
    if value <= 0:
        return Factor(value=1.0, precision=0.0)
    # A median's standard error is 1.25 times that of a mean; 1.48 makes a deviation typical.
    spread = 1.48 * float(np.median(np.abs(factors - value))) / value
    return Factor(value=value, precision=3 * 1.25 * spread / np.sqrt(len(factors)))


def _changes(
    blocks: Blocks, ratio: Floats, names: Names, readings: dict[str, Mistake]
) -> dict[str, Mistake]:
    """Return changes of colours by their kind, the simplest first; ``readings`` are among them."""
    brightness = _brightness(blocks)
    changes = {
        "level": Mistake(
            sentence=(
                f"{names.picture} is {brightness} times as bright as {names.other}:"
                f" {brightness.reason}?"
            ),
            mend=lambda image: image / brightness.value,
            show=lambda image: image * brightness.value,
        )
    }
    changes |= readings
    level = float(np.exp(np.log(ratio).mean()))
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
            show=lambda image: image * ratio,
        )
    offset = float(np.median((blocks.picture - blocks.other).mean(axis=1)))
    side = "high" if offset > 0 else "low"
    changes["offset"] = Mistake(
        sentence=f"{names.picture}'s values are all {abs(offset):.3g} too {side}.",
        mend=lambda image: np.maximum(image - offset, 0.0),
        show=lambda image: np.maximum(image + offset, 0.0),
    )
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
    power = max(float(np.median(rise[far] / run[far])), POWERS[0] / 2)
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
        show=lambda image: scale * np.maximum(image, 0.0) ** power,
    )


def _pairs_of_changes(blocks: Blocks, names: Names) -> Iterator[Mistake]:
    """Yield two changes at once: a factor with an offset, or other colours with a power."""
    slope, offset = np.polyfit(blocks.other.ravel(), blocks.picture.ravel(), deg=1)
    if slope > 0 and abs(slope - 1) > TINT:
        side = "high" if offset > 0 else "low"
        yield Mistake(
            sentence=(
                f"{names.picture} is {slope:.3g} times as bright as {names.other}, and its values"
                f" are then all {abs(offset):.3g} too {side}."
            ),
            mend=lambda image: np.maximum(image - offset, 0.0) / slope,
            show=lambda image: np.maximum(slope * image + offset, 0.0),
        )
    for misreading, (undo, redo) in MISREADINGS.items():
        if not misreading.startswith(("channels", "colours")):
            continue
        power = _power(Blocks(picture=blocks.picture, other=redo(blocks.other)), names)
        if power is not None and power.mend is not None and power.show is not None:
            yield Mistake(
                sentence=(
                    f"{names.picture} is misread. Its {misreading}{CURES.get(misreading, '')}."
                    f" {power.sentence}"
                ),
                mend=partial(_after, power.mend, undo),
                show=partial(_after, redo, power.show),
            )


def _after(first: Mending, second: Mending, image: Floats) -> Floats:
    return second(first(image))


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
    picture: Floats, other: Floats, counted: NDArray[np.bool_], names: Names
) -> Mistake | None:
    """Return where a picture ends at one value, and the other half does not."""
    largest = _largest(picture, counted)
    at_end = (_brightest(picture) >= (1 - 1e-4) * largest) & counted
    brighter = at_end & (_brightest(other) > (1 + TINT) * largest)
    share = brighter.sum() / max(counted.sum(), 1)
    if share < PLATEAU or brighter.sum() < 0.5 * at_end.sum():
        return None
    beyond = _brightest(other)[brighter]
    if beyond.std() < TINT * beyond.mean():  # a lamp, say: it is one value in both
        return None
    return Mistake(
        sentence=(
            f"{names.picture}'s values end at {largest:.3g}, where {names.other} is brighter in"
            f" {_percent(share)} of the pixels: clipped?"
        ),
        mend=lambda image: np.where(brighter[..., None], other, image),
    )
