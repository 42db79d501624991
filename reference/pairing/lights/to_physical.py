"""Replacing heuristic lights by physical ones (table in :mod:`reference.pairing.factors`)."""

import mitsuba as mi
import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.lights import INVERSE_SQUARE
from reference.pairing.lights import reading, spots
from reference.pairing.lights.reading import BSDF, EMITTER, SHAPE, PairedEmitter
from reference.scene import values
from reference.scene.graph import properties


def add_glowing_shapes(graph):
    """Give each shape whose ``phong`` has a ``k_i`` an area light of that radiance.

    To be called while the shapes still have their ``phong``.
    """
    records = []
    for shape in graph.nodes(SHAPE):
        for _, bsdf in graph.children(shape, BSDF):
            radiance = reading.given(graph, bsdf, "k_i", 0.0)
            if graph.plugin(bsdf) == "phong" and values.may_be_nonzero(radiance):
                light = graph.add(EMITTER, properties("area", radiance=radiance))
                graph.attach(shape, "emitter", light)
                records.append(PairedEmitter(graph.label(shape), "k_i", "area", 1.0, True))
    return records


def replace_lights(graph, surface):
    """Replace heuristic lights by physical ones; returns a :class:`PairedEmitter` each.

    ``surface()`` returns the `GBuffer` that the mean irradiance is
    taken over where the attenuation is not the inverse square.
    """
    convert = {
        "heuristic_point": _point_to_physical,
        "heuristic_spot": _spot_to_physical,
        "heuristic_directional": _directional_to_physical,
    }
    return [
        convert[graph.plugin(index)](graph, index, surface)
        for index in graph.nodes(EMITTER)
        if graph.plugin(index) in convert
    ]


def _point_to_physical(graph, index, surface):
    position = reading.position(graph, index)
    factor, exact, note = _level(graph, index, surface, lambda travel: 1.0)
    intensity = _scaled_intensity(graph, index, factor)
    graph.replace(index, properties("point", position=position, intensity=intensity))
    return PairedEmitter(graph.label(index), "heuristic_point", "point", factor, exact, note)


def _spot_to_physical(graph, index, surface):
    position, direction = reading.position(graph, index), reading.axis(graph, index)
    cutoff = values.number(graph, index, "cutoff", 30.0)
    exponent = values.number(graph, index, "exponent", 0.0)
    edge, beam_width = spots.cone_for(cutoff, exponent)

    def cone(travel):
        theta = np.degrees(np.arccos(np.clip(travel @ direction, -1, 1)))
        return spots.power_falloff(theta, exponent) * (theta <= cutoff)

    factor, _, note = _level(graph, index, surface, cone)
    target = np.ravel(position) + direction
    up = np.eye(3)[np.argmin(np.abs(direction))]
    derived = properties(
        "spot",
        to_world=mi.ScalarTransform4f().look_at(
            np.ravel(position).tolist(), target.tolist(), up.tolist()
        ),
        intensity=_scaled_intensity(graph, index, factor),
        cutoff_angle=edge,
        beam_width=beam_width,
    )
    graph.replace(index, derived)
    fitted = f"linear from {beam_width:.4g} to {edge:.4g} deg, fitted to m = {exponent:g}"
    note = f"{fitted}; {note}" if note else fitted
    return PairedEmitter(graph.label(index), "heuristic_spot", "spot", factor, False, note)


def _level(graph, index, surface, cone):
    """Return the factor from ``I_p0`` to Mitsuba's intensity, whether it is exact, and a note.

    ``cone(travel)`` is the light's directional factor, which both sides share in this mean.
    """
    coefficients = tuple(
        values.number(graph, index, key, default)
        for key, default in (("k0", 1.0), ("k1", 0.0), ("k2", 0.0))
    )
    if coefficients == INVERSE_SQUARE:
        return IRRADIANCE_PER_INTENSITY, True, ""
    k0, k1, k2 = coefficients
    clamped = reading.given(graph, index, "clamped", False)

    def heuristic(distance, travel):
        factor = 1 / np.maximum(k0 + k1 * distance + k2 * distance**2, np.finfo(float).tiny)
        return (np.minimum(factor, 1) if clamped else factor) * cone(travel)

    def physical(distance, travel):
        return cone(travel) / distance**2

    position = np.ravel(reading.position(graph, index))
    means = [surface().mean_irradiance(position, falloff) for falloff in (heuristic, physical)]
    ratio = means[0] / means[1] if means[1] > 0 else 1.0
    note = "same mean irradiance over the visible surface; only the fall-off's shape differs"
    return IRRADIANCE_PER_INTENSITY * ratio, False, note


def _directional_to_physical(graph, index, surface):
    direction = reading.given(graph, index, "direction", mi.ScalarVector3f(0, 0, 1))
    irradiance = _scaled_intensity(graph, index, IRRADIANCE_PER_INTENSITY)
    graph.replace(index, properties("directional", direction=direction, irradiance=irradiance))
    return PairedEmitter(
        graph.label(index), "heuristic_directional", "directional", IRRADIANCE_PER_INTENSITY, True
    )


def _scaled_intensity(graph, index, factor):
    scale = values.number(graph, index, "scale", 1.0)
    return values.scaled(values.colour(graph, index, "intensity", 1.0), factor * scale)
