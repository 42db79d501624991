"""Triangle meshes for flat, Gouraud and Phong shading: made of other shapes, given normals.

Every function that returns a mesh returns a new ``mitsuba.Mesh`` in world space, with the BSDF of
the original and no emitter; the original is unchanged. A flipped orientation (``flip_normals``)
becomes the order of the vertices. Call it after ``mitsuba.set_variant``.
"""

from typing import Any

import drjit as dr
import mitsuba as mi

from fotismos.heuristic.convention import Array, Direction, Interaction, Mesh, Position, Shape
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.meshes import faces, new_mesh, positions, texture_coordinates
from fotismos.heuristic.normals import triangle_normal, vertex_normals

RESOLUTION = 16
FINEST = 512
"""Finest tessellation: a sphere then has four million triangles, half a gigabyte."""


def to_mesh(shape: Shape, resolution: int = RESOLUTION) -> Mesh:
    """Return a shape as a triangle mesh with the shape's own normals and texture coordinates.

    It is a grid over the shape's ``(u, v)`` with two triangles per cell, so textures stay in place.
    With ``h = pi / (2 resolution)``, the angle of one step along a circle, its largest distance
    from the shape, for the radius ``r``, is:

    =============  ===============================================  ========================
    Shape          Cells                                            Distance
    =============  ===============================================  ========================
    ``rectangle``  ``resolution`` a side                            0
    ``disk``       ``4 resolution`` around, ``resolution`` rings    ``r (1 - cos(h / 2))``
    ``cylinder``   ``4 resolution`` around, ``resolution`` along    ``r (1 - cos(h / 2))``
    ``sphere``     ``4 resolution`` around, ``2 resolution`` bands  ``r (1 - cos^2(h / 2))``
    =============  ===============================================  ========================

    Vertices lie on the shape, so the mesh of a sphere lies inside it. Meshes, including the cube,
    are returned unchanged.
    """
    if not isinstance(resolution, int) or not 1 <= resolution <= FINEST:
        raise InputError(
            f"resolution = {resolution!r} is not allowed: give a whole number from 1 to {FINEST}."
        )
    kind = mi.ShapeType(shape.shape_type())
    if kind not in _cells(resolution):
        if shape.is_mesh():
            return shape
        raise InputError(
            f"shape {shape.id()!r}: a {shape.class_name()} cannot be made into triangles. Flat"
            " and Gouraud shading take meshes, spheres, disks, cylinders and rectangles: give"
            " a mesh, or use phong interpolation."
        )
    columns, rows = _cells(resolution)[kind]
    return _tessellated(shape, kind, columns=columns, rows=rows)


def with_vertex_normals(mesh: Mesh, weighting: str = "angle") -> Mesh:
    """Return a mesh with vertex normals by 6.32, 6.33 or 6.34, replacing any that it has."""
    computed = _checked_normals(mesh, weighting)
    return _build(
        mesh, positions(mesh), normals=computed, uv=texture_coordinates(mesh), corners=faces(mesh)
    )


def split_faces(mesh: Mesh) -> Mesh:
    """Return a mesh whose faces share no vertices, each with its face's normal.

    In this form a mesh with ``face_normals`` has vertices to evaluate at.
    """
    corners = dr.ravel(faces(mesh))
    normals = dr.repeat(face_normals(mesh), 3)
    uv = texture_coordinates(mesh)
    if uv is not None:
        uv = dr.gather(mi.Point2f, uv, corners)
    first = 3 * dr.arange(mi.UInt32, mesh.face_count())
    split = mi.Vector3u(first, first + 1, first + 2)
    return _build(
        mesh,
        dr.gather(mi.Vector3f, positions(mesh), corners),
        normals=normals,
        uv=uv,
        corners=split,
    )


def face_normals(mesh: Mesh) -> Direction:
    """Return the unit normals of a mesh's faces (see 6.19), zero for faces without area."""
    return _flat_normals(positions(mesh), faces(mesh))


def normals(mesh: Mesh) -> Direction:
    """Return a mesh's vertex normals: its own, or by 6.34 if it has none."""
    if not mesh.has_vertex_normals():
        return _checked_normals(mesh, "angle")
    given = dr.unravel(mi.Vector3f, mesh.vertex_normals_buffer())
    return -given if mesh.has_flipped_normals() else given


def _flat_normals(points: Position, corners: Array) -> Direction:
    p0, p1, p2 = [dr.gather(mi.Vector3f, points, corner) for corner in corners]
    return triangle_normal(p0, p1, p2)


def _checked_normals(mesh: Mesh, weighting: str) -> Direction:
    corners = faces(mesh)
    computed = vertex_normals(positions(mesh), corners, weighting)
    is_used = dr.zeros(mi.Bool, mesh.vertex_count())
    has_area = dr.squared_norm(face_normals(mesh)) > 0
    for i in range(3):
        dr.scatter(is_used, mi.Bool(True), corners[i], has_area)
    missing = dr.count(is_used & (dr.squared_norm(computed) == 0))[0]
    if missing:
        raise InputError(
            f"mesh {mesh.id()!r}: {missing} vertices have no normal, because the faces around them"
            " oppose each other. Separate the two sides, or set face_normals on the mesh."
        )
    return computed


def _cells(resolution: int) -> dict[Any, tuple[int, int]]:
    """Return the number of cells along ``u`` and ``v`` for each type of shape."""
    around = 4 * resolution
    return {
        mi.ShapeType.Rectangle: (resolution, resolution),
        mi.ShapeType.Disk: (resolution, around),
        mi.ShapeType.Cylinder: (around, resolution),
        mi.ShapeType.Sphere: (around, 2 * resolution),
    }


def _tessellated(shape: Shape, kind: Any, columns: int, rows: int) -> Mesh:
    """Evaluate a shape at the corners of a grid of cells, and join them by triangles."""
    index = dr.arange(mi.UInt32, (columns + 1) * (rows + 1))
    column = index % (columns + 1)
    row = index // (columns + 1)
    uv = mi.Point2f(mi.Float(column) / columns, mi.Float(row) / rows)
    points, surface_normals = _surface(shape, kind, _closed(kind, uv))
    # The corners of each cell, anticlockwise in (u, v), and two triangles of them.
    cell = dr.arange(mi.UInt32, columns * rows)
    first = cell + cell // columns
    second = first + 1
    third = first + columns + 2
    fourth = first + columns + 1
    corners = mi.Vector3u(
        dr.concat([first, first]), dr.concat([second, third]), dr.concat([third, fourth])
    )
    flat = _flat_normals(points, corners)
    has_area = dr.squared_norm(flat) > 0  # at a pole, and in the middle of a disk, half have none
    alignment = dr.dot(flat, dr.gather(mi.Vector3f, surface_normals, corners.x))
    # The parametrisation may be left-handed: then every triangle turns over.
    if dr.sum(alignment)[0] < 0:
        corners = corners.xzy
    corners = dr.gather(mi.Vector3u, corners, dr.compress(has_area))
    return _build(shape, points, normals=surface_normals, uv=uv, corners=corners)


def _surface(shape: Shape, kind: Any, uv: Array) -> tuple[Position, Direction]:
    """Return points and normals of a shape, one for each of its coordinates."""
    if kind in (mi.ShapeType.Cylinder, mi.ShapeType.Disk):
        # Mitsuba finds the point with a ray, which may miss the rim; the shape is straight across.
        along_u = kind == mi.ShapeType.Disk
        low = _evaluated(shape, mi.Point2f(0.25, uv.y) if along_u else mi.Point2f(uv.x, 0.25))
        high = _evaluated(shape, mi.Point2f(0.75, uv.y) if along_u else mi.Point2f(uv.x, 0.75))
        points = dr.lerp(low.p, high.p, 2 * (uv.x if along_u else uv.y) - 0.5)
        normals = low.n
    else:
        si = _evaluated(shape, uv)
        # Mitsuba's rectangle ignores its orientation in its parametrisation.
        flipped = kind == mi.ShapeType.Rectangle and shape.has_flipped_normals()
        points = si.p
        normals = -si.n if flipped else si.n
    everywhere = dr.zeros(mi.Vector3f, dr.width(uv))  # plane shapes have a single normal
    return mi.Vector3f(points), mi.Vector3f(normals) + everywhere


def _evaluated(shape: Shape, uv: Array) -> Interaction:
    si = shape.eval_parameterization(uv)
    if not dr.all(si.is_valid() & dr.all(dr.isfinite(si.p))):
        raise InputError(
            f"shape {shape.id()!r}: this {shape.class_name()} cannot be made into triangles,"
            " because its to_world shears or stretches it. Rotate and scale it evenly, or give it"
            " as a mesh."
        )
    return si


def _closed(kind: Any, uv: Array) -> Array:
    """Make both ends of a circle, and all meridians at a pole or centre, meet in one point."""
    full_turn_u = dr.select(uv.x < 1, uv.x, 0)
    full_turn_v = dr.select(uv.y < 1, uv.y, 0)
    if kind == mi.ShapeType.Sphere:
        return mi.Point2f(dr.select((uv.y > 0) & (uv.y < 1), full_turn_u, 0), uv.y)
    if kind == mi.ShapeType.Cylinder:
        return mi.Point2f(full_turn_u, uv.y)
    if kind == mi.ShapeType.Disk:
        return mi.Point2f(uv.x, dr.select(uv.x > 0, full_turn_v, 0))
    return uv


def _build(
    original: Shape, points: Position, normals: Direction, uv: Array, corners: Array
) -> Mesh:
    """Make a mesh from its arrays, with the name and BSDF of an original."""
    mesh = new_mesh(original.id(), points, corners=corners, normals=normals, uv=uv)
    mesh.set_id(original.id())
    mesh.set_bsdf(original.bsdf())
    return mesh
