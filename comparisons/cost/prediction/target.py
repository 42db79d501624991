"""The requested size, the sizes fitted for it, and whether both are possible."""

from math import sqrt

from comparisons.cost.effort import DETERMINISTIC_SPP
from heuristic.errors import InputError
from reference.rendering import memory
from reference.rendering.renderer import LARGEST_PASS

LARGEST_FITTED = 256**2
"""Pixels of the largest fitted size, if the requested one has at least four times as many."""

SEEN_SPP = (6, 32)
"""Counts measured at the requested size; none of them is fitted."""

Size = tuple[int, int]


def sizes(target: Size) -> tuple[Size, Size, Size]:
    """Return the sizes fitted for another: smaller ones of its shape.

    Raises
    ------
    InputError
        When the requested size is too small for that.
    """
    area = target[0] * target[1]
    largest = min(LARGEST_FITTED, area / 4)
    scales = [sqrt(largest / area) * factor for factor in (1 / 4, 1 / 2, 1)]
    smallest, middle, last = ((round(target[0] * s), round(target[1] * s)) for s in scales)
    if min(smallest) < 4:
        raise InputError(
            f"{target[0]}x{target[1]} is too small for a prediction: measure it with --resolution."
        )
    return smallest, middle, last


def require(name: str, target: Size, rendered: Size | None, is_measured: bool) -> None:
    """Reject sizes that cannot be predicted for a scene, or measured if that is requested.

    Parameters
    ----------
    name
        Name of the scene.
    target
        The requested width and height.
    rendered
        Width and height of the study itself; None if derived from ``target``.
    is_measured
        Whether to render at the requested size, too.

    Raises
    ------
    InputError
        For a size that is too small, of another shape, or too large for memory or one pass.
    """
    sizes(target)
    if rendered is not None:
        _require_shape(rendered, target)
    if is_measured:
        _require_room(name, *target)


def _require_shape(rendered: Size, target: Size) -> None:
    """Reject sizes of different shapes; a pixel of the smaller one is tolerated."""
    (width, height), (wide, high) = sorted([rendered, target])
    if abs(high * width / wide - height) > 1:
        raise InputError(
            f"{rendered[0]}x{rendered[1]} and {target[0]}x{target[1]} differ in shape: give"
            " --resolution the shape of --at, or omit it."
        )


def _require_room(name: str, width: int, height: int) -> None:
    most = LARGEST_PASS // max(*SEEN_SPP, *DETERMINISTIC_SPP)
    if width * height > most:
        raise InputError(
            f"{width}x{height} is too large to measure: at most {most} pixels are allowed. Omit"
            " --measure to predict it."
        )
    memory.require(name, width, height)
