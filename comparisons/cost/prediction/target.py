"""The size that is asked for, what is fitted for it, and whether either is possible."""

from math import sqrt

from comparisons.cost.effort import DETERMINISTIC_SPP
from heuristic.errors import InputError
from reference.rendering import memory
from reference.rendering.renderer import LARGEST_PASS

LARGEST_FITTED = 256**2
"""Pixels of the largest size that is fitted, where the asked one is at least four times that."""

SEEN_SPP = (6, 32)
"""Counts that are measured at the asked size: none of them is fitted."""

Size = tuple[int, int]


def sizes(target: Size) -> tuple[Size, Size, Size]:
    """Return the sizes that are fitted for another one: smaller ones of its shape.

    Raises
    ------
    InputError
        Where the asked size is too small for that.
    """
    area = target[0] * target[1]
    largest = min(LARGEST_FITTED, area / 4)
    scales = [sqrt(largest / area) * factor for factor in (1 / 4, 1 / 2, 1)]
    smallest, middle, last = ((round(target[0] * s), round(target[1] * s)) for s in scales)
    if min(smallest) < 4:
        raise InputError(
            f"{target[0]}x{target[1]} is too small to predict anything for: measure it itself with"
            " --resolution."
        )
    return smallest, middle, last


def require(name: str, target: Size, rendered: Size | None, is_measured: bool) -> None:
    """Refuse what cannot be predicted, or measured where that is asked for, of a scene.

    Parameters
    ----------
    name
        Of the scene.
    target
        The asked width and height.
    rendered
        Width and height of the study itself; None where they follow the asked ones.
    is_measured
        Whether to render at the asked size, too.

    Raises
    ------
    InputError
        For a size that is too small, of another shape, or too large for the memory or one pass.
    """
    sizes(target)
    if rendered is not None:
        _require_shape(rendered, target)
    if is_measured:
        _require_room(name, *target)


def _require_shape(rendered: Size, target: Size) -> None:
    """Refuse two sizes that are not of one shape, to half a pixel of the smaller."""
    (width, height), (wide, high) = sorted([rendered, target])
    if abs(high * width / wide - height) > 1:
        raise InputError(
            f"{rendered[0]}x{rendered[1]} and {target[0]}x{target[1]} are not of one shape: give"
            " --resolution the shape of --at, or leave it out."
        )


def _require_room(name: str, width: int, height: int) -> None:
    most = LARGEST_PASS // max(*SEEN_SPP, *DETERMINISTIC_SPP)
    if width * height > most:
        raise InputError(
            f"{width}x{height} is too large to be measured: {most} pixels are allowed. Leave out"
            " --measure to have it predicted."
        )
    memory.require(name, width, height)
