"""One criterion: a scene passes if at most 5 % of its pixels differ visibly.

The share of counted pixels whose difference is above a threshold t decides, without noise. Pixels
that noise leaves undecided widen its interval, and so a scene may be undecided, too. Of pictures
that are black, nearly so, or one colour, the error means little.
"""

from collections.abc import Sequence

import numpy as np

from fotismos.comparisons.departure.colour import BLACK
from fotismos.comparisons.departure.metrics import THRESHOLDS
from fotismos.comparisons.records.departure import Verdict, VisibleShare
from fotismos.heuristic.errors import InputError

LIMIT = 0.05
"""Largest share of the pixels that may differ visibly."""

TOLERANCE = 2.0
"""ΔE2000: the threshold unless chosen; visible side by side."""

DARK = 0.004
"""Display-linear: nobody sees a grey below it beside black, from which it is ΔE2000 2 away."""

UNIFORM = 1e-6
"""Relative differences within a picture that are rounding."""


def checked_threshold(threshold: float) -> float:
    """Return a threshold that records hold shares for; any other raises `InputError`."""
    if threshold not in THRESHOLDS:
        raise InputError(
            f"{threshold:g} is not a threshold of visible differences: give {THRESHOLDS[0]:g} to"
            f" {THRESHOLDS[-1]:g} in steps of {THRESHOLDS[1] - THRESHOLDS[0]:g}, such as"
            f" {TOLERANCE:g}."
        )
    return threshold


def share_above(visible: Sequence[VisibleShare], threshold: float = TOLERANCE) -> VisibleShare:
    """Return the share of pixels above a threshold, from a summary's ``visible``."""
    for share in visible:
        if share.threshold == threshold:
            return share
    listed = ", ".join(f"{share.threshold:g}" for share in visible)
    raise InputError(
        f"no share of pixels above {threshold:g} is recorded: give one of {listed or 'none'}."
    )


def decide(
    visible: Sequence[VisibleShare],
    threshold: float = TOLERANCE,
    limit: float = LIMIT,
) -> Verdict:
    """Return whether at most ``limit`` of the pixels are above a threshold, if noise allows.

    ``pass`` if the interval ends at ``limit`` or below it; ``fail`` if it begins above it.
    """
    share = share_above(visible, threshold)
    if share.high <= limit:
        return "pass"
    return "fail" if share.low > limit else "undecided"


def caution(
    test: np.ndarray,
    reference: np.ndarray,
    name: str,
    allow_empty: bool,
    is_picture: bool,
    exposure: float = 1.0,
) -> str:
    """Return why the error of linear pixels (N, 3) may mean nothing; often empty.

    They are shown at an ``exposure``. If so few pixels are seen to be lit that all of these may
    differ, pictures pass, whatever is wrong. ``is_picture`` says that the pixels to be tested were
    given: textbook shading may be black. If both are black, it raises `InputError`, unless
    ``allow_empty``: they would agree, whatever is wrong.
    """
    if not test.size:
        return ""
    test_light = np.abs(test)
    reference_light = np.abs(reference)
    test_is_black = float(test_light.max()) < BLACK
    reference_is_black = float(reference_light.max()) < BLACK
    if test_is_black and reference_is_black:
        if not allow_empty:
            raise InputError(
                f"{name}: both pictures are black: no pixel that counts is brighter than {BLACK} of"
                " display white. Check the lights, their intensity, and whether the camera is"
                " inside a shape. To allow black pictures, give `allow_empty`."
            )
        return "Both pictures are black, so their error means nothing."
    if reference_is_black:
        return (
            "The picture to compare with is black: check whether its lights reach what the camera"
            " sees."
        )
    if test_is_black and is_picture:
        return "The picture is black."
    lit = float((exposure * np.maximum(test_light, reference_light).max(axis=-1) >= DARK).mean())
    if lit <= LIMIT:
        return (
            f"Both pictures are nearly black: {100 * lit:.2g} % of the pixels show any light, so it"
            " means little that the others agree. Check the lights, and where the camera stands."
        )
    sides = (test_light, reference_light)
    if all((np.ptp(light, axis=0) <= UNIFORM * light.max()).all() for light in sides):
        return "Each picture is one colour, so nothing shows whether they are of the same view."
    return ""
