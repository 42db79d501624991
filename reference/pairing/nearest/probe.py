"""The rule for any BSDF: k_d, k_s and n measured by its own sampling.

It serves plugins that no other rule knows, including users', and parts of other rules.

At normal incidence, by a rank-1 lattice of samples that also covers the texture plane:

- albedos of reflection and transmission, as weighted by ``sample`` (light as particles, so a
  refraction's change of solid angle does not count);
- the diffuse part ``k_d = pi f``, with the BRDF ``f`` 60 degrees off the normal, outside the lobe;
- the lobe's width from the median slope of the rest, over half vectors: for Beckmann's lobe
  ``tan^2`` is distributed exponentially, with the median ``alpha^2 ln 2``. A mean would depend on
  the tail, where the diffuse part is not quite even.

Textures are averaged.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from math import cos, log, pi, radians, sin
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from heuristic.terms import normalisation
from reference.pairing.factors import exponent_of
from reference.pairing.nearest import operations
from reference.pairing.nearest.material import Context, Nearest
from reference.scene.graph import Graph

SAMPLES = 8192
LATTICE = (1, 3547, 1663, 5413, 2689)
"""Generator of the rank-1 lattice (Korobov): three numbers for the sample, two for the texture."""

OFF_LOBE = radians(60.0)

WAVELENGTHS = np.linspace(360.0, 830.0, 48)
"""Wavelengths at which a spectral variant is probed, nm; Mitsuba's own range."""


@dataclass(frozen=True)
class Probed:
    """Albedos at normal incidence, one value per channel or wavelength, and the lobe's width."""

    reflected: np.ndarray
    diffuse: np.ndarray
    passed: np.ndarray
    scattered: np.ndarray
    alpha: float

    @property
    def specular(self) -> np.ndarray:
        """Albedo of the lobe: all reflection except the diffuse part."""
        return np.maximum(self.reflected - self.diffuse, 0)


def probe(bsdf: mi.BSDF) -> Probed | None:
    """Return a BSDF as :class:`Probed`; None if it cannot be sampled."""
    wavelengths = WAVELENGTHS.reshape(-1, 4) if mi.is_spectral else (None,)
    try:
        parts = [_at(bsdf, chosen) for chosen in wavelengths]
    except RuntimeError:
        return None
    albedos = [np.concatenate(column) for column in zip(*(part[:4] for part in parts), strict=True)]
    alpha = float(np.mean([part[4] for part in parts]))
    if not all(np.isfinite(albedo).all() for albedo in albedos) or not np.isfinite(alpha):
        return None
    reflected, diffuse, passed, scattered = albedos
    return Probed(reflected, diffuse, passed, scattered, alpha)


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
    return operations.node(
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


def interaction(
    size: int, wavelengths: np.ndarray | None = None
) -> tuple[mi.SurfaceInteraction3f, list]:
    """Return interactions on a plane seen head on, spread over the texture plane by a lattice."""
    points = [mi.Float(row) for row in lattice(size)]
    si = dr.zeros(mi.SurfaceInteraction3f, size)
    si.t = 1.0
    si.n = mi.Normal3f(0, 0, 1)
    si.sh_frame = mi.Frame3f(mi.Vector3f(0, 0, 1))
    si.dp_du, si.dp_dv = mi.Vector3f(1, 0, 0), mi.Vector3f(0, 1, 0)
    si.uv = mi.Point2f(points[3], points[4])
    si.wi = mi.Vector3f(0, 0, 1)
    if wavelengths is not None:
        si.wavelengths = opaque_wavelengths(wavelengths)
    return si, points[:3]


def opaque_wavelengths(wavelengths: np.ndarray) -> mi.Spectrum:
    """Return four wavelengths as one spectrum that compiles the same kernel for all."""
    found = mi.Spectrum(*map(float, wavelengths))
    dr.make_opaque(found)
    return found


def _at(bsdf: mi.BSDF, wavelengths: np.ndarray | None) -> tuple:
    si, points = interaction(SAMPLES, wavelengths)
    context = mi.BSDFContext(mi.TransportMode.Importance)
    bs, weight = bsdf.sample(context, si, points[0], mi.Point2f(*points[1:]), True)
    weight = dr.select(dr.isfinite(weight) & (bs.pdf > 0), weight, 0)
    up = bs.wo.z > 0
    straight = mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null) | ~mi.has_flag(
        bs.sampled_type, mi.BSDFFlags.Diffuse
    )
    around = mi.Float(2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    sin_phi, cos_phi = dr.sincos(around)
    beside = mi.Vector3f(sin(OFF_LOBE) * cos_phi, sin(OFF_LOBE) * sin_phi, cos(OFF_LOBE))
    level = bsdf.eval(mi.BSDFContext(), si, beside, True) * (pi / cos(OFF_LOBE))
    dr.eval(bs, weight, up, straight, level)  # one kernel for all values read below
    reflected, passed, scattered, diffuse = (
        _means(value)
        for value in (
            dr.select(up, weight, 0),
            dr.select(~up & straight, weight, 0),
            dr.select(~up & ~straight, weight, 0),
            level,
        )
    )
    diffuse = np.clip(diffuse, 0, reflected)
    return reflected, diffuse, passed, scattered, _width(bs, weight, up, diffuse)


def _means(value: mi.Spectrum) -> np.ndarray:
    """Return the mean of each channel of a spectrum."""
    return np.array([np.mean(np.array(channel, float)) for channel in value])


def _width(bs, weight, up, diffuse):
    """Return the root mean square slope of the lobe without the diffuse part, by its median."""
    weights = np.mean(np.array(weight, float), axis=0) * np.array(up)
    cosine = np.clip(np.array(bs.wo.z, float), 1e-6, 1)
    density = np.array(bs.pdf, float)
    delta = np.array(mi.has_flag(bs.sampled_type, mi.BSDFFlags.Delta))
    # The diffuse part of each sample's weight, f cos / pdf, is k_d cos / (pi pdf).
    share = np.where(delta, 0, np.mean(diffuse) * cosine / (np.pi * np.maximum(density, 1e-30)))
    weights = np.maximum(weights - share, 0)
    slope = np.where(delta, 0, (1 - cosine) / (1 + cosine))  # tan^2 of half the angle
    order = np.argsort(slope)
    reached = np.cumsum(weights[order])
    median = slope[order][np.searchsorted(reached, reached[-1] / 2)] if reached[-1] > 0 else 0.0
    return float(np.sqrt(median / log(2)))


SMOOTH_ALPHA = 0.05
"""Replaces a smaller roughness: a mirror's lobe has no width, and the model's light no extent. The
albedo is kept, so the highlight holds as much as the mirror image of a small light."""


@dataclass(frozen=True)
class White:
    """The probe's albedos as values of the graph, and the lobe's width."""

    reflected: Any
    diffuse: Any
    specular: Any
    passed: Any
    scattered: Any
    alpha: float


def nearest(context: Context, index: int) -> Nearest:
    """The diffuse part as ``k_d``, the rest as a lobe of the same albedo and width."""
    found = with_values(context, index)
    if found is None:
        return Nearest(
            k_a=0.5, k_d=0.5, lost=(("reflection", "diffuse of 0.5: it cannot be sampled"),)
        )
    graph = context.graph
    rule = "k_d, k_s and n measured at normal incidence, textures averaged"
    lost = "all but a diffuse part and a lobe"
    if context.plugin(index) == "hair":
        # Light transmitted by a fibre leaves on the other side of the same strand.
        everything = operations.total(
            graph, operations.total(graph, found.reflected, found.passed), found.scattered
        )
        whole = ((lost, "k_d is the whole albedo"),)
        return Nearest(k_a=everything, k_d=everything, twosided=True, lost=whole)
    if not operations.is_zero(found.scattered):
        lost += ", and light scattered through"
    return Nearest(
        k_a=found.reflected,
        k_d=found.diffuse,
        **lobe(context, found.specular, found.alpha),
        transmittance=found.passed,
        lost=((lost, rule),),
    )


def with_values(context: Context, index: int, **values: Any) -> White | None:
    """Probe a node's BSDF with some parameters changed; return :class:`White`, None if impossible.

    Only parameters that are given are changed: others keep their defaults.
    """
    part = context.graph.part(index)
    props = part.props(0)
    for key, value in values.items():
        if key in props:
            props[key] = value
    found = probe(part.instantiate())
    if found is None:
        return None
    names = ("reflected", "diffuse", "specular", "passed", "scattered")
    return White(
        **{name: as_value(context.graph, getattr(found, name)) for name in names}, alpha=found.alpha
    )


def measured(context: Context, index: int, **values: Any) -> White:
    """Same as :func:`with_values`, for a BSDF that can be sampled.

    Raises
    ------
    InputError
        If it cannot be sampled.
    """
    found = with_values(context, index, **values)
    if found is None:
        graph = context.graph
        raise InputError(
            f"{graph.name}: {graph.label(index)}: its albedo is not a number, or Mitsuba cannot"
            " sample it. Check its parameters."
        )
    return found


def lobe(context: Context, albedo: Any, alpha: Any) -> dict[str, Any]:
    """Return ``k_s``, ``n`` and ``normalised`` of a lobe of an albedo and a roughness.

    ``n`` is :func:`reference.pairing.factors.exponent_of` ``alpha``, and ``k_s`` the albedo times
    :func:`heuristic.terms.normalisation`; if ``alpha`` is a texture, the plugin normalises.
    """
    if operations.is_zero(albedo):
        return {}
    known = operations.plain(alpha)
    if known is None:
        n = operations.exponent(context.graph, alpha)
        return {"k_s": albedo, "n": n, "normalised": True}
    n = exponent_of(max(float(np.mean(known)), SMOOTH_ALPHA))
    scale = float(normalisation("phong", n))
    return {"k_s": operations.product(context.graph, albedo, scale), "n": n}
