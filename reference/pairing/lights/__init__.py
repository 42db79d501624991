"""Lights: one declaration per kind, paired both ways (table in :mod:`reference.pairing.factors`).

The kinds are the :class:`LightKind` at the top of this package's modules; nothing else lists them.
Lights without a row in the table get the nearest light:

==================================  ===============================================================
Physical                            Nearest
==================================  ===============================================================
``envmap`` and other environments   ``I_a``, its mean radiance over the sphere
``sunsky``, ``timed_sunsky``        the same for the sky; the sun is a directional light of its
                                    irradiance and mean direction
``projector``, textured ``spot``    a spot: the even cone of the same solid angle and flux
textured ``area``                   as ``area``, of its mean radiance
any other                           none: it is left out
==================================  ===============================================================

**Level.** A light without an exact pair differs from its form in the other half by shape. Its level
follows one rule, so only the shape differs:

*Equal flux if the light's parameters determine it; otherwise equal mean irradiance over the surface
that the camera sees.*

A light that falls off as the inverse square sends the same flux through any sphere about it. Its
pair then depends neither on the scene nor on the view. A light with another ``f_att`` has no single
flux: it depends on the distance, which only the scene determines.

===============================  ==================================================================
Equal flux                       ``spot`` both ways, textured ``spot``, ``projector``; ``area``, in
                                 its far field; of environments the mean radiance, which is equal
                                 flux through a small sphere, and the sun's irradiance
Equal mean irradiance            ``heuristic_point``, ``heuristic_spot`` of another ``f_att`` than
                                 ``1 / d^2``
===============================  ==================================================================
"""

from collections.abc import Callable, Iterator
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import mitsuba as mi

from heuristic.light import PLUGINS
from reference.pairing.lights import environments
from reference.pairing.lights.kind import Given, LightKind, PairedEmitter
from reference.scene import values
from reference.scene.graph import Graph

EMITTER, SHAPE = mi.ObjectType.Emitter, mi.ObjectType.Shape

_modules = [import_module(f"{__name__}.{found.name}") for found in iter_modules(__path__)]
KINDS: tuple[LightKind, ...] = tuple(
    kind for module in _modules for kind in vars(module).values() if isinstance(kind, LightKind)
)

_by_plugin = {plugin: kind for kind in KINDS for plugin in kind.plugins}
_by_plugin |= {kind.model.plugin: kind for kind in KINDS if kind.model is not None}


def of(plugin: str) -> LightKind:
    """Return the kind of an emitter, of either half, by the name of its plugin.

    An unknown one counts as an environment, about which premises may assume the least.
    """
    return _by_plugin.get(plugin, environments.ENVIRONMENT)


def is_heuristic(plugin: str) -> bool:
    """Return whether an emitter is one of the heuristic's own lights."""
    return plugin in PLUGINS


def check(graph: Graph) -> None:
    """Reject intensities that are negative or not finite.

    Raises
    ------
    InputError
        Naming the parameter, its value and its place.
    """
    for index in graph.nodes(EMITTER):
        plugin = graph.plugin(index)
        colour = "intensity" if is_heuristic(plugin) else of(plugin).colour
        if colour:
            values.check_colours(graph, index, (colour,))


def to_heuristic(
    graph: Graph, geometry: Callable[[], mi.Scene], hide_emitters: bool
) -> tuple[list[PairedEmitter], Any]:
    """Replace physical lights by heuristic ones.

    ``geometry()`` returns the Mitsuba scene, for the size and place of area lights. The environment
    stays as a background. With ``hide_emitters`` the shapes of area lights are taken out.

    Returns
    -------
    records : list of PairedEmitter
    ambient : Any or None
        The radiance of the environment, as the parser keeps it, to become ``I_a``.
    """
    records, ambient = [], None
    for shape, key, index in list(_lights(graph)):
        if shape is not None:
            graph.detach(shape, key)
        light = Given(graph, index, shape, geometry, hide_emitters=hide_emitters)
        kind = of(light.plugin)
        if kind.on_shapes != (shape is not None):
            kind = environments.ENVIRONMENT
        found = kind.ambient(light) if kind.ambient is not None else None
        ambient = ambient if found is None else found
        records.append(kind.to_heuristic(light))
    return records, ambient


def to_physical(graph: Graph, surface: Callable[[], Any]) -> list[PairedEmitter]:
    """Replace heuristic lights by physical ones.

    ``surface()`` returns the `GBuffer` for the mean irradiance, which is used if the attenuation is
    not the inverse square.
    """
    own = [index for index in graph.nodes(EMITTER) if is_heuristic(graph.plugin(index))]
    ways = [(index, of(graph.plugin(index)).to_physical) for index in own]
    return [way(Given(graph, index, surface=surface)) for index, way in ways if way]


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
