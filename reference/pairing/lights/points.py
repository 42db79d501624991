"""Light from a point or in parallel: ``point``, ``directional``, ``spot`` and ``projector``.

Parallel light is an exact pair; so is a point with the fall-off of Mitsuba's.

Spots differ. Mitsuba's is even up to its beam width and falls linearly in the angle to 0 at its
cutoff; the chapters' (6.4) falls as ``cos^m`` and is cut off. Neither can reproduce the other. The
fit minimises ``int (s f(t) - g(t))^2 sin(t) dt`` over the cone, the mean square over its solid
angle, where ``g`` is the given fall-off and ``f`` the other one. The level ``s`` is not fitted: it
gives equal flux, ``s int f sin = int g sin``, by the rule of :mod:`reference.pairing.lights`. On
the axis the two then differ. The nearest form of a picture projected from a point is the even cone
of the same flux.
"""

from collections.abc import Callable
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from heuristic.lights import INVERSE_SQUARE, DirectionalLight, PointLight, SpotLight
from reference.pairing import probe
from reference.pairing.factors import INTENSITY_FACTOR
from reference.pairing.lights.kind import LightKind, LightNode, heuristic
from reference.scene.graph import properties


def _point_to_heuristic(light: LightNode) -> None:
    position, intensity = mi.ScalarPoint3d(*light.position()), light.value("intensity", 1.0)
    props = heuristic("heuristic_point", position=position, intensity=intensity)
    light.replace(props, INTENSITY_FACTOR)


def _point_to_physical(light: LightNode) -> None:
    factor, note = level(light, lambda travel: 1.0, lambda travel: 1.0, 1.0)
    position, intensity = mi.ScalarPoint3d(*light.position()), light.scaled_intensity(factor)
    light.replace(
        properties("point", position=position, intensity=intensity), factor, not note, note
    )


Cone = Callable[[np.ndarray], Any]


def level(light: LightNode, cone: Cone, derived_cone: Cone, flux_ratio: float) -> tuple[float, str]:
    """Return the factor from ``I_p0`` of a point or spot to Mitsuba's intensity, and its rule.

    Fluxes are equal, without a note, if ``f_att`` is the inverse square; otherwise mean irradiances
    over the visible surface. The cones are factors of the light and of Mitsuba's in directions of
    travel (N, 3), ``flux_ratio`` is the light's flux over Mitsuba's, for the same intensity on the
    axis.
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


POINT = LightKind(
    plugins=("point",),
    to_heuristic=_point_to_heuristic,
    to_physical=_point_to_physical,
    model=PointLight,
    colour="intensity",
    place=lambda light: {"position": light.position()},
    exact=True,
)


def _travel(light: LightNode) -> np.ndarray:
    return light.vector("direction", (0, 0, 1), 2)


def _directional_to_heuristic(light: LightNode) -> None:
    direction, intensity = mi.ScalarVector3f(*_travel(light)), light.value("irradiance", 1.0)
    props = heuristic("heuristic_directional", direction=direction, intensity=intensity)
    light.replace(props, INTENSITY_FACTOR)


def _directional_to_physical(light: LightNode) -> None:
    direction = light.value("direction", mi.ScalarVector3f(0, 0, 1))
    irradiance = light.scaled_intensity(IRRADIANCE_PER_INTENSITY)
    props = properties("directional", direction=direction, irradiance=irradiance)
    light.replace(props, IRRADIANCE_PER_INTENSITY)


DIRECTIONAL = LightKind(
    plugins=("directional",),
    to_heuristic=_directional_to_heuristic,
    to_physical=_directional_to_physical,
    model=DirectionalLight,
    colour="irradiance",
    place=lambda light: {"toward": -_travel(light)},
    exact=True,
)


def even_cone(light: LightNode) -> None:
    """Replace a light by the even cone of the same solid angle and flux, as its sampling shows."""
    origin, axis = light.column(3), light.column(2)
    beam = probe.beam(light.graph, light.emitter, origin, axis)
    if beam is None:
        light.leave_out()
        return
    cutoff, intensity = beam
    props = heuristic(
        "heuristic_spot",
        position=mi.ScalarPoint3f(*origin),
        direction=mi.ScalarVector3f(*axis),
        cutoff=cutoff,
        exponent=0.0,
        intensity=intensity,
    )
    note = f"an even cone of {cutoff:.4g} deg, of the same solid angle and flux"
    light.replace(props, INTENSITY_FACTOR, exact=False, note=note, lost="its picture")


PROJECTOR = LightKind(plugins=("projector",), to_heuristic=even_cone)


LARGEST_EXPONENT = 1e5
STEPS = 2048


def exponent_for(cutoff: float, beam_width: float) -> float:
    """Return the ``m`` of 6.4 nearest to Mitsuba's fall-off at equal flux; angles in degrees."""
    theta, weight = _cone(cutoff)
    wanted, flux = linear_falloff(theta, cutoff, beam_width), linear_flux(cutoff, beam_width)

    def distance(log_m):
        m = np.expm1(log_m)
        fitted = flux / power_flux(cutoff, m) * power_falloff(theta, m)
        return np.sum(weight * (fitted - wanted) ** 2)

    from scipy.optimize import minimize_scalar  # see albedo.ior_of_lobe

    # In log(1 + m), because sharp spots differ little from one exponent to the next.
    found = minimize_scalar(distance, bounds=(0, np.log(LARGEST_EXPONENT)), method="bounded")
    return float(np.expm1(found.x))


def cone_for(cutoff: float, exponent: float) -> tuple[float, float]:
    """Return the cutoff and beam width of the linear fall-off that is nearest to ``cos^m``.

    At equal flux, and in degrees. A sharp beam ends long before its cone, so the cutoff is fitted
    too, up to the cone's.
    """
    theta, weight = _cone(cutoff)
    wanted, flux = power_falloff(theta, exponent), power_flux(cutoff, exponent)

    def distance(edge, beam_width):
        fitted = flux / linear_flux(edge, beam_width) * linear_falloff(theta, edge, beam_width)
        return np.sum(weight * (fitted - wanted) ** 2)

    def best_beam(edge):
        # Mitsuba rejects a beam as wide as the cone; just below it the cone is even.
        return _least(lambda beam_width: distance(edge, beam_width), 0.0, edge * (1 - 1e-4))

    edge = _least(lambda edge: distance(edge, best_beam(edge)), 1e-3 * cutoff, cutoff)
    return edge, best_beam(edge)


def _least(function: Callable[[float], float], low: float, high: float) -> float:
    """Return the minimum of a function that has only one, including the ends of the interval."""
    from scipy.optimize import minimize_scalar  # see albedo.ior_of_lobe

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
    if light.value("texture", None) is not None:
        even_cone(light)
        return
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


SPOT = LightKind(
    plugins=("spot",),
    to_heuristic=_spot_to_heuristic,
    model=SpotLight,
    to_physical=_spot_to_physical,
    colour="intensity",
    place=lambda light: {"position": light.position()},
    exact=True,
)
