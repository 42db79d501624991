"""Spots, lights with an extent, and those that must be measured, to their nearest forms.

``area``: in the far field a point or an even spot, nearby a glow ``k_i``; of a texture the mean
radiance. One that surrounds what the camera sees is ``I_a``, if that is nearer. ``constant``,
``envmap`` and any other plugin whose light surrounds the scene: ``I_a``, the mean radiance over the
sphere; the sun of ``sunsky`` and ``timed_sunsky`` is a directional light of its irradiance and mean
direction. Any other light, such as ``projector``, is left out: it has no nearest form.

Spots differ. Mitsuba's is even up to its beam width and falls linearly in the angle to 0 at its
cutoff; the chapters' (6.4) falls as ``cos^m`` and is cut off. Neither can reproduce the other. The
fit minimises ``int (s f(t) - g(t))^2 sin(t) dt`` over the cone, the mean square over its solid
angle, where ``g`` is the given fall-off and ``f`` the other one. The level ``s`` is not fitted: it
gives equal flux, ``s int f sin = int g sin``. On the axis the two then differ.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.heuristic import meshes
from fotismos.heuristic.lights import DirectionalLight, PointLight, SpotLight
from fotismos.reference.pairing import probe
from fotismos.reference.pairing.factors import CLOSED_LIGHT_FACTOR, INTENSITY_FACTOR
from fotismos.reference.pairing.lights import (
    GLOWING,
    LightKind,
    LightNode,
    at_point,
    heuristic,
    level,
)
from fotismos.reference.pairing.pairing_record import SUN
from fotismos.reference.rendering.gbuffer import GBuffer
from fotismos.reference.scene import values
from fotismos.reference.scene.graph import Reference, properties

BSDF = mi.ObjectType.BSDF
EMITTER = mi.ObjectType.Emitter


def environment_to_ambient(light: LightNode) -> Any:
    """Return the mean radiance of an environment; a light of another kind is left out."""
    if not light.emitter.is_environment():
        light.leave_out()
        return None
    ambient = probe.mean_radiance(light.graph, light.emitter)
    light.becomes_ambient(probe.MEAN, "directions of the environment's light")
    return ambient


FLATNESS = 0.5
"""A light with a longer mean normal shines to one side; a closed one has a mean normal of 0."""

FLAT = 1 - 1e-4
"""A light with a mean normal longer than this is flat."""


CLOSED = 1 - 1e-3
"""A lamp that a larger share of directions meets is closed: few rays slip between triangles."""

VISIBLE = 1024
"""Places of the visible surface at which the light of a lamp is measured."""


def area_to_heuristic(light: LightNode) -> Any:
    """Replace a shape's light by a point, an even spot or ambient light, and a glow of the shape.

    Returns the radiance that becomes ``I_a``, if any.
    """
    graph = light.graph
    shape = light.shape
    label = graph.label(shape)
    radiance = light.value("radiance", 1.0)
    if light.hide_emitters:
        # Mitsuba's integrators look through it, and the heuristic casts no shadows.
        graph.remove(shape)
    else:  # its own copy of its phong shines
        ((key, bsdf),) = graph.children(shape, BSDF)
        props = mi.Properties(graph.props(bsdf))
        props.set_id(GLOWING.format(label))
        props["k_i"] = radiance
        graph.attach(shape, key, graph.add(BSDF, props))
    identifier = graph.props(shape).id()
    body = next(shape for shape in light.geometry().shapes() if shape.id() == identifier)
    extent = Extent.of(body)
    is_texture = isinstance(radiance, Reference)
    if is_texture and graph.instantiate(radiance.index()).is_spatially_varying():
        radiance = probe.surface_mean(graph, body)
    else:
        is_texture = False
    flatness = float(np.linalg.norm(extent.normal))
    if flatness > FLATNESS:
        # On its axis L times the projected area, and pi L A in all: I_0 2 pi / (m + 1) of 6.4.
        flatness = 1.0 if flatness > FLAT else flatness
        plugin = SpotLight.plugin
        factor = INTENSITY_FACTOR * extent.area * flatness
        form = ""
        exponent = 2 * flatness - 1
        axis = mi.ScalarVector3f(extent.normal)
        cone = {"direction": axis, "cutoff": 90.0, "exponent": exponent}
    else:
        plugin = PointLight.plugin
        factor = CLOSED_LIGHT_FACTOR * extent.area
        form = "closed, "
        exponent = 0.0
        cone = {}
    note = f"{form}area {extent.area:.6g}, in the far field; the shape keeps its emission as k_i"
    if flatness < 1:  # its light leaves through the shape
        cone["shell"] = extent.radius
        share = _ambient_share(light.surface(), body, extent, factor, exponent)
        if share is not None:
            note = f"I_a is its mean radiance times {share:.4g}, the share of directions it fills"
            is_exact = share in (0, 1) and not is_texture
            light.replaced.emitter(label, "area", "ambient", share, is_exact, note)
            if not is_exact:
                light.replaced.lose(label, "area", "directions of the lamp's light", note)
            return values.product(graph, radiance, share)
        if extent.is_inward:
            light.replaced.lose(label, "area", "places within the lamp", note)
    # A sphere has the area 4 pi r^2, a disk pi r^2; a rectangle has its two half edges.
    match graph.plugin(shape):
        case "sphere" | "disk" as kind:
            cone["radius"] = np.sqrt(extent.area / np.pi) / (2 if kind == "sphere" else 1)
        case "rectangle":
            matrix = np.array(mi.traverse(body)["to_world"].matrix, float).reshape(4, 4, -1)
            cone["half_u"] = mi.ScalarVector3f(matrix[:3, 0, 0])
            cone["half_v"] = mi.ScalarVector3f(matrix[:3, 1, 0])
    position = mi.ScalarPoint3f(extent.centroid)
    derived = heuristic(plugin, factor, **cone, position=position, intensity=radiance)
    derived.set_id(f"lamp ‘{label}’")
    graph.attach(0, f"light_of_{shape}", graph.add(EMITTER, derived))
    light.replaced.emitter(label, "area", plugin, factor, False, note)
    return None


def _ambient_share(
    visible: GBuffer, body: mi.Shape, extent: "Extent", factor: float, exponent: float
) -> float | None:
    """Return ``I_a`` of a lamp over its radiance, None if a point or spot is nearer.

    Nearer is what differs less, by least squares, from the light that arrives at the surface that
    the camera sees. Only a lamp that shines inwards may be ambient light; and one of whose light
    nothing arrives, since a point at its centre could shine where its back is.
    """
    position, normal = visible.places(VISIBLE)
    if not len(position):
        return None
    arriving = probe.share_of_directions(body, position, normal)
    if not arriving.any():
        return 0.0
    offset = extent.centroid - position
    distance = np.maximum(np.linalg.norm(offset, axis=1), np.finfo(float).tiny)
    toward = offset / distance[:, None]
    cosine = np.maximum(np.sum(normal * toward, axis=1), 0)
    fall_off = 1.0
    if exponent:
        ahead = -toward @ extent.normal / np.linalg.norm(extent.normal)
        fall_off = np.maximum(ahead, 0) ** exponent
    far = factor * cosine * fall_off / distance**2
    # The mean is the nearest even light, so its error is the variance.
    if not extent.is_inward or np.mean((arriving - far) ** 2) < np.var(arriving):
        return None
    share = float(np.mean(arriving))
    return 1.0 if share > CLOSED else share


ROOM = 1.02
"""Factor on the radius of a lamp: the grid's places lie up to a 64th inside its edges."""


@dataclass(frozen=True)
class Extent:
    """Where a lamp is and how large: centre (3,), area, mean normal (3,), and radius.

    ``is_inward`` says that its front faces its centre: ``int (p - c).n dA`` is below 0, which is
    three times the volume of a closed shape.
    """

    centroid: np.ndarray
    area: float
    normal: np.ndarray
    radius: float
    is_inward: bool

    @classmethod
    def of(cls, shape: mi.Shape) -> "Extent":
        """Measure a shape: Mitsuba's sampling is even in area, so means over a grid are of it."""
        cells = (np.arange(64) + 0.5) / 64
        x, y = np.reshape(np.meshgrid(cells, cells), (2, -1))
        sample = shape.sample_position(0.0, mi.Point2f(mi.Float(x), mi.Float(y)))
        normals = np.array(sample.n, float).T
        places = np.array(sample.p, float).T
        centroid = places.mean(axis=0)
        offset = places - centroid
        # Light leaves along the surface's own normals: those of vertices may be tilted.
        normal = meshes.mean_normals(shape)[0] if shape.is_mesh() else normals.mean(axis=0)
        return cls(
            centroid=centroid,
            area=float(np.ravel(shape.surface_area())[0]),
            normal=normal,
            radius=float(ROOM * np.linalg.norm(offset, axis=1).max()),
            is_inward=bool(np.sum(offset * normals) < 0),
        )


def sky_to_ambient(light: LightNode) -> Any:
    """Return the mean radiance of a sky; the sun becomes a directional light."""
    sun = probe.irradiance(light.graph, _only(light, "sky_scale"))
    note = probe.MEAN
    if sun is not None:
        intensity, direction = sun
        props = properties(
            DirectionalLight.plugin, direction=mi.ScalarVector3f(direction), intensity=intensity
        )
        props.set_id(f"sun of {light.label}")
        node = light.graph.add(mi.ObjectType.Emitter, props)
        light.graph.attach(0, f"{SUN}{light.index}", node)
        note += "; the sun a directional light of its irradiance"
    ambient = probe.mean_radiance(light.graph, _only(light, "sun_scale"))
    light.becomes_ambient(note, "directions of the sky's light, and the sun's extent")
    return ambient


def _only(light: LightNode, off: str) -> mi.Emitter:
    copy = light.graph.copy()
    copy.props(light.index)[off] = 0.0
    return copy.instantiate(light.index)


LARGEST_EXPONENT = 1e5
STEPS = 2048


def exponent_for(cutoff: float, beam_width: float) -> float:
    """Return the ``m`` of 6.4 nearest to Mitsuba's fall-off at equal flux; angles in degrees."""
    theta, _ = _cone(cutoff)
    target = linear_falloff(theta, cutoff, beam_width)
    return _exponent(cutoff, target, linear_flux(cutoff, beam_width))


def _exponent(cutoff: float, target: np.ndarray, flux: float) -> float:
    theta, weight = _cone(cutoff)

    def distance(log_m: float) -> float:
        m = np.expm1(log_m)
        fitted = flux / power_flux(cutoff, m) * power_falloff(theta, m)
        return float(np.sum(weight * (fitted - target) ** 2))

    # In log(1 + m), because sharp spots differ little from one exponent to the next.
    return float(np.expm1(_least(distance, 0.0, np.log(LARGEST_EXPONENT))))


def cone_for(cutoff: float, exponent: float) -> tuple[float, float]:
    """Return the cutoff and beam width of the linear fall-off that is nearest to ``cos^m``.

    At equal flux, and in degrees. A sharp beam ends long before its cone, so the cutoff is fitted
    too, up to the cone's.
    """
    theta, weight = _cone(cutoff)
    target = power_falloff(theta, exponent)
    flux = power_flux(cutoff, exponent)

    def distance(edge: float, beam_width: float) -> float:
        fitted = flux / linear_flux(edge, beam_width) * linear_falloff(theta, edge, beam_width)
        return float(np.sum(weight * (fitted - target) ** 2))

    def best_beam(edge: float) -> Any:
        # Mitsuba rejects a beam as wide as the cone; just below it the cone is even.
        return _least(lambda beam_width: distance(edge, beam_width), 0.0, edge * (1 - 1e-4))

    # A search in a search: each edge is judged with its best beam.
    edge = _least(lambda edge: distance(edge, best_beam(edge)), 1e-3 * cutoff, cutoff)
    return edge, best_beam(edge)


def _least(function: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import minimize_scalar  # loaded late: a tenth of a command's start

    # The bounded search only approaches the ends, which may be best.
    inner = minimize_scalar(function, bounds=(low, high), method="bounded").x
    return float(min((low, high, inner), key=function))


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
    cone: np.ndarray = np.maximum(np.cos(np.radians(theta)), 0) ** exponent * (theta < 90)
    return cone


def power_flux(cutoff: float, exponent: float) -> float:
    """Return ``int cos^m(t) sin(t) dt`` up to a cutoff in degrees."""
    cosine = np.cos(np.radians(cutoff))
    edge = cosine if exponent == 0 else max(cosine, 0.0)
    return float((1 - edge ** (exponent + 1)) / (exponent + 1))


def _cone(cutoff: float) -> tuple[np.ndarray, np.ndarray]:
    theta = (np.arange(STEPS) + 0.5) * cutoff / STEPS
    return theta, np.sin(np.radians(theta))


def spot_to_heuristic(light: LightNode) -> None:
    """Replace a spot by the nearest heuristic one; one that projects a picture is measured."""
    cutoff = light.number("cutoff_angle", 20.0)
    if light.value("texture", None) is None:
        beam_width = light.number("beam_width", 0.75 * cutoff)
        exponent = exponent_for(cutoff, beam_width)
        factor = INTENSITY_FACTOR * linear_flux(cutoff, beam_width) / power_flux(cutoff, exponent)
        intensity = light.value("intensity", 1.0)
        fall_off = f"the linear fall-off from {beam_width:g} to {cutoff:g} deg"
        is_round = True
    else:
        theta, weight = _cone(cutoff)
        sent, is_round = probe.sent_at_angles(light.emitter, np.radians(theta))
        fluxes = sent @ weight * np.radians(cutoff) / STEPS
        mean = sent.mean(axis=0)
        exponent = _exponent(cutoff, mean, float(fluxes.mean())) if mean.any() else 0.0
        factor = INTENSITY_FACTOR
        level = fluxes / power_flux(cutoff, exponent)
        intensity = probe.as_value(light.graph, level, emitted=True)
        fall_off = "the mean fall-off of its picture"
    props = heuristic(
        SpotLight.plugin,
        factor,
        position=mi.ScalarPoint3d(light.position()),
        direction=mi.ScalarVector3f(light.column(2)),
        cutoff=cutoff,
        exponent=exponent,
        intensity=intensity,
    )
    note = f"m = {exponent:.4g} fitted to {fall_off}; same flux"
    if not is_round:
        light.replaced.lose(light.label, light.plugin, "picture that the spot projects", note)
    light.replace(props, factor, exact=False, note=note)


def spot_to_physical(light: LightNode) -> None:
    """Replace a heuristic spot by Mitsuba's nearest."""
    position = light.position()
    axis = np.ravel(light.value("direction", (0, 0, 1))).astype(float)
    axis /= np.linalg.norm(axis)
    cutoff = light.number("cutoff", 30.0)
    exponent = light.number("exponent", 0.0)
    edge, beam_width = cone_for(cutoff, exponent)

    def angle(travel: Any) -> Any:
        return np.degrees(np.arccos(np.clip(travel @ axis, -1, 1)))

    factor, rule = level(
        light,
        lambda travel: power_falloff(angle(travel), exponent) * (angle(travel) <= cutoff),
        lambda travel: linear_falloff(angle(travel), edge, beam_width),
        power_flux(cutoff, exponent) / linear_flux(edge, beam_width),
    )
    fitted = f"linear from {beam_width:.4g} to {edge:.4g} deg, fitted to m = {exponent:g}"
    target = position + axis
    up = np.eye(3)[np.argmin(np.abs(axis))]  # the axis of the world most unlike the beam
    props = properties(
        "spot",
        to_world=mi.ScalarTransform4f().look_at(position.tolist(), target.tolist(), up.tolist()),
        intensity=light.scaled_intensity(factor),
        cutoff_angle=edge,
        beam_width=beam_width,
    )
    light.replace(props, factor, exact=False, note=f"{fitted}; {rule or 'same flux'}")


AREA = LightKind(
    plugins=("area",), colour="radiance", to_heuristic=area_to_heuristic, on_shape=True
)
ENVIRONMENT = LightKind(plugins=("envmap",), to_heuristic=environment_to_ambient, surrounds=True)
SKY = LightKind(plugins=("sunsky", "timed_sunsky"), to_heuristic=sky_to_ambient, surrounds=True)
SPOT = LightKind(
    plugins=("spot",),
    model=SpotLight,
    colour="intensity",
    to_heuristic=spot_to_heuristic,
    to_physical=spot_to_physical,
    place=at_point,
    exact=True,
)
PROJECTOR = LightKind(plugins=("projector",))

KINDS = (AREA, ENVIRONMENT, SKY, SPOT, PROJECTOR)
"""The kinds that :mod:`fotismos.reference.pairing.kinds` does not have."""
