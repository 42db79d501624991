"""What makes the error of a picture meaningless, whatever it is of."""

import numpy as np

from fotismos.comparisons.departure.colour import BLACK
from fotismos.heuristic.errors import InputError

UNIFORM = 1e-6
"""Relative differences within a picture that are rounding."""


def caution(
    test: np.ndarray, reference: np.ndarray, name: str, allow_empty: bool, is_picture: bool
) -> str:
    """Return why the error of linear pixels (N, 3) may mean nothing; often empty.

    ``is_picture`` says that the pixels to be tested were given: textbook shading may be black. If
    both are black, it raises `InputError`, unless ``allow_empty``: they would agree, whatever is
    wrong.
    """
    if not test.size:
        return ""
    sides = [np.abs(values) for values in (test, reference)]
    test_is_black = float(sides[0].max()) < BLACK
    reference_is_black = float(sides[1].max()) < BLACK
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
    if all((np.ptp(values, axis=0) <= UNIFORM * values.max()).all() for values in sides):
        return "Each picture is one colour, so nothing shows whether they are of the same view."
    return ""
