"""The images that one rendering makes: the transport of each, and the light that they share."""

from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

import drjit as dr

import fotismos.reference.scene  # noqa: F401  it gives Mitsuba a variant
from fotismos.heuristic.convention import Colour, Interaction, Mask, Scene


class Transport(NamedTuple):
    """The transport of light in one image, as parameters of ``direct_all`` of the same names."""

    shadows: bool = True
    bsdf_samples: int = 1
    max_depth: int = 2


def power_share(density: Any, other: Any) -> Any:
    """Return the weight of a sample of one density where the other could take it, too.

    The power heuristic, ``p² / (p² + q²)``: where both find a light, it leaves less noise than
    ``p / (p + q)``. Source: E. Veach, *Robust Monte Carlo methods for light transport simulation*,
    1997, section 9.2.4.
    """
    share = dr.rcp(1 + dr.square(other / density))
    # Where Mitsuba's `roughplastic` reflects nothing, its density is NaN. Mitsuba's own integrators
    # give such samples no weight.
    return dr.select(dr.isfinite(share), share, 0)


def sums(colours: Iterable[Colour], others: Iterable[Colour]) -> list[Colour]:
    """Add light to each image."""
    return [colour + other for colour, other in zip(colours, others, strict=True)]


def visibility(
    scene: Scene, si: Interaction, point: Any, active: Mask, transports: Sequence[Transport]
) -> list[Mask]:
    """Return where each image sees a point of a light: with shadows only where nothing hides it."""
    visible = active
    if any(transport.shadows for transport in transports):
        visible = active & ~scene.ray_test(si.spawn_ray_to(point), active)
    return [visible if transport.shadows else active for transport in transports]


def found_by_bsdf(
    active: Mask, is_delta: Mask, value: Colour, transports: Iterable[Transport]
) -> list[Colour]:
    """Return the light that samples of the BSDF find, for each image."""
    return [
        dr.select(active & (is_delta | (transport.bsdf_samples > 0)), value, 0)
        for transport in transports
    ]
