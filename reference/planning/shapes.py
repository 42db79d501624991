"""Facts about shapes: their form, which sides reflect, and which way normals point.

Everything here errs on one side: a shape is called flat, closed or convex only if that is certain.
Forms are computed in NumPy from a shape's data, since asking Mitsuba for surface points takes
milliseconds per shape. The tests compare the normals with those found by Mitsuba's rays.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum

import mitsuba as mi
import numpy as np

from heuristic import meshes
from reference.pairing.nearest import rule_of
from reference.scene import values
from reference.scene.graph import Graph

BSDF, SHAPE = mi.ObjectType.BSDF, mi.ObjectType.Shape

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

    ``plane`` is ``(point, normal)`` of a flat shape, in doubles, else None. ``has_true_normals`` is
    whether shading normals are known to be those of the surface.
    """

    form: Form
    is_outward: bool = True
    plane: tuple[np.ndarray, np.ndarray] | None = None
    has_true_normals: bool = True


UNKNOWN = Geometry(Form.OTHER, has_true_normals=False)


def geometry(shape: mi.Shape) -> Geometry:
    """Return the :class:`Geometry` of a shape."""
    kind = shape.shape_type()
    if kind == +mi.ShapeType.Sphere:
        # The flip already includes a transform that mirrors.
        return Geometry(Form.CLOSED, not shape.has_flipped_normals())
    if kind == +mi.ShapeType.Disk:
        return _disk(shape)
    if shape.is_mesh():
        return _mesh(shape, kind == +mi.ShapeType.Rectangle)
    return Geometry(Form.OTHER)


def _disk(shape: mi.Shape) -> Geometry:
    """A disk's normal is the third axis of its transform, which holds the flip.

    If a transform shears, that axis is not perpendicular to the disk, but Mitsuba renders with it.
    """
    matrix = np.array(mi.traverse(shape)["to_world"].matrix, float).reshape(4, 4, -1)[:, :, 0]
    along_u, along_v, axis = matrix[:3, :3].T
    across, length = np.cross(along_u, along_v), np.linalg.norm(axis)
    if not abs(axis @ across) > ALIKE * length * np.linalg.norm(across):
        return UNKNOWN
    return Geometry(Form.FLAT, plane=(matrix[:3, 3], axis / length))


def _mesh(mesh: mi.Mesh, is_rectangle: bool) -> Geometry:
    """Return the geometry of a mesh of V vertices and F faces.

    It is convex if all vertices lie on one side of each face: behind them, with normals outwards,
    or in front of them, as in a bowl seen from inside.
    """
    smooth = mesh.has_vertex_normals()
    if not 0 < mesh.vertex_count() * mesh.face_count() <= LARGEST_MESH:
        return Geometry(Form.OTHER, has_true_normals=not smooth)
    points = meshes.rows(mesh, meshes.POSITIONS).astype(float)
    faces = meshes.rows(mesh, meshes.FACES)
    first, second, third = (points[faces[:, i]] for i in range(3))
    across = np.cross(second - first, third - first)
    length = np.linalg.norm(across, axis=1)
    has_area = length > 0
    normals = across / np.where(has_area, length, 1)[:, None]
    if smooth:
        own = meshes.rows(mesh, meshes.NORMALS).astype(float)[faces]
        if not _are_alike(own, normals[:, None])[has_area].all():
            return UNKNOWN
    if mesh.has_flipped_normals():  # it turns normals of faces and of vertices alike
        normals = -normals
    if not has_area.all():
        return Geometry(Form.OTHER)
    if is_rectangle:
        if not _are_alike(normals, normals[0]).all():
            return UNKNOWN
        return Geometry(Form.FLAT, plane=(points.mean(axis=0), normals[0]))
    size = ROUNDING * np.ptp(points, axis=0).max()
    heights = normals @ points.T - np.sum(normals * first, axis=1)[:, None]  # (F, V)
    is_behind = bool(heights.max() <= size)
    known = is_behind or heights.min() >= -size
    return Geometry(Form.CONVEX, is_behind) if known else Geometry(Form.OTHER)


def _are_alike(normals: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return which vectors (..., 3), of any length, point along unit vectors."""
    return np.sum(normals * others, axis=-1) > ALIKE * np.linalg.norm(normals, axis=-1)


@dataclass(frozen=True, eq=False)
class ShapeFacts:
    """The facts of one shape.

    Attributes
    ----------
    low, high
        Corners of its bounding box, (3,) each.
    outer, inner
        Whether the side away from the body reflects, and the side towards it. The outer side of a
        flat shape is the one that its normal points to.
    shines_outwards
        Whether its normals point away from the body; an area light shines on their side.
    plane
        ``(point, normal)`` of a flat shape, else None.
    opaque
        Whether its BSDF only reflects; no rule covers transmitted light.
    sampled_as_hit
        Whether the points that Mitsuba samples on it are those that rays hit, and face alike.
    """

    name: str
    low: np.ndarray
    high: np.ndarray
    form: Form
    outer: bool
    inner: bool
    shines_outwards: bool
    plane: tuple | None
    opaque: bool
    sampled_as_hit: bool
    is_mesh: bool

    @classmethod
    def of(cls, graph: Graph, index: int | None, shape: mi.Shape) -> "ShapeFacts":
        """Return the facts of a shape, given its node in the graph (None if it has none)."""
        box, found = shape.bbox(), geometry(shape)
        nested = graph.children(index, BSDF) if index is not None else []
        bsdf = nested[0][1] if nested else None  # an instance has its group's
        opaque, front, back = _sides(graph, bsdf)
        return cls(
            name=shape.id(),
            low=np.array(box.min, float).ravel(),
            high=np.array(box.max, float).ravel(),
            form=found.form,
            outer=front if found.is_outward else back,
            inner=back if found.is_outward else front,
            shines_outwards=found.is_outward,
            plane=found.plane,
            opaque=opaque,
            sampled_as_hit=found.has_true_normals and _is_sampled_as_hit(graph, index, shape),
            is_mesh=shape.is_mesh(),
        )

    @property
    def reflects(self) -> bool:
        """Whether either side can reflect anything."""
        return self.outer or self.inner

    @property
    def is_convex(self) -> bool:
        """Whether no point of a side that reflects sees another one of the shape, from outside.

        The inner side of a closed body is not seen from there; that of an open part is.
        """
        if self.form is Form.OTHER:
            return False
        return self.form is not Form.CONVEX or not self.inner

    @property
    def is_hollow(self) -> bool:
        """Whether it is closed and reflects inside, which only a camera inside sees."""
        return self.form is Form.CLOSED and self.inner

    @property
    def hides_itself(self) -> bool:
        """Whether it may block its own light."""
        return self.form is Form.OTHER or not (self.form is Form.FLAT or self.shines_outwards)

    @property
    def facing(self) -> tuple[np.ndarray, float]:
        """``(direction, offset)`` of the half space that its only reflecting side looks into.

        It holds the points ``x`` with ``direction · x > offset``; all of them if light may come
        from anywhere: the offset is then -inf.
        """
        if self.plane is None or self.outer == self.inner:
            return np.zeros(3), -np.inf
        point, normal = self.plane
        direction = normal if self.outer else -normal
        return direction, float(direction @ point)


def _is_sampled_as_hit(graph: Graph, index: int | None, shape: mi.Shape) -> bool:
    """Return whether it is a shape whose samples Mitsuba 3.9 is known to place right.

    On a cylinder that is mirrored they face the other way, and on one that is not round they lie
    beside it.
    """
    if shape.shape_type() != +mi.ShapeType.Cylinder:
        round_or_flat = (+mi.ShapeType.Sphere, +mi.ShapeType.Disk)
        return shape.is_mesh() or shape.shape_type() in round_or_flat
    props = graph.props(index) if index is not None else {}
    given = np.array(props.get("to_world", mi.ScalarTransform4f()).matrix, float)[:3, :3]
    squares = given.T @ given
    if "p0" not in props and "p1" not in props:
        squares[2, 2] = squares[0, 0]  # it may be long
    is_round = np.allclose(squares, squares[0, 0] * np.eye(3), atol=1e-5 * squares[0, 0])
    return index is not None and is_round and bool(np.linalg.det(given) > 0)


def _sides(graph: Graph, bsdf: int | None) -> tuple[bool, bool, bool]:
    """Return whether a BSDF only reflects, and whether it can on its front and on its back."""
    if bsdf is None:
        return False, True, True
    plugin, props = graph.plugin(bsdf), graph.props(bsdf)
    if plugin == "twosided":
        inner = [_sides(graph, child) for _, child in graph.children(bsdf, BSDF)]
        reflects = any(front or back for _, front, back in inner)
        return bool(inner) and all(one[0] for one in inner), reflects, reflects
    rule = rule_of(plugin)
    if rule.reflectances is None or _any(props, rule.transmittances):
        return False, True, True
    reflects = not rule.reflectances or _any(props, rule.reflectances)
    return True, reflects, reflects and bool(props.get("twosided", False))


def _any(props: mi.Properties, defaults: Mapping[str, float]) -> bool:
    """Return whether any of some parameters, given with defaults, may be other than 0."""
    return any(
        values.may_be_nonzero(props.get(name, default)) for name, default in defaults.items()
    )
