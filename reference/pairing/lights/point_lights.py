"""Points and parallel light: ``point`` and ``directional``, in both models.

Parallel light is an exact pair; so is a point with the fall-off of Mitsuba's.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.lights import INVERSE_SQUARE, DirectionalLight, PointLight
from reference.pairing.factors import INTENSITY_FACTOR
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter, heuristic
from reference.scene.graph import properties


def _to_heuristic(light: Given) -> PairedEmitter:
    position, intensity = mi.ScalarPoint3d(*light.position()), light.value("intensity", 1.0)
    props = heuristic("heuristic_point", position=position, intensity=intensity)
    return light.replace(props, INTENSITY_FACTOR)


def _to_physical(light: Given) -> PairedEmitter:
    found = level(light)
    position, intensity = mi.ScalarPoint3d(*light.position()), light.scaled_intensity(found.factor)
    props = properties("point", position=position, intensity=intensity)
    return light.replace(props, found.factor, found.keeps_flux, found.note)


@dataclass(frozen=True)
class Level:
    """The factor from ``I_p0`` to Mitsuba's intensity, whether fluxes are equal, and a note."""

    factor: float
    keeps_flux: bool
    note: str


def _everywhere(travel: np.ndarray) -> float:
    return 1.0


def level(
    light: Given,
    cone: Callable[[np.ndarray], Any] = _everywhere,
    derived_cone: Callable[[np.ndarray], Any] = _everywhere,
    flux_ratio: float = 1.0,
) -> Level:
    """Return the :class:`Level` of a heuristic point or spot (:mod:`reference.pairing.lights`).

    Parameters
    ----------
    light
        The light, whose ``f_att`` decides: equal flux for the inverse square, otherwise equal mean
        irradiance over the visible surface.
    cone, derived_cone
        Factors of the light and of Mitsuba's in directions of travel (N, 3).
    flux_ratio
        The light's flux over Mitsuba's, for the same intensity on the axis.
    """
    defaults = (("k0", 1.0), ("k1", 0.0), ("k2", 0.0))
    k0, k1, k2 = (light.number(key, default) for key, default in defaults)
    if (k0, k1, k2) == INVERSE_SQUARE:
        return Level(IRRADIANCE_PER_INTENSITY * flux_ratio, True, "")
    clamped = light.value("clamped", False)

    def chapters(distance, travel):
        factor = 1 / np.maximum(k0 + k1 * distance + k2 * distance**2, np.finfo(float).tiny)
        return (np.minimum(factor, 1) if clamped else factor) * cone(travel)

    def physical(distance, travel):
        return derived_cone(travel) / distance**2

    place = light.position()
    here, there = (light.surface().mean_irradiance(place, f) for f in (chapters, physical))
    ratio = here / there if there > 0 else 1.0
    note = "same mean irradiance over the visible surface; only the fall-off's shape differs"
    return Level(IRRADIANCE_PER_INTENSITY * ratio, False, note)


POINT = LightKind(
    plugins=("point",),
    to_heuristic=_to_heuristic,
    to_physical=_to_physical,
    model=PointLight,
    colour="intensity",
    place=lambda light: {"position": light.position()},
    exact=True,
    edits={
        "point": {"intensity": "intensity.value"},
        "heuristic_point": {"position": "position", "scale": "scale"},
    },
)


def _directional_to_heuristic(light: Given) -> PairedEmitter:
    direction, intensity = mi.ScalarVector3f(*_travel(light)), light.value("irradiance", 1.0)
    props = heuristic("heuristic_directional", direction=direction, intensity=intensity)
    return light.replace(props, INTENSITY_FACTOR)


def _directional_to_physical(light: Given) -> PairedEmitter:
    direction = light.value("direction", mi.ScalarVector3f(0, 0, 1))
    irradiance = light.scaled_intensity(IRRADIANCE_PER_INTENSITY)
    props = properties("directional", direction=direction, irradiance=irradiance)
    return light.replace(props, IRRADIANCE_PER_INTENSITY)


def _travel(light: Given) -> np.ndarray:
    return light.vector("direction", (0, 0, 1), 2)


DIRECTIONAL = LightKind(
    plugins=("directional",),
    to_heuristic=_directional_to_heuristic,
    to_physical=_directional_to_physical,
    model=DirectionalLight,
    colour="irradiance",
    place=lambda light: {"toward": -_travel(light)},
    exact=True,
)
