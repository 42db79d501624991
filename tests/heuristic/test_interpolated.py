"""Flat, Gouraud and Phong shading: 6.35-6.38, their convergence, and Mitsuba's mesh attributes."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.heuristic import DirectionalLight, Material, PointLight, meshes, shade, tessellation
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.normals import WEIGHTINGS
from fotismos.heuristic.plugins.interpolated import (
    Interpolation,
    shade_mesh,
    shading_points,
    stored_shade,
)
from fotismos.reference import Source
from fotismos.reference.pairing.halves import PairOptions, pair
from fotismos.reference.scene.source import collect_messages
from tests.shared import oracle
from tests.shared.checks import rows
from tests.shared.parts import camera, mesh_of, moved

FLAT, GOURAUD, PHONG = Interpolation.FLAT, Interpolation.GOURAUD, Interpolation.PHONG

INNER = np.random.default_rng(5).dirichlet((1, 1, 1), 20)
"""Where in every triangle the ways of shading are compared."""


# --- In Mitsuba -----------------------------------------------------------------------------------


def looking_down(xy, height=5.0):
    xy = np.asarray(xy, np.float32)
    return mi.Ray3f(mi.Point3f(*xy.T, height), mi.Vector3f(0, 0, -1))


def hits(mesh, ray):
    si = mi.load_dict({"type": "scene", "mesh": mesh}, optimize=False).ray_intersect(ray)
    assert dr.all(si.is_valid())
    return si


CORNERS = np.array([(0, 0, 0), (4, 0, 0), (0, 4, 1.0)])
TILTED = np.array([(0.6, 0, 0.8), (0, -0.6, 0.8), (0, 0, 1.0)])
COLOURED = Material(k_a=0.1, k_d=(0.5, 0.3, 0.2), k_s=0.4, n=4)
LIGHTS = [PointLight((1, 2, 6), (1, 0.5, 0.25)), DirectionalLight((0, 1, -2), 0.5)]


def by_oracle(position, normal, viewer):
    """COLOURED under LIGHTS, by the NumPy oracle."""
    material = oracle.Material(k_a=0.1, k_d=(0.5, 0.3, 0.2), k_s=0.4, n=4)
    lights = [
        oracle.Light("point", (1, 0.5, 0.25), position=(1, 2, 6)),
        oracle.Light("directional", 0.5, direction=(0, 1, -2)),
    ]
    return oracle.shade(position, normal, np.array(viewer) - position, material, lights, 1.0)


def test_gouraud_is_stored_at_vertices_and_interpolated(rgb):
    mesh = mesh_of(CORNERS, TILTED)
    shade_mesh(mesh, GOURAUD, (1, 1, 9), COLOURED, LIGHTS, 1.0)
    at_vertices = by_oracle(CORNERS, TILTED, (1, 1, 9))
    stored = np.array(mesh.attribute_buffer("vertex_heuristic")).reshape(-1, 3)
    np.testing.assert_allclose(stored, at_vertices, rtol=1e-5)
    si = hits(mesh, looking_down((INNER @ CORNERS)[:, :2]))
    found = rows(mi.Color3f(stored_shade(si, GOURAUD)))
    np.testing.assert_allclose(found, INNER @ at_vertices, rtol=1e-5, atol=1e-6)


def test_a_highlight_inside_a_triangle_is_lost_by_gouraud_and_kept_by_phong(rgb):
    """Figure 6.14: light and viewer stand over the middle, and no vertex sees the highlight."""
    angles = 2 * np.pi * np.arange(3) / 3
    corners = np.stack([2 * np.cos(angles), 2 * np.sin(angles), 0 * angles], 1)
    mesh = mesh_of(corners, [(0, 0, 1)] * 3)
    above = (0, 0, 2.0)
    material, lights = Material(k_s=0.9, n=50), [PointLight(above, 1.0)]
    si = hits(mesh, looking_down(np.zeros((1, 2))))
    kept = shade(
        mi.Vector3f(si.p), mi.Vector3f(si.sh_frame.n), mi.Vector3f(above), material, lights
    )
    for interpolation, at_most in {GOURAUD: 1e-6, FLAT: 0.9}.items():
        shade_mesh(mesh, interpolation, above, material, lights)
        value = float(stored_shade(si, interpolation).x[0])
        assert value <= at_most * (1 + 1e-6)
    assert float(kept[0]) == pytest.approx(0.9, rel=1e-5)


@pytest.mark.parametrize("interpolation", [FLAT, GOURAUD], ids=lambda i: i.value)
def test_large_meshes_are_stored_whole(rgb, interpolation):
    """Mitsuba reads past the end of a list that is too short, which large meshes bring to light."""
    mesh = tessellation.to_mesh(mi.load_dict({"type": "sphere"}), 256)
    shade_mesh(mesh, interpolation, (0, 0, 9), Material(k_d=1.0), LIGHTS[1:])
    name = "face_heuristic" if interpolation is FLAT else "vertex_heuristic"
    stored = dr.unravel(mi.Color3f, mesh.attribute_buffer(name))
    points = shading_points(mesh, interpolation)
    toward = dr.normalize(mi.Vector3f(0, -1, 2))
    expected = 0.5 * dr.maximum(dr.dot(points.n, toward), 0)
    assert float(dr.max(abs(stored.y - expected))[0]) < 1e-6


@pytest.mark.parametrize("plugin", ["sphere", "disk", "cylinder", "rectangle"])
@pytest.mark.parametrize("flipped", [False, True])
def test_shapes_become_meshes_that_look_like_them(rgb, plugin, flipped):
    placed = moved((1, 2, 3)).rotate((0.6, 0, 0.8), 40).scale(2)
    shape = mi.load_dict(
        {
            "type": plugin,
            "id": "it",
            "to_world": placed,
            "flip_normals": flipped,
            "bsdf": {"type": "phong"},
        }
    )
    mesh = tessellation.to_mesh(shape, 32)
    assert mesh.id() == "it"
    assert mesh.bsdf().class_name() == shape.bsdf().class_name()
    step = np.pi / 64
    area = {
        "rectangle": 1,
        "disk": np.sinc(1 / 64),
        "cylinder": np.sinc(1 / 128),
        "sphere": 1 - 5 / 24 * step**2,
    }
    assert float(mesh.surface_area()[0] / shape.surface_area()[0]) == pytest.approx(
        area[plugin], rel=1e-4
    )

    rng = np.random.default_rng(8)
    centre = np.array([[1], [2], [3]])
    origin = mi.Point3f(*(centre + rng.normal(size=(3, 4000)) * 9).astype(np.float32))
    aim = mi.Point3f(*(centre + rng.uniform(-1.2, 1.2, (3, 4000))).astype(np.float32))
    ray = mi.Ray3f(origin, dr.normalize(aim - origin))
    one, other = (
        mi.load_dict({"type": "scene", "it": it}, optimize=False).ray_intersect(ray)
        for it in (shape, mesh)
    )
    both = one.is_valid() & other.is_valid()
    assert float(dr.count(both)[0]) > 0.97 * float(dr.count(one.is_valid())[0]) > 300
    # Rays along the surface meet it far apart; those within 80 degrees of the normal do not.
    steep = both & (abs(dr.dot(one.n, ray.d)) > 0.17)
    assert float(dr.max(dr.select(steep, dr.norm(one.p - other.p), 0))[0]) < 8 * step**2
    gap = dr.norm(one.sh_frame.n - other.sh_frame.n)
    assert float(dr.max(dr.select(steep, gap, 0))[0]) < 4 * step**2
    assert dr.all(~steep | (dr.dot(other.n, other.sh_frame.n) > 0.99))
    seam = abs(one.uv - other.uv)
    seam = dr.minimum(seam, 1 - seam)
    middle = steep & (one.uv.x > 0.1) & (one.uv.x < 0.9) & (one.uv.y > 0.1) & (one.uv.y < 0.9)
    assert float(dr.max(dr.select(middle, dr.max(seam), 0))[0]) < 0.02


def test_what_cannot_be_made_into_triangles_is_refused(rgb):
    grid = mi.TensorXf(np.linspace(-1, 1, 8).reshape(2, 2, 2, 1))
    with pytest.raises(InputError, match=r"'blob'.*SDFGrid.*phong interpolation"):
        tessellation.to_mesh(mi.load_dict({"type": "sdfgrid", "id": "blob", "grid": grid}))
    sheared = mi.ScalarTransform4f().rotate((1, 2, 3), 40)  # an axis of another length than 1
    with collect_messages(said := []):
        shape = mi.load_dict({"type": "cylinder", "id": "tube", "to_world": sheared})
    assert "shearing" in " ".join(said)
    with pytest.raises(InputError, match=r"'tube'.*to_world"):
        tessellation.to_mesh(shape)
    for resolution in (0, -3, 1.5):
        with pytest.raises(InputError, match="whole number from 1 to 512"):
            tessellation.to_mesh(mi.load_dict({"type": "sphere"}), resolution)
    cube = mi.load_dict({"type": "cube"})
    assert tessellation.to_mesh(cube) is cube
    scene = mi.load_dict(two_balls(twosided=False))
    with pytest.raises(InputError, match=r"shape '(out|in)ward' is a Sphere: .* need triangle"):
        scene.integrator().render(scene, spp=1)


# --- Meshes without, or with several, vertex normals ----------------------------------------------

ROOF = np.array([(0, 0, 1), (0, 2, 1), (2, 0, 0), (-2, 0, 0.0)])
ROOF_FACES = [(0, 2, 1), (0, 1, 3)]


def test_a_mesh_without_vertex_normals_gets_those_of_6_34(rgb):
    mesh = mesh_of(ROOF, faces=ROOF_FACES)
    expected = np.array([(0, 0, 1)] * 2 + [(1, 0, 2) / np.sqrt(5), (-1, 0, 2) / np.sqrt(5)])
    np.testing.assert_allclose(rows(shading_points(mesh, GOURAUD).n), expected, atol=1e-6)
    for weighting in WEIGHTINGS:
        smooth = tessellation.with_vertex_normals(mesh, weighting)
        np.testing.assert_allclose(rows(tessellation.normals(smooth)), expected, atol=1e-6)
        assert smooth.has_vertex_normals()
    assert not mesh.has_vertex_normals()


def test_face_normals_need_faces_of_their_own_vertices(rgb):
    mesh = mesh_of(ROOF, faces=ROOF_FACES, face_normals=True)
    with pytest.raises(InputError, match="split_faces"):
        shading_points(mesh, GOURAUD)
    split = tessellation.split_faces(mesh)
    expected = np.repeat([(1, 0, 2), (-1, 0, 2)], 3, axis=0) / np.sqrt(5)
    np.testing.assert_allclose(rows(shading_points(split, GOURAUD).n), expected, atol=1e-6)
    assert split.vertex_count() == 6
    assert float(split.surface_area()[0]) == pytest.approx(float(mesh.surface_area()[0]))


def test_opposing_faces_are_refused(rgb):
    mesh = mesh_of(CORNERS, faces=[(0, 1, 2), (2, 1, 0)])
    with pytest.raises(InputError, match="'few': 3 vertices have no normal"):
        shading_points(mesh, GOURAUD)
    assert rows(shading_points(mesh, FLAT).n)[:, 2] == pytest.approx([0.9701425, -0.9701425])


def test_degenerate_faces_and_lone_vertices_stay_black_and_finite(rgb):
    points = [*CORNERS, (8, 0, 0), (9, 9, 9)]
    mesh = mesh_of(points, faces=[(0, 1, 2), (0, 1, 3), (1, 1, 1)])
    for interpolation, name in {FLAT: "face_heuristic", GOURAUD: "vertex_heuristic"}.items():
        shade_mesh(mesh, interpolation, (1, 1, 9), COLOURED, LIGHTS)
        stored = np.array(mesh.attribute_buffer(name)).reshape(-1, 3)
        assert np.isfinite(stored).all()
        assert stored[0].min() > 0
        assert not stored[-1].any()


# --- Through the plugins --------------------------------------------------------------------------


def two_balls(twosided):
    """Two coarse balls, of which the camera sees the outside of one and the back of the other."""
    phong = {"type": "phong", "k_d": 0.5, "k_s": 0.7, "n": 9.0, "twosided": twosided}
    balls = {
        name: mi.load_dict({"type": "sphere", "id": name, "center": (x, 0, 0), "bsdf": phong}
                           | {"flip_normals": x > 0})
        for name, x in {"outward": -1, "inward": 1}.items()
    }  # fmt: skip
    return {
        "type": "scene",
        "integrator": {"type": "heuristic", "interpolation": "flat"},
        "sensor": camera((1, -6, 2), size=16),
        "lamp": {"type": "heuristic_point", "position": (3, -5, 4), "k0": 0.0, "k2": 0.1}
        | {"intensity": {"type": "uniform", "value": 3.0}},
        **balls,
    }


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_mono"], indirect=True)
@pytest.mark.parametrize("twosided", [False, True])
def test_the_integrator_shades_each_face_at_its_centroid(variant, twosided):
    """Of the face's own normal, on the side that is seen; the corners are those of the mesh."""
    given = two_balls(twosided)
    names = ("outward", "inward")
    given |= {name: tessellation.to_mesh(given[name], 3) for name in names}
    scene = mi.load_dict(given, optimize=False)
    mi.render(scene, spp=1)  # stores the values
    x, z = np.random.default_rng(6).uniform(-2, 2, (2, 400))
    ray = mi.Ray3f(mi.Point3f(1, -6, 2), dr.normalize(mi.Vector3f(x - 1, 6, z - 2)))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, len(x))
    found, valid, _ = scene.integrator().sample(scene, sampler, mi.RayDifferential3f(ray))
    found = np.array(found & valid).T
    si = scene.ray_intersect(ray)
    material = oracle.Material(k_d=0.5, k_s=0.7, n=9)
    lamp = oracle.Light("point", 3.0, position=(3, -5, 4), attenuation=(0, 0, 0.1))
    for mesh, middle in ((given[name], x) for name, x in zip(names, (-1, 1), strict=True)):
        where = np.array(si.shape == mi.ShapePtr(mesh)) & np.array(si.is_valid())
        assert where.sum() > 50
        corners = rows(meshes.positions(mesh))[rows(meshes.faces(mesh)).astype(int)]
        points = corners[np.array(si.prim_index)[where]]
        centroid, (a, b, c) = points.mean(axis=1), points.transpose(1, 0, 2)
        normal = np.cross(b - a, c - a)
        normal *= np.sign(np.sum(normal * (centroid - (middle, 0, 0)), axis=1))[:, None]
        view = np.array((1, -6, 2)) - centroid
        expected = oracle.shade(centroid, normal, view, material, [lamp])
        assert np.ptp(expected) > 0.2
        if mesh is given["inward"] and not twosided:
            expected = 0 * expected
        np.testing.assert_allclose(found[where], expected + 0 * found[where], atol=1e-5)


def test_flat_and_gouraud_shading_are_refused_by_wavelength(spectral):
    with pytest.raises(RuntimeError, match="flat and Gouraud shading need RGB"):
        mi.load_dict(two_balls(twosided=False))


# --- A scene's shapes become meshes ---------------------------------------------------------------

TETRAHEDRON = np.array([(1, 1, 1), (-1, -1, 1), (-1, 1, -1), (1, -1, -1)], float)
SIDES = ((0, 1, 3), (0, 2, 1), (0, 3, 2), (1, 2, 3))


def seen(**shapes):
    """A scene of diffuse shapes under a parallel light."""
    sun = {"type": "directional", "direction": (-1, 2, -1)}
    sensor = camera((1, -6, 2), size=16)
    return Source("a test", {"type": "scene", "sensor": sensor, "sun": sun, **shapes})


def half(source, interpolation=PHONG, **others):
    return pair(source, PairOptions(interpolation=interpolation, **others)).heuristic.instantiate()


def test_meshes_with_the_normals_of_faces_keep_them(rgb, tmp_path):
    """Under parallel light a diffuse face is even, however it is shaded."""
    path = tmp_path / "four.ply"
    mesh_of(TETRAHEDRON, faces=SIDES).write_ply(str(path))
    shape = {"type": "ply", "filename": str(path), "face_normals": True}
    pictures = {
        name: np.array(mi.render(half(seen(it=shape), **how), spp=4))
        for name, how in {
            "as it is": {},
            "as a mesh": {"tessellation": 4},
            "flat": {"interpolation": FLAT},
            "gouraud": {"interpolation": GOURAUD},
        }.items()
    }
    expected = pictures.pop("as it is")
    assert len(np.unique(expected[..., 0].round(4))) > 3
    for name, picture in pictures.items():
        np.testing.assert_allclose(picture, expected, atol=1e-5, err_msg=name)


@pytest.mark.parametrize("weights", WEIGHTINGS)
def test_vertex_normals_have_the_weights_that_are_asked_for(rgb, weights):
    """Those of the block's corners, summed over its triangles in NumPy (6.32 to 6.34)."""
    scene = half(SCENES["vertex-normals"].source(), vertex_weights=weights)
    (mesh,) = scene.shapes()
    points = rows(meshes.positions(mesh)).astype(float)
    corners = rows(meshes.faces(mesh)).astype(int)
    expected = np.zeros_like(points)
    for face in corners:
        for corner in range(3):
            here, after, before = points[np.roll(face, -corner)]
            product = np.cross(after - here, before - here)
            double_area = np.linalg.norm(product)
            angle = np.arctan2(double_area, np.dot(after - here, before - here))
            weight = {"mean": 1.0, "area": double_area, "angle": angle}[weights]
            expected[face[corner]] += weight * product / double_area
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    assert len(points) == 8
    np.testing.assert_allclose(rows(tessellation.normals(mesh)), expected, atol=1e-6)
    # Only the angles do not depend on how a side is divided.
    is_even = np.allclose(np.abs(expected), 1 / np.sqrt(3), atol=1e-6)
    assert is_even is (weights == "angle")


def test_instances_are_refused_by_name(rgb):
    group = {"type": "shapegroup", "ball": {"type": "sphere"}}
    copy = {"type": "instance", "group": {"type": "ref", "id": "group"}}
    source = seen(group=group, left=copy)
    with pytest.raises(InputError, match=r"instances and their groups .* `interpolation=phong`"):
        half(source, FLAT)
