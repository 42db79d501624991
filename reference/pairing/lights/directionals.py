"""Parallel light: ``directional`` and ``heuristic_directional``, an exact pair."""

import mitsuba as mi
import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.lights import DirectionalLight
from reference.pairing.factors import INTENSITY_FACTOR
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter, heuristic
from reference.scene.graph import properties


def _to_heuristic(light: Given) -> PairedEmitter:
    direction, intensity = mi.ScalarVector3f(*_travel(light)), light.value("irradiance", 1.0)
    props = heuristic("heuristic_directional", direction=direction, intensity=intensity)
    return light.replace(props, INTENSITY_FACTOR)


def _to_physical(light: Given) -> PairedEmitter:
    direction = light.value("direction", mi.ScalarVector3f(0, 0, 1))
    irradiance = light.scaled_intensity(IRRADIANCE_PER_INTENSITY)
    props = properties("directional", direction=direction, irradiance=irradiance)
    return light.replace(props, IRRADIANCE_PER_INTENSITY)


def _travel(light: Given) -> np.ndarray:
    return light.vector("direction", (0, 0, 1), 2)


KIND = LightKind(
    plugins=("directional",),
    to_heuristic=_to_heuristic,
    to_physical=_to_physical,
    model=DirectionalLight,
    colour="irradiance",
    place=lambda light: {"toward": -_travel(light)},
    exact=True,
)
