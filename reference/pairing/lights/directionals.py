"""Parallel light: ``directional`` and ``heuristic_directional``, an exact pair."""

import mitsuba as mi
import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.lights import DirectionalLight
from reference.pairing.factors import INTENSITY_FACTOR
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter


def _to_heuristic(light: Given) -> PairedEmitter:
    return light.replace(
        "heuristic_directional",
        direction=mi.ScalarVector3f(*light.direction),
        intensity=light.value("irradiance", 1.0),
        scale=INTENSITY_FACTOR,
    )


def _to_physical(light: Given) -> PairedEmitter:
    return light.replace(
        "directional",
        IRRADIANCE_PER_INTENSITY,
        direction=light.value("direction", mi.ScalarVector3f(0, 0, 1)),
        irradiance=light.scaled_intensity(IRRADIANCE_PER_INTENSITY),
    )


def _place(light: Given) -> dict[str, np.ndarray]:
    return {"toward": -np.array(light.direction)}


KIND = LightKind(
    plugins=("directional",),
    to_heuristic=_to_heuristic,
    model=DirectionalLight,
    to_physical=_to_physical,
    colour="irradiance",
    place=_place,
    exact=True,
)
