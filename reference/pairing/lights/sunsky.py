"""Daylight: ``sunsky`` and ``timed_sunsky``. The sky is ``I_a``, the sun a directional light."""

import mitsuba as mi

from reference.pairing.lights import measured
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter
from reference.scene.graph import properties


def _ambient(light: Given) -> object:
    return measured.mean_radiance(light.graph, _only(light, "sun_scale"))


def _to_heuristic(light: Given) -> PairedEmitter:
    sun = measured.irradiance(light.graph, _only(light, "sky_scale"))
    note = measured.MEAN
    if sun is not None:
        intensity, direction = sun
        props = properties(
            "heuristic_directional", direction=mi.ScalarVector3f(*direction), intensity=intensity
        )
        props.set_id(f"sun of {light.label}")
        node = light.graph.add(mi.ObjectType.Emitter, props)
        light.graph.attach(0, f"sun_of_{light.index}", node)
        note += "; the sun a directional light of its irradiance"
    return light.becomes_ambient(note, "directions of the sky's light, and the sun's extent")


def _only(light: Given, off: str) -> mi.Emitter:
    """Return the light with one of its two parts switched off."""
    copy = light.graph.copy()
    copy.props(light.index)[off] = 0.0
    return copy.instantiate(light.index)


KIND = LightKind(
    plugins=("sunsky", "timed_sunsky"),
    to_heuristic=_to_heuristic,
    ambient=_ambient,
    surrounds=True,
)
