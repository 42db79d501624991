"""The light of a scene's background, as shaders read it (``point.environment``).

It is that of Mitsuba's environment emitter, such as ``constant``, ``envmap`` or ``sunsky``. In a
scene without one it is ``I_a`` in every direction; in a scene with one, ``I_a`` is its mean,
without a sun.

A map has rows from straight up to straight down, and columns around that axis, as Mitsuba's
``envmap`` has them. With ``(x, y, z)`` in the emitter's own frame, a direction is at column ``W u -
1/2`` and row ``(H - 1) v``, where ``2 pi u = atan2(x, -z)`` and ``pi v = acos(y)``. Between four
texels it is interpolated bilinearly.
"""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic import vectors
from fotismos.heuristic.convention import Colour, Doubles, Floats, Interaction, Scene, Vector
from fotismos.heuristic.errors import InputError

ROWS = 512
"""Rows of a map made of another emitter than ``envmap``; it has twice as many columns."""

UNIT = 1e-6
"""How far rounding may take the squared length of a unit vector from 1."""


def environment(scene: Scene, direction: Vector, sun: bool = True) -> Colour:
    """Return the radiance of a scene's background, for the ``prepare`` of a heuristic.

    ``direction`` is a Dr.Jit vector of any length in world space, away from the scene. ``sun``
    says whether it includes the sun of ``sunsky``, which is also one of the lights. InputError in
    spectral variants, whose colours depend on the wavelengths of a ray.
    """
    if mi.is_spectral:
        raise InputError(
            f"the environment has no colour in {mi.variant()}: a preparation reads it in RGB only."
            " Give `heuristic_variant=llvm_ad_rgb`."
        )
    emitter = scene.environment()
    if emitter is None:
        ambient = getattr(scene.integrator(), "ambient", None)
        return mi.Spectrum(ambient.eval(dr.zeros(mi.SurfaceInteraction3f)) if ambient else 0)
    if sun:
        return radiance(emitter, direction)
    with without_sun(scene):
        sky = radiance(emitter, direction)
        dr.eval(sky)  # before the sun is back
    return sky


@contextmanager
def without_sun(scene: Scene) -> Iterator[None]:
    """Switch off the sun of a scene's ``sunsky``, which is one of the lights, for the block."""
    emitter = scene.environment()
    parameters = {} if emitter is None else mi.traverse(emitter)
    if "sun_scale" not in parameters:
        yield
        return
    scale = parameters["sun_scale"]
    parameters["sun_scale"] = 0.0
    parameters.update()
    try:
        yield
    finally:
        parameters["sun_scale"] = scale
        parameters.update()


def radiance(emitter: Any, direction: Vector, at: Interaction | None = None) -> Colour:
    """Return an environment emitter's radiance at the time and wavelengths of an interaction."""
    there = dr.zeros(mi.SurfaceInteraction3f)
    if at is not None:
        there.time = at.time
        there.wavelengths = at.wavelengths
    vector = mi.Vector3f(direction)
    # A unit vector stays as it is: Mitsuba's angles lose half of the digits near the poles.
    is_unit = dr.abs(dr.squared_norm(vector) - 1) < UNIT
    there.wi = -dr.select(is_unit, vector, vectors.normalise(vector))
    return emitter.eval(there)


@dataclass(frozen=True)
class EnvironmentMap:
    """The background as ``texels`` (H, W, 3), and the rotation (3, 3) into its own frame."""

    texels: Floats
    to_local: Doubles


def environment_map(scene: Scene) -> EnvironmentMap:
    """Return the background as a map: an ``envmap``'s own, or another emitter read at texels."""
    emitter = scene.environment()
    if emitter is None:
        level = np.array(environment(scene, mi.Vector3f(0)), np.float32).reshape(1, 1, 3)
        return EnvironmentMap(np.repeat(level, 2, axis=0), np.eye(3))
    parameters = mi.traverse(emitter)
    if "data" in parameters:
        # Its first and last columns repeat the last and the first.
        texels = np.array(parameters["data"])[:, 1:-1, :3] * float(np.ravel(parameters["scale"])[0])
        to_world = np.array(parameters["to_world"].matrix, float).reshape(4, 4, -1)[:3, :3, 0]
        return EnvironmentMap(texels, np.linalg.inv(to_world))
    toward = directions(ROWS, 2 * ROWS)
    texels = radiance(emitter, mi.Vector3f(*toward.reshape(-1, 3).T.astype(np.float32)))
    shown = np.array(texels, np.float32).reshape(3, -1).T + np.zeros((toward.size // 3, 1))
    return EnvironmentMap(shown.reshape(toward.shape), np.eye(3))


def directions(rows: int, columns: int) -> Doubles:
    """Return the unit vectors (rows, columns, 3) of a map's texels, in its frame."""
    azimuth = 2 * np.pi * (np.arange(columns) + 0.5) / columns
    polar = np.pi * np.arange(rows)[:, None] / (rows - 1)
    x = np.sin(polar) * np.sin(azimuth)
    z = -np.sin(polar) * np.cos(azimuth)
    return np.stack([x, np.broadcast_to(np.cos(polar), x.shape), z], axis=-1)
