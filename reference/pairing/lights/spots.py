"""Spots: ``spot`` and ``heuristic_spot``, whose fall-offs are fitted to each other; ``projector``.

Mitsuba's ``spot`` is even up to its beam width and falls linearly in the angle to 0 at its cutoff;
the chapters' (6.4) falls as ``cos^m`` and is cut off. Neither can reproduce the other. The fit
minimises ``int (s f(t) - g(t))^2 sin(t) dt`` over the cone, the mean square over its solid angle,
where ``g`` is the given fall-off and ``f`` the other one. The level ``s`` is not fitted: it gives
equal flux, ``s int f sin = int g sin``, by the rule of :mod:`reference.pairing.lights`. On the axis
the two then differ.

The nearest form of a picture projected from a point is the even cone of the same flux.
"""

from collections.abc import Callable
from dataclasses import replace

import mitsuba as mi
import numpy as np

from heuristic.lights import SpotLight
from reference.pairing.factors import INTENSITY_FACTOR
from reference.pairing.lights import measured, point_lights
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter, heuristic
from reference.scene.graph import properties


def even_cone(light: Given) -> PairedEmitter:
    """Replace a light by the even cone of the same solid angle and flux, as its sampling shows."""
    label, origin, axis = light.label, light.column(3), light.column(2)
    beam = measured.beam(light.graph, light.emitter, origin, axis)
    if beam is None:
        return light.leave_out()
    props = heuristic(
        "heuristic_spot",
        position=mi.ScalarPoint3f(*origin),
        direction=mi.ScalarVector3f(*axis),
        cutoff=beam.cutoff,
        exponent=0.0,
        intensity=beam.intensity,
    )
    note = f"an even cone of {beam.cutoff:.4g} deg, of the same solid angle and flux"
    record = light.replace(props, INTENSITY_FACTOR, exact=False, note=note)
    return replace(record, name=label, lost="its picture")


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

    from scipy.optimize import minimize_scalar  # see refraction.of_lobe

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
    from scipy.optimize import minimize_scalar  # see refraction.of_lobe

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


def _to_heuristic(light: Given) -> PairedEmitter:
    if light.value("texture", None) is not None:
        return even_cone(light)
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
    note = (
        f"m = {exponent:.4g} fitted to the linear fall-off from {beam_width:g} to {cutoff:g} deg;"
        " same flux"
    )
    return light.replace(props, factor, exact=False, note=note)


def _to_physical(light: Given) -> PairedEmitter:
    position, axis = light.position(), np.ravel(light.value("direction", (0, 0, 1))).astype(float)
    axis /= np.linalg.norm(axis)
    cutoff, exponent = light.number("cutoff", 30.0), light.number("exponent", 0.0)
    edge, beam_width = cone_for(cutoff, exponent)

    def angle(travel):
        return np.degrees(np.arccos(np.clip(travel @ axis, -1, 1)))

    level = point_lights.level(
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
        intensity=light.scaled_intensity(level.factor),
        cutoff_angle=edge,
        beam_width=beam_width,
    )
    note = f"{fitted}; {level.note or 'same flux'}"
    return light.replace(props, level.factor, exact=False, note=note)


SPOT = LightKind(
    plugins=("spot",),
    to_heuristic=_to_heuristic,
    model=SpotLight,
    to_physical=_to_physical,
    colour="intensity",
    place=lambda light: {"position": light.position()},
    exact=True,
    edits={
        "heuristic_spot": {
            "position": "position",
            "direction": "direction",
            "intensity": "intensity.value",
            "scale": "scale",
        }
    },
)
