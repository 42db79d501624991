"""The arrays of Mitsuba's meshes: nothing else reads or writes them, so a new interface ends here.

===================  ==============================  ===========================================
Array                Mitsuba 3.9: flat               after Mitsuba's pull request 1933: tensors
===================  ==============================  ===========================================
positions            ``vertex_positions`` (3 V)      ``positions`` (P, 3)
normals              ``vertex_normals`` (3 V)        ``normals`` (N, 3)
texture coordinates  ``vertex_texcoords`` (2 V)      ``texcoords`` (V, 2)
vertices of faces    ``faces`` (3 F)                 ``faces`` (F, 3)
===================  ==============================  ===========================================

There, vertices may share positions and normals: ``position_index`` and ``normal_index`` (V) name
those of each vertex. Meshes get their arrays when they are made, and have no methods that return
them. No release has that interface yet. What a mesh has decides, not Mitsuba's version.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.arrays import Array, Direction, Mesh, Position, Vector
from heuristic.errors import InstallationError


@dataclass(frozen=True)
class Part:
    """An array: its name in each interface, its Dr.Jit type, and the index that shares entries."""

    flat: str
    tensor: str
    kind: str
    index: str = ""


POSITIONS = Part("vertex_positions", "positions", "Vector3f", "position_index")
NORMALS = Part("vertex_normals", "normals", "Vector3f", "normal_index")
TEXCOORDS = Part("vertex_texcoords", "texcoords", "Point2f")
FACES = Part("faces", "faces", "Vector3u")


def is_flat(mesh: Mesh | type) -> bool:
    """Return whether a mesh, or the class, has flat arrays."""
    return hasattr(mesh, f"{POSITIONS.flat}_buffer")


def has(mesh: Mesh, part: Part) -> bool:
    """Return whether a mesh has normals, or texture coordinates."""
    if is_flat(mesh):
        return getattr(mesh, f"has_{part.flat}")()
    return dr.width(_array(mi.traverse(mesh), part.tensor)) > 0


def vectors(mesh: Mesh, part: Part) -> Array:
    """Return one Dr.Jit vector per vertex or face."""
    kind = getattr(mi, part.kind)
    if is_flat(mesh):
        return dr.unravel(kind, getattr(mesh, f"{part.flat}_buffer")())
    values = mi.traverse(mesh)
    found = dr.unravel(kind, _array(values, part.tensor))
    index = _array(values, part.index)
    return dr.gather(kind, found, mi.UInt32(index)) if dr.width(index) else found


def rows(mesh: Mesh, part: Part) -> np.ndarray:
    """Return one row per vertex or face."""
    if not is_flat(mesh):
        return np.array(vectors(mesh, part)).T
    # Without Dr.Jit, which takes milliseconds: plans read thousands of meshes.
    flat = np.array(getattr(mesh, f"{part.flat}_buffer")())
    return flat.reshape(-1, 2 if part is TEXCOORDS else 3)


def made(
    name: str,
    positions: Position,
    corners: Array,
    normals: Direction | None = None,
    uv: Array | None = None,
) -> Mesh:
    """Return a new mesh.

    Parameters
    ----------
    positions, normals
        Three components per vertex; without normals, the mesh has those of its faces.
    corners
        Three vertex numbers per face, anticlockwise as seen from the outside.
    uv
        Two components per vertex.
    """
    given = {POSITIONS: positions, FACES: corners, NORMALS: normals, TEXCOORDS: uv}
    given = {part: values for part, values in given.items() if values is not None}
    if not is_flat(mi.Mesh):
        return mi.Mesh(name, **{part.tensor: _tensor(values) for part, values in given.items()})
    mesh = mi.Mesh(
        name,
        dr.width(positions),
        dr.width(corners),
        has_vertex_normals=normals is not None,
        has_vertex_texcoords=uv is not None,
    )
    parameters = mi.traverse(mesh)
    for part, values in given.items():
        parameters[part.flat] = dr.ravel(values)
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
        is_tensor = dr.is_tensor_v(parameters[name])
        parameters[name] = _tensor(values) if is_tensor else dr.ravel(values)
    parameters.update()


def tried() -> str:
    """Make a mesh, read it back, and return which interface it has.

    Raises
    ------
    InstallationError
        If this Mitsuba's meshes cannot be made, or read differently.
    """
    corner, uv = mi.Vector3f([0, 1, 0], [0, 0, 1], [2, 2, 3]), mi.Point2f([0, 1, 0], [0, 0, 1])
    given = {POSITIONS: corner, FACES: mi.Vector3u(0, 1, 2), NORMALS: corner + 1, TEXCOORDS: uv}
    try:
        mesh = made("tried", *given.values())
        store(mesh, {"vertex_tried": corner})
        wrong = [
            part.tensor
            for part, values in given.items()
            if not np.array_equal(rows(mesh, part), np.array(values).T)
        ]
    except Exception as error:  # whatever a changed interface raises
        raise InstallationError(f"{type(error).__name__}: {error}") from error
    if wrong:
        raise InstallationError(f"{', '.join(wrong)} of a mesh are read differently than written")
    return "flat arrays" if is_flat(mesh) else "tensors, unlike those of any tested version"


def _array(values, name):
    """Return the numbers of a tensor or flat array, row after row; none if it is missing."""
    if name not in values:
        return mi.Float()
    return values[name].array if dr.is_tensor_v(values[name]) else values[name]


def _tensor(values):
    kind = mi.TensorXu if dr.is_integral_v(values) else mi.TensorXf
    return kind(dr.ravel(values), (dr.width(values), len(values)))
