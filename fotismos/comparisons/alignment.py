"""Where a picture's content is, by its edges: a shift looks like wrong shading.

Geometric edges, where the normal or the hit changes, are in any picture of the same scene, however
it is shaded. The other half mostly shares its edges too: it shows where light ends. The picture's
edges are correlated with both at all shifts up to :data:`REACH`, and the better agreement counts; a
parabola through the highest values gives the fraction of a pixel. A shift counts only if it
improves the agreement by more than a shift of the other half itself, which is in its place: noise
and shading explain that much. Each half of the repeats must show it, too.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fotismos.comparisons.departure.blocks import ratio
from fotismos.comparisons.departure.colour import luminance

if TYPE_CHECKING:  # two pictures have no scene
    from fotismos.reference.rendering.gbuffer import GBuffer

REACH = 8
FINER = 4
"""Largest shift considered in pixels, at most a quarter of the picture's smaller side; and rays
along each side of a pixel."""

LEAST = 0.08
CHANCE = 5.0
"""Correlation below which edges are uninformative; and that of a picture of so few pixels that
chance makes it, in units of one over the root of their number."""

DOUBTFUL = 2.0
"""A shift improves the agreement by more than this times what noise does."""
AGREEMENT = 1.0
"""Pixels by which the shifts of halves of the repeats may differ from that of all."""


ROUNDING = 1e-12
"""Share of a map's squares below which its variance is rounding."""


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


def geometry_edges(surface: "GBuffer") -> np.ndarray:
    """Return how much the geometry changes at each pixel, (H, W).

    ``surface`` has :data:`FINER` rays along each side of a pixel.
    """
    layers = np.concatenate([surface.normal, surface.hit[..., None]], axis=-1)
    height, width = surface.hit.shape
    # Means over the rays of a pixel, (H, W, 4).
    by_pixel = layers.reshape(height // FINER, FINER, width // FINER, FINER, 4)
    return _edges(by_pixel.mean(axis=(1, 3)))


def scene_edges(surface: "GBuffer", textbook: np.ndarray | None) -> list[np.ndarray]:
    """Return maps of edges that a picture of a scene may contain: of its geometry, and its half's.

    For ``surface`` see :func:`geometry_edges`; ``textbook`` is the textbook half, (H, W, 3).
    """
    edges = [geometry_edges(surface)]
    return edges if textbook is None else [*edges, picture_edges(textbook)]


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
    slopes = [np.gradient(layers, axis=axis) for axis in (0, 1) if layers.shape[axis] > 1]
    size = np.sqrt(sum((slope**2).sum(axis=-1) for slope in slopes) + np.zeros(layers.shape[:2]))
    strength: np.ndarray = size / (size + 0.25)
    return strength


def _shift(edges: np.ndarray, seen: np.ndarray) -> Place:
    reach = max(1, min(REACH, min(edges.shape) // 4))
    table = _correlations(seen, edges, reach)
    y, x = map(int, np.unravel_index(np.argmax(table), table.shape))
    highest = float(table[y, x])
    gain = highest - float(table[reach, reach])
    if highest < max(LEAST, CHANCE / np.sqrt(seen.size)):
        return Place(shift=None, correlation=highest, gain=gain)
    down = y - reach + _vertex(table[:, x], y)
    right = x - reach + _vertex(table[y], x)
    return Place(shift=(float(right), float(down)), correlation=highest, gain=gain)


def _correlations(seen: np.ndarray, edges: np.ndarray, reach: int) -> np.ndarray:
    """Return the correlations of two maps (H, W) where they overlap after shifts of the second.

    Rows are shifts down, and columns to the right, from ``-reach`` to ``reach``.
    """
    first = seen - seen.mean()
    second = edges - edges.mean()
    shifts = np.arange(-reach, reach + 1)
    down = shifts[:, None]
    right = shifts[None]
    # Zeros beyond the edges, since Fourier transforms are of periodic maps.
    sides = [side + reach for side in edges.shape]
    spectrum = np.fft.rfft2(first, sides) * np.conj(np.fft.rfft2(second, sides))
    products = np.fft.irfft2(spectrum, sides)[down, right]
    height, width = edges.shape
    counts = np.maximum((height - np.abs(down)) * (width - np.abs(right)), 1.0)
    seen_sums = _overlap_sums(first, down, right)
    edge_sums = _overlap_sums(second, -down, -right)
    covariance = products - seen_sums * edge_sums / counts
    variances = np.ones(counts.shape)
    for map_of, sums, by in (
        (first, seen_sums, (down, right)),
        (second, edge_sums, (-down, -right)),
    ):
        squares = _overlap_sums(map_of**2, *by)
        variance = squares - sums**2 / counts
        # What is left of a flat part is rounding.
        variances = variances * np.where(variance > ROUNDING * squares.max(), variance, 0.0)
    return ratio(covariance, np.sqrt(variances))


def _overlap_sums(values: np.ndarray, down: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Return sums of a map (H, W) over the part that shifted maps of its size overlap."""
    height, width = values.shape
    top, bottom = np.clip(down, 0, height), np.clip(height + down, 0, height)
    left, end = np.clip(right, 0, width), np.clip(width + right, 0, width)
    # Sums of the cells between the corners, then of all cells above and to the left of each.
    rows = np.unique([0, *top.ravel(), *bottom.ravel()])
    columns = np.unique([0, *left.ravel(), *end.ravel()])
    cells = values
    for axis, starts in enumerate((rows, columns)):
        cells = np.add.reduceat(cells, starts[starts < values.shape[axis]], axis=axis)
    corner = np.pad(cells.cumsum(axis=0).cumsum(axis=1), ((1, 0), (1, 0)))
    top, bottom = np.searchsorted(rows, top), np.searchsorted(rows, bottom)
    left, end = np.searchsorted(columns, left), np.searchsorted(columns, end)
    sums: np.ndarray = (
        corner[bottom, end] - corner[top, end] - corner[bottom, left] + corner[top, left]
    )
    return sums


def _vertex(values: np.ndarray, peak: int) -> float:
    """Return the offset of the vertex of a parabola through a maximum and its neighbours."""
    if not 0 < peak < len(values) - 1:
        return 0.0
    before, top, after = values[peak - 1 : peak + 2]
    bend = before - 2 * top + after
    return 0.0 if bend >= 0 else float(0.5 * (before - after) / bend)


def is_doubtful(
    place: Place,
    by_noise: Place | None,
    repeats: Sequence[np.ndarray],
    expected: Sequence[np.ndarray],
) -> bool:
    """Return whether noise may make a shift.

    ``by_noise`` is where the other half seems to be, which is in its place. Shifts that noise makes
    also differ from half to half of the repeats (H, W, 3), if there are several.
    """
    if by_noise is not None and 0 < place.gain <= DOUBTFUL * by_noise.gain:
        return True
    if place.shift is None or len(repeats) < 2:
        return False
    for first in range(2):
        shift = measure(np.mean(repeats[first::2], axis=0), expected).shift
        if shift is None or np.abs(np.subtract(shift, place.shift)).max() > AGREEMENT:
            return True
    return False
