"""The arrays of Mitsuba's meshes, and what the doctor says of versions."""

import mitsuba as mi
import numpy as np

from fotismos.heuristic import meshes

POINTS = [(0, 0, 0), (4, 0, 0), (0, 4, 1), (4, 4, 2)]
FACES = [(0, 1, 2), (2, 1, 3)]
NORMALS = [(0, 0, 1), (0.6, 0, 0.8), (0, 0.6, 0.8), (0, 0, 1)]
UV = [(0, 0), (1, 0), (0, 1), (1, 1)]


def made(*more):
    columns = (mi.Vector3f(np.float32(POINTS).T), mi.Vector3u(np.uint32(FACES).T), *more)
    return meshes.new_mesh("few", *columns)


def test_arrays_are_read_as_written(rgb):
    normals, uv = mi.Vector3f(np.float32(NORMALS).T), mi.Point2f(np.float32(UV).T)
    mesh, bare = made(normals, uv), made()
    for part, given in (
        (meshes.POSITIONS, POINTS),
        (meshes.FACES, FACES),
        (meshes.NORMALS, NORMALS),
        (meshes.TEXCOORDS, UV),
    ):
        np.testing.assert_array_equal(meshes.rows(mesh, part), np.float32(given))
        assert (meshes.rows(bare, part) is None) == (part in (meshes.NORMALS, meshes.TEXCOORDS))


def test_attributes_are_added_once_and_overwritten(rgb):
    mesh = made()
    for factor in (1, 2):
        values = factor * mi.Vector3f(np.float32(NORMALS).T)
        meshes.store(mesh, {"vertex_own": values, "face_own": mi.Vector3f([1, 2], 3, factor)})
    stored = mi.traverse(mesh)
    np.testing.assert_array_equal(np.ravel(stored["vertex_own"]), 2 * np.float32(NORMALS).ravel())
    np.testing.assert_array_equal(np.ravel(stored["face_own"]), [1, 3, 2, 2, 3, 2])
