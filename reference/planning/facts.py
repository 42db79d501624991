"""Facts about a scene for the rules of planning: shapes, lights, camera.

Everything here errs on one side, so a rule that relies on it never leaves out light that exists.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.interpolation import Interpolation
from heuristic.plugins.phong import COEFFICIENTS
from reference.pairing import lights
from reference.pairing.halves import Pair
from reference.pairing.lights.kind import Given
from reference.planning.cameras import CameraFacts, camera_of
from reference.planning.shape_tree import ShapeTree
from reference.planning.shapes import ShapeFacts, shape_facts
from reference.scene import values
from reference.scene.graph import Graph

BSDF, EMITTER, SENSOR, SHAPE = (
    getattr(mi.ObjectType, kind) for kind in ("BSDF", "Emitter", "Sensor", "Shape")
)


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
class Structure:
    """The facts of a scene: shapes, lights, and where its camera's rays begin."""

    shapes: tuple[ShapeFacts, ...]
    lights: tuple[LightFacts, ...]
    camera: CameraFacts

    def may_be_seen_from_inside(self, shape: ShapeFacts) -> bool:
        """Return whether a camera ray may begin inside a closed shape that reflects there."""
        return shape.is_hollow and not self.camera.is_outside(shape.corners())

    @cached_property
    def numbers(self) -> dict[str | None, int]:
        """The position of each shape among them, by its name; the first of several of that name."""
        return {shape.name: i for i, shape in reversed(list(enumerate(self.shapes)))}

    def shape(self, name: str | None) -> ShapeFacts | None:
        """Return the shape of a name, None if there is none."""
        return self.shapes[self.numbers[name]] if name in self.numbers else None

    @cached_property
    def reflecting(self) -> np.ndarray:
        """The numbers of the shapes that reflect."""
        return np.array([i for i, shape in enumerate(self.shapes) if shape.reflects], int)

    @cached_property
    def tree(self) -> ShapeTree:
        """The shapes in a tree."""
        return ShapeTree.of(self.shapes)

    @cached_property
    def reflecting_tree(self) -> ShapeTree:
        """The shapes that reflect, in a tree."""
        return self.tree.holding(self.reflecting)


def examine(graph: Graph, scene: mi.Scene) -> Structure:
    """Return the :class:`Structure` of a physical half, given its graph and its scene."""
    shapes = shape_facts(graph, scene.shapes())
    plugins = ", ".join(graph.plugin(index) for index in graph.nodes(SENSOR))
    camera = camera_of(plugins, scene.sensors())
    return Structure(shapes, tuple(_lights(graph)), camera)


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
        place: dict[str, Any] = lights.of(plugin).place(Given(graph, index))
        yield LightFacts(name, plugin, **place)


@dataclass(frozen=True)
class Facts:
    """Facts about a pair in the current variant.

    Parameters
    ----------
    pair
        Both halves.
    structure
        Structure of the physical half.
    interpolation
        Interpolation of the heuristic half.
    """

    pair: Pair
    structure: Structure
    interpolation: Interpolation = Interpolation.PHONG

    @cached_property
    def rulings(self) -> dict:
        """Rulings so far, by rule of pruning."""
        return {}

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
