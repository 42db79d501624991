"""The colour differences as colour-science defines them, and FLIP as its authors compute it.

They take as long as rendering does, so the compiled ones (`comparisons.departure.colorimetry`,
`comparisons.departure.flip`) are used instead; the tests and ``fotismos doctor`` compare them.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import colour
import numpy as np
from colour.appearance import VIEWING_CONDITIONS_CAM16, XYZ_to_CAM16
from colour.difference import delta_E_CIE2000
from colour.models import (
    RGB_COLOURSPACE_BT709,
    RGB_COLOURSPACE_BT2020,
    JMh_CAM16_to_CAM16UCS,
    RGB_to_ICtCp,
    XYZ_to_Lab,
)
from numpy.typing import NDArray

from comparisons.departure.flip import LARGEST, exposures
from comparisons.departure.metrics import METRICS
from comparisons.departure.spaces import DEFAULT_VIEWING, PQ_PEAK, Array, Viewing

AGREEMENT = 1e-4
"""Largest allowed deviation of the compiled colour differences from colour-science's."""


def lab(rgb: Array, viewing: Viewing) -> Array:
    """Return CIE L*a*b* of linear RGB (..., 3) as displayed."""
    return np.asarray(XYZ_to_Lab(_shown(rgb, viewing, 1.0)), float)


def cam16ucs(rgb: Array, viewing: Viewing, white: float = 1.0) -> Array:
    """Return CAM16-UCS J'a'b' of linear RGB (..., 3) as displayed, up to `white`."""
    adapted = 100.0 * RGB_COLOURSPACE_BT709.matrix_RGB_to_XYZ.sum(axis=1)
    found = XYZ_to_CAM16(
        100.0 * _shown(rgb, viewing, white),
        adapted,
        0.2 * viewing.ambient_illuminance / np.pi,
        viewing.background,
        VIEWING_CONDITIONS_CAM16["Average"],
        compute_H=False,
    )
    correlates = [np.asarray(each, float) for each in (found.J, found.M, found.h)]
    return JMh_CAM16_to_CAM16UCS(np.stack(correlates, axis=-1))


def itp(rgb: Array, viewing: Viewing) -> Array:
    """Return 720 · (I, T, P) of linear RGB (..., 3)."""
    matrix = RGB_COLOURSPACE_BT2020.matrix_XYZ_to_RGB @ RGB_COLOURSPACE_BT709.matrix_RGB_to_XYZ
    level = viewing.exposure * viewing.white_luminance
    absolute = np.clip(rgb @ (level * matrix).T, 0.0, PQ_PEAK)
    return RGB_to_ICtCp(absolute, method="ITU-R BT.2100-2 PQ") * [720.0, 360.0, 720.0]


def _shown(rgb: Array, viewing: Viewing, white: float) -> Array:
    clipped = np.clip(rgb * viewing.exposure, 0.0, white)
    return clipped @ RGB_COLOURSPACE_BT709.matrix_RGB_to_XYZ.T


def _distance(a: Array, b: Array) -> Array:
    return np.linalg.norm(a - b, axis=-1)


DEFINED: dict[str, tuple[Callable[..., Array], Callable[..., Any]]] = {
    "dE2000": (lab, delta_E_CIE2000),
    "dE_ITP": (itp, _distance),
    "dE_CAM16UCS": (cam16ucs, _distance),
}
"""Space and difference of each metric that colour-science defines."""

FLIPS = ("ldr_flip", "hdr_flip")
"""Metrics that their authors' program defines."""


def flip(name: str, test: Array, reference: Array, viewing: Viewing) -> NDArray[np.float32]:
    """Return "ldr_flip" or "hdr_flip" (H, W) of linear images from 0 to 65504, by its authors."""
    # Threads that spin while waiting take most of a busy machine.
    os.environ.setdefault("OMP_WAIT_POLICY", "passive")
    from flip_evaluator import evaluate

    is_high = name == "hdr_flip"
    truth, shown = (
        np.clip(viewing.exposure * image, 0.0, LARGEST if is_high else 1.0)
        for image in (reference, test)
    )
    parameters = {"ppd": float(viewing.pixels_per_degree)}
    if is_high:
        parameters["startExposure"], parameters["stopExposure"] = exposures(truth)
    found, *_ = evaluate(
        np.ascontiguousarray(truth, np.float32),
        np.ascontiguousarray(shown, np.float32),
        "HDR" if is_high else "LDR",
        inputsRGB=False,
        applyMagma=False,
        computeMeanError=False,
        parameters=parameters,
    )
    return found[..., 0]


def farthest(count: int = 4096) -> float:
    """Return the largest deviation of the compiled differences, over random colours."""
    test, reference = np.random.default_rng(0).random((2, count, 3))
    apart = 0.0
    with np.errstate(all="ignore"), colour.utilities.suppress_warnings(python_warnings=True):
        for name, (space, difference) in DEFINED.items():
            defined = difference(*(space(image, DEFAULT_VIEWING) for image in (test, reference)))
            found = METRICS[name](test[None], reference[None], DEFAULT_VIEWING)[0]
            apart = max(apart, float(np.abs(found - defined).max()))
    images = [colours.reshape(64, -1, 3) for colours in (test, reference)]
    for name in FLIPS:
        defined = flip(name, images[0], images[1], DEFAULT_VIEWING)
        apart = max(apart, float(np.abs(METRICS[name](*images) - defined).max()))
    return apart
