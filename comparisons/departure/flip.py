"""FLIP: the differences that a viewer sees when flipping between two images.

It filters both images by the eye's contrast sensitivity before it compares colours, and compares
edges and points separately. So it needs the number of pixels per degree of view. The authors' own
code computes it (``flip-evaluator``): Andersson et al., *FLIP: A Difference Evaluator for
Alternating Images*, HPG 2020; *Visualizing Errors in Rendered High Dynamic Range Images*,
Eurographics 2021.

The exposures of HDR-FLIP are chosen here, by the formulas of the second paper: their code ends the
process if the reference is black, and takes 23 exposures if most of it is.
"""

from __future__ import annotations

import os
from collections.abc import Iterable
from typing import Any

import numpy as np

from comparisons.departure.spaces import Array, Viewing, luminance

SHOWN = 2.118872
"""Luminance that the tone curve of HDR-FLIP (ACES, by Narkowicz) shows as 0.85."""

LARGEST = 65504.0
"""Largest value of half floats; HDR-FLIP sees no difference beyond it."""

DARKEST = 1e-9
"""Luminance, in units of display white, below which a pixel is black: exposing it overflows."""

MOST_STOPS = 8.0
"""Stops between the first and last exposure of HDR-FLIP; each exposure takes as long as FLIP."""


def ldr_flip(test: Array, reference: Array, viewing: Viewing) -> Array:
    """Return LDR-FLIP (H, W) from 0 to 1 of linear images (H, W, 3) as a display shows them.

    Images are exposed, then clipped to [0, 1]. Equal images are 0 apart, black and white 0.967,
    green and blue 1. It is symmetric. Raises nothing for finite images.
    """
    shown = [np.clip(viewing.exposure * image, 0.0, 1.0) for image in (reference, test)]
    return _evaluated("LDR", shown, viewing)


def hdr_flip(test: Array, reference: Array, viewing: Viewing) -> Array:
    """Return HDR-FLIP (H, W) from 0 to 1: the largest LDR-FLIP over the range of `exposures`.

    Linear images (H, W, 3) are only clipped to [0, 65504]. It is not symmetric: the reference
    determines the exposures. Raises nothing for finite images.
    """
    shown = [np.clip(viewing.exposure * image, 0.0, LARGEST) for image in (reference, test)]
    start, stop = exposures(shown[0])
    return _evaluated("HDR", shown, viewing, startExposure=start, stopExposure=stop)


def exposures(reference: Array) -> tuple[float, float]:
    """Return the first and last exposure of HDR-FLIP in stops, for a linear image (H, W, 3) ≥ 0.

    ``log2(SHOWN / Y)``, where Y is the largest and the median luminance; if the median is black, it
    is that of all other pixels. At most `MOST_STOPS` apart; both are 0 for a black image.
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
    # Threads that spin while waiting take most of a busy machine.
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
