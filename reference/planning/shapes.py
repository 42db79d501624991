"""Facts about shapes: their form, which sides reflect, and which way normals point.

Everything here errs on one side: a shape is called flat, closed or convex only if that is certain
(:mod:`reference.planning.forms`).
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product

import mitsuba as mi
import numpy as np

from reference.pairing.nearest import rule_of
from reference.planning.forms import Form, Geometry, geometries
from reference.scene import values
from reference.scene.graph import Graph

BSDF, SHAPE = mi.ObjectType.BSDF, mi.ObjectType.Shape

CORNERS = np.array(list(product((False, True), repeat=3)))
"""Which end of a box each of its corners takes along each axis."""


@dataclass(frozen=True)
class ShapeFacts:
    """The facts of one shape.

    Attributes
    ----------
    name
        Its id.
    low, high
        Corners of its bounding box, (3,) each.
    form
        What is certain about its form.
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
    def facing(self) -> tuple[np.ndarray, float] | None:
        """``(direction, offset)`` of the half space that its only reflecting side looks into.

        It holds the points ``x`` with ``direction · x > offset``. None if light may come from
        anywhere.
        """
        if self.plane is None or self.outer == self.inner:
            return None
        point, normal = self.plane
        direction = normal if self.outer else -normal
        return direction, float(direction @ point)

    def corners(self) -> np.ndarray:
        """Return the corners of the bounding box, (8, 3)."""
        return np.where(CORNERS, self.high, self.low)


def shape_facts(graph: Graph, shapes: Sequence[mi.Shape]) -> tuple[ShapeFacts, ...]:
    """Return the facts of a scene's shapes, given the graph that they were made from."""
    nodes = {graph.props(index).id(): index for index in graph.nodes(SHAPE)}
    return tuple(
        _facts(graph, nodes.get(shape.id()), shape, form)
        for shape, form in zip(shapes, geometries(shapes), strict=True)
    )


def _facts(graph: Graph, index: int | None, shape: mi.Shape, found: Geometry) -> ShapeFacts:
    """Return the facts of a shape, given its node in the graph (None if it has none)."""
    box = shape.bbox()
    nested = graph.children(index, BSDF) if index is not None else []
    bsdf = nested[0][1] if nested else None  # an instance has its group's
    opaque, front, back = _sides(graph, bsdf)
    return ShapeFacts(
        name=shape.id(),
        low=np.array(box.min, float).ravel(),
        high=np.array(box.max, float).ravel(),
        form=found.form,
        outer=front if found.is_outward else back,
        inner=back if found.is_outward else front,
        shines_outwards=found.is_outward,
        plane=found.plane,
        opaque=opaque,
        sampled_as_hit=_is_sampled_as_hit(graph, index, shape),
    )


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
