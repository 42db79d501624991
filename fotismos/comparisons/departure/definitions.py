"""The colour differences as colour-science defines them.

They take ten times as long as the compiled ones (`fotismos.comparisons.departure.colour`), which
are used instead. Every comparison, ``fotismos doctor`` and the tests compare the two.
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

with np.printoptions():  # which colour-science changes
    import colour  # noqa: F401
from colour.appearance import VIEWING_CONDITIONS_CAM16, XYZ_to_CAM16
from colour.difference import delta_E_CIE2000
from colour.models import (
    RGB_COLOURSPACE_BT709,
    RGB_COLOURSPACE_BT2020,
    JMh_CAM16_to_CAM16UCS,
    RGB_to_ICtCp,
    XYZ_to_Lab,
)

from fotismos.comparisons.departure.colour import PQ_PEAK, Array
from fotismos.comparisons.departure.metrics import METRICS, Metric
from fotismos.comparisons.records.departure import DEFAULT_VIEWING, Viewing

AGREEMENT = 1e-4
"""Largest allowed deviation of the compiled colour differences from colour-science's."""

ROUNDED = 1e-6
"""By how much a colour is moved to see if a difference jumps there: far more than the rounding of
L*a*b* (1e-12), and far less than what a wrong formula changes."""


def lab(rgb: Array, viewing: Viewing) -> Array:
    """Return CIE L*a*b* of linear RGB (..., 3) as displayed."""
    return np.asarray(XYZ_to_Lab(_shown(rgb, viewing, 1.0)), float)


def cam16ucs(rgb: Array, viewing: Viewing, white: float = 1.0) -> Array:
    """Return CAM16-UCS J'a'b' of linear RGB (..., 3) as displayed, up to `white`."""
    adapted = 100.0 * RGB_COLOURSPACE_BT709.matrix_RGB_to_XYZ.sum(axis=1)
    appearance = XYZ_to_CAM16(
        100.0 * _shown(rgb, viewing, white),
        adapted,
        0.2 * viewing.ambient_illuminance / np.pi,
        viewing.background,
        VIEWING_CONDITIONS_CAM16["Average"],
        compute_H=False,
    )
    correlates = [
        np.asarray(correlate, float) for correlate in (appearance.J, appearance.M, appearance.h)
    ]
    return np.asarray(JMh_CAM16_to_CAM16UCS(np.stack(correlates, axis=-1)))


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
    return np.asarray(np.linalg.norm(a - b, axis=-1))


DEFINED: dict[str, tuple[Callable[..., Array], Callable[..., Any]]] = {
    "dE2000": (lab, delta_E_CIE2000),
    "dE_ITP": (itp, _distance),
    "dE_CAM16UCS": (cam16ucs, _distance),
}
"""Space and difference of each metric that colour-science defines."""


@np.errstate(all="ignore")  # black has no hue
def deviations(
    test: Array, reference: Array, values: Mapping[str, Array], viewing: Viewing = DEFAULT_VIEWING
) -> dict[str, float]:
    """Return the largest deviation of each metric's ``values`` (N,), for linear colours (N, 3).

    ΔE2000 jumps where hues are 180 degrees apart: the mean hue turns to the other side, and
    rounding decides. So a deviation counts only if it is one from colours nearby, too.
    """
    apart = {}
    for name, (space, difference) in DEFINED.items():
        first = space(test, viewing)
        second = space(reference, viewing)
        deviation = np.abs(values[name] - difference(first, second))
        far = np.flatnonzero(deviation > ROUNDED)
        for turned in _nearby(first[far]):
            other = np.abs(values[name][far] - difference(turned, second[far]))
            deviation[far] = np.minimum(deviation[far], other)
        apart[name] = float(deviation.max(initial=0))
    return apart


def _nearby(colours: Array) -> list[Array]:
    """Return colours (N, 3) whose hue is turned either way, by :data:`ROUNDED` along the circle."""
    a = colours[:, 1]
    b = colours[:, 2]
    chroma = np.maximum(np.hypot(a, b), ROUNDED)
    step = ROUNDED * np.stack([np.zeros(len(a)), -b / chroma, a / chroma], axis=-1)
    return [colours + step, colours - step]


def farthest() -> float:
    """Return the largest deviation of the compiled differences, over random colours."""
    test, reference = np.random.default_rng(0).random((2, 4096, 3))
    distances = {name: METRICS[name](test[None], reference[None])[0] for name in DEFINED}
    return max(deviations(test, reference, distances).values())


def metrics() -> dict[str, Metric]:
    """Return all metrics; colour-science computes those that it defines."""
    chosen = dict(METRICS)
    for name, (space, difference) in DEFINED.items():
        metric: Any = chosen[name]
        chosen[name] = replace(metric, coordinates=_quiet(space), difference=_quiet(difference))
    return chosen


def _quiet(function: Callable[..., Any]) -> Callable[..., Any]:
    """Let a function ignore the warnings of black colours, which have no hue."""
    return np.errstate(all="ignore")(function)
