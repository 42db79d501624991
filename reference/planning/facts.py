"""Facts about a pair for the rules of planning: shapes, lights, and where camera rays begin.

Everything here errs on one side, so a rule that relies on it never leaves out light that exists.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.interpolation import Interpolation
from heuristic.plugins.phong import COEFFICIENTS
from reference.pairing import lights
from reference.pairing.halves import Pair
from reference.pairing.lights.kind import LightNode
from reference.planning.shapes import ShapeFacts
from reference.scene import values
from reference.scene.graph import Graph

BSDF, EMITTER, SENSOR, SHAPE = (
    getattr(mi.ObjectType, kind) for kind in ("BSDF", "Emitter", "Sensor", "Shape")
)

PLANAR = ("perspective", "thinlens", "orthographic")
"""Sensors whose rays begin in one plane, within the convex hull of those at the film's corners and
the lens's edge."""

EDGE = 8
"""Points along each side of the square that maps to the lens."""

MARGIN = 1.05
"""Widens the polygon of points on a lens's edge until it holds the disk, with rounding."""


@dataclass(frozen=True)
class CameraFacts:
    """Where the rays of a camera begin: a set of points, not one.

    A perspective camera's rays begin on its near clip plane, those of a thin lens on that plane
    too, and those of an orthographic camera on a plane as wide as the picture.

    Attributes
    ----------
    origins
        Corners of a convex set that holds all origins, (N, 3); None if unknown, as for a sensor on
        a shape, and no rule may rely on the camera's position.
    axis
        Unit normal of the plane that the set lies in, (3,).
    is_still
        Whether the shutter opens only for an instant.
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
        film, border = sensor.film(), 0.0
        if film.sample_border():
            border = film.rfilter().border_size() / min(film.crop_size())
        ends, steps = (-border, 1 + border), np.arange(EDGE) / EDGE
        across = np.concatenate([steps, np.ones(EDGE), 1 - steps, np.zeros(EDGE)])
        lens = np.stack([across, np.roll(across, EDGE)])  # around the square's edge
        places = np.array([(x, y) for x in ends for y in ends]).T
        on_film = mi.Point2f(np.repeat(places, 4 * EDGE, axis=1))
        on_lens = mi.Point2f(np.tile(lens, 4))
        ray, _ = sensor.sample_ray(0.0, 0.5, on_film, on_lens)
        origins = np.array(ray.o, float).T
        middle = origins.mean(axis=0)
        axis = np.ravel(np.array(sensor.world_transform().matrix, float)[:3, 2])
        wide = middle + MARGIN * (origins - middle)
        return cls(plugin, wide, axis / np.linalg.norm(axis), is_still)

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
            box, begin = corners @ direction, self.origins @ direction
            gap = max(box.min() - begin.max(), begin.min() - box.max())
            if gap > 1e-6 * max(np.abs(box).max(), np.abs(begin).max()):
                return True
        return False


@dataclass(frozen=True)
class LightFacts:
    """The facts of one light.

    ``position`` belongs to a point or spot, ``toward`` the direction to a directional light,
    ``shape`` the name of the shape of an area light; the others are None.
    """

    name: str
    kind: str
    position: np.ndarray | None = None
    toward: np.ndarray | None = None
    shape: str | None = None


@dataclass(frozen=True)
class Facts:
    """Facts about a pair in the current variant; shapes, lights and camera of the physical half.

    ``rule_results`` holds the results of the rules of pruning so far, by name.
    """

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
        return shape.is_hollow and not self.camera.is_outside(shape)

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
    def light_kinds(self) -> str:
        """The kinds of the physical half's lights, as evidence."""
        kinds = {light.kind for light in self.lights}
        return f"lights: {', '.join(sorted(kinds)) or 'none'}"

    @property
    def sees_through_lamps(self) -> bool:
        """Whether camera rays may pass a hidden lamp and then hit a shape that is not a mesh.

        Mitsuba's ``path`` and ``direct`` err there: they measure the distance behind the lamp from
        the camera. ``volpath`` and ``direct_all`` are right, and triangles do not need it.
        """
        hidden = self.pair.hide_emitters and len(self.lamps) > 0
        return hidden and not all(shape.is_mesh or shape in self.lamps for shape in self.shapes)

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
        plugin, name = graph.plugin(index), graph.label(index)
        if index in owners:
            yield LightFacts(name, plugin, shape=owners[index])
        else:
            place: dict[str, Any] = lights.of(plugin).place(LightNode(graph, index))
            yield LightFacts(name, plugin, **place)
