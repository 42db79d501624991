"""What is odd about a picture as a whole, in words: exposure, white, encoding, channels."""

from collections.abc import Iterator

import numpy as np

from comparisons.comparison import PictureRecord
from comparisons.pictures.readings import READINGS, factor_of_pi
from comparisons.pictures.registration import TURNED

SHIFT = 0.5
"""Pixels from which a shift is told."""

LEVEL = 2.0
"""Factor of brightness from which the exposure is told."""

TINT = 0.05
"""Relative difference of the channels' factors from which the white is told."""

BLOCK = 8
"""Pixels of the side of a block whose mean colour is looked at."""

EVEN = 0.2
"""Spread of a tint over the picture, as a share of it, up to which it is that of the white."""

BETTER = 0.5
"""Share of the difference that another reading of the values may leave to be believed."""


def ratios(picture: np.ndarray, reference: np.ndarray) -> tuple[float, float, float]:
    """Return the means of a picture's channels over those of the reference, both (N, 3)."""
    least = 1e-6
    found = (picture.mean(axis=0) + least) / (reference.mean(axis=0) + least)
    return tuple(float(value) for value in found)


def told(
    found: PictureRecord, picture: np.ndarray, reference: np.ndarray, counted: np.ndarray
) -> Iterator[str]:
    """Yield what is odd; where the picture lies comes first.

    Parameters
    ----------
    found
        The record of the picture.
    picture, reference
        (H, W, 3), linear.
    counted
        (H, W), where the scene has a surface.
    """
    yield from _place(found)
    if found.repeats == 1:
        yield (
            "The picture is one file, whose own noise is not known: it counts as departure. Give"
            " repeats of other seeds to tell them apart."
        )
    reading = _other_reading(picture, reference, counted)
    if reading:
        yield reading
        return
    yield from _level(found)
    yield from _white(picture, reference, counted)


def _white(picture: np.ndarray, reference: np.ndarray, counted: np.ndarray) -> Iterator[str]:
    """Tell a white that is another one everywhere; wrong shading is so here and there."""
    shown, expected = (_blocks(each, counted) for each in (picture, reference))
    logs = np.log(shown / expected)
    logs -= logs.mean(axis=1, keepdims=True)
    tint = np.median(logs, axis=0)
    spread = np.median(np.abs(logs - tint), axis=0).max()
    if np.ptp(tint) > TINT and spread < EVEN * np.abs(tint).max():
        relative = ", ".join(f"{value:.3g}" for value in np.exp(tint))
        yield f"Its red, green and blue are {relative} times as strong beside it: another white?"


def _blocks(image: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Return means of blocks of pixels that count, (B, 3), where there is light."""
    height, width = (side // BLOCK * BLOCK for side in counted.shape)
    weighted = np.where(counted[..., None], image, 0)[:height, :width].astype(float)
    sums = weighted.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).sum(axis=(1, 3))
    sums = sums.reshape(-1, 3)
    return np.maximum(sums, 1e-3 * max(sums.mean(), 1e-9))


def _place(found: PictureRecord) -> Iterator[str]:
    if found.shift is None:
        yield "The picture's edges do not tell whether it lies where the camera sees the scene."
        return
    x, y = found.shift
    if max(abs(x), abs(y)) >= SHIFT:
        across = f"{abs(x):.1f} pixels to the {'right' if x > 0 else 'left'}"
        down = f"{abs(y):.1f} pixels {'down' if y > 0 else 'up'}"
        yield (
            f"The picture is shifted by {across} and {down} (by its edges): edges look like wrong"
            " shading. Check the camera, the crop and the pixel centres before anything else."
        )


def _level(found: PictureRecord) -> Iterator[str]:
    level = float(np.mean(found.ratio))
    if mistake := factor_of_pi(level):
        yield f"The picture is {level:.3g} times as bright as the reference: {mistake}?"
        return
    if not 1 / LEVEL < level < LEVEL:
        yield f"The picture is {level:.3g} times as bright as the reference: another exposure?"


def _other_reading(picture: np.ndarray, reference: np.ndarray, counted: np.ndarray) -> str:
    """Say by which other reading of its values the picture comes near to the reference."""
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
    words = min(distances, key=distances.get)
    if distances[words] > BETTER * plain:
        return ""
    return f"The picture is read wrongly. {words}"


def _distance(image: np.ndarray, reference: np.ndarray) -> float:
    """Return the relative RMS difference after the best factor on an image."""
    image, reference = np.asarray(image, float), np.asarray(reference, float)
    # On the scale of a display, so that a highlight does not decide alone.
    image, reference = (np.minimum(each, 4 * each.mean() + 1e-9) for each in (image, reference))
    factor = np.sum(image * reference) / max(np.sum(image * image), 1e-30)
    return float(
        np.sqrt(np.mean((factor * image - reference) ** 2) / np.mean(reference**2 + 1e-12))
    )
