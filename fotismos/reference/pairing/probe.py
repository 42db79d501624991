"""BSDFs and lights measured by their own sampling, by rank-1 lattices of samples.

BSDFs at normal incidence, their textures averaged:

- albedos of reflection and transmission, as weighted by ``sample`` (light as particles, so a
  refraction's change of solid angle does not count);
- the diffuse part ``k_d = pi f``, with the BRDF ``f`` 60 degrees off the normal, outside the lobe;
- the lobe's width from the median slope of the rest, over half vectors: for Beckmann's lobe
  ``tan^2`` is distributed exponentially, with the median ``alpha^2 ln 2``. A mean would depend on
  the tail, where the diffuse part is not quite even.

Lights by means over directions and surfaces. What is returned for a graph is a number, a colour, or
a reference to a node with a tabulated spectrum.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache
from math import cos, log, pi, radians, sin
from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic.convention import IRRADIANCE_PER_INTENSITY, Colour, Number
from fotismos.heuristic.errors import InputError
from fotismos.reference.scene import values
from fotismos.reference.scene.graph import Graph

SAMPLES = 8192
SAMPLES_OF_LIGHTS = 65_536
AROUND = 32
"""Directions around the axis of a spot that is measured."""

DIRECTIONS = 610
"""Directions in which a place looks for a lamp; they and :data:`LATTICE_OF_DIRECTIONS` are numbers
of Fibonacci, two apart."""

NODES = 256
"""Cosines of an :class:`AlbedoTable`; at each the BSDF is sampled :data:`SAMPLES` times."""

LATTICE = (1, 3547, 1663, 5413, 2689)
"""Generator of the rank-1 lattice (Korobov): three numbers for the sample, two for the texture."""
LATTICE_OF_LIGHTS = (1, 19_463)
LATTICE_OF_DIRECTIONS = (1, 233)

OFF_LOBE = radians(60.0)

WAVELENGTHS = np.linspace(360.0, 830.0, 48)
"""Wavelengths at which a spectral variant is probed, nm; Mitsuba's own range."""

MEAN = "I_a is the mean radiance over the sphere"


@dataclass(frozen=True)
class Albedos:
    """A BSDF's albedos at normal incidence, arrays or values of a graph, and its lobe's width.

    Of all reflection, its diffuse part and its lobe, of light that passes straight or refracted,
    and of light scattered through.
    """

    reflected: Any
    diffuse: Any
    specular: Any
    passed: Any
    scattered: Any
    alpha: float


def probe(bsdf: mi.BSDF) -> Albedos | None:
    """Return a BSDF's :class:`Albedos` as arrays; None if it cannot be sampled."""
    drawn = _of_rays() if mi.is_spectral else None
    try:
        parts = [_parts(bsdf, four) for four in ((None,) if drawn is None else drawn)]
    except RuntimeError:
        return None
    by_part = zip(*(colours for colours, _ in parts), strict=True)
    columns = [np.stack(column, 1) for column in by_part]
    if drawn is not None:
        # Rays draw their four wavelengths far apart: here they are put in order.
        columns = [np.interp(WAVELENGTHS, drawn.T.ravel(), column.ravel()) for column in columns]
    reflected, diffuse, passed, scattered = map(np.ravel, columns)
    alpha = float(np.mean([width for _, width in parts]))
    if not np.isfinite([*reflected, *diffuse, *passed, *scattered, alpha]).all():
        return None
    return Albedos(
        reflected=reflected,
        diffuse=diffuse,
        specular=np.maximum(reflected - diffuse, 0),
        passed=passed,
        scattered=scattered,
        alpha=alpha,
    )


def with_values(graph: Graph, index: int, **changes: Any) -> Albedos | None:
    """Probe a node's BSDF, and return values of the graph; None if it cannot be sampled.

    Changes apply only to parameters that are given: others keep their defaults.
    """
    part = graph.part(index)
    props = part.props(0)
    for key, value in changes.items():
        if key in props:
            props[key] = value
    response = probe(part.instantiate())
    names = ("reflected", "diffuse", "specular", "passed", "scattered")
    return response and replace(
        response, **{name: as_value(graph, getattr(response, name)) for name in names}
    )


def measured(graph: Graph, index: int, **changes: Any) -> Albedos:
    """Same as :func:`with_values`; InputError for a BSDF that cannot be sampled."""
    response = with_values(graph, index, **changes)
    if response is None:
        from fotismos.reference.scene import spectra  # loaded late: few scenes have such a BSDF

        cause = " ".join(spectra.short_tables(graph, index)) or "Check its parameters."
        raise InputError(
            f"{graph.name}: {graph.label(index)}: its albedo is not a number, or Mitsuba cannot"
            f" sample it. {cause}"
        )
    return response


def as_value(graph: Graph, albedo: np.ndarray, emitted: bool = False) -> Any:
    """Return albedos as a value of a graph: a number, a colour, or a tabulated spectrum.

    ``emitted`` values are always tabulated in spectral variants, where a number means daylight.
    """
    albedo = np.asarray(albedo, float)
    tabulated = emitted and mi.is_spectral
    if not tabulated and np.ptp(albedo) <= 1e-6 * max(albedo.max(), 1e-30):
        return float(albedo.mean())
    if not mi.is_spectral:
        return tuple(albedo.tolist())
    return values.node(
        graph,
        "regular",
        wavelength_min=float(WAVELENGTHS[0]),
        wavelength_max=float(WAVELENGTHS[-1]),
        values=", ".join(f"{value:.6g}" for value in albedo),
    )


@cache
def lattice(size: int, generator: Sequence[int] = LATTICE) -> np.ndarray:
    """Return the points of a rank-1 lattice in the unit cube, (len(generator), size)."""
    return (np.outer(generator, np.arange(size)) / size + 0.5 / size) % 1


def _wavelengths() -> np.ndarray | tuple[None]:
    return WAVELENGTHS.reshape(-1, 4) if mi.is_spectral else (None,)


def _of_rays() -> np.ndarray:
    """Return wavelengths as a ray has them, (n, 4): tints of `principled` depend on all four."""
    # Mitsuba spaces the four evenly: a quarter of the range of random numbers apart.
    places = (np.arange(WAVELENGTHS.size) + 0.5) / WAVELENGTHS.size
    wavelengths, _ = mi.sample_rgb_spectrum(mi.Spectrum(mi.Float(places)))
    return np.array(wavelengths[0]).reshape(4, -1).T


def _at(si: Any, wavelengths: np.ndarray | None) -> Any:
    """Return an interaction at four wavelengths; opaque ones compile the same kernel for all."""
    if wavelengths is not None:
        si.wavelengths = mi.Spectrum(*map(float, wavelengths))
        dr.make_opaque(si.wavelengths)
    return si


def _parts(bsdf: mi.BSDF, wavelengths: np.ndarray | None) -> tuple[tuple[Any, ...], float]:
    # Light along the normal of a plane, at places all over its textures.
    points = [mi.Float(row) for row in lattice(SAMPLES)]
    lobe, x, y, u, v = points
    si = _at(dr.zeros(mi.SurfaceInteraction3f, SAMPLES), wavelengths)
    si.t = 1.0
    si.n = mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(mi.Vector3f(0, 0, 1))
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
    si.uv = mi.Point2f(u, v)
    si.wi = mi.Vector3f(0, 0, 1)
    context = mi.BSDFContext(mi.TransportMode.Importance)
    bs, weight = bsdf.sample(context, si, lobe, mi.Point2f(x, y), True)
    weight = dr.select(dr.isfinite(weight) & (bs.pdf > 0), weight, 0)
    # Light goes up, passes straight or refracted, or is scattered through.
    up = bs.wo.z > 0
    straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null) | ~mi.has_flag(
        bs.sampled_type, mi.BSDFFlags.Diffuse
    )
    # The BRDF on a cone beside the lobe; `eval` contains the cosine.
    around = mi.Float(2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    sin_phi, cos_phi = dr.sincos(around)
    beside = mi.Vector3f(sin(OFF_LOBE) * cos_phi, sin(OFF_LOBE) * sin_phi, cos(OFF_LOBE))
    level = bsdf.eval(mi.BSDFContext(), si, beside, True) * (pi / cos(OFF_LOBE))
    dr.eval(bs, weight, up, straight, level)  # one kernel for all values read below
    reflected = _channel_means(dr.select(up, weight, 0))
    passed = _channel_means(dr.select(~up & straight, weight, 0))
    scattered = _channel_means(dr.select(~up & ~straight, weight, 0))
    diffuse = np.clip(_channel_means(level), 0, reflected)
    return (reflected, diffuse, passed, scattered), _width(bs, weight, up=up, diffuse=diffuse)


def _width(bs: Any, weight: Any, up: Any, diffuse: Any) -> Any:
    weights = np.mean(np.array(weight, float), axis=0) * np.array(up)
    cosine = np.clip(np.array(bs.wo.z, float), 1e-6, 1)
    density = np.array(bs.pdf, float)
    delta = np.array(mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta))
    # The diffuse part of each sample's weight, f cos / pdf, is k_d cos / (pi pdf).
    share = np.where(delta, 0, np.mean(diffuse) * cosine / (np.pi * np.maximum(density, 1e-30)))
    weights = np.maximum(weights - share, 0)
    slope = np.where(delta, 0, (1 - cosine) / (1 + cosine))  # tan^2 of half the angle
    # The slope below which half of the lobe's light lies.
    order = np.argsort(slope)
    reached = np.cumsum(weights[order])
    median = slope[order][np.searchsorted(reached, reached[-1] / 2)] if reached[-1] > 0 else 0.0
    return float(np.sqrt(median / log(2)))


def mean_radiance(graph: Graph, emitter: mi.Emitter) -> Any:
    """Return the mean radiance of an environment over the sphere, ``int L dw / (4 pi)``."""
    means, _ = _arriving(emitter)
    return as_value(graph, means / (4 * np.pi), emitted=True)


def irradiance(graph: Graph, emitter: mi.Emitter) -> tuple[Any, list[float]] | None:
    """Return ``int L dw`` of a distant light as intensity ``I_p``, and its mean direction.

    The direction is the mean direction of travel, weighted by radiance. None if no light arrives.
    """
    means, toward = _arriving(emitter)
    if not means.any():
        return None
    return as_value(graph, means / IRRADIANCE_PER_INTENSITY, emitted=True), (-toward).tolist()


def surface_mean(graph: Graph, shape: mi.Shape) -> Any:
    """Return the mean radiance of a shape that shines, over its surface, seen head on."""
    emitter = shape.emitter()
    x, y = _lattice()
    sample = shape.sample_position(0.0, mi.Point2f(x, y))
    si = dr.zeros(mi.SurfaceInteraction3f, SAMPLES_OF_LIGHTS)
    si.p = sample.p
    si.n = sample.n
    si.uv = sample.uv
    si.wi = mi.Vector3f(0, 0, 1)
    means = [_channel_means(emitter.eval(_at(si, wavelengths))) for wavelengths in _wavelengths()]
    return as_value(graph, np.maximum(np.concatenate(means), 0), emitted=True)


def share_of_directions(shape: mi.Shape, position: np.ndarray, normal: np.ndarray) -> np.ndarray:
    """Return the share (M,) of the hemisphere, by cosine, in which places (M, 3) see its front.

    It is what a white diffuse surface of that ``normal`` (M, 3) sends if the shape has the radiance
    1. Other shapes hide nothing, but parts of the shape hide others.
    """
    alone = mi.load_dict({"type": "scene", "shape": shape})
    number = dr.arange(mi.UInt32, len(position) * DIRECTIONS)
    place = number // DIRECTIONS

    def spread(rows: np.ndarray, indices: Any) -> list[Any]:
        return [dr.gather(mi.Float, mi.Float(row), indices) for row in rows]

    cells = lattice(DIRECTIONS, LATTICE_OF_DIRECTIONS)
    cell = mi.Point2f(*spread(cells, number % DIRECTIONS))
    frame = mi.Frame3f(mi.Vector3f(*spread(normal.T, place)))
    direction = frame.to_world(mi.warp.square_to_cosine_hemisphere(cell))
    si = alone.ray_intersect(mi.Ray3f(mi.Point3f(*spread(position.T, place)), direction))
    is_seen = np.array(si.is_valid() & (si.wi.z > 0), float)
    shares: np.ndarray = is_seen.reshape(-1, DIRECTIONS).mean(axis=1)
    return shares


def sent_at_angles(emitter: mi.Emitter, theta: np.ndarray) -> tuple[np.ndarray, bool]:
    """Return the mean intensity (channels, T) of a point-like light at angles off its z axis.

    Also whether it is the same all around, but for 1 % of its largest on average.
    """
    angle = np.repeat(theta, AROUND)
    around = np.tile(2 * np.pi * (np.arange(AROUND) + 0.5) / AROUND, len(theta))
    sine = np.sin(angle)
    local = (sine * np.cos(around), sine * np.sin(around), np.cos(angle))
    it = dr.zeros(mi.SurfaceInteraction3f, len(angle))
    # At the distance 1 the irradiance is the intensity.
    it.p = emitter.world_transform() @ mi.Point3f(*map(mi.Float, local))
    sent = []
    is_round = True
    for wavelengths in _wavelengths():
        _, weight = emitter.sample_direction(_at(it, wavelengths), mi.Point2f(0.5))
        rings = np.array(weight, float).reshape(-1, len(theta), AROUND)
        is_round &= bool(np.ptp(rings, axis=2).mean() <= 0.01 * rings.max())
        sent.append(rings.mean(axis=2))
    return np.concatenate(sent), is_round


def _arriving(emitter: mi.Emitter) -> tuple[np.ndarray, np.ndarray]:
    """Return ``int L dw`` per channel, and the unit mean direction towards the light."""
    it = dr.zeros(mi.SurfaceInteraction3f, SAMPLES_OF_LIGHTS)
    x, y = _lattice()
    means = []
    toward = np.zeros(3)
    for wavelengths in _wavelengths():
        ds, weight = emitter.sample_direction(_at(it, wavelengths), mi.Point2f(x, y))
        weight = dr.select(dr.isfinite(weight) & (ds.pdf > 0), weight, 0)
        means.append(_channel_means(weight))
        toward += np.array(ds.d, float) @ np.mean(np.array(weight, float), axis=0)
    # At least 0: sky models dip slightly below.
    arriving = np.maximum(np.concatenate(means), 0)
    return arriving, toward / max(float(np.linalg.norm(toward)), 1e-30)


def _lattice() -> tuple[mi.Float, ...]:
    return tuple(mi.Float(row) for row in lattice(SAMPLES_OF_LIGHTS, LATTICE_OF_LIGHTS))


def _channel_means(spectrum: Any) -> np.ndarray:
    return np.array([np.mean(np.array(channel, float)) for channel in spectrum])


class AlbedoTable:
    """The albedo of a uniform, isotropic BSDF over the cosine of the view direction, RGB.

    Nodes are even in ``sqrt(mu)``: Fresnel's terms bend most towards grazing. A BSDF that also
    reflects on its back does so in the same way.
    """

    DRJIT_STRUCT: ClassVar = {"table": Any}  # what dr.freeze must know of

    def __init__(self, bsdf: Any) -> None:
        self.has_back = mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide)
        mu = np.linspace(1e-3, 1, NODES) ** 2
        # Spread out in the kernel: millions of numbers need not be sent.
        places = dr.arange(mi.UInt32, NODES * SAMPLES)
        grid_mu = dr.gather(mi.Float, mi.Float(mu), places // SAMPLES)
        rows = lattice(SAMPLES)
        lobe = dr.gather(mi.Float, mi.Float(rows[0]), places % SAMPLES)
        u = dr.gather(mi.Float, mi.Float(rows[1]), places % SAMPLES)
        v = dr.gather(mi.Float, mi.Float(rows[2]), places % SAMPLES)
        si = dr.zeros(mi.SurfaceInteraction3f, NODES * SAMPLES)
        si.wi = mi.Vector3f(dr.safe_sqrt(1 - dr.square(grid_mu)), 0, grid_mu)
        _, weight = bsdf.sample(mi.BSDFContext(), si, lobe, mi.Point2f(u, v))
        # Thousands of equal terms lose four digits in single precision.
        means = [
            mi.Float(dr.block_sum(mi.Float64(channel), SAMPLES) / SAMPLES) for channel in weight
        ]
        self.table = dr.ravel(mi.Color3f(*means))
        dr.eval(self.table)

    def at(self, mu: Number) -> Colour:
        """Interpolate linearly at cosines ``mu``; behind a one-sided surface, 0."""
        mu = abs(mu) if self.has_back else mu
        # The inverse of the nodes' even spacing in `sqrt(mu)` from 1e-3 to 1.
        node = (dr.safe_sqrt(mu) - 1e-3) / (1 - 1e-3) * (NODES - 1)
        node = dr.clip(node, 0, NODES - 1)
        below = dr.minimum(mi.UInt32(node), NODES - 2)
        low = dr.gather(mi.Color3f, self.table, below)
        high = dr.gather(mi.Color3f, self.table, below + 1)
        return dr.select(mu > 0, dr.lerp(low, high, node - mi.Float(below)), 0)
