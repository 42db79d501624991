"""The images that one rendering makes: the lights and transport of each, and what they share."""

from collections.abc import Iterable, Mapping, Sequence
from types import MappingProxyType
from typing import Any, ClassVar, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np

import fotismos.reference.scene  # noqa: F401  it gives Mitsuba a variant
from fotismos.heuristic.convention import Colour, Interaction, Mask, Scene


class Transport(NamedTuple):
    """The transport of light in one image, as parameters of ``direct_all`` of the same names.

    ``group`` is that of the lights whose light the image holds.
    """

    shadows: bool = True
    bsdf_samples: int = 1
    max_depth: int = 2
    group: int = 0


class LightGroups:
    """The groups of a scene's lights, by number, and further lights that are not the scene's.

    ``numbers`` are those of ``scene.emitters()``; ``others`` are lights at points, by their group.
    """

    DRJIT_STRUCT: ClassVar = {"table": Any, "others": Any}  # what dr.freeze must know of

    def __init__(
        self,
        scene: Scene,
        numbers: Sequence[int],
        others: Mapping[int, Sequence[Any]] = MappingProxyType({}),
    ) -> None:
        self.numbers = tuple(numbers)
        self.others = {group: list(lights) for group, lights in others.items()}
        self.table: Any = None
        if len(set(numbers)) > 1:
            lights = [int(_registered(mi.EmitterPtr(light))[0]) for light in scene.emitters()]
            table = np.zeros(max(lights) + 1, np.uint32)
            table[lights] = numbers
            self.table = mi.UInt32(table)

    def members(self, scene: Scene) -> list[tuple[Any, int]]:
        """Return all lights, each with its group."""
        others = [(light, group) for group, lights in self.others.items() for light in lights]
        return [*zip(scene.emitters(), self.numbers, strict=True), *others]

    def holds(self, group: int, emitter: Any) -> Any:
        """Return whether lights of the scene, a pointer on each lane, are in a group."""
        if self.table is None:
            return group in self.numbers
        return dr.gather(mi.UInt32, self.table, _registered(emitter)) == group


def _registered(emitter: Any) -> Any:
    """Return the numbers of lights, which Dr.Jit gives them; 0 of none."""
    return dr.reinterpret_array(mi.UInt32, emitter)


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


def spread(
    transports: Iterable[Transport], some: Iterable[Transport], light: Iterable[Colour]
) -> list[Colour]:
    """Return the light of some images among those of all; 0 in the others."""
    known = dict(zip(some, light, strict=True))
    return [known.get(transport, 0) for transport in transports]


def sampled(light: Any, si: Interaction, sample: Any, active: Mask) -> tuple[Any, Any, Any, Any]:
    """Return a point of a light as seen from a surface: place, direction, density and weight."""
    ds, weight = light.sample_direction(si, sample, active)
    return ds.p, ds.d, ds.pdf, weight


def visibility(
    scene: Scene, si: Interaction, point: Any, active: Mask, transports: Sequence[Transport]
) -> list[Mask]:
    """Return where each image sees a point of a light: with shadows only where nothing hides it."""
    visible = active
    if any(transport.shadows for transport in transports):
        visible = active & ~scene.ray_test(si.spawn_ray_to(point), active)
    return [visible if transport.shadows else active for transport in transports]


def found_by_bsdf(
    active: Mask,
    is_delta: Mask,
    value: Colour,
    emitter: Any,
    groups: LightGroups,
    transports: Iterable[Transport],
) -> list[Colour]:
    """Return the light that samples of the BSDF find of an emitter, for each image."""
    return [
        dr.select(
            active
            & (is_delta | (transport.bsdf_samples > 0))
            & groups.holds(transport.group, emitter),
            value,
            0,
        )
        for transport in transports
    ]
