"""The cheapest reference that is right, chosen by what a scene calls for.

======================================  ===========================================================
What the scene calls for                What is simulated
======================================  ===========================================================
neither occlusion nor interreflection   ``direct_all`` without shadow rays; a constant environment
                                        from a table of the BSDF's albedo where there is one BSDF
no interreflection                      ``direct_all``: points and directions exactly, the rest
                                        sampled
interreflection between diffuse         ``direct_all`` with the indirect part sampled, and that
surfaces, several points or directions  alone (2, 4, 12 lights: 1.3, 1.3, 2.6 times as efficient as
                                        ``path``, which picks one of them for each sample)
interreflection                         ``path``, as deep as the scene allows; with glossy surfaces
                                        their noise decides, and it is the faster
a BSDF that may let light through       ``path``, whatever the depth
participating media                     ``volpath``, or ``volpathmis`` where the scene asks for it
                                        or its extinction has a colour
======================================  ===========================================================

All take the sampler of least noise for its time. Where no light needs random numbers, only the
pixel filter is left to sample; the same samples are then better in few passes of many, within which
they are stratified, and four passes are enough to see what noise is left.
"""

from dataclasses import replace

import mitsuba as mi

from heuristic.interpolation import Interpolation
from reference.effects.effect import Decision
from reference.effects.enumeration import EFFECTS
from reference.effects.interreflection import INTERREFLECTION
from reference.effects.light_forms import is_exact
from reference.effects.shadows import OCCLUSION
from reference.pairing.halves import Pair
from reference.pairing.nearest.operations import plain
from reference.planning.facts import Facts
from reference.planning.plan import PASSES, SAMPLER, STOCK_RR_DEPTH, STOCK_SAMPLER, Plan
from reference.planning.structure import BSDF, EMITTER, examine
from reference.rendering.indirect import RR_DEPTH
from reference.scene.graph import Graph

SPECTRAL_TEXTURES = ("regular", "irregular", "blackbody")
DETERMINISTIC_PASSES = 4


def sampler(everything: bool = False) -> str:
    """Return the sampler of a plan; it is known before the scene is, which is made with it."""
    return STOCK_SAMPLER if everything else SAMPLER


def plan(
    pair: Pair,
    scene: mi.Scene,
    interpolation: Interpolation = Interpolation.PHONG,
    everything: bool = False,
) -> Plan:
    """Decide on each effect, and choose the reference.

    Parameters
    ----------
    pair
        Both halves.
    scene
        The physical half, instantiated.
    interpolation
        Of the heuristic half.
    everything
        Switch all pruning off: what a user of Mitsuba gets without thinking, ``path`` with the
        independent sampler.
    """
    facts = Facts(pair, examine(pair.physical, scene), interpolation)
    decisions = tuple(effect.decide(facts) for effect in EFFECTS)
    chosen = _reference(facts, decisions)
    return chosen.unpruned() if everything else chosen


def _reference(facts: Facts, decisions: tuple[Decision, ...]) -> Plan:
    """Return the cheapest plan that is right, by the table of the module's docstring."""
    pair, graph = facts.pair, facts.pair.physical
    stock = Plan(
        decisions=decisions,
        kernel_terms=facts.kernel_terms,
        integrator=_stock(pair),
        max_depth=pair.max_depth,
        stock_integrator=_stock(pair),
        scene_depth=pair.max_depth,
        rr_depth=pair.rr_depth or RR_DEPTH,
    )
    if pair.media or facts.is_clear or 0 <= pair.max_depth < 2:
        return stock
    if stock.calls_for(INTERREFLECTION) and pair.max_depth != 2:
        exact = [light for light in facts.structure.lights if is_exact(light.kind)]
        if len(exact) > 1 and _diffuse(graph):
            return replace(stock, integrator="direct_all", rr_depth=STOCK_RR_DEPTH)
        return replace(stock, integrator="path")
    tabulated = not stock.calls_for(OCCLUSION) and _can_tabulate(graph)
    is_random = mi.is_spectral or any(
        not is_exact(light.kind) and not (tabulated and light.kind == "constant")
        for light in facts.structure.lights
    )
    return replace(
        stock.directly(),
        rr_depth=STOCK_RR_DEPTH,
        passes=PASSES if is_random else DETERMINISTIC_PASSES,
        tabulate_environment=tabulated,
    )


def _stock(pair: Pair) -> str:
    """Return Mitsuba's integrator for a scene: the one that it names, if that can follow media."""
    if pair.integrator in ("volpath", "volpathmis"):
        return pair.integrator
    if not pair.media:
        return "path"
    graph = pair.physical
    extinctions = (
        graph.props(index).get(key, 0.0)
        for index in graph.nodes(mi.ObjectType.Medium)
        for key in ("sigma_t", "sigma_s")
    )
    coloured = any(isinstance(plain(value), tuple) for value in extinctions)
    return "volpathmis" if coloured else "volpath"


def wants_spectra(graph: Graph) -> bool:
    """Tell whether a scene holds spectra that three numbers cannot stand for.

    Those are tabulated spectra, black bodies and spectral films; uniform values, RGB and Mitsuba's
    own daylight (``d65``), which RGB values are relative to, are not.
    """
    if any(graph.plugin(i) == "specfilm" for i in graph.nodes(mi.ObjectType.Film)):
        return True
    if any(graph.plugin(i) in SPECTRAL_TEXTURES for i in graph.nodes(mi.ObjectType.Texture)):
        return True
    return any(
        hasattr(value, "is_uniform") and not value.is_uniform()
        for index in graph.nodes_in_use()
        for _, value in graph.props(index).items()
    )


def _diffuse(graph: Graph) -> bool:
    return all(graph.plugin(index) in ("diffuse", "twosided") for index in graph.nodes(BSDF))


def _can_tabulate(graph: Graph) -> bool:
    """Tell whether the environment can be tabulated: one plain BSDF, one constant light, RGB."""
    shapes = graph.nodes(mi.ObjectType.Shape)
    extended = [graph.plugin(i) for i in graph.nodes(EMITTER)]
    extended = [plugin for plugin in extended if not is_exact(plugin)]
    textures = graph.nodes(mi.ObjectType.Texture)
    return len(shapes) == 1 and extended == ["constant"] and not textures and mi.is_rgb
