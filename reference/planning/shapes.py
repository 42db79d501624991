"""Facts about shapes: what they are, which of their sides reflect, and which way normals point.

Everything here errs on one side: a shape is called flat, closed or convex only where that is
certain. Normals are those that Mitsuba renders with, asked for at surface points: ``flip_normals``
and transforms that mirror are in them.
"""

from dataclasses import dataclass
from enum import Enum

import drjit as dr
import mitsuba as mi
import numpy as np

from reference.pairing.nearest import rule_of
from reference.scene import values
from reference.scene.graph import Graph

BSDF = mi.ObjectType.BSDF

ROUNDING = 1e-6
"""Of a mesh's size: dents less deep than single precision resolves do not count."""

ALIKE = 1 - 4e-6
"""Cosine above which two unit normals of single precision are the same."""

LARGEST_MESH = 4_000_000
"""Vertices times faces up to which convexity is examined; larger meshes count as not convex."""


class Form(Enum):
    """What is certain about the form of a shape.

    ``FLAT`` lies in a plane. ``CLOSED`` bounds a convex body on all sides. ``CONVEX`` is a part of
    the surface of a convex body, or all of it. Of ``OTHER`` nothing is known.
    """

    FLAT = "flat"
    CLOSED = "closed"
    CONVEX = "convex"
    OTHER = "other"


@dataclass(frozen=True)
class ShapeFacts:
    """What is known about one shape.

    Attributes
    ----------
    name
        Its id.
    low, high
        Corners of its bounding box, (3,) each.
    form
        What is certain about its form.
    outer, inner
        Whether the side away from the body reflects, and the side towards it. Of a flat shape the
        outer side is the one that its normal points to.
    shines_outwards
        Whether its normals, on whose side an area light shines, point away from the body.
    plane
        ``(point, normal)`` of a flat shape, else None.
    opaque
        Whether its BSDF only reflects; a light that comes through is beyond all rules.
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

    @property
    def reflects(self) -> bool:
        """Whether either side can reflect anything."""
        return self.outer or self.inner

    @property
    def is_convex(self) -> bool:
        """Whether no point of a side that reflects sees another one of the shape, from outside.

        The inner side of a closed body is not seen from there. That of a part of one is.
        """
        if self.form is Form.OTHER:
            return False
        return self.form is not Form.CONVEX or not self.inner

    @property
    def is_hollow(self) -> bool:
        """Whether it is closed and reflects inside, which only a camera inside would see."""
        return self.form is Form.CLOSED and self.inner

    @property
    def hides_itself(self) -> bool:
        """Whether it may stand in the way of the light that it sends out."""
        return self.form is Form.OTHER or not (self.form is Form.FLAT or self.shines_outwards)

    def corners(self) -> np.ndarray:
        """Return the corners of the bounding box, (8, 3)."""
        choice = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T
        return np.where(choice, self.high, self.low)

    def may_face(self, other: "ShapeFacts") -> bool:
        """Tell whether this shape can receive light from another one, as far as planes tell."""
        if self.plane is None or self.outer == self.inner:
            return True
        point, normal = self.plane
        facing = normal if self.outer else -normal
        margin = ROUNDING * np.max(np.abs(other.high - other.low), initial=1e-30)
        return bool(np.max((other.corners() - point) @ facing) > margin)


def shape_facts(graph: Graph, index: int | None, shape: mi.Shape) -> ShapeFacts:
    """Return the facts of a shape, given its node in the graph (None for what has none)."""
    box = shape.bbox()
    nested = graph.children(index, BSDF) if index is not None else []
    bsdf = nested[0][1] if nested else None  # an instance has those of its group
    plugins, front, back = _sides(graph, bsdf)
    form, is_outward, plane = _geometry(shape)
    return ShapeFacts(
        name=shape.id(),
        low=np.ravel(box.min),
        high=np.ravel(box.max),
        form=form,
        outer=front if is_outward else back,
        inner=back if is_outward else front,
        shines_outwards=is_outward,
        plane=plane,
        opaque=bool(plugins) and all(rule_of(p).reflectances is not None for p in plugins),
    )


def _sides(graph: Graph, bsdf: int | None) -> tuple[tuple[str, ...], bool, bool]:
    """Return the plugins of a BSDF, and whether it can reflect on its front and on its back."""
    if bsdf is None:
        return (), True, True
    plugin, props = graph.plugin(bsdf), graph.props(bsdf)
    if plugin == "twosided":
        inner = [_sides(graph, child) for _, child in graph.children(bsdf, BSDF)]
        plugins = tuple(name for names, _, _ in inner for name in names)
        reflects = any(front or back for _, front, back in inner)
        return plugins, reflects, reflects
    reflectances = rule_of(plugin).reflectances
    if reflectances is None:
        return (plugin,), True, True
    reflects = any(
        values.may_be_nonzero(props.get(name, default)) for name, default in reflectances.items()
    )
    return (plugin,), reflects, reflects and bool(props.get("twosided", False))


def _geometry(shape: mi.Shape) -> tuple[Form, bool, tuple | None]:
    """Return the form of a shape, whether its normals point outwards, and the plane it lies in."""
    kind, unknown = shape.shape_type(), (Form.OTHER, True, None)
    if kind == +mi.ShapeType.Sphere:
        return _sphere(shape) or unknown
    if kind in (+mi.ShapeType.Rectangle, +mi.ShapeType.Disk):
        sample = shape.sample_position(0.0, mi.Point2f(0.5))
        point, normal = (np.array(part, float)[:, 0] for part in (sample.p, sample.n))
        rendered = _mesh_normals(shape) if shape.is_mesh() else _met(shape, point, normal)
        same = rendered is not None and np.all(rendered @ normal > ALIKE)
        return (Form.FLAT, True, (point, normal)) if same else unknown
    if shape.is_mesh():
        return _convex_mesh(shape) or unknown
    return unknown


def _met(shape: mi.Shape, point: np.ndarray, normal: np.ndarray) -> np.ndarray | None:
    """Return geometric and shading normal where a ray against a normal meets a shape, (2, 3)."""
    size = float(np.max(np.ravel(shape.bbox().extents())))
    begin = mi.Point3f(*map(float, point + size * normal))
    si = shape.ray_intersect(mi.Ray3f(begin, mi.Vector3f(*map(float, -normal))))
    if not bool(si.is_valid()[0]):
        return None
    return np.array([np.ravel(si.n), np.ravel(si.sh_frame.n)], float)


def _sphere(shape: mi.Shape) -> tuple[Form, bool, None] | None:
    box = shape.bbox()
    centre = (np.ravel(box.min) + np.ravel(box.max)) / 2
    sides = []
    for direction in (*np.eye(3), *-np.eye(3)):
        found = _met(shape, centre + direction * np.ravel(box.extents()) / 2, direction)
        if found is None:
            return None
        sides += [float(normal @ direction) for normal in found]
    outwards = np.array(sides) > 0
    return (Form.CLOSED, bool(outwards[0]), None) if outwards.all() or not outwards.any() else None


def _mesh_normals(mesh: mi.Mesh) -> np.ndarray | None:
    """Return the faces' geometric normals, (F, 3); None where a shading normal is not its face's.

    Both are asked for at the centre and at the corners of each face.
    """
    count = mesh.face_count()
    found = dr.zeros(mi.PreliminaryIntersection3f, count)
    found.t = dr.full(mi.Float, 1.0, count)
    found.prim_index = dr.arange(mi.UInt32, count)
    found.shape = mi.ShapePtr(mesh)
    ray = dr.zeros(mi.Ray3f, count)
    ray.d = mi.Vector3f(0, 0, 1)
    for corner in ((0, 0), (1, 0), (0, 1), (1 / 3, 1 / 3)):
        found.prim_uv = mi.Point2f(*corner)
        si = mesh.compute_surface_interaction(ray, found)
        geometric, shading = (np.array(normal, float).T for normal in (si.n, si.sh_frame.n))
        if not np.einsum("fi,fi->f", geometric, shading).min() > ALIKE:
            return None
    return geometric


def _convex_mesh(mesh: mi.Mesh) -> tuple[Form, bool, None] | None:
    """Return the facts of a mesh whose vertices all lie on one side of each of its faces.

    The side is the same for all faces: behind them, with normals outwards, or before them, as of a
    bowl that is looked into. Shading normals have to be the faces' own.
    """
    from heuristic import meshes  # which few scenes need

    if not mesh.face_count() or mesh.vertex_count() * mesh.face_count() > LARGEST_MESH:
        return None
    points = np.array(meshes.positions(mesh), float).T
    faces = np.array(meshes.faces(mesh)).T
    a, b, c = (points[faces[:, i]] for i in range(3))
    across = np.cross(b - a, c - a)
    length = np.linalg.norm(across, axis=1)
    if length.min() == 0:
        return None
    rendered = _mesh_normals(mesh)
    if rendered is None:
        return None
    # The vertices in double precision say where a face lies, Mitsuba which way it looks.
    normal = across / length[:, None]
    normal *= np.sign(np.einsum("fi,fi->f", normal, rendered))[:, None]
    size = np.ptp(points, axis=0).max()
    height = np.einsum("fi,vi->fv", normal, points) - np.einsum("fi,fi->f", normal, a)[:, None]
    if height.max() <= ROUNDING * size:
        return Form.CONVEX, True, None
    if height.min() >= -ROUNDING * size:
        return Form.CONVEX, False, None
    return None
