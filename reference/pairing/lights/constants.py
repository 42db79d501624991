"""Even light from all sides: ``constant``, and the model's ambient light ``I_a``."""

import mitsuba as mi

from reference.pairing.factors import Convention
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter
from reference.scene import values
from reference.scene.graph import Graph, properties

KIND = LightKind(
    plugins=("constant",),
    to_heuristic=Given.becomes_ambient,
    ambient=lambda light: light.value("radiance", 1.0),
    colour="radiance",
    surrounds=True,
    uniform=True,
)


def add_environment(
    physical: Graph, graph: Graph, ambient: object, convention: Convention
) -> PairedEmitter:
    """Add the constant environment that stands for ``I_a`` to the physical half of a graph.

    A physical surface has one diffuse reflectance, where the model has ``k_a`` beside ``k_d``. The
    ``matched`` radiance is ``I_a k_a / k_d``, by least squares where materials differ; the
    ``literal`` one is ``I_a``.
    """
    ratio, exact = (1.0,) * 3, True
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
    """Return ``k_a / k_d`` for each channel by least squares, and whether it fits all materials."""
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
