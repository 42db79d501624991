"""The arrays of Mitsuba's meshes: nothing else reads or writes them."""

from collections.abc import Mapping

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic.convention import Array, Direction, Mesh, Position, Vector

POSITIONS = "vertex_positions"
NORMALS = "vertex_normals"
TEXCOORDS = "vertex_texcoords"
FACES = "faces"
"""The arrays of a mesh, by their names in ``mitsuba.traverse``."""


def positions(mesh: Mesh) -> Position:
    """Return the positions of a mesh's vertices, as vectors."""
    return dr.unravel(mi.Vector3f, mesh.vertex_positions_buffer())


def faces(mesh: Mesh) -> Array:
    """Return the vertex numbers of a mesh's faces, anticlockwise as seen from the outside."""
    corners = dr.unravel(mi.Vector3u, mesh.faces_buffer())
    return corners.xzy if mesh.has_flipped_normals() else corners


def texture_coordinates(mesh: Mesh) -> Array | None:
    """Return a mesh's texture coordinates, None if it has none."""
    if not mesh.has_vertex_texcoords():
        return None
    return dr.unravel(mi.Point2f, mesh.vertex_texcoords_buffer())


def rows(mesh: Mesh, part: str) -> Array:
    """Return an array, one row per vertex or face; None if the mesh does not have it.

    Without Dr.Jit, which takes milliseconds: plans read thousands of meshes.
    """
    if part in (NORMALS, TEXCOORDS) and not getattr(mesh, f"has_{part}")():
        return None
    flat = np.array(getattr(mesh, f"{part}_buffer")())
    return flat.reshape(-1, 2 if part == TEXCOORDS else 3)


def mean_normals(mesh: Mesh) -> tuple[Array, Array]:
    """Return the means over a mesh's surface of the normals of faces, and of vertices, (3,) each.

    Faces are turned to the side of their vertices' normals, which tell what side shines. Without
    these, both means are those of the faces.
    """
    corners = rows(mesh, FACES)
    points = rows(mesh, POSITIONS).astype(float)[corners]  # (F, 3, 3): by face and corner
    across = np.cross(points[:, 1] - points[:, 0], points[:, 2] - points[:, 0])
    areas = np.linalg.norm(across, axis=1)
    turn = -1 if mesh.has_flipped_normals() else 1
    smooth = across * turn
    if mesh.has_vertex_normals():
        of_vertices = rows(mesh, NORMALS).astype(float)[corners].mean(axis=1) * turn
        across = across * np.sign(np.sum(across * of_vertices, axis=1, keepdims=True))
        smooth = of_vertices * areas[:, None]
    else:
        across = smooth
    total = max(areas.sum(), 1e-300)
    return across.sum(axis=0) / total, smooth.sum(axis=0) / total


def new_mesh(
    name: str,
    positions: Position,
    corners: Array,
    normals: Direction | None = None,
    uv: Array | None = None,
) -> Mesh:
    """Return a new mesh of vertices, and of three vertex numbers per face.

    They are anticlockwise as seen from the outside. Without normals, the mesh has those of its
    faces.
    """
    mesh = mi.Mesh(
        name,
        dr.width(positions),
        dr.width(corners),
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=uv is not None,
    )
    parameters = mi.traverse(mesh)
    for part, values in ((POSITIONS, positions), (FACES, corners), (NORMALS, normals),
                         (TEXCOORDS, uv)):  # fmt: skip
        if values is not None:
            parameters[part] = dr.ravel(values)
    parameters.update()
    return mesh


def store(mesh: Mesh, attributes: Mapping[str, Vector]) -> None:
    """Write attributes of three components per vertex or face; new names are added."""
    for name, values in attributes.items():
        if not mesh.has_attribute(name):
            # Zeros, because this copies one by one; all, because Mitsuba does not check the length.
            mesh.add_attribute(name, 3, [0.0] * (3 * dr.width(values)))
    parameters = mi.traverse(mesh)
    for name, values in attributes.items():
        parameters[name] = dr.ravel(values)
    parameters.update()
