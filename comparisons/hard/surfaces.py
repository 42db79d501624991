"""The hard cases of surfaces, triangles and their normals, and sums of many lights."""

import drjit as dr
import numpy as np
from drjit.llvm import Array3f, Array3u
from numpy.typing import ArrayLike, NDArray

import heuristic
from comparisons.hard import textbook
from comparisons.hard.cases import HardCase, quietly
from heuristic import interpolation, normals, vertex_normals

LIGHTS = 10_000


def _single(values: ArrayLike) -> NDArray[np.float32]:
    return np.asarray(values, np.float32)


def _lights():
    """Return the intensities and positions of one light of 1e6 and many of 1e-2 around it."""
    rng = np.random.default_rng(3)
    position = rng.normal(size=(LIGHTS, 3)).astype(np.float32) + _single([0, 0, 8])
    intensity = np.full(LIGHTS, 0.01, np.float32)
    intensity[0] = 1e6
    return intensity, position


def _sum_of_lights(dtype):
    intensity, position = (array.astype(dtype) for array in _lights())
    length = np.sqrt((position * position).sum(axis=1))
    terms = intensity * np.maximum(position[:, 2] / length, 0)
    # One after the other, as a loop over the lights adds them.
    return np.cumsum(terms, dtype=dtype)[-1:]


def _kernel_sum():
    intensity, position = _lights()
    lights = [
        heuristic.PointLight(tuple(map(float, place)), float(value))
        for value, place in zip(intensity, position, strict=True)
    ]
    up = Array3f(0, 0, 1)
    return np.array(heuristic.shade(Array3f(0), up, up, heuristic.Material(k_d=1), lights))


def _triangle(name, hard, corners, bound=1e-5, exact=None):
    corners = _single(corners)

    def ours():
        return np.array(
            normals.triangle_normal(*(Array3f(*map(float, corner)) for corner in corners))
        )[:, 0]

    return HardCase(
        name, "geometry", hard, bound,
        lambda: textbook.triangle_normal(*corners, textbook.NAIVE),
        ours,
        exact or (lambda: textbook.triangle_normal(*corners, textbook.EXACT)),
    )  # fmt: skip


_AXES = _single([1e3, 1.0, 1e-3])
_ON_ELLIPSOID = _single([600.0, 0.48, 0.64e-3])
_ELLIPSOID_SCALE = np.float32(1e-20)


def _ellipsoid_normal(dtype):
    axes = (_AXES * _ELLIPSOID_SCALE).astype(dtype)
    gradient = 2 * (_ON_ELLIPSOID * _ELLIPSOID_SCALE).astype(dtype) / axes**2
    return gradient / np.sqrt((gradient**2).sum())


def _our_ellipsoid_normal():
    axes = map(float, _AXES * _ELLIPSOID_SCALE)
    gradient = normals.ellipsoid_gradient(
        Array3f(*map(float, _ON_ELLIPSOID * _ELLIPSOID_SCALE)), *axes
    )
    return np.array(normals.implicit_normal(gradient))[:, 0]


# Two sides of a sheet: each face is there twice, once turned over.
_SHEET = _single([[0.1, 0.2, 0.3], [1.3, 0.1, 0.9], [0.2, 1.7, 0.4]])


def _naive_vertex_normals():
    front = textbook.triangle_normal(*_SHEET, textbook.NAIVE)
    back = textbook.triangle_normal(*_SHEET[[1, 0, 2]], textbook.NAIVE)
    total = front + back
    with np.errstate(all="ignore"):
        return total / np.sqrt((total * total).sum())


def _our_vertex_normals():
    faces = Array3u([0, 1], [1, 0], [2, 2])
    return np.array(vertex_normals.mean_normals(Array3f(_SHEET.T.copy()), faces))[:, 0]


def _naive_scan_line():
    middle = _single([0.6, 0.0, 0.8]) * _single(0.5) + _single([-0.6, 0, -0.8]) * 0.5
    with np.errstate(all="ignore"):
        return middle / np.sqrt((middle * middle).sum())


def _our_scan_line():
    a = Array3f(0.6, 0, 0.8)
    return np.array(interpolation.scan_line_normal(a, -a, 0, 1, dr.opaque(type(a.x), 0.5)))[:, 0]


_HUGE = _single([[0.1, 0.2, 0.3], [1.3, 0.1, 0.9], [0.2, 1.7, 0.4], [0.5, 0.6, 0.5]]) * _single(
    1e15
)
"""Three corners, and a point above the triangle."""


def _weights(dtype):
    p0, p1, p2, point = _HUGE.astype(dtype)
    product = np.cross(p1 - p0, p2 - p0)
    b1 = (np.cross(point - p0, p2 - p0) * product).sum() / (product * product).sum()
    b2 = (np.cross(p1 - p0, point - p0) * product).sum() / (product * product).sum()
    return np.array([1 - b1 - b2, b1, b2])


def _our_weights():
    p0, p1, p2, point = (Array3f(*map(float, corner)) for corner in _HUGE)
    return np.array(interpolation.barycentric_coordinates(point, p0, p1, p2))[:, 0]


CASES = (
    HardCase(
        "10,000 lights of mixed magnitude", "lights",
        "One light of 1e6 swallows the last digits of 9,999 lights of 0.01, one by one.", 1e-6,
        lambda: _sum_of_lights(textbook.NAIVE), _kernel_sum,
        lambda: _sum_of_lights(textbook.EXACT),
    ),
    _triangle("a triangle of size 1e-30", "The cross product of its edges vanishes.",
              [(0, 0, 0), (1e-30, 0, 2e-30), (0, 3e-30, 1e-30)]),
    _triangle("a triangle of size 1e30", "The cross product of its edges is infinite.",
              [(0, 0, 0), (1e30, 0, 2e30), (0, 3e30, 1e30)]),
    _triangle("a triangle of size 1e-40", "Denormal edges; a side below the smallest normal float"
              " counts as none, and the triangle has no normal.",
              [(0, 0, 0), (1e-40, 0, 2e-40), (0, 3e-40, 1e-40)], exact=lambda: np.zeros(3)),
    _triangle("a needle of 1e-5 by 2", "Its long edges are nearly parallel.",
              [(0.137, 0.291, 0.353), (1.713, 1.931, 1.337), (1.71301, 1.93099, 1.33703)], 1e-4),
    HardCase(
        "an ellipsoid of aspect 1e6", "geometry",
        "Half axes of 1e-17, 1e-20 and 1e-23: their squares vanish, and with them the gradient.",
        1e-5, quietly(lambda: _ellipsoid_normal(textbook.NAIVE)), _our_ellipsoid_normal,
        lambda: _ellipsoid_normal(textbook.EXACT),
    ),
    HardCase(
        "vertices whose normals cancel", "shading",
        "The two sides of a sheet leave rounding noise, or 0 / 0, in place of a normal.", 1e-5,
        _naive_vertex_normals, _our_vertex_normals, lambda: np.zeros(3),
    ),
    HardCase(
        "a single huge triangle", "shading",
        "Barycentric weights divide by the fourth power of its size, 1e15.", 1e-5,
        quietly(lambda: _weights(textbook.NAIVE)), _our_weights,
        lambda: _weights(textbook.EXACT),
    ),
    HardCase(
        "an interpolated normal of length zero", "shading",
        "Half way between opposite normals: 0 / 0.", 1e-5,
        _naive_scan_line, _our_scan_line, lambda: np.zeros(3),
    ),
)  # fmt: skip
