"""Replacing the lights of a scene by their counterparts, by :mod:`reference.pairing.factors`.

Lights without a row in the table get the nearest light: an environment or a sky becomes ``I_a``,
its mean radiance over the sphere, and the sun a directional light of its irradiance and mean
direction; a ``projector`` or textured ``spot`` becomes the even cone of the same solid angle and
flux; a textured ``area`` light has its mean radiance. Any other light is left out.

**Level.** A light without an exact pair differs from its form in the other half by shape. Its level
follows one rule, so only the shape differs: *equal flux if the light's parameters determine it;
otherwise equal mean irradiance over the surface that the camera sees.* A light that falls off as
the inverse square sends the same flux through any sphere about it, so its pair depends neither on
the scene nor on the view. A heuristic point or spot with another ``f_att`` has no single flux: it
depends on the distance, which only the scene determines.

Parallel light is an exact pair; so is a point with the fall-off of Mitsuba's.

Spots differ. Mitsuba's is even up to its beam width and falls linearly in the angle to 0 at its
cutoff; the chapters' (6.4) falls as ``cos^m`` and is cut off. Neither can reproduce the other. The
fit minimises ``int (s f(t) - g(t))^2 sin(t) dt`` over the cone, the mean square over its solid
angle, where ``g`` is the given fall-off and ``f`` the other one. The level ``s`` is not fitted: it
gives equal flux, ``s int f sin = int g sin``. On the axis the two then differ.
"""

from collections.abc import Callable, Iterator
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.lights import INVERSE_SQUARE
from reference.pairing.factors import INTENSITY_FACTOR, Convention, Replacements
from reference.pairing.lights import LightNode, heuristic, is_heuristic
from reference.scene import values
from reference.scene.graph import Graph, properties

EMITTER = mi.ObjectType.Emitter

Cone = Callable[[np.ndarray], Any]


def to_heuristic(
    graph: Graph, geometry: Callable[[], mi.Scene], hide_emitters: bool, replaced: Replacements
) -> Any:
    """Replace physical lights by heuristic ones, and return the radiance that becomes ``I_a``.

    ``geometry()`` returns the Mitsuba scene. The environment stays as a background. With
    ``hide_emitters`` the shapes of area lights are taken out.
    """
    ambient = None
    for shape, key, index in list(_physical(graph)):
        if shape is not None:
            graph.detach(shape, key)
        light = LightNode(
            graph, index, shape, geometry, hide_emitters=hide_emitters, replaced=replaced
        )
        is_textured = light.plugin == "spot" and light.value("texture", None) is not None
        if light.plugin in TO_HEURISTIC and shape is None and not is_textured:
            TO_HEURISTIC[light.plugin](light)
        else:
            from reference.pairing import lamps  # loaded late: most scenes have points alone

            found = lamps.to_heuristic(light)
            ambient = ambient if found is None else found
    return ambient


def to_physical(graph: Graph, surface: Callable[[], Any], replaced: Replacements) -> None:
    """Replace heuristic lights by physical ones; ``surface()`` returns the visible `GBuffer`."""
    for index in [i for i in graph.nodes(EMITTER) if is_heuristic(graph.plugin(i))]:
        light = LightNode(graph, index, surface=surface, replaced=replaced)
        TO_PHYSICAL[light.plugin](light)


def _physical(graph: Graph) -> Iterator[tuple[int | None, str, int]]:
    """Return shape, key and node of the physical lights; those of shapes come last."""
    on_shapes = [
        (shape, key, index)
        for shape in graph.nodes(mi.ObjectType.Shape)
        for key, index in graph.children(shape, EMITTER)
    ]
    owned = {index for _, _, index in on_shapes}
    for index in graph.nodes(EMITTER):
        if index not in owned and not is_heuristic(graph.plugin(index)):
            yield None, "", index
    for shape, key, index in on_shapes:
        if graph.plugin(index) != "heuristic_glow":
            yield shape, key, index


def _point_to_heuristic(light: LightNode) -> None:
    position, intensity = mi.ScalarPoint3d(*light.position()), light.value("intensity", 1.0)
    light.replace(heuristic("heuristic_point", position=position, intensity=intensity))


def _point_to_physical(light: LightNode) -> None:
    factor, note = level(light, lambda travel: 1.0, lambda travel: 1.0, 1.0)
    position, intensity = mi.ScalarPoint3d(*light.position()), light.scaled_intensity(factor)
    light.replace(
        properties("point", position=position, intensity=intensity), factor, not note, note
    )


def level(light: LightNode, cone: Cone, derived_cone: Cone, flux_ratio: float) -> tuple[float, str]:
    """Return the factor from ``I_p0`` of a point or spot to Mitsuba's intensity, and its rule.

    The cones are factors of the light and of Mitsuba's in directions of travel (N, 3),
    ``flux_ratio`` is the light's flux over Mitsuba's, for the same intensity on the axis.
    """
    defaults = (("k0", 1.0), ("k1", 0.0), ("k2", 0.0))
    k0, k1, k2 = (light.number(key, default) for key, default in defaults)
    if (k0, k1, k2) == INVERSE_SQUARE:
        return IRRADIANCE_PER_INTENSITY * flux_ratio, ""
    clamped = light.value("clamped", False)

    def chapters(distance, travel):
        factor = 1 / np.maximum(k0 + k1 * distance + k2 * distance**2, np.finfo(float).tiny)
        return (np.minimum(factor, 1) if clamped else factor) * cone(travel)

    def physical(distance, travel):
        return derived_cone(travel) / distance**2

    place = light.position()
    here, there = (light.surface().mean_irradiance(place, f) for f in (chapters, physical))
    note = "same mean irradiance over the visible surface; only the fall-off's shape differs"
    return IRRADIANCE_PER_INTENSITY * (here / there if there > 0 else 1.0), note


def _directional_to_heuristic(light: LightNode) -> None:
    direction, intensity = mi.ScalarVector3f(*light.travel()), light.value("irradiance", 1.0)
    light.replace(heuristic("heuristic_directional", direction=direction, intensity=intensity))


def _directional_to_physical(light: LightNode) -> None:
    direction = light.value("direction", mi.ScalarVector3f(0, 0, 1))
    irradiance = light.scaled_intensity(IRRADIANCE_PER_INTENSITY)
    props = properties("directional", direction=direction, irradiance=irradiance)
    light.replace(props, IRRADIANCE_PER_INTENSITY)


LARGEST_EXPONENT = 1e5
STEPS = 2048


def exponent_for(cutoff: float, beam_width: float) -> float:
    """Return the ``m`` of 6.4 nearest to Mitsuba's fall-off at equal flux; angles in degrees."""
    theta, weight = _cone(cutoff)
    target, flux = linear_falloff(theta, cutoff, beam_width), linear_flux(cutoff, beam_width)

    def distance(log_m):
        m = np.expm1(log_m)
        fitted = flux / power_flux(cutoff, m) * power_falloff(theta, m)
        return np.sum(weight * (fitted - target) ** 2)

    # In log(1 + m), because sharp spots differ little from one exponent to the next.
    return float(np.expm1(_least(distance, 0.0, np.log(LARGEST_EXPONENT))))


def cone_for(cutoff: float, exponent: float) -> tuple[float, float]:
    """Return the cutoff and beam width of the linear fall-off that is nearest to ``cos^m``.

    At equal flux, and in degrees. A sharp beam ends long before its cone, so the cutoff is fitted
    too, up to the cone's.
    """
    theta, weight = _cone(cutoff)
    target, flux = power_falloff(theta, exponent), power_flux(cutoff, exponent)

    def distance(edge, beam_width):
        fitted = flux / linear_flux(edge, beam_width) * linear_falloff(theta, edge, beam_width)
        return np.sum(weight * (fitted - target) ** 2)

    def best_beam(edge):
        # Mitsuba rejects a beam as wide as the cone; just below it the cone is even.
        return _least(lambda beam_width: distance(edge, beam_width), 0.0, edge * (1 - 1e-4))

    edge = _least(lambda edge: distance(edge, best_beam(edge)), 1e-3 * cutoff, cutoff)
    return edge, best_beam(edge)


def _least(function: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import minimize_scalar  # loaded late: a tenth of a command's start

    found = minimize_scalar(function, bounds=(low, high), method="bounded").x
    return float(min((low, high, found), key=function))


def linear_falloff(theta: np.ndarray, cutoff: float, beam_width: float) -> np.ndarray:
    """Return the factor of Mitsuba's ``spot`` at the angles ``theta``, all in degrees."""
    return np.clip((cutoff - theta) / max(cutoff - beam_width, 1e-12), 0, 1)


def linear_flux(cutoff: float, beam_width: float) -> float:
    """Return its ``int g(t) sin(t) dt``: ``1 - (sin c - sin b) / (c - b)``; in degrees."""
    c, b = np.radians((cutoff, min(beam_width, cutoff * (1 - 1e-9))))
    # The quotient of the sines as a product: for narrow beams it is nearly 1.
    return float(1 - np.cos((c + b) / 2) * np.sinc((c - b) / (2 * np.pi)))


def power_falloff(theta: np.ndarray, exponent: float) -> np.ndarray:
    """Return ``cos^m(theta)``, 0 beyond a right angle unless ``m = 0``; ``theta`` in degrees."""
    if exponent == 0:
        return np.ones_like(theta)
    return np.maximum(np.cos(np.radians(theta)), 0) ** exponent * (theta < 90)


def power_flux(cutoff: float, exponent: float) -> float:
    """Return ``int cos^m(t) sin(t) dt`` up to a cutoff in degrees."""
    cosine = np.cos(np.radians(cutoff))
    edge = cosine if exponent == 0 else max(cosine, 0.0)
    return float((1 - edge ** (exponent + 1)) / (exponent + 1))


def _cone(cutoff: float) -> tuple[np.ndarray, np.ndarray]:
    theta = (np.arange(STEPS) + 0.5) * cutoff / STEPS
    return theta, np.sin(np.radians(theta))


def _spot_to_heuristic(light: LightNode) -> None:
    cutoff = light.number("cutoff_angle", 20.0)
    beam_width = light.number("beam_width", 0.75 * cutoff)
    exponent = exponent_for(cutoff, beam_width)
    factor = INTENSITY_FACTOR * linear_flux(cutoff, beam_width) / power_flux(cutoff, exponent)
    props = heuristic(
        "heuristic_spot",
        factor,
        position=mi.ScalarPoint3d(*light.position()),
        direction=mi.ScalarVector3f(*light.column(2)),
        cutoff=cutoff,
        exponent=exponent,
        intensity=light.value("intensity", 1.0),
    )
    ends = f"from {beam_width:g} to {cutoff:g} deg"
    note = f"m = {exponent:.4g} fitted to the linear fall-off {ends}; same flux"
    light.replace(props, factor, exact=False, note=note)


def _spot_to_physical(light: LightNode) -> None:
    position, axis = light.position(), np.ravel(light.value("direction", (0, 0, 1))).astype(float)
    axis /= np.linalg.norm(axis)
    cutoff, exponent = light.number("cutoff", 30.0), light.number("exponent", 0.0)
    edge, beam_width = cone_for(cutoff, exponent)

    def angle(travel):
        return np.degrees(np.arccos(np.clip(travel @ axis, -1, 1)))

    factor, rule = level(
        light,
        lambda travel: power_falloff(angle(travel), exponent) * (angle(travel) <= cutoff),
        lambda travel: linear_falloff(angle(travel), edge, beam_width),
        power_flux(cutoff, exponent) / linear_flux(edge, beam_width),
    )
    fitted = f"linear from {beam_width:.4g} to {edge:.4g} deg, fitted to m = {exponent:g}"
    ends = (position, position + axis, np.eye(3)[np.argmin(np.abs(axis))])
    props = properties(
        "spot",
        to_world=mi.ScalarTransform4f().look_at(*(end.tolist() for end in ends)),
        intensity=light.scaled_intensity(factor),
        cutoff_angle=edge,
        beam_width=beam_width,
    )
    light.replace(props, factor, exact=False, note=f"{fitted}; {rule or 'same flux'}")


def add_glowing_shapes(graph: Graph, replaced: Replacements) -> None:
    """Give each shape whose ``phong`` has a ``k_i`` an area light of that radiance."""
    for shape in graph.nodes(mi.ObjectType.Shape):
        for _, bsdf in graph.children(shape, mi.ObjectType.BSDF):
            radiance = graph.props(bsdf).get("k_i", 0.0)
            if graph.plugin(bsdf) == "phong" and values.may_be_nonzero(radiance):
                light = graph.add(mi.ObjectType.Emitter, properties("area", radiance=radiance))
                graph.attach(shape, "emitter", light)
                replaced.emitter(graph.label(shape), "k_i", "area", 1.0)


def add_environment(
    physical: Graph, graph: Graph, ambient: Any, convention: Convention, replaced: Replacements
) -> None:
    """Add the constant environment that corresponds to ``I_a`` to the physical half of a graph.

    A physical surface has one diffuse reflectance. The ``matched`` radiance is ``I_a k_a / k_d``,
    by least squares if materials differ; the ``literal`` one is ``I_a``.
    """
    ratio, exact = np.ones(3), True
    if convention is Convention.MATCHED:
        ratio, exact = _ambient_ratio(graph)
    known = values.plain(ambient)
    if known is not None and (ratio != 1).any():
        ambient = tuple((np.multiply(known, ratio)).tolist())
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


TO_HEURISTIC: dict[str, Callable[[LightNode], None]] = {
    "point": _point_to_heuristic,
    "directional": _directional_to_heuristic,
    "spot": _spot_to_heuristic,
}
"""By plugin; other lights, and textured spots, are in :mod:`reference.pairing.lamps`."""

TO_PHYSICAL: dict[str, Callable[[LightNode], None]] = {
    "heuristic_point": _point_to_physical,
    "heuristic_directional": _directional_to_physical,
    "heuristic_spot": _spot_to_physical,
}
