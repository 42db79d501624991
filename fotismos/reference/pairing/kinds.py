"""The kinds of lights: lights that are paired by their parameters, and where the others are.

Kinds that must be measured are in :mod:`fotismos.reference.pairing.lamps`, which is loaded for them
alone: most scenes have points and parallel light.
"""

from collections.abc import Iterable
from typing import Any

import mitsuba as mi

from fotismos.heuristic.convention import IRRADIANCE_PER_INTENSITY
from fotismos.heuristic.lights import DirectionalLight, PointLight
from fotismos.reference.pairing.lights import LightKind, LightNode, at_point, heuristic, level
from fotismos.reference.scene.graph import properties


def point_to_heuristic(light: LightNode) -> None:
    """Replace a point by the heuristic's."""
    position = mi.ScalarPoint3d(light.position())
    intensity = light.value("intensity", 1.0)
    light.replace(heuristic(PointLight.plugin, position=position, intensity=intensity))


def point_to_physical(light: LightNode) -> None:
    """Replace a heuristic point by Mitsuba's."""
    factor, note = level(light, lambda travel: 1.0, lambda travel: 1.0, 1.0)
    position = mi.ScalarPoint3d(light.position())
    intensity = light.scaled_intensity(factor)
    props = properties("point", position=position, intensity=intensity)
    light.replace(props, factor, not note, note)


def directional_to_heuristic(light: LightNode) -> None:
    """Replace parallel light by the heuristic's."""
    travel = mi.ScalarVector3f(light.travel())
    intensity = light.value("irradiance", 1.0)
    light.replace(heuristic(DirectionalLight.plugin, direction=travel, intensity=intensity))


def directional_to_physical(light: LightNode) -> None:
    """Replace heuristic parallel light by Mitsuba's."""
    travel = light.value("direction", mi.ScalarVector3f(0, 0, 1))
    irradiance = light.scaled_intensity(IRRADIANCE_PER_INTENSITY)
    props = properties("directional", direction=travel, irradiance=irradiance)
    light.replace(props, IRRADIANCE_PER_INTENSITY)


def constant_to_ambient(light: LightNode) -> Any:
    """Return the radiance of an even environment."""
    light.becomes_ambient()
    return light.value("radiance", 1.0)


POINT = LightKind(
    plugins=("point",),
    model=PointLight,
    colour="intensity",
    to_heuristic=point_to_heuristic,
    to_physical=point_to_physical,
    place=at_point,
    exact=True,
)
DIRECTIONAL = LightKind(
    plugins=("directional",),
    model=DirectionalLight,
    colour="irradiance",
    to_heuristic=directional_to_heuristic,
    to_physical=directional_to_physical,
    place=lambda light: {"toward": -light.travel()},
    exact=True,
)
CONSTANT = LightKind(
    plugins=("constant",),
    colour="radiance",
    to_heuristic=constant_to_ambient,
    surrounds=True,
    uniform=True,
)


def by_plugin(declared: Iterable[LightKind]) -> dict[str, LightKind]:
    """Return the kind of each plugin, of either half.

    Raises ``ValueError`` if two kinds name the same plugin: one of them would never be used.
    """
    result: dict[str, LightKind] = {}
    for kind in declared:
        for plugin in kind.names:
            if plugin in result:
                raise ValueError(f"Two kinds of light have the plugin {plugin}. Remove one.")
            result[plugin] = kind
    return result


BY_PLUGIN = by_plugin((POINT, DIRECTIONAL, CONSTANT))


def all_kinds() -> tuple[LightKind, ...]:
    """Return all kinds of lights."""
    from fotismos.reference.pairing import lamps  # loaded late, as this module says

    return (*dict.fromkeys(BY_PLUGIN.values()), *lamps.KINDS)


def of(plugin: str) -> LightKind:
    """Return the kind of an emitter, of either half, by the name of its plugin.

    An unknown one counts as an environment, about which premises may assume the least.
    """
    if plugin in BY_PLUGIN:
        return BY_PLUGIN[plugin]
    from fotismos.reference.pairing import lamps  # as late

    known = (kind for kind in lamps.KINDS if plugin in kind.names)
    return next(known, lamps.ENVIRONMENT)
