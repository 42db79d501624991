"""What a kind of light declares, and a light of a graph that its rules read and replace."""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property, partial
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.heuristic.convention import IRRADIANCE_PER_INTENSITY
from fotismos.heuristic.lights import (
    INVERSE_SQUARE,
    PLUGINS,
    Light,
    has_field,
)
from fotismos.reference.pairing.factors import INTENSITY_FACTOR, Replacements
from fotismos.reference.scene import values
from fotismos.reference.scene.graph import Graph, properties

FALLOFF_OF_MITSUBA = dict(zip(("k0", "k1", "k2"), map(float, INVERSE_SQUARE), strict=True))

GLOWING = "{}_glowing"
"""The id of the textbook material of a lamp, by the lamp's label."""


@dataclass
class LightNode:
    """A light of a graph that becomes one of the halves; rules read, replace and record it.

    ``shape`` is the node of the shape that shines, if any. ``geometry()`` returns the Mitsuba scene
    without materials, ``surface()`` the visible `GBuffer`, without the shapes that shine if the
    light is physical. With ``hide_emitters`` camera rays look through lights.
    """

    graph: Graph
    index: int
    shape: Any = None
    geometry: Any = None
    surface: Any = None
    hide_emitters: bool = False
    replaced: Replacements = field(default_factory=Replacements)

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
        """Return a parameter as a finite number, or raise ``InputError``."""
        return values.number(self.graph, self.index, key, default)

    def column(self, number: int) -> list[float]:
        """Return the first three components of a column of ``to_world``: an axis, or the origin."""
        matrix = self.value("to_world", mi.ScalarTransform4f()).matrix
        return [float(component) for component in np.array(matrix)[:3, number]]

    def vector(self, key: str, default: tuple[float, ...], column: int) -> np.ndarray:
        """Return a position or direction (3,), given directly or as a column of ``to_world``."""
        is_moved = "to_world" in self.graph.props(self.index)
        components = self.column(column) if is_moved else self.value(key, default)
        return np.ravel(components).astype(float)

    def position(self) -> np.ndarray:
        """Return the position of a light that shines from a point, (3,) in world space."""
        return self.vector("position", (0, 0, 0), 3)

    def travel(self) -> np.ndarray:
        """Return the direction in which parallel light travels, (3,) in world space."""
        return self.vector("direction", (0, 0, 1), 2)

    def intensities(self) -> tuple[Any, ...]:
        """Return ``L_d`` and ``L_s`` of a textbook light, without its scale."""
        colour = partial(values.colour, self.graph, self.index)
        common = colour("intensity", 1.0)
        return colour("diffuse_intensity", common), colour("specular_intensity", common)

    def scaled_intensity(self, factor: float) -> tuple[float, ...]:
        """Return ``L_d`` of a textbook light times a factor."""
        colour, _ = self.intensities()
        return tuple((np.multiply(colour, factor * self.number("scale", 1.0))).tolist())

    def replace(
        self,
        props: mi.Properties,
        factor: float = INTENSITY_FACTOR,
        exact: bool = True,
        note: str = "",
    ) -> None:
        """Replace it by a light of another plugin."""
        self._record(props.plugin_name(), factor, exact, note)
        self.graph.replace(self.index, props)

    def becomes_ambient(self, note: str = "", lost: str = "") -> None:
        """Record an environment that becomes ``I_a``; the node stays."""
        self._record("ambient", 1.0, not lost, note, lost)

    def leave_out(self) -> None:
        """Remove the light from the scene."""
        note = "left out: it has no nearest form"
        self._record("none", 0.0, False, note, "this kind of light")
        self.graph.remove(self.index)

    def _record(self, derived: str, factor: float, exact: bool, note: str, lost: str = "") -> None:
        self.replaced.emitter(self.label, self.plugin, derived, factor, exact, note)
        if lost:
            self.replaced.lose(self.label, self.plugin, lost, note)


@dataclass(frozen=True)
class LightKind:
    """A kind of light, and how it is paired.

    ``to_heuristic`` and ``to_physical`` are rules. The first replaces a light by its nearest form
    in the textbook half, and returns the radiance that becomes ``I_a``, if any; a kind without it
    is left out. The second replaces its heuristic form by the nearest physical light.

    ``plugins`` are Mitsuba's emitters of this kind, ``model`` its class in
    :mod:`fotismos.heuristic.lights`; None if the heuristic has no light of this kind. ``colour`` is
    the parameter that holds the intensity, if the kind is paired by its parameters. ``place``
    returns ``position`` or ``toward``, the direction to the light, (3,) each, if it has one. It may
    shine from a shape (``on_shape``), be ``exact`` (it needs no random numbers), or shine from
    everywhere (``surrounds``), evenly so (``uniform``).
    """

    plugins: tuple[str, ...]
    model: type[Light] | None = None
    colour: str = ""
    to_heuristic: Callable[[LightNode], Any] | None = None
    to_physical: Callable[[LightNode], None] | None = None
    place: Callable[[LightNode], dict[str, Any]] = lambda light: {}
    on_shape: bool = False
    exact: bool = False
    surrounds: bool = False
    uniform: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Its plugins in either half."""
        return self.plugins if self.model is None else (*self.plugins, self.model.plugin)

    def has(self, name: str) -> bool:
        """Return whether its heuristic form has a field, such as ``attenuation`` or ``cutoff``."""
        return self.model is not None and has_field(self.model, name)


def at_point(light: LightNode) -> dict[str, Any]:
    """Return the position of a light that shines from a point."""
    return {"position": light.position()}


def is_heuristic(plugin: str) -> bool:
    """Return whether an emitter is one of the heuristic's own lights."""
    return plugin in PLUGINS


def give_one_intensity(graph: Graph) -> None:
    """Let the textbook lights of a graph have their diffuse intensity for both terms."""
    for index in graph.nodes(mi.ObjectType.Emitter):
        props = graph.props(index)
        if is_heuristic(graph.plugin(index)):
            both = props.get("diffuse_intensity", props.get("intensity", 1.0))
            props["specular_intensity"] = both


def heuristic(plugin: str, scale: float = INTENSITY_FACTOR, **values: Any) -> mi.Properties:
    """Return the properties of a textbook light with the fall-off of Mitsuba's."""
    falloff = FALLOFF_OF_MITSUBA if has_field(PLUGINS[plugin], "attenuation") else {}
    return properties(plugin, scale=scale, **values, **falloff)


def level(
    light: LightNode, cone: Callable[..., Any], derived_cone: Callable[..., Any], flux_ratio: float
) -> tuple[float, str]:
    """Return the factor from ``I_p0`` of a point or spot to Mitsuba's intensity, and its rule.

    The cones are factors of the light and of Mitsuba's in directions of travel (N, 3),
    ``flux_ratio`` is the light's flux over Mitsuba's, for the same intensity on the axis.
    """
    k0 = light.number("k0", 1.0)
    k1 = light.number("k1", 0.0)
    k2 = light.number("k2", 0.0)
    clamped = light.value("clamped", False)
    # Equal flux, at any distance.
    if (k0, k1, k2) == INVERSE_SQUARE and not clamped:
        return IRRADIANCE_PER_INTENSITY * flux_ratio, ""

    # Otherwise equal mean irradiance over what the camera sees.
    def chapters(distance: Any, travel: Any) -> Any:
        factor = 1 / np.maximum(k0 + k1 * distance + k2 * distance**2, np.finfo(float).tiny)
        return (np.minimum(factor, 1) if clamped else factor) * cone(travel)

    def physical(distance: Any, travel: Any) -> Any:
        return derived_cone(travel) / distance**2

    position = light.position()
    here = light.surface().mean_irradiance(position, chapters)
    there = light.surface().mean_irradiance(position, physical)
    note = "same mean irradiance over the visible surface; only the fall-off's shape differs"
    return IRRADIANCE_PER_INTENSITY * (here / there if there > 0 else 1.0), note
