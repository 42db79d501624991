"""Light from all around: ``constant``, ``envmap``, daylight, and the model's ambient light ``I_a``.

Any other plugin whose light surrounds the scene counts as an ``envmap``. A light that is neither an
environment nor of another kind is left out: it has no nearest form. The sky of ``sunsky`` and
``timed_sunsky`` is ``I_a``, and the sun a directional light.
"""

from typing import Any

import mitsuba as mi

from reference.pairing.factors import Convention
from reference.pairing.lights import measured
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter
from reference.scene import values
from reference.scene.graph import Graph, properties


def _ambient(light: Given) -> Any:
    if light.shape is None and light.emitter.is_environment():
        return measured.mean_radiance(light.graph, light.emitter)
    return None


def _to_heuristic(light: Given) -> PairedEmitter:
    if light.shape is None and light.emitter.is_environment():
        return light.becomes_ambient(measured.MEAN, "directions of the environment's light")
    return light.leave_out()


ENVIRONMENT = LightKind(
    plugins=("envmap",), to_heuristic=_to_heuristic, ambient=_ambient, surrounds=True
)


CONSTANT = LightKind(
    plugins=("constant",),
    to_heuristic=Given.becomes_ambient,
    ambient=lambda light: light.value("radiance", 1.0),
    colour="radiance",
    surrounds=True,
    uniform=True,
)


def add_environment(
    physical: Graph, graph: Graph, ambient: Any, convention: Convention
) -> PairedEmitter:
    """Add the constant environment that corresponds to ``I_a`` to the physical half of a graph.

    A physical surface has one diffuse reflectance, whereas the model has ``k_a`` and ``k_d``. The
    ``matched`` radiance is ``I_a k_a / k_d``, by least squares if materials differ; the ``literal``
    one is ``I_a``.
    """
    ratio: tuple[float, ...] = (1.0,) * 3
    exact = True
    if convention is Convention.MATCHED:
        ratio, exact = _ambient_ratio(graph)
    plain = isinstance(ambient, (float, int, *values.COLOURS))
    if plain and ratio != (1.0,) * 3:
        components = (float(ambient),) * 3 if isinstance(ambient, (float, int)) else tuple(ambient)
        ambient = values.scaled(components, ratio)
    light = physical.add(mi.ObjectType.Emitter, properties("constant", radiance=ambient))
    physical.attach(0, "environment", light)
    note = f"radiance I_a k_a / k_d, k_a / k_d = ({', '.join(f'{r:.4g}' for r in ratio)})"
    mean = sum(ratio) / len(ratio)
    return PairedEmitter("ambient", "ambient", "constant", mean, exact, note)


def _ambient_ratio(graph: Graph) -> tuple[tuple[float, ...], bool]:
    """Return ``k_a / k_d`` per channel by least squares, and whether it fits all materials."""
    pairs, has_lobe = [], False
    for index in graph.nodes(mi.ObjectType.BSDF):
        if graph.plugin(index) == "phong":
            k_a, k_d, k_s = (values.colour(graph, index, k, 0.0) for k in ("k_a", "k_d", "k_s"))
            has_lobe = has_lobe or any(k_s)
            # Without a diffuse part the reflectance is k_a itself.
            pairs.append((k_a, k_d if any(k_d) or any(k_s) else k_a))
    ratio = []
    for channel in range(3):
        weight = sum(k_d[channel] ** 2 for _, k_d in pairs)
        product = sum(k_a[channel] * k_d[channel] for k_a, k_d in pairs)
        ratio.append(product / weight if weight > 0 else 1.0)
    exact = not has_lobe and all(
        abs(k_a[channel] - ratio[channel] * k_d[channel]) <= 1e-6 * max(k_a[channel], 1e-6)
        for k_a, k_d in pairs
        for channel in range(3)
    )
    return tuple(ratio), exact


def _sky(light: Given) -> Any:
    return measured.mean_radiance(light.graph, _only(light, "sun_scale"))


def _daylight(light: Given) -> PairedEmitter:
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


DAYLIGHT = LightKind(
    plugins=("sunsky", "timed_sunsky"),
    to_heuristic=_daylight,
    ambient=_sky,
    surrounds=True,
)
