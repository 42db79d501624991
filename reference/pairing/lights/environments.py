"""Environments with directions: ``envmap``, and any other plugin whose light surrounds the scene.

What is neither an environment nor of another kind is left out: it has no nearest form.
"""

from reference.pairing.lights import measured
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter


def _ambient(light: Given) -> object:
    if light.shape is None and light.emitter.is_environment():
        return measured.mean_radiance(light.graph, light.emitter)
    return None


def _to_heuristic(light: Given) -> PairedEmitter:
    if light.shape is None and light.emitter.is_environment():
        return light.becomes_ambient(measured.MEAN, "directions of the environment's light")
    return light.leave_out()


KIND = LightKind(plugins=("envmap",), to_heuristic=_to_heuristic, ambient=_ambient, surrounds=True)
