"""Points: ``point`` and ``heuristic_point``. The other way, the level of any attenuation."""

from collections.abc import Callable

import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.lights import INVERSE_SQUARE, PointLight
from reference.pairing.factors import INTENSITY_FACTOR
from reference.pairing.lights.kind import (
    FALLOFF_OF_MITSUBA,
    Given,
    LightKind,
    PairedEmitter,
    at_position,
)
from reference.planning.effects import Effect


def _to_heuristic(light: Given) -> PairedEmitter:
    return light.replace(
        "heuristic_point",
        position=light.position,
        intensity=light.value("intensity", 1.0),
        scale=INTENSITY_FACTOR,
        **FALLOFF_OF_MITSUBA,
    )


def _to_physical(light: Given) -> PairedEmitter:
    factor, exact, note = level(light, lambda travel: 1.0)
    intensity = light.scaled_intensity(factor)
    return light.replace("point", factor, exact, note, position=light.position, intensity=intensity)


def level(light: Given, cone: Callable[[np.ndarray], object]) -> tuple[float, bool, str]:
    """Return the factor from ``I_p0`` to Mitsuba's intensity, whether it is exact, and a note.

    ``cone(travel)`` is the light's factor in directions of travel (N, 3), which both sides share in
    this mean.
    """
    k0, k1, k2 = (
        light.number(key, default) for key, default in (("k0", 1.0), ("k1", 0.0), ("k2", 0.0))
    )
    if (k0, k1, k2) == INVERSE_SQUARE:
        return IRRADIANCE_PER_INTENSITY, True, ""
    clamped = light.value("clamped", False)

    def heuristic(distance, travel):
        factor = 1 / np.maximum(k0 + k1 * distance + k2 * distance**2, np.finfo(float).tiny)
        return (np.minimum(factor, 1) if clamped else factor) * cone(travel)

    def physical(distance, travel):
        return cone(travel) / distance**2

    position = np.ravel(light.position)
    means = [
        light.surface().mean_irradiance(position, falloff) for falloff in (heuristic, physical)
    ]
    ratio = means[0] / means[1] if means[1] > 0 else 1.0
    note = "same mean irradiance over the visible surface; only the fall-off's shape differs"
    return IRRADIANCE_PER_INTENSITY * ratio, False, note


KIND = LightKind(
    plugins=("point",),
    to_heuristic=_to_heuristic,
    model=PointLight,
    to_physical=_to_physical,
    colour="intensity",
    place=at_position,
    exact=True,
    effect=Effect.ATTENUATION,
    edits={
        "point": {"intensity": "intensity.value"},
        "heuristic_point": {"position": "position", "scale": "scale"},
    },
)
