"""Light of the environment by a split sum: a map that is blurred in advance, and a table.

After Karis, "Real shading in Unreal Engine 4" (2013). The lobe reflects the integral of L f (N.L).
It is split into a mean of L, seen as from above the surface, and the integral of f (N.L), which is
F0 A + B. What the lobe leaves reaches the base.
"""

from functools import cache

import fotismos  # isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr
import mitsuba as mi
import numpy as np
from cook_torrance import lit, reflectance

LEVELS = 5
"""Blurred maps, at roughness 1/5 to 1, which is the root of alpha; at 0 the map is sharp."""

SIZE = 64
"""Rows and columns of the table."""

SAMPLES = 512
SPREAD = (np.arange(SAMPLES) + 0.5) / SAMPLES
TURN = np.pi * (3 - np.sqrt(5)) * np.arange(SAMPLES)  # the golden angle fills a disc evenly


def prepare(scene):
    """Return the maps of the environment: sharp, blurred by GGX, and by the cosine; and the table.

    The sun is not among them, since it is one of the lights.
    """
    halves = [facets((level / LEVELS) ** 2) for level in range(1, LEVELS + 1)]
    blurred = [_mean(scene, 64, 2 * h[2] * h - [[0], [0], [1]]) for h in halves]
    sharp = _mean(scene, 512, np.array([[0.0], [0.0], [1.0]]))
    cosine = _mean(scene, 64, _directions(SPREAD, TURN))
    table = mi.Texture2f(mi.TensorXf(brdf()), wrap_mode=dr.WrapMode.Clamp)
    return _texture([sharp]), _texture(blurred), _texture([cosine]), table


def shade(point):
    """The environment by the split sum, and the lights as in `cook_torrance`."""
    sharp, blurred, cosine, table = point.prepared
    material, normal, view = point.material, point.normal, point.view
    facing = dr.clip(dr.dot(normal, view), 0, 1)
    mirrored = 2 * facing * normal - view
    roughness = dr.sqrt(material.alpha)
    level = roughness * LEVELS
    rough = _read(blurred, mirrored, level - 1)
    light = dr.lerp(_read(sharp, mirrored), rough, dr.minimum(level, 1))
    scale, bias = table.eval(place(facing, roughness, SIZE))
    lobe = reflectance(material) * scale + bias
    base = (1 - lobe) * (1 - material.metallic) * material.base_color
    value = light * lobe + _read(cosine, normal) * base
    return value + sum(lit(point, light) for light in point.lights)


def place(x, y, size):
    """Return where a table with texels at 0 to 1, both included, is read."""
    return mi.Point2f(x, y) * ((size - 1) / size) + 0.5 / size


@cache
def brdf():
    """Return A and B by roughness and N.V, (SIZE, SIZE, 2): means over facets drawn from GGX."""
    steps = np.maximum(np.linspace(0, 1, SIZE), 0.01)
    facing = steps[:, None]
    rows = []
    for alpha in steps**2:
        half = facets(alpha)
        turned = np.maximum(facing * half[2] + np.sqrt(1 - facing**2) * half[0], 0)  # V.H
        cosine = 2 * turned * half[2] - facing  # N.L
        # Smith's masking, to which Karis has Schlick's approximation.
        masked = 4 * facing * np.maximum(cosine, 0)
        for c in (facing, cosine):
            masked = masked / (np.abs(c) + np.sqrt(alpha**2 + (1 - alpha**2) * c * c))
        weight = masked * turned / (half[2] * facing)
        grazing = (1 - turned) ** 5
        rows.append([np.mean(weight * part, axis=1) for part in (1 - grazing, grazing)])
    return np.moveaxis(np.array(rows, np.float32), 1, 2)


def facets(alpha):
    """Return the normals (3, SAMPLES) of facets about z, as dense as GGX has them."""
    return _directions(np.sqrt((1 - SPREAD) / (1 + (alpha**2 - 1) * SPREAD)), TURN)


def _directions(z, turn):
    side = np.sqrt(1 - z * z)
    return np.array([side * np.cos(turn), side * np.sin(turn), z])


def _mean(scene, rows, lobe):
    """Return the mean light (rows, 2 rows, 3) about all directions over a lobe, weighted by z."""
    polar, turn = np.meshgrid(np.arange(rows), np.arange(2 * rows), indexing="ij")
    toward = _directions(np.cos(np.pi * (polar + 0.5) / rows), np.pi * (turn + 0.5) / rows)
    samples = lobe.shape[1]
    number = dr.arange(mi.UInt32, polar.size * samples)
    about = dr.gather(mi.Vector3f, mi.Vector3f(toward.reshape(3, -1)), number // samples)
    local = dr.gather(mi.Vector3f, mi.Vector3f(lobe), number % samples)
    world = mi.Frame3f(about).to_world(local)
    light = dr.maximum(local.z, 0) * fotismos.environment(scene, world, sun=False)
    total = [dr.block_sum(channel, samples) for channel in light]
    return np.stack(total, axis=-1).reshape(*polar.shape, 3) / np.maximum(lobe[2], 0).sum()


def _texture(maps):
    """Return maps as one texture, each with its first column again at the end, and vice versa."""
    padded = np.pad(maps, ((0, 0), (0, 0), (1, 1), (0, 0)), mode="wrap")
    return mi.Texture3f(mi.TensorXf(padded.astype(np.float32)), wrap_mode=dr.WrapMode.Clamp)


def _read(texture, toward, level=0):
    """Return the light about a direction, between maps."""
    levels, _, width, _ = texture.shape
    turn = dr.atan2(toward.y, toward.x) / (2 * dr.pi)
    column = (dr.select(turn < 0, turn + 1, turn) * (width - 2) + 1) / width
    row = dr.acos(dr.clip(toward.z, -1, 1)) / dr.pi
    return mi.Color3f(texture.eval(mi.Point3f(column, row, (level + 0.5) / levels)))
