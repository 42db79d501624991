"""Facts about a scene that the planning rules reason from: what its shapes and lights are.

Everything here errs on one side: a shape is called convex, flat, or unable to see another one only
where that is certain, so that a rule that rests on it never leaves out light that is there.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import mitsuba as mi
import numpy as np

from heuristic.interpolation import Interpolation
from heuristic.plugins.phong import COEFFICIENTS
from reference.pairing import lights
from reference.pairing.halves import Pair
from reference.pairing.lights.kind import Given
from reference.pairing.nearest import rule_of
from reference.scene import values
from reference.scene.graph import Graph

BSDF, EMITTER, SHAPE = (getattr(mi.ObjectType, kind) for kind in ("BSDF", "Emitter", "Shape"))

ROUNDING = 1e-6
"""Of a mesh's size: dents less deep than single precision resolves do not count."""

LARGEST_MESH = 4_000_000
"""Vertices times faces up to which convexity is examined; larger meshes count as not convex."""


@dataclass(frozen=True)
class ShapeFacts:
    """What is known about one shape.

    Attributes
    ----------
    name
        Its id.
    low, high
        Corners of its bounding box, (3,) each.
    convex
        No point of the side that reflects sees another of its points (for closed shapes, from
        outside), and its shading normals are those of its surface.
    plane
        ``(point, normal)`` of a flat shape that reflects on the side of its normal alone, else
        None.
    reflects
        Whether its BSDF can reflect anything.
    opaque
        Whether its BSDF only reflects; a light that comes through is beyond these rules.
    """

    name: str
    low: np.ndarray
    high: np.ndarray
    convex: bool
    plane: tuple | None
    reflects: bool
    opaque: bool

    def corners(self) -> np.ndarray:
        """Return the corners of the bounding box, (8, 3)."""
        choice = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, 8).T
        return np.where(choice, self.high, self.low)

    def may_face(self, other: "ShapeFacts") -> bool:
        """Tell whether this shape can receive light from another one, as far as planes tell."""
        if self.plane is None:
            return True
        point, normal = self.plane
        margin = ROUNDING * np.max(np.abs(other.high - other.low), initial=1e-30)
        return bool(np.max((other.corners() - point) @ normal) > margin)


@dataclass(frozen=True)
class LightFacts:
    """What is known about one light.

    ``position`` is that of a point or spot, ``toward`` the direction to a directional light,
    ``shape`` the name of the shape of an area light; the others are None.
    """

    name: str
    kind: str
    position: np.ndarray | None = None
    toward: np.ndarray | None = None
    shape: str | None = None


@dataclass(frozen=True)
class Structure:
    """The facts of a scene: shapes, lights, and where its cameras stand."""

    shapes: tuple[ShapeFacts, ...]
    lights: tuple[LightFacts, ...]
    cameras: tuple[np.ndarray, ...]


def examine(graph: Graph, scene: mi.Scene) -> Structure:
    """Return the :class:`Structure` of a physical half: its graph, and the same instantiated."""
    nodes = {graph.props(index).id(): index for index in graph.nodes(SHAPE)}
    shapes = tuple(_shape_facts(graph, nodes.get(shape.id()), shape) for shape in scene.shapes())
    cameras = tuple(np.ravel(sensor.world_transform().translation()) for sensor in scene.sensors())
    return Structure(shapes, tuple(_lights(graph)), cameras)


def _shape_facts(graph: Graph, index: int | None, shape: mi.Shape) -> ShapeFacts:
    box = shape.bbox()
    nested = graph.children(index, BSDF) if index is not None else []
    bsdf = nested[0][1] if nested else None  # an instance has those of its group
    plugins, reflects, twosided = _surface(graph, bsdf)
    convex, plane = _geometry(shape, twosided)
    return ShapeFacts(
        name=shape.id(),
        low=np.ravel(box.min),
        high=np.ravel(box.max),
        convex=convex,
        plane=plane,
        reflects=reflects,
        opaque=bool(plugins) and all(rule_of(p).reflectances is not None for p in plugins),
    )


def _surface(graph: Graph, bsdf: int | None) -> tuple[tuple[str, ...], bool, bool]:
    """Return the plugins of a BSDF, whether it can reflect, and whether it is two-sided."""
    if bsdf is None:
        return (), True, True
    if graph.plugin(bsdf) == "twosided":
        inner = [_surface(graph, child) for _, child in graph.children(bsdf, BSDF)]
        plugins = tuple(plugin for found, _, _ in inner for plugin in found)
        return plugins, any(reflects for _, reflects, _ in inner), True
    plugin, props = graph.plugin(bsdf), graph.props(bsdf)
    reflectances = rule_of(plugin).reflectances
    if reflectances is None:
        return (plugin,), True, True
    reflects = any(
        values.may_be_nonzero(props.get(name, default)) for name, default in reflectances.items()
    )
    return (plugin,), reflects, bool(props.get("twosided", False))


def _geometry(shape: mi.Shape, twosided: bool) -> tuple[bool, tuple | None]:
    """Tell whether a shape is convex, and its plane if it is flat and one-sided."""
    kind = shape.shape_type()
    if kind == +mi.ShapeType.Sphere:
        return True, None
    if kind in (+mi.ShapeType.Rectangle, +mi.ShapeType.Disk):
        sample = shape.sample_position(0.0, mi.Point2f(0.5))
        plane = np.array(sample.p)[:, 0], np.array(sample.n)[:, 0]
        return True, None if twosided else plane
    if shape.is_mesh():
        # The back of an open mesh may see itself; only one-sided BSDFs keep it black.
        return not twosided and _is_convex(shape), None
    return False, None


def _is_convex(mesh: mi.Mesh) -> bool:
    """Tell whether all vertices lie behind all faces, and shading normals are the faces' own.

    A bowl whose faces look inward has all vertices before them, and is not convex in this sense.
    """
    from heuristic import meshes  # which few scenes need

    if mesh.vertex_count() * mesh.face_count() > LARGEST_MESH:
        return False
    points = np.array(meshes.positions(mesh), float).T
    faces = np.array(meshes.faces(mesh)).T
    a, b, c = (points[faces[:, i]] for i in range(3))
    normal = np.cross(b - a, c - a)
    length = np.linalg.norm(normal, axis=1)
    if not len(faces) or length.min() == 0:
        return False
    normal /= length[:, None]
    size = np.ptp(points, axis=0).max()
    height = np.einsum("fi,vi->fv", normal, points) - np.einsum("fi,fi->f", normal, a)[:, None]
    if height.max() > ROUNDING * size:
        return False
    if mesh.has_vertex_normals() and not mesh.has_face_normals():
        shading = np.array(meshes.normals(mesh), float).T[faces]
        return bool(np.einsum("fki,fi->fk", shading, normal).min() > 1 - ROUNDING)
    return True


def _lights(graph: Graph) -> Iterator[LightFacts]:
    owners = {
        child: graph.props(shape).id()
        for shape in graph.nodes(SHAPE)
        for _, child in graph.children(shape, EMITTER)
    }
    for index in graph.nodes(EMITTER):
        plugin, name = graph.plugin(index), graph.label(index)
        if index in owners:
            yield LightFacts(name, plugin, shape=owners[index])
            continue
        yield LightFacts(name, plugin, **lights.of(plugin).place(Given(graph, index)))


@dataclass(frozen=True)
class Facts:
    """Facts about a pair in the current variant.

    Parameters
    ----------
    pair
        Both halves.
    structure
        Of the physical half.
    interpolation
        Of the heuristic half.
    """

    pair: Pair
    structure: Structure
    interpolation: Interpolation = Interpolation.PHONG

    @cached_property
    def kernel(self) -> mi.Properties:
        """The parameters of the heuristic half's integrator."""
        graph = self.pair.heuristic
        return graph.props(graph.nodes(mi.ObjectType.Integrator)[0])

    @property
    def has_shadows(self) -> bool:
        """Whether the heuristic half itself has shadows."""
        return self.kernel.get("occlusion", False)

    @cached_property
    def kernel_terms(self) -> tuple[str, ...]:
        """The coefficients that are not 0 in every material."""
        graph = self.pair.heuristic
        materials = [graph.props(i) for i in graph.nodes(BSDF) if graph.plugin(i) == "phong"]
        return tuple(
            name
            for name in COEFFICIENTS
            if any(name in props and values.may_be_nonzero(props[name]) for props in materials)
        )

    @property
    def lights_in_words(self) -> str:
        """The kinds of the physical half's lights, as evidence."""
        kinds = {light.kind for light in self.structure.lights}
        return f"lights: {', '.join(sorted(kinds)) or 'none'}"

    @cached_property
    def is_clear(self) -> bool:
        """Whether a BSDF of the physical half may let light through."""
        return any(not shape.opaque for shape in self.structure.shapes)
