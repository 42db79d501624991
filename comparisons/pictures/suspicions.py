"""What is odd about a picture as a whole, in words: exposure, white, encoding, channels."""

from collections.abc import Iterator

import numpy as np

from comparisons.comparison import PictureRecord
from comparisons.pictures.readings import READINGS, factor_of_pi
from comparisons.pictures.registration import TURNED

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


def ratios(picture: np.ndarray, reference: np.ndarray) -> tuple[float, float, float]:
    """Return the means of a picture's channels over those of the reference, both (N, 3)."""
    if picture.max() <= 1:  # clipped at display white, as a PNG is: a lamp would decide
        reference = np.minimum(reference, 1)
    least = 1e-6
    found = (picture.mean(axis=0) + least) / (reference.mean(axis=0) + least)
    red, green, blue = map(float, found)
    return red, green, blue


def told(
    found: PictureRecord, picture: np.ndarray, reference: np.ndarray, counted: np.ndarray
) -> Iterator[str]:
    """Yield what is odd, the picture's position first.

    Parameters
    ----------
    found
        The record of the picture.
    picture, reference
        (H, W, 3), linear.
    counted
        (H, W): True where the scene has a surface.
    """
    yield from _place(found)
    if found.repeats == 1:
        yield (
            "The picture is one file, so its noise is unknown and counts as departure. Give"
            " repeats of other seeds to separate the two."
        )
    reading = _other_reading(picture, reference, counted)
    if reading:
        yield reading
        return
    yield from _level(found)
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


def _place(found: PictureRecord) -> Iterator[str]:
    if found.shift is None:
        yield "The picture's edges do not show whether it is aligned with the scene's camera."
        return
    x, y = found.shift
    if max(abs(x), abs(y)) >= SHIFT:
        across = f"{abs(x):.1f} pixels to the {'right' if x > 0 else 'left'}"
        down = f"{abs(y):.1f} pixels {'down' if y > 0 else 'up'}"
        yield (
            f"The picture's edges are shifted by {across} and {down}, which looks like wrong"
            " shading. Check the camera, the crop and the pixel centres first."
        )


def _level(found: PictureRecord) -> Iterator[str]:
    level = float(np.mean(found.ratio))
    if mistake := factor_of_pi(level):
        yield f"The picture is {level:.3g} times as bright as the reference: {mistake}?"
        return
    if not 1 / LEVEL < level < LEVEL:
        yield f"The picture is {level:.3g} times as bright as the reference: another exposure?"


def _other_reading(picture: np.ndarray, reference: np.ndarray, counted: np.ndarray) -> str:
    """Describe the other reading of its values that brings the picture near the reference."""
    plain = _distance(picture[counted], reference[counted])
    if plain < 1e-3:
        return ""
    readings = {
        f"Its {each.told}{each.cure and f': {each.cure}'}.": each.undo(picture) for each in READINGS
    }
    for how, turn in TURNED.items():
        readings[f"It looks {how}, or lit from the other side."] = turn(picture)
    distances = {
        words: _distance(image[counted], reference[counted]) for words, image in readings.items()
    }
    words = min(distances, key=distances.__getitem__)
    if distances[words] > BETTER * plain:
        return ""
    return f"The picture is misread. {words}"


def _distance(image: np.ndarray, reference: np.ndarray) -> float:
    """Return the relative RMS difference after the best factor on an image."""
    image, reference = np.asarray(image, float), np.asarray(reference, float)
    # Clipped near display white, or highlights alone would decide.
    image, reference = (np.minimum(each, 4 * each.mean() + 1e-9) for each in (image, reference))
    factor = np.sum(image * reference) / max(np.sum(image * image), 1e-30)
    return float(
        np.sqrt(np.mean((factor * image - reference) ** 2) / np.mean(reference**2 + 1e-12))
    )
