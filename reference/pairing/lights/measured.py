"""Lights measured by their own sampling: means over directions and surfaces, for pairing.

Every mean is over a rank-1 lattice of samples, and is a value that a graph can hold.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.convention import IRRADIANCE_PER_INTENSITY
from reference.pairing.nearest.probe import WAVELENGTHS, as_value, lattice, opaque_wavelengths
from reference.scene.graph import Graph

SAMPLES = 65_536
LATTICE = (1, 19_463)
"""Generator of the rank-1 lattice (Korobov)."""


MEAN = "I_a is the mean radiance over the sphere"


@dataclass(frozen=True)
class Beam:
    """A light from one place: the even cone of the same solid angle and flux.

    ``cutoff`` is in degrees, ``intensity`` a value of the graph, per steradian.
    """

    cutoff: float
    intensity: Any


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


def beam(
    graph: Graph, emitter: mi.Emitter, position: Sequence[float], axis: Sequence[float]
) -> Beam | None:
    """Return the :class:`Beam` of a light at a position; None if it sends nothing.

    Directions are spread evenly over a cone about the axis, first the hemisphere, then the
    narrowest cone that holds all light found there.
    """
    widest = 0.0  # cosine of the cone's half angle
    for _ in range(4):
        found = _intensities(emitter, position, axis, widest)
        lit = found.max(axis=0) > 0
        if not lit.any():
            return None
        widest = max(1 - (1 - _cosines(widest)[lit].min()) * 1.05, 0.0)
    found = _intensities(emitter, position, axis, widest)
    lit = found.max(axis=0) > 0
    share = lit.mean()
    cutoff = np.degrees(np.arccos(1 - share * (1 - widest)))
    return Beam(float(cutoff), as_value(graph, found.mean(axis=1) / share, emitted=True))


def surface_mean(graph: Graph, shape: mi.Shape) -> Any:
    """Return the mean radiance of a shape's textured emission over its area."""
    emitter = shape.emitter()
    x, y = _lattice()
    sample = shape.sample_position(0.0, mi.Point2f(x, y))
    si = dr.zeros(mi.SurfaceInteraction3f, SAMPLES)
    si.p, si.n, si.uv = sample.p, sample.n, sample.uv
    si.wi = mi.Vector3f(0, 0, 1)
    means = [_channel_means(emitter.eval(_at(si, wavelengths))) for wavelengths in _wavelengths()]
    return as_value(graph, np.concatenate(means), emitted=True)


def _arriving(emitter: mi.Emitter) -> tuple[np.ndarray, np.ndarray]:
    """Return ``int L dw`` per channel, and the unit mean direction towards the light."""
    it = dr.zeros(mi.SurfaceInteraction3f, SAMPLES)
    x, y = _lattice()
    means, toward = [], np.zeros(3)
    for wavelengths in _wavelengths():
        ds, weight = emitter.sample_direction(_at(it, wavelengths), mi.Point2f(x, y))
        weight = dr.select(dr.isfinite(weight) & (ds.pdf > 0), weight, 0)
        means.append(_channel_means(weight))
        toward += np.array(ds.d, float) @ np.mean(np.array(weight, float), axis=0)
    return np.concatenate(means), toward / max(float(np.linalg.norm(toward)), 1e-30)


def _intensities(
    emitter: mi.Emitter, position: Sequence[float], axis: Sequence[float], widest: float
) -> np.ndarray:
    """Return the intensity in directions spread over a cone, (channels, SAMPLES)."""
    cosine = _cosines(widest)
    sine = np.sqrt(np.maximum(1 - cosine**2, 0))
    turn = 2 * np.pi * np.array(_lattice()[1], float)
    local = mi.Vector3f(*(mi.Float(c) for c in (sine * np.cos(turn), sine * np.sin(turn), cosine)))
    direction = mi.Frame3f(dr.normalize(mi.Vector3f(*axis))).to_world(local)
    it = dr.zeros(mi.SurfaceInteraction3f, SAMPLES)
    it.p = mi.Point3f(*position) + direction
    found = []
    for wavelengths in _wavelengths():
        ds, weight = emitter.sample_direction(_at(it, wavelengths), mi.Point2f(0.5))
        lit = dr.select(ds.pdf > 0, weight, 0)
        found.append(np.array(lit, float).reshape(len(weight), SAMPLES))
    return np.concatenate(found)


def _cosines(widest: float) -> np.ndarray:
    return 1 - np.array(_lattice()[0], float) * (1 - widest)


def _lattice() -> tuple[mi.Float, ...]:
    return tuple(mi.Float(row) for row in lattice(SAMPLES, LATTICE))


def _wavelengths():
    return WAVELENGTHS.reshape(-1, 4) if mi.is_spectral else (None,)


def _at(it, wavelengths):
    if wavelengths is not None:
        it.wavelengths = opaque_wavelengths(wavelengths)
    return it


def _channel_means(spectrum):
    """Return the mean of each channel, at least 0: sky models dip slightly below."""
    return np.array([max(np.mean(np.array(channel, float)), 0.0) for channel in spectrum])
