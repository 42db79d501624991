"""Light from all around: ``constant``, ``envmap``, daylight, and the model's ambient light ``I_a``.

Any other plugin whose light surrounds the scene counts as an ``envmap``. A light that is neither an
environment nor of another kind is left out: it has no nearest form. The sky of ``sunsky`` and
``timed_sunsky`` is ``I_a``, and the sun a directional light.
"""

from typing import Any

import mitsuba as mi
import numpy as np

from reference.pairing import probe
from reference.pairing.factors import Convention, Replacements
from reference.pairing.lights.kind import LightKind, LightNode
from reference.scene import values
from reference.scene.graph import Graph, properties


def _ambient(light: LightNode) -> Any:
    if light.shape is None and light.emitter.is_environment():
        return probe.mean_radiance(light.graph, light.emitter)
    return None


def _to_heuristic(light: LightNode) -> None:
    if light.shape is None and light.emitter.is_environment():
        light.becomes_ambient(probe.MEAN, "directions of the environment's light")
    else:
        light.leave_out()


ENVIRONMENT = LightKind(
    plugins=("envmap",), to_heuristic=_to_heuristic, ambient=_ambient, surrounds=True
)


CONSTANT = LightKind(
    plugins=("constant",),
    to_heuristic=LightNode.becomes_ambient,
    ambient=lambda light: light.value("radiance", 1.0),
    colour="radiance",
    surrounds=True,
    uniform=True,
)


def add_environment(
    physical: Graph, graph: Graph, ambient: Any, convention: Convention, replaced: Replacements
) -> None:
    """Add the constant environment that corresponds to ``I_a`` to the physical half of a graph.

    A physical surface has one diffuse reflectance, whereas the model has ``k_a`` and ``k_d``. The
    ``matched`` radiance is ``I_a k_a / k_d``, by least squares if materials differ; the ``literal``
    one is ``I_a``.
    """
    ratio, exact = np.ones(3), True
    if convention is Convention.MATCHED:
        ratio, exact = _ambient_ratio(graph)
    known = values.plain(ambient)
    if known is not None and (ratio != 1).any():
        ambient = values.scaled(known, ratio)
    light = physical.add(mi.ObjectType.Emitter, properties("constant", radiance=ambient))
    physical.attach(0, "environment", light)
    note = f"radiance I_a k_a / k_d, k_a / k_d = ({', '.join(f'{r:.4g}' for r in ratio)})"
    replaced.emitter("ambient", "ambient", "constant", float(ratio.mean()), exact, note)


def _ambient_ratio(graph: Graph) -> tuple[np.ndarray, bool]:
    """Return ``k_a / k_d`` per channel by least squares, and whether it fits all materials."""
    phongs = [i for i in graph.nodes(mi.ObjectType.BSDF) if graph.plugin(i) == "phong"]
    k_a, k_d, k_s = (
        np.array([values.colour(graph, i, key, 0.0) for i in phongs]).reshape(-1, 3)
        for key in ("k_a", "k_d", "k_s")
    )
    # Without a diffuse part the reflectance is k_a itself.
    has_part = np.logical_or(k_d.any(axis=1, keepdims=True), k_s.any(axis=1, keepdims=True))
    k_d = np.where(has_part, k_d, k_a)
    weight = np.sum(k_d**2, axis=0)
    ratio = np.where(weight > 0, np.sum(k_a * k_d, axis=0) / np.where(weight > 0, weight, 1), 1.0)
    fits = np.abs(k_a - ratio * k_d) <= 1e-6 * np.maximum(k_a, 1e-6)
    return ratio, bool(fits.all() and not k_s.any())


def _sky(light: LightNode) -> Any:
    return probe.mean_radiance(light.graph, _only(light, "sun_scale"))


def _daylight(light: LightNode) -> None:
    sun = probe.irradiance(light.graph, _only(light, "sky_scale"))
    note = probe.MEAN
    if sun is not None:
        intensity, direction = sun
        props = properties(
            "heuristic_directional", direction=mi.ScalarVector3f(*direction), intensity=intensity
        )
        props.set_id(f"sun of {light.label}")
        node = light.graph.add(mi.ObjectType.Emitter, props)
        light.graph.attach(0, f"sun_of_{light.index}", node)
        note += "; the sun a directional light of its irradiance"
    light.becomes_ambient(note, "directions of the sky's light, and the sun's extent")


def _only(light: LightNode, off: str) -> mi.Emitter:
    """Return the light with one of its two parts switched off."""
    copy = light.graph.copy()
    copy.props(light.index)[off] = 0.0
    return copy.instantiate(light.index)


DAYLIGHT = LightKind(
    plugins=("sunsky", "timed_sunsky"),
    to_heuristic=_daylight,
    ambient=_sky,
    surrounds=True,
)
