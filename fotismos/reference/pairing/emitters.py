"""Replacing the lights of a scene by their counterparts, by ``reference.pairing.factors``.

Lights without a row in the table get the nearest light (:mod:`fotismos.reference.pairing.lamps`).

**Level.** A light without an exact pair differs from its form in the other half by shape. Its level
follows one rule, so only the shape differs: *equal flux if the light's parameters determine it;
otherwise equal mean irradiance over the surface that the camera sees.* A light that falls off as
the inverse square sends the same flux through any sphere about it, so its pair depends neither on
the scene nor on the view. A heuristic point or spot with another ``f_att`` has no single flux: it
depends on the distance, which only the scene determines.

Parallel light is an exact pair; so is a point with the fall-off of Mitsuba's.

Physical light has one intensity. A textbook light of two (6.6, 6.8) is paired by its diffuse one,
which determines the irradiance; its ``L_s`` is recorded as lost.
"""

from collections.abc import Callable, Iterator
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.reference.pairing import kinds
from fotismos.reference.pairing.factors import Convention, Replacements
from fotismos.reference.pairing.lights import LightNode, is_heuristic
from fotismos.reference.pairing.pairing_record import SECOND_INTENSITY
from fotismos.reference.scene import values
from fotismos.reference.scene.graph import Graph, properties

EMITTER = mi.ObjectType.Emitter


def to_heuristic(
    graph: Graph,
    geometry: Callable[[], mi.Scene],
    surface: Callable[[], Any],
    hide_emitters: bool,
    replaced: Replacements,
) -> Any:
    """Replace physical lights by heuristic ones, and return the radiance that becomes ``I_a``.

    ``geometry()`` returns the Mitsuba scene, ``surface()`` the `GBuffer` of what the camera sees
    without the shapes that shine. The environment stays as a background. With
    ``hide_emitters`` the shapes of area lights are taken out.
    """
    ambient = None
    for shape, key, index in list(_physical(graph)):
        if shape is not None:
            graph.detach(shape, key)
        light = LightNode(
            graph=graph,
            index=index,
            shape=shape,
            geometry=geometry,
            surface=surface,
            hide_emitters=hide_emitters,
            replaced=replaced,
        )
        kind = kinds.of(light.plugin)
        if kind.to_heuristic is None or kind.on_shape != (shape is not None):
            light.leave_out()
            continue
        glow = kind.to_heuristic(light)
        if glow is not None:
            ambient = glow if ambient is None else values.total_emission(graph, ambient, glow)
    return ambient


def to_physical(graph: Graph, surface: Callable[[], Any], replaced: Replacements) -> None:
    """Replace textbook lights by physical ones; ``surface()`` returns the visible `GBuffer`."""
    for index in [i for i in graph.nodes(EMITTER) if is_heuristic(graph.plugin(i))]:
        light = LightNode(graph, index, surface=surface, replaced=replaced)
        if len(set(light.intensities())) > 1:
            nearest = "its diffuse intensity L_d, for all reflection"
            replaced.lose(light.label, light.plugin, SECOND_INTENSITY, nearest)
        rule = kinds.of(light.plugin).to_physical
        if rule is None:
            raise NotImplementedError(
                f"{light.plugin} has no physical form. Name one in its `LightKind`."
            )
        rule(light)


def _physical(graph: Graph) -> Iterator[tuple[int | None, str, int]]:
    """Return shape, key and node of the physical lights; those of shapes come last."""
    on_shapes = [
        (shape, key, index)
        for shape in graph.nodes(mi.ObjectType.Shape)
        for key, index in graph.children(shape, EMITTER)
    ]
    owned = {index for _, _, index in on_shapes}
    for index in graph.nodes(EMITTER):
        if index not in owned and not is_heuristic(graph.plugin(index)):
            yield None, "", index
    for shape, key, index in on_shapes:
        if graph.plugin(index) != "heuristic_glow":
            yield shape, key, index


def add_glowing_shapes(graph: Graph, replaced: Replacements) -> None:
    """Give each shape whose ``phong`` has a ``k_i`` an area light of that radiance."""
    for shape in graph.nodes(mi.ObjectType.Shape):
        for _, bsdf in graph.children(shape, mi.ObjectType.BSDF):
            radiance = graph.props(bsdf).get("k_i", 0.0)
            if graph.plugin(bsdf) == "phong" and values.may_be_nonzero(radiance):
                light = graph.add(mi.ObjectType.Emitter, properties("area", radiance=radiance))
                graph.attach(shape, "emitter", light)
                replaced.emitter(graph.label(shape), "k_i", "area", 1.0)


def add_environment(
    physical: Graph, graph: Graph, ambient: Any, convention: Convention, replaced: Replacements
) -> None:
    """Add the constant environment that corresponds to ``I_a`` to the physical half of a graph.

    A physical surface has one diffuse reflectance. The ``matched`` radiance is ``I_a k_a / k_d``,
    by least squares if materials differ; the ``literal`` one is ``I_a``.
    """
    ratio = np.ones(3)
    exact = True
    if convention is Convention.MATCHED:
        ratio, exact = _ambient_ratio(graph)
    level = values.plain(ambient)
    if level is not None and (ratio != 1).any():
        ambient = tuple((np.multiply(level, ratio)).tolist())
    light = physical.add(mi.ObjectType.Emitter, properties("constant", radiance=ambient))
    physical.attach(0, "environment", light)
    note = f"radiance I_a k_a / k_d, k_a / k_d = ({', '.join(f'{r:.4g}' for r in ratio)})"
    replaced.emitter("ambient", "ambient", "constant", float(ratio.mean()), exact, note)


def _ambient_ratio(graph: Graph) -> tuple[np.ndarray, bool]:
    """Return ``k_a / k_d`` per channel by least squares, and whether it fits all materials."""
    phongs = graph.nodes(mi.ObjectType.BSDF, "phong")
    k_a = np.array([values.colour(graph, i, "k_a", 0.0) for i in phongs]).reshape(-1, 3)
    k_d = np.array([values.colour(graph, i, "k_d", 0.0) for i in phongs]).reshape(-1, 3)
    k_s = np.array([values.colour(graph, i, "k_s", 0.0) for i in phongs]).reshape(-1, 3)
    # Without a diffuse part the reflectance is k_a itself.
    has_part = np.logical_or(k_d.any(axis=1, keepdims=True), k_s.any(axis=1, keepdims=True))
    k_d = np.where(has_part, k_d, k_a)
    # Least squares without a constant: `sum k_a k_d / sum k_d^2`.
    weight = np.sum(k_d**2, axis=0)
    ratio = np.where(weight > 0, np.sum(k_a * k_d, axis=0) / np.where(weight > 0, weight, 1), 1.0)
    fits = np.abs(k_a - ratio * k_d) <= 1e-6 * np.maximum(k_a, 1e-6)
    return ratio, bool(fits.all() and not k_s.any())
