"""Normals of surfaces (6.16-6.25) and of mesh vertices (6.32-6.34), against closed forms."""

import drjit as dr
import drjit.llvm
import drjit.llvm.ad
import drjit.scalar
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fotismos.heuristic import normals
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.normals import WEIGHTINGS, corner_angles, vertex_normals
from tests.shared.checks import rows

SINGLE, DOUBLE = drjit.llvm.ad.Array3f, drjit.llvm.ad.Array3f64
EVERY_TYPE = pytest.mark.parametrize(
    "vector_type", [SINGLE, DOUBLE, drjit.llvm.Array3f, drjit.llvm.Array3f64], ids=str
)
EVERY_WEIGHTING = pytest.mark.parametrize("weighting", WEIGHTINGS)
Array3u = drjit.llvm.ad.Array3u


def rounding(vector_type):
    return 2 * dr.epsilon(vector_type)


def require_units(found, expected, tolerance):
    np.testing.assert_allclose(rows(found), np.atleast_2d(expected), rtol=0, atol=tolerance)


@EVERY_TYPE
def test_a_plane_has_its_coefficients_as_normal(vector_type):
    number = dr.value_t(vector_type)
    require_units(
        normals.plane_normal(number(2), number(-3), number(6)),
        (2 / 7, -3 / 7, 6 / 7),
        rounding(vector_type),
    )


whole = st.integers(-1000, 1000)
vectors = st.tuples(whole, whole, whole)


@settings(max_examples=50, deadline=None)
@given(point=vectors, direction=vectors, s=st.integers(-1000, 1000), t=st.integers(-1000, 1000))
def test_collinear_vertices_have_no_normal(point, direction, s, t):
    """Whole numbers are exact in both precisions, so that the points are truly on a line."""
    for vector_type in (SINGLE, DOUBLE):
        p = vector_type(*point)
        found = normals.triangle_normal(
            p, p + s * vector_type(*direction), p + t * vector_type(*direction)
        )
        require_units(found, (0, 0, 0), 0)


@pytest.mark.parametrize(
    "order", [(0, 1, 2), (1, 2, 0), (2, 0, 1), (0, 2, 1), (2, 1, 0), (1, 0, 2)]
)
def test_a_needle_has_the_normal_of_its_points(order):
    """Sides near 1, base 1e-4, away from the axes: two long sides would lose four digits."""
    points = np.array([[0.3, 0.1, 0.2], [0.9, 0.7, 0.5], [0.9, 0.70006, 0.49992]], np.float32)
    exact = points.astype(float)
    a, b, c = exact[list(order)]
    product = np.cross(b - a, c - a)
    found = normals.triangle_normal(*(SINGLE(*points[i].tolist()) for i in order))
    require_units(found, product / np.linalg.norm(product), 4 * rounding(SINGLE))


AXES = [(1, 1, 1), (3, 2, 1), (1000, 1, 1), (1, 1, 1000), (1, 1000, 0.03), (1e-3, 1, 0.5)]


def longitude_latitude(vector_type, seed=1):
    """Random places on an ellipsoid, the equator, meridians and the near of a pole among them."""
    rng = np.random.default_rng(seed)
    u = np.concatenate([rng.uniform(-np.pi, np.pi, 500), [0, np.pi / 2, 1, 1, 1]])
    v = np.concatenate([rng.uniform(-1.55, 1.55, 500), [0, 0, 0, 1.5707, -1.5707]])
    number = dr.value_t(vector_type)
    return number(u), number(v)


@EVERY_TYPE
@pytest.mark.parametrize("axes", AXES)
def test_both_ways_to_an_ellipsoids_normal_agree_and_point_outwards(vector_type, axes):
    u, v = longitude_latitude(vector_type)
    point = normals.ellipsoid_point(u, v, *axes)
    implicit = normals.implicit_normal(normals.ellipsoid_gradient(point, *axes))
    parametric = normals.parametric_normal(*normals.ellipsoid_tangents(u, v, *axes))
    require_units(implicit, rows(parametric), 8 * rounding(vector_type))
    assert dr.all(dr.dot(implicit, point) > 0)
    np.testing.assert_allclose(dr.norm(implicit), 1, atol=2 * rounding(vector_type))


def test_gradient_and_tangents_are_the_derivatives():
    """Dr.Jit differentiates 6.21 and 6.24; the closed forms must say the same."""
    axes = (3.0, 2.0, 0.5)
    u, v = longitude_latitude(DOUBLE)
    point = dr.detach(normals.ellipsoid_point(u, v, *axes))
    dr.enable_grad(point)
    dr.backward(normals.ellipsoid(point, *axes))
    gradient = normals.ellipsoid_gradient(dr.detach(point), *axes)
    np.testing.assert_allclose(rows(dr.grad(point)), rows(gradient), atol=1e-13)
    for number, tangent in enumerate(normals.ellipsoid_tangents(u, v, *axes)):
        place = [drjit.llvm.ad.Float64(u), drjit.llvm.ad.Float64(v)]
        dr.enable_grad(place[number])
        moved = normals.ellipsoid_point(*place, *axes)
        dr.forward(place[number])
        np.testing.assert_allclose(rows(dr.grad(moved)), rows(tangent), atol=1e-13)


@EVERY_TYPE
def test_what_has_no_direction_has_the_zero_normal(vector_type):
    zero = vector_type(0)
    require_units(normals.implicit_normal(zero), (0, 0, 0), 0)
    require_units(normals.plane_normal(zero.x, zero.y, zero.z), (0, 0, 0), 0)
    require_units(normals.parametric_normal(zero, vector_type(1, 2, 3)), (0, 0, 0), 0)
    parallel = normals.parametric_normal(vector_type(0.1, 0.2, 0.3), vector_type(0.3, 0.6, 0.9))
    require_units(parallel, (0, 0, 0), 0)


@EVERY_WEIGHTING
def test_faces_without_area_count_nothing(weighting):
    points = SINGLE([0, 1, 0, 2, 0.5], [0, 0, 1, 0, 0], [0, 0, 0, 0, 0])
    faces = Array3u([0, 0, 0, 1], [1, 1, 0, 1], [2, 3, 0, 1])  # a face, a line, and two points
    found = vertex_normals(points, faces, weighting)
    require_units(found, [(0, 0, 1)] * 3 + [(0, 0, 0)] * 2, 0)


@EVERY_TYPE
@EVERY_WEIGHTING
@pytest.mark.parametrize("thickness", [1.0, 1e-3, 1e-5])
def test_opposing_faces_leave_no_normal(vector_type, weighting, thickness):
    """Both sides of a sheet, the back beginning with another vertex, down to a thin sliver."""
    rng = np.random.default_rng(3)
    corners = rng.normal(size=(3, 3))
    corners[2] = corners[0] + 0.4 * (corners[1] - corners[0]) + thickness * corners[2]
    found = vertex_normals(vector_type(corners.T), Array3u([0, 1], [1, 0], [2, 2]), weighting)
    require_units(found, np.zeros((3, 3)), 0)


def test_angles_of_slivers_keep_their_digits():
    """Base 1, height h: the small angles are atan(2h), which acos would round to zero or 5e-4."""
    for height in (1e-1, 1e-4, 1e-6):
        h = np.float32(height).item()
        first, second, third = corner_angles(SINGLE(0), SINGLE(1, 0, 0), SINGLE(0.5, h, 0))
        assert float(first[0]) == pytest.approx(np.arctan(2 * h), rel=1e-6)
        assert float(second[0]) == pytest.approx(np.arctan(2 * h), rel=1e-6)
        assert float(third[0]) == pytest.approx(np.pi - 2 * np.arctan(2 * h), rel=1e-6)


def test_a_weighting_that_does_not_exist_is_refused():
    points = SINGLE([0, 1, 0], [0, 0, 1], [0, 0, 0])
    with pytest.raises(InputError, match="choose one of mean, area, angle"):
        vertex_normals(points, Array3u(0, 1, 2), "volume")
    none = vertex_normals(points, dr.zeros(Array3u, 0))
    require_units(none, [(0,) * 3] * 3, 0)
