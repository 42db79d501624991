"""Which way normals point, against those that Mitsuba's rays find, on shapes made at random."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.reference.planning.facts import Form, geometry
from tests.shared.parts import mesh_of, moved

pytestmark = pytest.mark.usefixtures("rgb")


def random_transform(rng, shear=False):
    """A turn, a mirror or none, an even or an uneven scale, and a turn before that."""
    scale = rng.uniform(0.3, 3, 3) if shear else np.full(3, rng.uniform(0.3, 3))
    made = moved(vector(rng.normal(size=3))).rotate(axis(rng), 77.0)
    made = made.scale(vector(scale * rng.choice([-1, 1], 3)))
    return made.rotate(axis(rng), float(rng.uniform(0, 90)))


def vector(values):
    return list(map(float, values))


def axis(rng):
    direction = rng.normal(size=3)
    return vector(direction / np.linalg.norm(direction))


def met(shape, point, normal):
    """Return the geometric and the shading normal where a ray against a normal meets a shape."""
    ray = mi.Ray3f(mi.Point3f(*map(float, point + normal)), mi.Vector3f(*map(float, -normal)))
    si = shape.ray_intersect(ray)
    assert bool(si.is_valid()[0])
    return np.array([np.ravel(si.n), np.ravel(si.sh_frame.n)])


@pytest.mark.parametrize("shear", [False, True])
@pytest.mark.parametrize("kind", ["rectangle", "disk"])
def test_flat_shapes_look_where_mitsuba_says(kind, shear):
    rng = np.random.default_rng(0)
    given = [
        {"type": kind, "to_world": random_transform(rng, shear), "flip_normals": bool(flip)}
        for flip in rng.integers(2, size=40)
    ]
    shapes = [mi.load_dict(one) for one in given]
    flat = 0
    for shape in shapes:
        found = geometry(shape)
        if found.form is Form.FLAT:
            flat += 1
            assert met(shape, *found.plane) @ found.plane[1] == pytest.approx(1, abs=1e-6)
    # Mitsuba shades mirrored rectangles as if seen from behind, and sheared disks askew.
    expected = {("disk", True): [0], ("disk", False): [40]}
    assert flat in expected.get((kind, shear), range(10, 40))


def test_spheres_look_where_mitsuba_says():
    rng, seen = np.random.default_rng(1), set()
    for flip in rng.integers(2, size=16):
        to_world = random_transform(rng)
        given = {"type": "sphere", "to_world": to_world, "flip_normals": bool(flip)}
        shape = mi.load_dict(given)
        found = geometry(shape)
        box = shape.bbox()
        centre = np.ravel(box.min + box.max) / 2
        up = np.array([0.0, 0, 1])
        radius = float(np.ravel(box.extents())[2]) / 2
        sides = met(shape, centre + radius * up, up) @ up
        assert found.form is Form.CLOSED
        assert (sides > 0).all() if found.is_outward else (sides < 0).all()
        seen.add((bool(flip), found.is_outward))
    assert len(seen) == 4  # mirrored ones among both


def random_mesh(rng, name, smooth, face_normals, flip):
    """A tetrahedron, from outside or inside, with normals of its own or of its faces."""
    corners = rng.normal(size=(4, 3))
    faces = np.array([[0, 1, 2], [0, 2, 3], [0, 3, 1], [1, 3, 2]])
    points, faces = corners[faces].reshape(-1, 3), np.arange(12).reshape(4, 3)
    normals = None
    if smooth is not None:
        normal = np.cross(points[1::3] - points[::3], points[2::3] - points[::3])
        normal /= np.linalg.norm(normal, axis=1)[:, None]
        normals = np.repeat(normal, 3, axis=0) + smooth * rng.normal(size=(12, 3))
    return mesh_of(points, normals, faces, name, flip_normals=flip, face_normals=face_normals)


def rendered(mesh):
    """Return the normals of a mesh's faces and their centres' shading normals, as rendered."""
    found = dr.zeros(mi.PreliminaryIntersection3f, 4)
    found.t, found.shape = dr.full(mi.Float, 1.0, 4), mi.ShapePtr(mesh)
    found.prim_index, found.prim_uv = dr.arange(mi.UInt32, 4), mi.Point2f(0.5, 0.3)
    ray = dr.zeros(mi.Ray3f, 4)
    ray.d = mi.Vector3f(0, 0, 1)
    si = mesh.compute_surface_interaction(ray, found)
    return np.array(si.n).T, np.array(si.sh_frame.n).T


@pytest.mark.parametrize("flip", [False, True])
@pytest.mark.parametrize("face_normals", [False, True])
@pytest.mark.parametrize("smooth", [None, 0.0, 0.3])
def test_meshes_look_where_mitsuba_says(smooth, face_normals, flip):
    rng = np.random.default_rng(2)
    meshes = [random_mesh(rng, f"mesh {i}", smooth, face_normals, flip) for i in range(12)]
    for mesh in meshes:
        found = geometry(mesh)
        geometric, shading = rendered(mesh)
        if not np.allclose(geometric, shading, atol=1e-3):
            assert smooth
            assert found.form is Form.OTHER
            continue
        assert found.form is Form.CONVEX
        centre = np.array(mesh.vertex_positions_buffer()).reshape(-1, 3).mean(axis=0)
        corners = np.array(mesh.vertex_positions_buffer()).reshape(4, 3, 3)[:, 0]
        outwards = np.einsum("fi,fi->f", geometric, corners - centre) > 0
        assert outwards.all() if found.is_outward else not outwards.any()
