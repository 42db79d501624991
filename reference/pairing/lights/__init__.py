"""Lights: one declaration per kind, paired both ways (table in :mod:`reference.pairing.factors`).

Lights without a row in the table get the nearest light: an environment or a sky becomes ``I_a``,
its mean radiance over the sphere, and the sun a directional light of its irradiance and mean
direction; a ``projector`` or textured ``spot`` becomes the even cone of the same solid angle and
flux; a textured ``area`` light has its mean radiance. Any other light is left out.

**Level.** A light without an exact pair differs from its form in the other half by shape. Its level
follows one rule, so only the shape differs: *equal flux if the light's parameters determine it;
otherwise equal mean irradiance over the surface that the camera sees.* A light that falls off as
the inverse square sends the same flux through any sphere about it, so its pair depends neither on
the scene nor on the view. A heuristic point or spot with another ``f_att`` has no single flux: it
depends on the distance, which only the scene determines.
"""

from collections.abc import Callable, Iterator
from typing import Any

import mitsuba as mi

from heuristic.lights import PLUGINS
from reference.pairing.factors import Replacements
from reference.pairing.lights.areas import AREA
from reference.pairing.lights.environments import CONSTANT, DAYLIGHT, ENVIRONMENT
from reference.pairing.lights.kind import LightKind, LightNode
from reference.pairing.lights.points import DIRECTIONAL, POINT, PROJECTOR, SPOT
from reference.scene import values
from reference.scene.graph import Graph

EMITTER, SHAPE = mi.ObjectType.Emitter, mi.ObjectType.Shape

KINDS: tuple[LightKind, ...] = (
    AREA,
    ENVIRONMENT,
    CONSTANT,
    DAYLIGHT,
    POINT,
    DIRECTIONAL,
    SPOT,
    PROJECTOR,
)

_by_plugin = {plugin: kind for kind in KINDS for plugin in kind.plugins}
_by_plugin |= {kind.model.plugin: kind for kind in KINDS if kind.model is not None}


def of(plugin: str) -> LightKind:
    """Return the kind of an emitter, of either half, by the name of its plugin.

    An unknown one counts as an environment, about which premises may assume the least.
    """
    return _by_plugin.get(plugin, ENVIRONMENT)


def is_heuristic(plugin: str) -> bool:
    """Return whether an emitter is one of the heuristic's own lights."""
    return plugin in PLUGINS


def check(graph: Graph) -> None:
    """Reject intensities that are negative or not finite."""
    for index in graph.nodes(EMITTER):
        plugin = graph.plugin(index)
        colour = "intensity" if is_heuristic(plugin) else of(plugin).colour
        if colour:
            values.check_colours(graph, index, (colour,))


def to_heuristic(
    graph: Graph,
    geometry: Callable[[], mi.Scene],
    hide_emitters: bool,
    replaced: Replacements,
) -> Any:
    """Replace physical lights by heuristic ones, and return the radiance that becomes ``I_a``.

    ``geometry()`` returns the Mitsuba scene, for the size and place of area lights. The environment
    stays as a background. With ``hide_emitters`` the shapes of area lights are taken out.
    """
    ambient = None
    for shape, key, index in list(_lights(graph)):
        if shape is not None:
            graph.detach(shape, key)
        light = LightNode(
            graph, index, shape, geometry, hide_emitters=hide_emitters, replaced=replaced
        )
        kind = of(light.plugin)
        if kind.on_shapes != (shape is not None):
            kind = ENVIRONMENT
        found = kind.ambient(light) if kind.ambient is not None else None
        ambient = ambient if found is None else found
        kind.to_heuristic(light)
    return ambient


def to_physical(graph: Graph, surface: Callable[[], Any], replaced: Replacements) -> None:
    """Replace heuristic lights by physical ones.

    ``surface()`` returns the `GBuffer` for the mean irradiance, which is used if the attenuation is
    not the inverse square.
    """
    own = [index for index in graph.nodes(EMITTER) if is_heuristic(graph.plugin(index))]
    for index in own:
        if way := of(graph.plugin(index)).to_physical:
            way(LightNode(graph, index, surface=surface, replaced=replaced))


def _lights(graph: Graph) -> Iterator[tuple[int | None, str, int]]:
    """Return shape, key and node of the physical lights; those of shapes come last."""
    on_shapes = [
        (shape, key, index)
        for shape in graph.nodes(SHAPE)
        for key, index in graph.children(shape, EMITTER)
    ]
    owned = {index for _, _, index in on_shapes}
    for index in graph.nodes(EMITTER):
        if index not in owned and not is_heuristic(graph.plugin(index)):
            yield None, "", index
    for shape, key, index in on_shapes:
        if graph.plugin(index) != "heuristic_glow":
            yield shape, key, index
