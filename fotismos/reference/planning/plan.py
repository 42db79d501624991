"""The cheapest correct reference, chosen by the effects that a scene needs.

======================================  ===========================================================
The scene needs                         Simulated
======================================  ===========================================================
neither occlusion nor interreflection   ``direct_all`` without shadow rays; a constant environment
                                        from a table of the BSDF's albedo if there is one BSDF
no interreflection                      ``direct_all``: points and directions exactly, the rest
                                        sampled
interreflection between diffuse         ``direct_all`` with the indirect part sampled, and that
surfaces, several points or directions  alone (2, 4, 12 lights: 1.3, 1.3, 2.6 times as efficient as
                                        ``path``, which picks one of them for each sample)
interreflection                         ``path``, as deep as the scene allows; with glossy surfaces
                                        their noise decides, and it is the faster
curved shapes behind hidden lamps;      ``volpath`` in place of ``path`` and ``direct``, which err
masks, and what else lets light
straight through
a BSDF that may let light through       ``path``, whatever the depth
participating media                     ``volpath``, or ``volpathmis`` where the scene asks for it
                                        or its extinction is coloured
======================================  ===========================================================

All take the sampler of :mod:`fotismos.reference.rendering.sampler`, stratified within a pass: few
passes of many samples are better than many of few, and eight are enough for standard errors. If
only the pixel filter is sampled, four show the remaining noise.
"""

from typing import Any

import mitsuba as mi
from msgspec.structs import replace

from fotismos.heuristic.convention import Scene
from fotismos.heuristic.heuristics import Interpolation
from fotismos.reference.pairing import kinds
from fotismos.reference.pairing.halves import Pair
from fotismos.reference.planning.effects import EFFECTS, INTERREFLECTION
from fotismos.reference.planning.facts import BSDF, Facts
from fotismos.reference.planning.plan_record import PASSES, SPP, Plan
from fotismos.reference.planning.rules import LIGHT_BY_LIGHT, RULES, TABULATED_ENVIRONMENT
from fotismos.reference.records import PATHS, RR_DEPTH
from fotismos.reference.rendering import direct
from fotismos.reference.scene.graph import Graph
from fotismos.reference.scene.values import plain

EXACT_SPP = 64
EXACT_PASSES = 4
"""Samples and passes of plans in which only camera rays are random. Only edges then have noise, and
four times as many samples change mean errors by 1e-5."""


def plan(
    pair: Pair,
    scene: mi.Scene,
    interpolation: Interpolation = Interpolation.PHONG,
    everything: bool = False,
) -> Plan:
    """Decide on each effect, and choose the reference; ``scene`` is the physical half.

    ``everything`` switches all pruning off, for Mitsuba's default with the independent sampler.
    """
    chosen = _reference(Facts.of(pair, scene, interpolation))
    return chosen.unpruned() if everything else chosen


def physical_integrator(plan: Plan, scene: Scene, hide_emitters: bool) -> Any:
    """Make the integrator that a plan names, for the physical half's scene."""
    direct.register()
    description = {"type": plan.integrator, "hide_emitters": hide_emitters}
    if plan.integrator == "direct":
        return mi.load_dict(description)
    description["max_depth"] = plan.max_depth
    if plan.integrator in PATHS:
        return mi.load_dict(description | {"rr_depth": plan.rr_depth})
    settings = {"shadows": plan.shadows, "bsdf_samples": plan.bsdf_samples}
    integrator = mi.load_dict(description | settings)
    # The effect left out may be the environment itself.
    if plan.tabulated_environment and scene.environment() is not None:
        from fotismos.reference.pairing.probe import AlbedoTable  # loaded late: few plans need it

        integrator.environment_albedo = AlbedoTable(scene.shapes()[0].bsdf())
    return integrator


def _reference(facts: Facts) -> Plan:
    pair = facts.pair
    graph = facts.pair.physical
    stock = Plan(
        effects=tuple(effect.decide(facts) for effect in EFFECTS),
        kernel_terms=facts.kernel_terms,
        integrator=_stock(facts),
        max_depth=pair.max_depth,
        stock_integrator=_stock(facts),
        scene_depth=pair.max_depth,
        rr_depth=pair.rr_depth or RR_DEPTH,
        rules=tuple(rule.check(facts) for rule in RULES),
    )
    # Without this rule nothing is known to replace Mitsuba's own integrator.
    if not LIGHT_BY_LIGHT.check(facts).applies:
        return stock
    present = [kinds.of(light.kind) for light in facts.lights]
    if stock.calls_for(INTERREFLECTION) and pair.max_depth != 2:
        is_diffuse = all(graph.plugin(i) in ("diffuse", "twosided") for i in graph.nodes(BSDF))
        if sum(kind.exact for kind in present) > 1 and is_diffuse:
            return replace(stock, integrator="direct_all", rr_depth=RR_DEPTH)
        # Behind hidden lamps only the stock integrator is right.
        return stock if facts.sees_through_lamps else replace(stock, integrator="path")
    tabulated = TABULATED_ENVIRONMENT.check(facts).applies
    # Random numbers besides the place on the film: wavelength, lens, or an extent.
    is_random = (
        mi.is_spectral
        or facts.camera.plugin not in ("perspective", "orthographic")
        or not all(kind.exact or (tabulated and kind.uniform) for kind in present)
    )
    return replace(
        stock.directly(),
        spp=SPP if is_random else EXACT_SPP,
        passes=PASSES if is_random else EXACT_PASSES,
        exact=not is_random,
        tabulated_environment=tabulated,
    )


def _stock(facts: Facts) -> str:
    """Return Mitsuba's integrator for a scene: the one that it names, if it is right there."""
    pair = facts.pair
    errs = facts.sees_through_lamps or facts.lets_straight_through
    if errs and not pair.media and pair.integrator != "volpathmis":
        return "volpath"
    if pair.integrator in ("volpath", "volpathmis"):
        return pair.integrator
    if not pair.media:
        return "direct" if pair.integrator == "direct" else "path"
    graph = pair.physical
    extinctions = (
        graph.props(index).get(key, 0.0)
        for index in graph.nodes(mi.ObjectType.Medium)
        for key in ("sigma_t", "sigma_s")
    )
    coloured = any(isinstance(plain(value), tuple) for value in extinctions)
    return "volpathmis" if coloured else "volpath"


def wants_spectra(graph: Graph) -> bool:
    """Return whether a scene holds spectra that three numbers cannot represent.

    Tabulated spectra, black bodies and spectral films; not Mitsuba's daylight (``d65``).
    """
    in_use = graph.nodes_in_use()
    tabulated = ("regular", "irregular", "blackbody", "specfilm")
    return any(graph.plugin(index) in tabulated for index in in_use) or any(
        hasattr(value, "is_uniform") and not value.is_uniform()
        for index in in_use
        for _, value in graph.props(index).items()
    )
