"""FLIP: what someone sees who flips between two images, at the resolution that an eye has.

It filters both images by the eye's contrast sensitivity before it compares colours, and compares
edges and points apart; so it needs to know how many pixels an eye has to a degree. The authors'
own code computes it (``flip-evaluator``): Andersson et al., *FLIP: A Difference Evaluator for
Alternating Images*, HPG 2020; *Visualizing Errors in Rendered High Dynamic Range Images*,
Eurographics 2021.

The exposures of HDR-FLIP are chosen here, by the formulas of the second paper: the code ends the
process where the reference is black, and takes 23 exposures where most of it is.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np

from comparisons.departure.spaces import Array, Viewing, luminance

#: Luminance that the tone curve of HDR-FLIP (ACES, by Narkowicz) shows as 0.85.
SHOWN = 2.118872

#: The largest value of half floats, beyond which HDR-FLIP sees no difference.
LARGEST = 65504.0

#: Luminance of display white below which a pixel is black: brighter exposures overflow.
DARKEST = 1e-9

#: Stops between the first and the last exposure of HDR-FLIP, each of which takes as long as FLIP.
MOST_STOPS = 8.0


def ldr_flip(test: Array, reference: Array, viewing: Viewing) -> Array:
    """LDR-FLIP (H, W) from 0 to 1 of linear images (H, W, 3) as a display shows them.

    Exposed, then clipped to [0, 1]. Images that are alike are 0 apart, black and white 0.967, green
    and blue 1. It is symmetric. Raises nothing for finite images.
    """
    shown = [np.clip(viewing.exposure * image, 0.0, 1.0) for image in (reference, test)]
    return _evaluated("LDR", shown, viewing)


def hdr_flip(test: Array, reference: Array, viewing: Viewing) -> Array:
    """HDR-FLIP (H, W) from 0 to 1: the largest LDR-FLIP over the exposures of `exposures`.

    Linear images (H, W, 3) are clipped to [0, 65504] only. It is not symmetric: the reference says
    which exposures there are. Raises nothing for finite images.
    """
    shown = [np.clip(viewing.exposure * image, 0.0, LARGEST) for image in (reference, test)]
    start, stop = exposures(shown[0])
    return _evaluated("HDR", shown, viewing, startExposure=start, stopExposure=stop)


def exposures(reference: Array) -> tuple[float, float]:
    """The first and the last exposure of HDR-FLIP in stops, for a linear image (H, W, 3) ≥ 0.

    ``log2(SHOWN / Y)``, where Y is the largest luminance, and the median; where that is black, the
    median of the pixels that are not. At most `MOST_STOPS` apart; both 0 for a black image.
    """
    light = luminance(reference)
    lit = light[light > DARKEST]
    if not lit.size:
        return 0.0, 0.0
    middle = np.median(light)
    middle = middle if middle > DARKEST else np.median(lit)
    start, stop = (float(np.log2(SHOWN / y)) for y in (light.max(), middle))
    return start, min(stop, start + MOST_STOPS)


def _evaluated(kind: str, shown: Iterable[Array], viewing: Viewing, **more: Any) -> Array:
    # Threads that spin where they wait take most of a busy machine.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    from flip_evaluator import evaluate

    images = (np.ascontiguousarray(image, np.float32) for image in shown)
    found, *_ = evaluate(
        *images,
        kind,
        inputsRGB=False,
        applyMagma=False,
        computeMeanError=False,
        parameters={"ppd": float(viewing.pixels_per_degree), **more},
    )
    return found[..., 0].astype(np.float64)
