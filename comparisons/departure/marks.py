"""Which pixels differ by more than the noise: Student's t-test, corrected for many tests."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from reference.rendering.renderer import require_finite


def critical_t(passes: int, values: int, level: float = 0.01) -> float:
    """Two-sided critical value of Student's t with ``passes − 1`` degrees of freedom.

    Šidák's correction makes `level` the chance of one false alarm among `values` independent
    tests: each is made at ``α = 1 − (1 − level)^(1/values)``. For a 512² image of three channels
    at 1 % that is 9.5 with 20 passes, 30 with 8 and 557 with 4: few passes see little.
    """
    from scipy.special import stdtrit

    each = -np.expm1(np.log1p(-level) / max(values, 1))
    return float(-stdtrit(passes - 1, each / 2))


def significance(
    mean_difference: ArrayLike,
    standard_error: ArrayLike,
    passes: int,
    pixels: int,
    level: float = 0.01,
    *,
    magnitude: ArrayLike = 0.0,
    absolute_floor: float = 1e-6,
    relative_floor: float = 1e-5,
) -> np.ndarray:
    """The pixels (H, W) whose difference is more than noise and more than float32 rounding.

    mean_difference, standard_error
        (H, W, 3): mean over independent passes of (test − reference), and the standard error of
        that mean, s/√passes. Zero errors are allowed: where lights are points and both images
        share their camera rays, the comparison has no noise.
    passes, pixels
        Number of independent passes, and of pixels tested.
    level
        Chance that a comparison without any real difference marks a pixel at all.
    magnitude
        Broadcast to (H, W, 3): size of the values compared, e.g. the larger of the two images.

    A pixel is marked if in any channel ::

        |d| > t · SE    and    |d| > max(absolute_floor, relative_floor · |magnitude|)

    with t from `critical_t` over pixels × channels. Raises `NonFiniteError`; `ValueError` if a
    single pass has a standard error other than 0.
    """
    difference = np.abs(np.asarray(mean_difference, np.float64))
    error = np.asarray(standard_error, np.float64)
    require_finite(difference, "mean difference")
    require_finite(error, "standard error of the difference")
    rounding = np.maximum(absolute_floor, relative_floor * np.abs(magnitude))
    marked = difference > rounding
    if error.any():
        if passes < 2:
            raise ValueError(f"{passes} pass cannot have a standard error: at least 2 are needed")
        marked &= difference > critical_t(passes, pixels * difference.shape[-1], level) * error
    return marked.any(axis=-1)
