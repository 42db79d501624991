"""The declaration of a kind of light, and the light that its rules read.

A kind is one :class:`LightKind` at the top of a module of :mod:`reference.pairing.lights`.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.light import PLUGINS, Light
from heuristic.lights import INVERSE_SQUARE
from reference.pairing.factors import INTENSITY_FACTOR
from reference.scene import values
from reference.scene.graph import Graph, properties

FALLOFF_OF_MITSUBA = dict(zip(("k0", "k1", "k2"), map(float, INVERSE_SQUARE), strict=True))


@dataclass(frozen=True)
class PairedEmitter:
    """The replacement of a light, the factor between the intensities, and what has no form."""

    name: str
    given: str
    derived: str
    factor: float
    exact: bool
    note: str = ""
    lost: str = ""


@dataclass(frozen=True)
class Given:
    """A light of a graph that becomes one of the halves; rules read and replace it.

    Attributes
    ----------
    graph, index
        The graph and the light's node.
    shape
        Node of the shape that shines, None for lights without a shape.
    geometry, surface
        Return the Mitsuba scene without materials, for the size and place of shapes, and the
        `GBuffer` for mean irradiances.
    hide_emitters
        Whether camera rays look through lights.
    """

    graph: Graph
    index: int
    shape: Any = None
    geometry: Any = None
    surface: Any = None
    hide_emitters: bool = False

    @property
    def plugin(self) -> str:
        """The name of the light's plugin."""
        return self.graph.plugin(self.index)

    @property
    def label(self) -> str:
        """A short name for records."""
        return self.graph.label(self.index)

    @cached_property
    def emitter(self) -> mi.Emitter:
        """The light as a Mitsuba object."""
        return self.graph.instantiate(self.index)

    def value(self, key: str, default: Any) -> Any:
        """Return a parameter as the parser keeps it."""
        return self.graph.props(self.index).get(key, default)

    def number(self, key: str, default: float) -> float:
        """Return a parameter as a finite number, or raise :class:`heuristic.errors.InputError`."""
        return values.number(self.graph, self.index, key, default)

    def column(self, number: int) -> list[float]:
        """Return the first three components of a column of ``to_world``: an axis, or the origin."""
        matrix = self.value("to_world", mi.ScalarTransform4f()).matrix
        return [float(component) for component in np.array(matrix)[:3, number]]

    def vector(self, key: str, default: tuple, column: int) -> np.ndarray:
        """Return a position or direction (3,), given directly or as a column of ``to_world``."""
        is_moved = "to_world" in self.graph.props(self.index)
        given = self.column(column) if is_moved else self.value(key, default)
        return np.ravel(given).astype(float)

    def position(self) -> np.ndarray:
        """Return the position of a light that shines from a point, (3,) in world space."""
        return self.vector("position", (0, 0, 0), 3)

    def scaled_intensity(self, factor: float) -> tuple[float, ...]:
        """Return the intensity of a heuristic light times a factor."""
        colour = values.colour(self.graph, self.index, "intensity", 1.0)
        return values.scaled(colour, factor * self.number("scale", 1.0))

    def replace(
        self, props: mi.Properties, factor: float, exact: bool = True, note: str = ""
    ) -> PairedEmitter:
        """Replace it by a light of another plugin, and return the record."""
        given = self.plugin
        self.graph.replace(self.index, props)
        return PairedEmitter(self.label, given, props.plugin_name(), factor, exact, note)

    def becomes_ambient(self, note: str = "", lost: str = "") -> PairedEmitter:
        """Return the record of an environment that becomes ``I_a``; the node stays."""
        return PairedEmitter(self.label, self.plugin, "ambient", 1.0, not lost, note, lost)

    def leave_out(self) -> PairedEmitter:
        """Remove the light from the scene, and return the record."""
        self.graph.remove(self.index)
        note, lost = "left out: it has no nearest form", "this kind of light"
        return PairedEmitter(self.label, self.plugin, "none", 0.0, False, note, lost)


@dataclass(frozen=True)
class LightKind:
    """A kind of light: one declaration.

    Attributes
    ----------
    plugins
        Mitsuba's emitters of this kind.
    to_heuristic, to_physical
        Replace the light by the nearest form, and return the record. The second is None if the
        heuristic has no light of this kind.
    model
        Its class in :mod:`heuristic.lights`, or None.
    ambient
        Returns the radiance that becomes ``I_a``, as the parser keeps it, or None.
    colour
        The parameter that holds the intensity, if the kind is paired by its parameters.
    place
        Returns ``position`` or ``toward``, the direction to the light, (3,) each; nothing for
        lights with neither.
    exact, surrounds, uniform, on_shapes
        Whether it needs no random numbers, shines from everywhere, shines evenly from everywhere,
        belongs to a shape.
    edits
        Properties that a study can edit in place: for each plugin and property, its name in
        ``mitsuba.traverse``.
    """

    plugins: tuple[str, ...]
    to_heuristic: Callable[[Given], PairedEmitter]
    to_physical: Callable[[Given], PairedEmitter] | None = None
    model: type[Light] | None = None
    ambient: Callable[[Given], Any] | None = None
    colour: str = ""
    place: Callable[[Given], dict[str, np.ndarray]] = lambda light: {}
    exact: bool = False
    surrounds: bool = False
    uniform: bool = False
    on_shapes: bool = False
    edits: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    def has(self, name: str) -> bool:
        """Return whether its heuristic form has a field, such as ``attenuation`` or ``cutoff``."""
        return self.model is not None and _has(self.model, name)


def heuristic(plugin: str, scale: float = INTENSITY_FACTOR, **values: Any) -> mi.Properties:
    """Return the properties of a heuristic light with the fall-off of Mitsuba's."""
    falloff = FALLOFF_OF_MITSUBA if _has(PLUGINS[plugin], "attenuation") else {}
    return properties(plugin, scale=scale, **values, **falloff)


def _has(model: Any, name: str) -> bool:
    return name in {entry.name for entry in fields(model)}
