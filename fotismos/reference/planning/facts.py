"""Facts about a pair for the rules of planning: shapes, lights, and where camera rays begin.

Everything here errs on one side, so a rule that relies on it never leaves out light that exists: a
shape is called flat, closed or convex only if that is certain. Forms are computed in NumPy from a
shape's data, since asking Mitsuba for surface points takes milliseconds per shape. The tests
compare the normals with those found by Mitsuba's rays.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.heuristic import meshes
from fotismos.heuristic.heuristics import Interpolation
from fotismos.heuristic.materials import COEFFICIENTS
from fotismos.reference.pairing import kinds, lights
from fotismos.reference.pairing.bsdfs import (
    LAYERED_BUMPS,
    REFLECTANCES,
    TRANSMITTANCES,
    WRAPPERS,
    has_bump_shadows,
    is_mirror,
)
from fotismos.reference.pairing.halves import Pair
from fotismos.reference.pairing.lights import LightKind, LightNode
from fotismos.reference.scene import values
from fotismos.reference.scene.graph import Graph

BSDF = mi.ObjectType.BSDF
EMITTER = mi.ObjectType.Emitter
SENSOR = mi.ObjectType.Sensor
SHAPE = mi.ObjectType.Shape

PLANAR = ("perspective", "thinlens", "orthographic")
"""Sensors whose rays begin in one plane, within the convex hull of those at the film's corners and
the lens's edge."""

EDGE = 8
"""Points along each side of the square that maps to the lens."""

MARGIN = 1.05
"""Widens the polygon of points on a lens's edge until it holds the disk, with rounding."""

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
    """The form of a shape, and the ``plane`` ``(point, normal)`` of a flat one, in doubles.

    ``has_true_normals`` is whether shading normals are known to be those of the surface.
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
    across = np.cross(along_u, along_v)
    length = np.linalg.norm(axis)
    # Either way round: the transform may mirror.
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
    first = points[faces[:, 0]]
    second = points[faces[:, 1]]
    third = points[faces[:, 2]]
    across = np.cross(second - first, third - first)
    length = np.linalg.norm(across, axis=1)
    has_area = length > 0
    normals = across / np.where(has_area, length, 1)[:, None]
    # Interpolated normals must be those of the faces, or nothing is certain.
    if smooth:
        vertex_normals = meshes.rows(mesh, meshes.NORMALS).astype(float)[faces]
        if not _are_alike(vertex_normals, normals[:, None])[has_area].all():
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
    is_convex = is_behind or heights.min() >= -size
    return Geometry(Form.CONVEX, is_behind) if is_convex else Geometry(Form.OTHER)


def _are_alike(normals: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Return which vectors (..., 3), of any length, point along unit vectors."""
    is_alike: np.ndarray = np.sum(normals * others, axis=-1) > ALIKE * np.linalg.norm(
        normals, axis=-1
    )
    return is_alike


@dataclass(frozen=True, eq=False)
class ShapeFacts:
    """The facts of one shape, between the corners ``low`` and ``high`` (3,) of its box.

    ``outer`` and ``inner`` are whether the side away from the body reflects, and the side towards
    it; the outer side of a flat shape is the one that its normal points to. An area light
    ``shines_outwards`` if its normals point away from the body. ``opaque`` is whether its BSDF only
    reflects, ``lets_straight_through`` whether light may pass it unrefracted, as it does a mask,
    ``sampled_as_hit`` whether the points that Mitsuba samples on it are those that rays
    hit, and face alike.
    """

    name: str
    low: np.ndarray
    high: np.ndarray
    form: Form
    outer: bool
    inner: bool
    shines_outwards: bool
    plane: tuple[Any, ...] | None
    opaque: bool
    lets_straight_through: bool
    sampled_as_hit: bool
    is_mesh: bool

    @classmethod
    def of(cls, graph: Graph, index: int | None, shape: mi.Shape) -> "ShapeFacts":
        """Return the facts of a shape, given its node in the graph (None if it has none)."""
        box = shape.bbox()
        shown = geometry(shape)
        nested = graph.children(index, BSDF) if index is not None else []
        bsdf = nested[0][1] if nested else None  # an instance has its group's
        opaque, front, back = sides(graph, bsdf)
        return cls(
            name=shape.id(),
            low=np.array(box.min, float).ravel(),
            high=np.array(box.max, float).ravel(),
            form=shown.form,
            outer=front if shown.is_outward else back,
            inner=back if shown.is_outward else front,
            shines_outwards=shown.is_outward,
            plane=shown.plane,
            opaque=opaque,
            lets_straight_through=_lets_straight_through(shape.bsdf()),
            sampled_as_hit=shown.has_true_normals and _is_sampled_as_hit(graph, index, shape),
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


def _lets_straight_through(bsdf: mi.BSDF | None) -> bool:
    """Return whether a BSDF has a null component; an instance has its group's, not known here."""
    return bsdf is None or mi.has_flag(bsdf.flags(), mi.BSDFFlags.Null)


def _is_sampled_as_hit(graph: Graph, index: int | None, shape: mi.Shape) -> bool:
    """Return whether Mitsuba 3.9 is known to place its samples on a shape correctly.

    On a cylinder that is mirrored they face the other way, and on one that is not round they lie
    beside it.
    """
    if shape.shape_type() != +mi.ShapeType.Cylinder:
        round_or_flat = (+mi.ShapeType.Sphere, +mi.ShapeType.Disk)
        return shape.is_mesh() or shape.shape_type() in round_or_flat
    props = graph.props(index) if index is not None else {}
    matrix = np.array(props.get("to_world", mi.ScalarTransform4f()).matrix, float)[:3, :3]
    # Round: axes of equal length, perpendicular to each other.
    squares = matrix.T @ matrix
    if "p0" not in props and "p1" not in props:
        squares[2, 2] = squares[0, 0]  # it may be long
    is_round = np.allclose(squares, squares[0, 0] * np.eye(3), atol=1e-5 * squares[0, 0])
    return index is not None and is_round and bool(np.linalg.det(matrix) > 0)


def sides(graph: Graph, bsdf: int | None) -> tuple[bool, bool, bool]:
    """Return whether a BSDF only reflects, and whether its front and its back may reflect."""
    if bsdf is None:
        return False, True, True
    plugin = graph.plugin(bsdf)
    props = graph.props(bsdf)
    if plugin == "twosided":
        inner = [sides(graph, child) for _, child in graph.children(bsdf, BSDF)]
        reflects = any(front or back for _, front, back in inner)
        return bool(inner) and all(side[0] for side in inner), reflects, reflects
    reflectances = REFLECTANCES.get(plugin)
    transmittances = TRANSMITTANCES.get(plugin, {})
    passes = any(
        values.may_be_nonzero(props.get(name, usual))
        for name, usual in (transmittances or {}).items()
    )
    reflects = any(
        values.may_be_nonzero(props.get(name, usual))
        for name, usual in (reflectances or {}).items()
    )
    # A plugin that is not known, or transmits, may do anything.
    if reflectances is None or passes:
        return False, True, True
    reflects |= not reflectances
    return True, reflects, reflects and bool(props.get("twosided", False))


@dataclass(frozen=True)
class CameraFacts:
    """Where the rays of a camera begin: on the near clip plane, or one as wide as the picture.

    ``origins`` (N, 3) are corners of a convex set that holds them all, None if unknown, as for a
    sensor on a shape, and then no rule may rely on the camera's position. ``axis`` is the unit
    normal of the set's plane; ``is_still`` is whether the shutter opens only for an instant.
    """

    plugin: str
    origins: np.ndarray | None = None
    axis: np.ndarray | None = None
    is_still: bool = False

    @classmethod
    def of(cls, plugin: str, sensors: list[mi.Sensor]) -> "CameraFacts":
        """Return the facts of a scene's camera; with several sensors nothing is known."""
        if len(sensors) != 1:
            return cls(plugin)
        (sensor,) = sensors
        is_still = sensor.shutter_open_time() == 0
        if plugin not in PLANAR:
            return cls(plugin, is_still=is_still)
        film = sensor.film()
        border = 0.0
        # Rays of a sampled border begin outside the film, in shares of its shorter side.
        if film.sample_border():
            border = film.rfilter().border_size() / min(film.crop_size())
        ends = (-border, 1 + border)
        steps = np.arange(EDGE) / EDGE
        across = np.concatenate([steps, np.ones(EDGE), 1 - steps, np.zeros(EDGE)])
        lens = np.stack([across, np.roll(across, EDGE)])  # around the square's edge
        places = np.array([(x, y) for x in ends for y in ends]).T
        # Each of the film's four corners with all points of the lens.
        on_film = mi.Point2f(np.repeat(places, 4 * EDGE, axis=1))
        on_lens = mi.Point2f(np.tile(lens, 4))
        ray, _ = sensor.sample_ray(0.0, 0.5, on_film, on_lens)
        origins = np.array(ray.o, float).T
        middle = origins.mean(axis=0)
        axis = np.ravel(np.array(sensor.world_transform().matrix, float)[:3, 2])
        wide = middle + MARGIN * (origins - middle)
        unit = axis / np.linalg.norm(axis)
        return cls(plugin=plugin, origins=wide, axis=unit, is_still=is_still)

    def is_outside(self, shape: ShapeFacts) -> bool:
        """Return whether all rays certainly begin outside a shape's box.

        Two convex sets are apart if a plane lies between them; it tries planes along the axes and
        along the camera's own.
        """
        if self.origins is None:
            return False
        ends = np.stack([shape.low, shape.high])
        corners = np.stack(np.meshgrid(*ends.T), axis=-1).reshape(8, 3)
        for direction in (*np.eye(3), self.axis):
            box = corners @ direction
            begin = self.origins @ direction
            gap = max(box.min() - begin.max(), begin.min() - box.max())
            if gap > 1e-6 * max(np.abs(box).max(), np.abs(begin).max()):
                return True
        return False


@dataclass(frozen=True)
class LightFacts:
    """The facts of one light: its position, or the direction to it, or the name of its shape."""

    name: str
    kind: str
    position: np.ndarray | None = None
    toward: np.ndarray | None = None
    shape: str | None = None


@dataclass(frozen=True)
class Facts:
    """Facts about a pair in the current variant; shapes, lights and camera of the physical half."""

    pair: Pair
    shapes: tuple[ShapeFacts, ...]
    lights: tuple[LightFacts, ...]
    camera: CameraFacts
    interpolation: Interpolation = Interpolation.PHONG
    rule_results: dict[str, Any] = field(default_factory=dict, repr=False)

    @classmethod
    def of(
        cls, pair: Pair, scene: mi.Scene, interpolation: Interpolation = Interpolation.PHONG
    ) -> "Facts":
        """Return the facts of a pair, given the scene of its physical half."""
        graph = pair.physical
        nodes = {graph.props(index).id(): index for index in graph.nodes(SHAPE)}
        shapes = (ShapeFacts.of(graph, nodes.get(s.id()), s) for s in scene.shapes())
        plugins = ", ".join(graph.plugin(index) for index in graph.nodes(SENSOR))
        camera = CameraFacts.of(plugins, scene.sensors())
        return cls(pair, tuple(shapes), tuple(_lights(graph)), camera, interpolation)

    @cached_property
    def by_name(self) -> dict[str | None, ShapeFacts]:
        """The shapes by their names; the first of several of one name."""
        return {shape.name: shape for shape in reversed(self.shapes)}

    @cached_property
    def lamps(self) -> tuple[ShapeFacts | None, ...]:
        """The shapes that shine; None for one that is not known."""
        return tuple(self.by_name.get(light.shape) for light in self.lights if light.shape)

    def may_be_seen_from_inside(self, shape: ShapeFacts) -> bool:
        """Return whether a camera ray may begin inside a closed shape that reflects there."""
        is_hollow = shape.form is Form.CLOSED and shape.inner
        return is_hollow and not self.camera.is_outside(shape)

    @cached_property
    def kernel(self) -> mi.Properties:
        """The parameters of the textbook half's integrator."""
        graph = self.pair.heuristic
        return graph.props(graph.nodes(mi.ObjectType.Integrator)[0])

    @property
    def has_shadows(self) -> bool:
        """Whether the textbook half itself has shadows."""
        return bool(self.kernel.get("occlusion", False))

    @cached_property
    def materials(self) -> list[mi.Properties]:
        """The parameters of the textbook half's materials."""
        graph = self.pair.heuristic
        return [graph.props(index) for index in graph.nodes(BSDF, "phong")]

    @cached_property
    def kernel_terms(self) -> tuple[str, ...]:
        """The coefficients that are not 0 in every material; ``k_s`` of a mirror does not count."""
        return tuple(
            name
            for name in COEFFICIENTS
            if any(
                values.may_be_nonzero(props.get(name, 0.0))
                and not (name == "k_s" and is_mirror(props))
                for props in self.materials
            )
        )

    @property
    def has_mirror(self) -> bool:
        """Whether a textbook material is a mirror."""
        return any(map(is_mirror, self.materials))

    @property
    def variant(self) -> str:
        """Mitsuba's variant."""
        return str(mi.variant())

    @cached_property
    def bsdfs(self) -> list[str]:
        """The plugins of the physical half's materials, sorted."""
        graph = self.pair.physical
        return sorted({graph.plugin(index) for index in graph.nodes(BSDF)})

    @property
    def has_microfacets(self) -> bool:
        """Whether a material of the physical half is more than diffuse."""
        return bool({*self.bsdfs} - {"diffuse", "null", *WRAPPERS})

    @staticmethod
    def is_wrapper(plugin: str) -> bool:
        """Return whether a material is made of others."""
        return plugin in WRAPPERS

    @staticmethod
    def has_bump_shadows(material: mi.Properties) -> bool:
        """Return whether a material's bumps have shadows."""
        return has_bump_shadows(material)

    def only_reflects(self, index: int) -> bool:
        """Return whether a material of the physical half is known to let no light through."""
        return sides(self.pair.physical, index)[0]

    @cached_property
    def layered_bumps(self) -> set[int]:
        """The materials of which the textbook half has only one of several maps."""
        graph = self.pair.physical
        names = {
            loss.name
            for loss in self.pair.unrepresentable
            if (loss.lost, loss.nearest) in LAYERED_BUMPS
        }
        return {index for index in graph.nodes(BSDF) if graph.label(index) in names}

    @cached_property
    def surrounding_lamps(self) -> list[str]:
        """The labels of the shapes whose light is ambient light in the textbook half."""
        pairs = self.pair.pairing.emitters
        return [
            light.name for light in pairs if (light.given, light.derived) == ("area", "ambient")
        ]

    def surrounds(self, material: mi.Properties) -> bool:
        """Return whether a textbook material is that of a lamp around the scene."""
        return material.id() in map(lights.GLOWING.format, self.surrounding_lamps)

    @staticmethod
    def light_kind(plugin: str) -> LightKind:
        """Return the kind of a light of either half."""
        return kinds.of(plugin)

    @property
    def light_kinds(self) -> str:
        """The kinds of the physical half's lights, as evidence."""
        plugins = {light.kind for light in self.lights}
        return f"lights: {', '.join(sorted(plugins)) or 'none'}"

    @property
    def sees_through_lamps(self) -> bool:
        """Whether camera rays may pass a hidden lamp and then hit a shape that is not a mesh.

        Mitsuba's ``path`` and ``direct`` err there: they measure the distance behind the lamp from
        the camera. ``volpath`` and ``direct_all`` are right, and triangles do not need it.
        """
        hidden = self.pair.hide_emitters and len(self.lamps) > 0
        return hidden and not all(shape.is_mesh or shape in self.lamps for shape in self.shapes)

    @cached_property
    def lets_straight_through(self) -> bool:
        """Whether light may pass a surface unrefracted, as it does a mask.

        Mitsuba's ``path`` and ``direct`` err there: their shadow rays end at such a surface, camera
        rays that pass all surfaces lose what masks reflect, and hidden lamps show behind them.
        """
        return any(shape.lets_straight_through for shape in self.shapes)

    @property
    def is_clear(self) -> bool:
        """Whether a BSDF of the physical half may let light through."""
        return any(not shape.opaque for shape in self.shapes)


def _lights(graph: Graph) -> Iterator[LightFacts]:
    owners = {
        child: graph.props(shape).id()
        for shape in graph.nodes(SHAPE)
        for _, child in graph.children(shape, EMITTER)
    }
    for index in graph.nodes(EMITTER):
        plugin = graph.plugin(index)
        name = graph.label(index)
        if index in owners:
            yield LightFacts(name, plugin, shape=owners[index])
        else:
            location: dict[str, Any] = kinds.of(plugin).place(LightNode(graph, index))
            yield LightFacts(name, plugin, **location)
