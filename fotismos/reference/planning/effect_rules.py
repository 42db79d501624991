"""The rules and sites of effects, which :mod:`fotismos.reference.planning.effects` names.

A rule returns whether a scene needs an effect, and the evidence. Sites are the nodes or keys of the
physical half's graph that have it; ``put`` functions replace them in a copy of that graph by what
the textbook half has.
"""

from collections.abc import Sequence
from typing import Any

import mitsuba as mi

from fotismos.heuristic.heuristics import Interpolation
from fotismos.reference.pairing import lights
from fotismos.reference.pairing.bsdfs import (
    LAYERED_BUMPS,
    WRAPPERS,
    has_bump_shadows,
    is_mirror,
)
from fotismos.reference.planning.facts import BSDF, EMITTER, SHAPE, Facts, sides
from fotismos.reference.scene.graph import Graph, graft

# --- Terms of the heuristic kernel -----------------------------------------------------------


def has_coefficient(facts: Facts, coefficient: str) -> tuple[bool, str]:
    """Whether a material has a coefficient that is not 0."""
    present = coefficient in facts.kernel_terms
    where = "not 0 in some material" if present else "0 in every material"
    if coefficient == "k_s" and any(map(is_mirror, facts.materials)):
        where += ", mirrors aside: the kernel traces no rays"
    return present, f"{coefficient} is {where}"


def has_ambient(facts: Facts) -> tuple[bool, str]:
    """Whether there is ambient light, and a material that reflects it."""
    if "ambient" not in facts.kernel:
        return False, "no ambient light"
    return has_coefficient(facts, "k_a")


def is_interpolated(facts: Facts) -> tuple[bool, str]:
    """Whether colours are interpolated over polygons, or constant."""
    interpolation = facts.interpolation
    return interpolation is not Interpolation.PHONG, f"interpolation {interpolation.value}"


def is_spectral(facts: Facts) -> tuple[bool, str]:
    """Whether light has wavelengths."""
    return mi.is_spectral, f"variant {mi.variant()}"


# --- Lights that differ in form --------------------------------------------------------------


def lights_of_two_intensities(facts: Facts) -> list[str]:
    """Find the lights whose specular intensity is lost."""
    lost = facts.pair.unrepresentable
    return [light.name for light in lost if light.lost == lights.SECOND_INTENSITY]


def has_two_intensities(facts: Facts) -> tuple[bool, str]:
    """Whether a light has two intensities."""
    names = lights_of_two_intensities(facts)
    return bool(names), f"lights of two intensities: {', '.join(names) or 'none'}"


def inexact_lights(facts: Facts, with_cone: bool) -> list[str]:
    """Find the keys of the scene's lights whose two forms differ by cone, or only by fall-off.

    A spot's attenuation goes with its cone: Mitsuba has no spot with another fall-off. An even cone
    (``m = 0``) is the same in both forms.
    """

    def has_uneven_cone(graph: Graph, index: int) -> bool:
        is_spot = lights.of(graph.plugin(index)).has("cutoff")
        return is_spot and graph.props(index).get("exponent", 0.0) != 0

    heuristic = facts.pair.heuristic
    physical = dict(facts.pair.physical.children(0, EMITTER))
    inexact = {light.name for light in facts.pair.pairing.emitters if not light.exact}
    return [
        key
        for key, index in heuristic.children(0, EMITTER)
        if key in physical
        and lights.of(heuristic.plugin(index)).has("attenuation")
        and has_uneven_cone(heuristic, index) is with_cone
        and heuristic.label(index) in inexact
    ]


def put_lights(graph: Graph, facts: Facts, keys: Sequence[str]) -> None:
    """Put the textbook half's lights into a graph."""
    emitters = dict(facts.pair.heuristic.children(0, EMITTER))
    for key in keys:
        graph.attach(0, key, graft(graph, facts.pair.heuristic, emitters[key]))


def is_attenuated(facts: Facts) -> tuple[bool, str]:
    """Distance attenuation: any point or spot whose ``f_att`` depends on the distance."""
    graph = facts.pair.heuristic
    for index in graph.nodes(EMITTER):
        props = graph.props(index)
        is_even = (props.get("k1", 0.0), props.get("k2", 0.0)) == (0.0, 0.0)
        if lights.of(graph.plugin(index)).has("attenuation") and not is_even:
            return True, f"{graph.label(index)} falls off with distance"
    return False, "no light of the textbook half falls off with distance"


def has_cone(facts: Facts) -> tuple[bool, str]:
    """Whether a light of either half has a cone."""
    halves = facts.pair.heuristic, facts.pair.physical
    plugins = (half.plugin(index) for half in halves for index in half.nodes(EMITTER))
    return any(lights.of(plugin).has("cutoff") for plugin in plugins), facts.light_kinds


def surrounding_lamps(facts: Facts) -> list[str]:
    """Return the labels of the shapes whose light is ambient light in the textbook half."""
    pairs = facts.pair.pairing.emitters
    return [light.name for light in pairs if (light.given, light.derived) == ("area", "ambient")]


def shining_shapes(facts: Facts) -> list[int]:
    """Find the shapes that shine, but for those that are ambient light in the textbook half."""
    graph = facts.pair.physical
    surrounding = surrounding_lamps(facts)
    return [
        shape
        for shape in graph.nodes(SHAPE)
        if graph.children(shape, EMITTER) and graph.label(shape) not in surrounding
    ]


def has_far_lights(facts: Facts) -> tuple[bool, str]:
    """Whether a shape shines that is a spot or point in the textbook half."""
    return bool(shining_shapes(facts)), facts.light_kinds


def put_far_lights(graph: Graph, facts: Facts, shapes: Sequence[int]) -> None:
    """Put the textbook half's lights into a graph, in place of shapes that shine."""
    for shape in shapes:
        for key, _ in graph.children(shape, EMITTER):
            detach(graph, facts, [(shape, key)])
    # The lights that only the textbook half has are those in place of shapes.
    before = dict(facts.pair.physical.children(0, EMITTER))
    emitters = facts.pair.heuristic.children(0, EMITTER)
    put_lights(graph, facts, [key for key, _ in emitters if key not in before])


def own_light(phong: mi.Properties, facts: Facts) -> dict[str, Any]:
    """Return the light of a textbook material itself, unless its shape surrounds the scene."""
    is_there = "k_i" in phong and not _surrounds(phong, facts)
    return {"k_i": phong["k_i"]} if is_there else {}


def _surrounds(phong: mi.Properties, facts: Facts) -> bool:
    return phong.id() in map(lights.GLOWING.format, surrounding_lamps(facts))


def surroundings(facts: Facts) -> list[tuple[int, str]]:
    """Find the lights that shine from everywhere, as node of their parent, and key in it."""
    graph = facts.pair.physical
    surrounding = surrounding_lamps(facts)
    shapes = [shape for shape in graph.nodes(SHAPE) if graph.label(shape) in surrounding]
    return [
        (parent, key)
        for parent in (0, *shapes)
        for key, index in graph.children(parent, EMITTER)
        if parent or not lights.of(graph.plugin(index)).exact
    ]


def is_surrounded(facts: Facts) -> tuple[bool, str]:
    """Whether a light shines from everywhere."""
    kinds = (light.kind for light in facts.lights if light.shape is None)
    around = surrounding_lamps(facts)
    evidence = f"; around the scene: {', '.join(around)}" if around else ""
    is_there = bool(around) or any(lights.of(kind).surrounds for kind in kinds)
    return is_there, facts.light_kinds + evidence


def detach(graph: Graph, facts: Facts, sites: Sequence[tuple[int, str]]) -> None:
    """Remove lights from a graph, and the shapes that shone if emitters are hidden."""
    for parent, key in sites:
        graph.detach(parent, key)
        if parent and facts.pair.hide_emitters:
            graph.remove(parent)


def ambient_light(phong: mi.Properties, facts: Facts) -> dict[str, Any]:
    """Return the ambient light that a textbook material reflects, and its own if it surrounds."""
    emitted = {"k_i": phong["k_i"]} if _surrounds(phong, facts) else {}
    if "k_a" in phong and "ambient" in facts.kernel:
        emitted |= {"k_a": phong["k_a"], "ambient": facts.kernel["ambient"]}
    return emitted


# --- Surfaces that differ in form ------------------------------------------------------------


def _materials(graph: Graph, shape: int) -> list[int]:
    """Return the BSDFs of a shape, and all that are nested in them."""
    return [
        index
        for _, bsdf in graph.children(shape, BSDF)
        for index in graph.nodes_in_use(bsdf)
        if graph.kind(index) == BSDF
    ]


def inexact_surfaces(facts: Facts, opaque: bool) -> list[int]:
    """Find the opaque shapes, or the others, whose two BSDFs differ; diffuse ones do not.

    What differs of bumps is an effect of its own.
    """
    graph = facts.pair.physical
    surfaces = []
    for shape in graph.nodes(SHAPE):
        materials = _materials(graph, shape)
        inner = [index for index in materials if graph.plugin(index) not in WRAPPERS]
        is_exact = all(graph.plugin(index) == "diffuse" for index in inner)
        is_masked = any(graph.plugin(index) == "mask" for index in materials)
        is_opaque = not is_masked and all(sides(graph, index)[0] for index in inner)
        if not is_exact and is_opaque is opaque:
            surfaces.append(shape)
    return surfaces


def lossy_bumps(facts: Facts) -> list[int]:
    """Find the shapes with bumps of which the textbook half lacks shadows or layers."""
    graph = facts.pair.physical
    layered = _layered_bumps(facts)
    return [
        shape
        for shape in graph.nodes(SHAPE)
        if any(
            index in layered or has_bump_shadows(graph.props(index))
            for index in _materials(graph, shape)
        )
    ]


def _layered_bumps(facts: Facts) -> set[int]:
    """Return the BSDFs of which the textbook half has only one of several maps."""
    graph = facts.pair.physical
    names = {
        loss.name
        for loss in facts.pair.unrepresentable
        if (loss.lost, loss.nearest) in LAYERED_BUMPS
    }
    return {index for index in graph.nodes(BSDF) if graph.label(index) in names}


def put_bumps(graph: Graph, facts: Facts, shapes: Sequence[int]) -> None:
    """Take the shadows of bumps from shapes; those with layers get the textbook half's material."""
    layered = _layered_bumps(facts)
    for shape in shapes:
        materials = _materials(graph, shape)
        if layered.intersection(materials):
            put_materials(graph, facts, [shape])
        for index in materials:
            if has_bump_shadows(graph.props(index)):
                graph.props(index)["use_shadowing_function"] = False


def has_lossy_bumps(facts: Facts) -> tuple[bool, str]:
    """Whether bumps have shadows, or maps lie over others."""
    if lossy_bumps(facts):
        return True, "a map's bumps have shadows, or maps lie over each other"
    return False, "no map's bumps have shadows, and no maps lie over each other"


def put_materials(graph: Graph, facts: Facts, shapes: Sequence[int]) -> None:
    """Give shapes the materials of the textbook half; shared materials stay shared."""
    replaced: dict[int, int] = {}
    for shape in shapes:
        ((key, _),) = graph.children(shape, BSDF)
        ((_, phong),) = facts.pair.heuristic.children(shape, BSDF)
        if phong not in replaced:
            replaced[phong] = graft(graph, facts.pair.heuristic, phong)
        graph.attach(shape, key, replaced[phong])


def is_reflected(facts: Facts) -> tuple[bool, str]:
    """Whether a BSDF is more than diffuse."""
    graph = facts.pair.physical
    plugins = {graph.plugin(index) for index in graph.nodes(BSDF)}
    return bool(plugins - {"diffuse", "null", *WRAPPERS}), f"BSDFs: {', '.join(sorted(plugins))}"
