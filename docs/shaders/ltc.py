"""Rectangular lamps by linearly transformed cosines.

After Heitz, Dupuy, Hill and Neubelt, "Real-time polygonal-light shading with linearly transformed
cosines" (2016). A matrix M turns the lobe of a cosine into one that is nearly GGX's; the light of a
polygon through the lobe is that through the cosine of the polygon turned by the inverse of M, which
is a sum over its edges. The matrices are fitted here.
"""

from functools import cache

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr
import mitsuba as mi
import numpy as np
import split_sum
from cook_torrance import lit, reflectance
from scipy.optimize import least_squares

SIZE = 16
"""Matrices by roughness, the root of alpha, and by the root of 1 - N.V."""


def prepare(scene):
    """Return the tables of the inverse matrices and of the BRDF; they depend on no scene."""
    matrices, amounts = (mi.TensorXf(one) for one in (fitted(), split_sum.brdf()))
    clamp = {"wrap_mode": dr.WrapMode.Clamp}
    return mi.Texture2f(matrices, **clamp), mi.Texture2f(amounts, **clamp)


def shade(point):
    """Lamps that are rectangles; other lights as in `cook_torrance`, and ambient light."""
    matrices, amounts = point.prepared
    material, normal, view = point.material, point.normal, point.view
    facing = dr.clip(dr.dot(normal, view), 0, 1)
    mirrored = 2 * facing * normal - view
    across = dr.normalize(dr.cross(normal, view) + 1e-6 * mi.Frame3f(normal).t)
    about_normal = mi.Frame3f(dr.cross(across, normal), across, normal)
    about_mirrored = mi.Frame3f(dr.cross(across, mirrored), across, mirrored)
    roughness = dr.sqrt(material.alpha)
    a, b, d, e = matrices.eval(split_sum.place(dr.sqrt(1 - facing), roughness, SIZE))
    scale, bias = amounts.eval(split_sum.place(facing, roughness, split_sum.SIZE))
    lobe = reflectance(material) * scale + bias
    base = (1 - lobe) * (1 - material.metallic) * material.base_color
    value = point.ambient * material.base_color
    for light in point.lights:
        middle = light.toward * light.distance
        u, v = light.extent.u, light.extent.v
        corners = [middle - u - v, middle + u - v, middle + u + v, middle - u + v]
        plain = [about_normal.to_local(corner) for corner in corners]
        turned = [
            mi.Vector3f(a * p.x + b * p.z, p.y, material.alpha * (d * p.x + e * p.z))
            for p in map(about_mirrored.to_local, corners)
        ]
        # I = L A cos / (pi d^2), where A cos = 4 (u x v).L
        area = 4 * dr.cross(u, v)
        seen = dr.maximum(dr.abs(dr.dot(area, light.toward)), 1e-9)
        radiance = light.intensity * dr.pi * dr.square(light.distance) / seen
        shining = radiance * (base * polygon(plain) + lobe * polygon(turned))
        value += dr.select(dr.squared_norm(area) > 0, shining, lit(point, light))
    return value


def polygon(corners):
    """Return the share of the cosine's light, from above z = 0, that comes from a convex polygon.

    Lambert's sum over its edges, as seen from the origin: the angle times z of the edge's normal.
    The edges end at the horizon, and one along the horizon joins their ends.
    """
    total = 0
    leaves = enters = mi.Vector3f(0)
    for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
        cut = dr.select(p.z == q.z, 0, p.z / (p.z - q.z))
        middle = p + cut * (q - p)
        middle.z = 0
        total += dr.select(
            (p.z > 0) | (q.z > 0),
            _edge(dr.select(p.z > 0, p, middle), dr.select(q.z > 0, q, middle)),
            0,
        )
        leaves = dr.select((p.z > 0) & (q.z <= 0), middle, leaves)
        enters = dr.select((p.z <= 0) & (q.z > 0), middle, enters)
    return dr.abs(total + _edge(leaves, enters)) / (2 * dr.pi)


def _edge(p, q):
    normal = dr.cross(p, q)
    length = dr.norm(normal)
    return dr.select(length > 0, dr.atan2(length, dr.dot(p, q)) * normal.z / length, 0)


@cache
def fitted():
    """Return a, b, d and e of the inverse matrices ((a, 0, b), (0, 1, 0), (alpha d, 0, alpha e)).

    By roughness and view, (SIZE, SIZE, 4), about the mirrored ray: there they differ least.
    """
    steps = np.linspace(0, 1, SIZE)
    table = np.empty((SIZE, SIZE, 4), np.float32)
    for row, roughness in enumerate(steps):
        for column, root in enumerate(steps):
            alpha, facing = max(roughness, 0.05) ** 2, max(1 - root**2, 0.02)
            narrow = np.array([facing, 0, 0, 2 * facing])  # of a surface that is nearly a mirror
            table[row, column] = least_squares(_misfit, narrow, args=_lobe(alpha, facing)).x
    return table


def _lobe(alpha, facing):
    """Return directions drawn from GGX, their density, and GGX's lobe with an integral of 1."""
    half = split_sum.facets(alpha)
    side = np.sqrt(1 - facing**2)
    view = np.array([[side], [0], [facing]])
    turned = np.sum(half * view, axis=0)
    toward = 2 * turned * half - view
    density = (
        (alpha / (1 + (alpha**2 - 1) * half[2] ** 2)) ** 2 * half[2] / (4 * np.pi * abs(turned))
    )
    root = np.sqrt(alpha**2 + (1 - alpha**2) * toward[2] ** 2)
    share = np.where((toward[2] > 0) & (turned > 0), toward[2] / (toward[2] + root), 0)
    share *= turned / half[2]  # the lobe over the density, up to a factor
    about = np.array([[facing, 0, side], [0, 1, 0], [-side, 0, facing]])  # the mirrored ray
    return alpha, about @ toward, density, share / share.mean()


def _misfit(numbers, alpha, toward, density, share):
    """Return the difference of both lobes, whose mean square is that over all directions."""
    a, b, d, e = numbers * (1, 1, alpha, alpha)
    x, y, z = a * toward[0] + b * toward[2], toward[1], d * toward[0] + e * toward[2]
    cosine = np.maximum(z, 0) / np.pi * (a * e - b * d) / (x * x + y * y + z * z) ** 2
    return (cosine - share * density) / np.sqrt(density)
