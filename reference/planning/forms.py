"""Forms of shapes: flat, closed or convex, and the direction of the normals that Mitsuba renders.

Everything is computed in NumPy from a shape's data, since asking Mitsuba for surface points takes
milliseconds per shape. The tests compare the normals with those found by Mitsuba's rays.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from enum import Enum

import mitsuba as mi
import numpy as np

from heuristic import mesh_arrays

ROUNDING = 1e-6
"""Share of a shape's size: dents below the resolution of single precision do not count."""

ALIKE = 1 - 4e-6
"""Cosine above which two unit normals of single precision count as equal."""

LARGEST_MESH = 4_000_000
"""Vertices times faces up to which convexity is examined; larger meshes count as not convex."""


class Form(Enum):
    """What is certain about the form of a shape.

    ``FLAT`` lies in a plane. ``CLOSED`` bounds a convex body on all sides. ``CONVEX`` is a part of
    the surface of a convex body, or all of it. Nothing is known about ``OTHER``.
    """

    FLAT = "flat"
    CLOSED = "closed"
    CONVEX = "convex"
    OTHER = "other"


@dataclass(frozen=True)
class Geometry:
    """The form of a shape, whether its normals point outwards, and the plane it lies in.

    ``plane`` is ``(point, normal)`` of a flat shape, in doubles, else None.
    """

    form: Form
    is_outward: bool = True
    plane: tuple[np.ndarray, np.ndarray] | None = None


UNKNOWN = Geometry(Form.OTHER)


def geometries(shapes: Sequence[mi.Shape]) -> list[Geometry]:
    """Return the :class:`Geometry` of each shape; meshes of one size are examined together."""
    found = [UNKNOWN] * len(shapes)
    meshes: dict[tuple, list[int]] = {}
    for number, shape in enumerate(shapes):
        kind = shape.shape_type()
        if kind == +mi.ShapeType.Sphere:
            # The flip already includes a transform that mirrors.
            found[number] = Geometry(Form.CLOSED, not shape.has_flipped_normals())
        elif kind == +mi.ShapeType.Disk:
            found[number] = _disk(shape)
        elif shape.is_mesh():
            size = shape.vertex_count(), shape.face_count()
            smooth = mesh_arrays.has(shape, mesh_arrays.NORMALS)
            if 0 < size[0] * size[1] <= LARGEST_MESH:
                flat = kind == +mi.ShapeType.Rectangle
                meshes.setdefault((*size, smooth, flat), []).append(number)
    for (vertices, faces, smooth, flat), numbers in meshes.items():
        step = max(LARGEST_MESH // (vertices * faces), 1)
        for part in (numbers[i : i + step] for i in range(0, len(numbers), step)):
            same = Meshes.of([shapes[number] for number in part], smooth)
            for number, one in zip(part, same.flat() if flat else same.convex(), strict=True):
                found[number] = one
    return found


def _disk(shape: mi.Shape) -> Geometry:
    """A disk's normal is the third axis of its transform, which holds the flip.

    If a transform shears, that axis is not perpendicular to the disk, but Mitsuba renders with it.
    """
    matrix = np.array(mi.traverse(shape)["to_world"].matrix, float).reshape(4, 4, -1)[:, :, 0]
    along_u, along_v, axis = matrix[:3, :3].T
    across, length = _cross(along_u, along_v), np.linalg.norm(axis)
    if not abs(axis @ across) > ALIKE * length * np.linalg.norm(across):
        return UNKNOWN
    return Geometry(Form.FLAT, plane=(matrix[:3, 3], axis / length))


@dataclass(frozen=True)
class Meshes:
    """M meshes of V vertices and F faces each.

    Attributes
    ----------
    points
        (M, V, 3), in doubles.
    first
        (M, F, 3): a corner of each face.
    normals
        (M, F, 3): unit normals of the faces, as Mitsuba renders them.
    known
        (M,): whether each face has an area, and shading normals are the faces' own.
    """

    points: np.ndarray
    first: np.ndarray
    normals: np.ndarray
    known: np.ndarray

    @classmethod
    def of(cls, meshes: Sequence[mi.Mesh], smooth: bool) -> "Meshes":
        """Return meshes of one size; if ``smooth``, they are shaded by normals at vertices."""

        def read(part: mesh_arrays.Part, kind: type) -> np.ndarray:
            return np.array([mesh_arrays.rows(mesh, part) for mesh in meshes], kind)

        points, faces = read(mesh_arrays.POSITIONS, float), read(mesh_arrays.FACES, int)
        corners = [_taken(points, faces[..., i]) for i in range(3)]
        across = _cross(corners[1] - corners[0], corners[2] - corners[0])
        length = np.linalg.norm(across, axis=-1, keepdims=True)
        known = np.all(length > 0, axis=(1, 2))
        normals = across / np.where(length > 0, length, 1)
        if smooth:
            own = read(mesh_arrays.NORMALS, float)
            for i in range(3):
                known &= np.all(_are_alike(_taken(own, faces[..., i]), normals), axis=1)
        # The flip turns normals of faces and of vertices alike.
        sign = np.array([-1.0 if mesh.has_flipped_normals() else 1.0 for mesh in meshes])
        return cls(points, corners[0], normals * sign[:, None, None], known)

    def flat(self) -> Iterator[Geometry]:
        """Return the facts of rectangles."""
        normals, points = self.normals[:, 0], self.points.mean(axis=1)
        known = self.known & np.all(_are_alike(self.normals, normals[:, None]), axis=1)
        for is_known, point, normal in zip(known, points, normals, strict=True):
            yield Geometry(Form.FLAT, plane=(point, normal)) if is_known else UNKNOWN

    def convex(self) -> Iterator[Geometry]:
        """Return the facts of meshes whose vertices all lie on one side of each of their faces.

        The side is the same for all faces: behind them, with normals outwards, or in front of them,
        as in a bowl seen from inside.
        """
        size = ROUNDING * np.ptp(self.points, axis=1).max(axis=1)
        places = np.sum(self.normals * self.first, axis=-1)[..., None]
        heights = self.normals @ self.points.transpose(0, 2, 1) - places  # (M, F, V)
        is_behind = self.known & (heights.max(axis=(1, 2)) <= size)
        is_before = self.known & (heights.min(axis=(1, 2)) >= -size)
        for behind, before in zip(is_behind, is_before, strict=True):
            yield Geometry(Form.CONVEX, bool(behind)) if behind or before else UNKNOWN


def _taken(values: np.ndarray, numbers: np.ndarray) -> np.ndarray:
    """Return the vectors (M, F, 3) of numbers (M, F) among values (M, V, 3)."""
    return np.take_along_axis(values, numbers[..., None], axis=1)


def _cross(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return cross products of vectors (..., 3); NumPy's function takes several times as long."""
    (ax, ay, az), (bx, by, bz) = np.moveaxis(a, -1, 0), np.moveaxis(b, -1, 0)
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


def _are_alike(normals: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return which vectors (..., 3), of any length, point along unit vectors."""
    return np.sum(normals * others, axis=-1) > ALIKE * np.linalg.norm(normals, axis=-1)
