"""What a kind of light declares, and what its rules read.

A kind is one module of :mod:`reference.pairing.lights` that ends in ``KIND = LightKind(...)``. It
says how the light is paired in both directions, and what planning, studies and the scenes between
the halves need to know of it.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields
from functools import cached_property

import mitsuba as mi
import numpy as np

from heuristic.light import Light
from heuristic.lights import INVERSE_SQUARE
from reference.pairing.factors import INTENSITY_FACTOR
from reference.planning.effects import Effect
from reference.scene import values
from reference.scene.graph import Graph, properties

FALLOFF_OF_MITSUBA = dict(zip(("k0", "k1", "k2"), map(float, INVERSE_SQUARE), strict=True))


@dataclass(frozen=True)
class PairedEmitter:
    """What a light was replaced by, the factor between the intensities, and what has no form."""

    name: str
    given: str
    derived: str
    factor: float
    exact: bool
    note: str = ""
    lost: str = ""


@dataclass(frozen=True)
class Given:
    """A light of a graph that is being changed into one of the halves, as rules read it.

    Attributes
    ----------
    graph, index
        The graph and the light's node.
    shape
        Node of the shape that shines, None for lights that belong to no shape.
    geometry : callable
        Returns the Mitsuba scene without materials, for the size and place of shapes.
    surface : callable
        Returns the `GBuffer` of the physical half, for the mean irradiance over it.
    hide_emitters
        Whether camera rays look through lights.
    """

    graph: Graph
    index: int
    shape: int | None = None
    geometry: Callable[[], mi.Scene] | None = None
    surface: Callable[[], object] | None = None
    hide_emitters: bool = False

    @property
    def plugin(self) -> str:
        """The name of the light's plugin."""
        return self.graph.plugin(self.index)

    @property
    def label(self) -> str:
        """A short name for records: see :meth:`Graph.label`."""
        return self.graph.label(self.index)

    @cached_property
    def emitter(self) -> mi.Emitter:
        """The light as Mitsuba makes it."""
        return self.graph.instantiate(self.index)

    def value(self, key: str, default: object) -> object:
        """Return a parameter as the parser keeps it."""
        return self.graph.props(self.index).get(key, default)

    def number(self, key: str, default: float) -> float:
        """Return a parameter as a finite number.

        Raises
        ------
        InputError
            When it is not one.
        """
        return values.number(self.graph, self.index, key, default)

    def column(self, number: int) -> list[float]:
        """Return the first three components of a column of ``to_world``: an axis, or the origin."""
        matrix = self.value("to_world", mi.ScalarTransform4f()).matrix
        return [float(component) for component in np.array(matrix)[:3, number]]

    @property
    def position(self) -> object:
        """The position of a point or spot, however it was given, in world space."""
        if "to_world" in self.graph.props(self.index):
            return mi.ScalarPoint3f(*self.column(3))
        return self.value("position", mi.ScalarPoint3f(0))

    @property
    def direction(self) -> list[float]:
        """The direction in which parallel light travels, however it was given; of any length."""
        if "to_world" in self.graph.props(self.index):
            return self.column(2)
        return [float(c) for c in np.ravel(self.value("direction", (0, 0, 1)))]

    def scaled_intensity(self, factor: float) -> tuple[float, ...]:
        """Return the intensity of a heuristic light times a factor."""
        colour = values.colour(self.graph, self.index, "intensity", 1.0)
        return values.scaled(colour, factor * self.number("scale", 1.0))

    def replace(
        self,
        plugin: str,
        factor: float = INTENSITY_FACTOR,
        exact: bool = True,
        note: str = "",
        **parameters: object,
    ) -> PairedEmitter:
        """Put a light of another plugin in its place, and return the record of it."""
        given = self.plugin
        self.graph.replace(self.index, properties(plugin, **parameters))
        return PairedEmitter(self.label, given, plugin, factor, exact, note)

    def becomes_ambient(self, note: str = "", lost: str = "") -> PairedEmitter:
        """Return the record of an environment that is ``I_a``; its node stays as a background."""
        return PairedEmitter(self.label, self.plugin, "ambient", 1.0, not lost, note, lost)

    def leave_out(self) -> PairedEmitter:
        """Take the light out of the scene, and return the record of it."""
        self.graph.remove(self.index)
        note = "left out: it has no nearest form"
        lost = "this kind of light"
        return PairedEmitter(self.label, self.plugin, "none", 0.0, False, note, lost)


@dataclass(frozen=True)
class LightKind:
    """A kind of light: one declaration.

    Attributes
    ----------
    plugins
        Mitsuba's emitters of this kind.
    to_heuristic
        Replaces the light by its nearest heuristic form, and returns the record of it.
    model
        Its class in :mod:`heuristic.lights`, None where the heuristic has no light of its own for
        it.
    to_physical
        Replaces the heuristic light by the physical one; None where there is no ``model``.
    ambient
        Returns the radiance that becomes ``I_a``, as the parser keeps it, or None; called before
        ``to_heuristic``.
    colour
        The parameter that holds the intensity, where the kind is paired by its parameters.
    place
        Returns ``position``, or ``toward`` (the direction to the light), (3,) each, in a dict;
        nothing for lights that have neither.
    exact
        Whether it needs no random numbers.
    surrounds
        Whether its light comes from everywhere: an environment.
    uniform
        Whether that light is the same from everywhere.
    on_shapes
        Whether it belongs to a shape that shines.
    effect
        The effect that tells its two forms apart, None where they are one.
    edits
        What a study can edit in place: for each plugin and property, its name below
        ``mitsuba.traverse``.
    """

    plugins: tuple[str, ...]
    to_heuristic: Callable[[Given], PairedEmitter]
    model: type[Light] | None = None
    to_physical: Callable[[Given], PairedEmitter] | None = None
    ambient: Callable[[Given], object] | None = None
    colour: str = ""
    place: Callable[[Given], dict[str, np.ndarray]] = lambda light: {}
    exact: bool = False
    surrounds: bool = False
    uniform: bool = False
    on_shapes: bool = False
    effect: Effect | None = None
    edits: Mapping[str, Mapping[str, str]] = field(default_factory=dict)

    @property
    def is_attenuated(self) -> bool:
        """Whether the heuristic form has the coefficients of 6.1."""
        return self._has("attenuation")

    @property
    def has_cone(self) -> bool:
        """Whether the light ends at the edge of a cone."""
        return self._has("cutoff")

    def _has(self, name: str) -> bool:
        return self.model is not None and name in {entry.name for entry in fields(self.model)}


def at_position(light: Given) -> dict[str, np.ndarray]:
    """Return the place of a light that shines from a point."""
    is_moved = "to_world" in light.graph.props(light.index)
    given = light.column(3) if is_moved else light.value("position", (0, 0, 0))
    return {"position": np.ravel(given).astype(float)}
