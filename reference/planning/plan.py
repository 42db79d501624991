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
curved shapes behind hidden lamps       ``volpath`` in place of ``path`` and ``direct``, which err
a BSDF that may let light through       ``path``, whatever the depth
participating media                     ``volpath``, or ``volpathmis`` where the scene asks for it
                                        or its extinction is coloured
======================================  ===========================================================

All take the sampler of :mod:`fotismos.reference.rendering.sampler`, stratified within a pass: few
passes of many samples are better than many of few, and eight are enough for standard errors. If
only the pixel filter is sampled, four show the remaining noise.
"""

from collections.abc import Collection
from typing import Annotated, Any, Literal

import mitsuba as mi
from msgspec import Meta
from msgspec.structs import replace

from fotismos.heuristic.convention import Scene
from fotismos.heuristic.heuristics import Interpolation
from fotismos.heuristic.materials import COEFFICIENTS
from fotismos.reference.pairing import lights
from fotismos.reference.pairing.halves import Pair
from fotismos.reference.pairing.settings import PATHS
from fotismos.reference.planning.effects import (
    EFFECTS,
    INTERREFLECTION,
    OCCLUSION,
    PRUNED,
    Decision,
    Effect,
)
from fotismos.reference.planning.facts import BSDF, Facts
from fotismos.reference.planning.rules import (
    LIGHT_BY_LIGHT,
    RULES,
    TABULATED_ENVIRONMENT,
    RuleResult,
)
from fotismos.reference.records import Amount, Count, Record, Size
from fotismos.reference.rendering import direct
from fotismos.reference.rendering.sampler import SAMPLER, STOCK_SAMPLER
from fotismos.reference.scene.graph import Graph
from fotismos.reference.scene.values import plain

Depth = Annotated[
    int, Meta(ge=-1, description="As Mitsuba counts: 2 is direct light alone, -1 is unlimited.")
]

STOCK_RR_DEPTH = 5
SPP = 512
PASSES = 8
"""64 samples per pass take half the time of 16 for the same noise."""

EXACT_SPP = 64
EXACT_PASSES = 4
"""Of plans whose only random numbers are the places of camera rays: only edges have noise, and four
times as many samples move mean departures by 1e-5."""


class Guard(Record):
    """The result of probing a plan that leaves something out, against everything.

    Attributes
    ----------
    state
        If it disagreed, everything was simulated; not needed if nothing is left out.
    rays
        Camera rays that were traced both ways.
    departure, error
        Relative difference of the plan's mean from the full one, and its standard error.
    seconds
        Time of the probe, which no other time includes.
    """

    state: Literal["agreed", "disagreed", "not needed"] = "not needed"
    rays: Count = 0
    departure: float = 0.0
    error: Amount = 0.0
    seconds: Amount = 0.0

    @property
    def words(self) -> str:
        """The result as a sentence."""
        return (
            f"the plan's mean is {self.departure:+.2%} off the mean of everything simulated, with a"
            f" standard error of {self.error:.2%}, over {self.rays} camera rays"
        )


class Plan(Record):
    """How both halves are rendered, and the effects that the scene calls for.

    Attributes
    ----------
    kernel_terms
        Coefficients whose terms the heuristic kernel holds.
    stock_integrator, scene_depth
        The integrator and the depth of paths that Mitsuba's users get.
    sampler
        Mitsuba sampler of both renderings.
    spp
        Over all passes.
    exact
        Whether only camera rays are random: both halves are then functions of the ray alone, and
        their difference has no noise.
    rr_depth
        Depth at which Russian roulette of paths begins.
    bsdf_samples
        Those that look for lights.
    tabulated_environment
        Whether a constant environment comes from a table of albedos.
    heuristic_reads
        What the heuristic reads of each point that it shades.
    """

    effects: tuple[Decision, ...]
    kernel_terms: tuple[str, ...]
    integrator: str
    max_depth: Depth
    stock_integrator: str
    scene_depth: Depth
    sampler: str = SAMPLER
    spp: Size = SPP
    passes: Size = PASSES
    exact: bool = False
    rr_depth: int = STOCK_RR_DEPTH
    shadows: bool = True
    bsdf_samples: Count = 1
    tabulated_environment: bool = False
    rules: tuple[RuleResult, ...] = ()
    heuristic_reads: tuple[str, ...] = ()
    guard: Guard | None = None

    @property
    def simulation(self) -> str:
        """The integrator, and what it does without, in words."""
        rays = "" if self.shadows else ", no shadow rays"
        return self.integrator + rays + ", environment from a table" * self.tabulated_environment

    def calls_for(self, effect: Effect) -> bool:
        """Return whether the scene needs an effect."""
        return next(d.called_for for d in self.effects if d.name == effect.label)

    def simulating(self, effects: Collection[Effect], max_depth: int | None = None) -> "Plan":
        """Return this plan with only some of its effects, those of the integrator.

        ``max_depth`` takes the place of the plan's own; at 2 interreflection is left out.
        """
        if max_depth == 2:
            effects = set(effects) - {INTERREFLECTION}
        omitted = [effect for effect in PRUNED if effect not in effects and self.calls_for(effect)]
        plan = self.directly() if omitted else self
        for effect in omitted:
            plan = replace(plan, **effect.without)
        is_limited = self.calls_for(INTERREFLECTION) and INTERREFLECTION not in omitted
        if max_depth in (None, plan.max_depth) or not is_limited:
            return plan
        paths = self.integrator if self.integrator in PATHS else "path"
        # `path` always has shadows.
        return replace(plan, integrator="direct_all" if omitted else paths, max_depth=max_depth)

    def directly(self) -> "Plan":
        """Return this plan with ``direct_all``, which can leave out more than ``path``."""
        return replace(
            self,
            integrator="direct_all",
            rr_depth=direct.RR_DEPTH,
            max_depth=self.max_depth if self.calls_for(INTERREFLECTION) else 2,
            shadows=self.calls_for(OCCLUSION),
            bsdf_samples=1,
        )

    def omissions(self) -> tuple[str, ...]:
        """Return what the plan leaves out by proof, as nouns."""
        applied = {result.name for result in self.rules if result.applies}
        return tuple(rule.omits for rule in RULES if rule.name in applied)

    def unpruned(self, rule: str = "asked", evidence: str = "pruning is off") -> "Plan":
        """Return the plan that prunes nothing, Mitsuba's default, and the reason for it."""
        return Plan(
            effects=tuple(effect.decision(True, rule, evidence) for effect in EFFECTS),
            kernel_terms=COEFFICIENTS,
            integrator=self.stock_integrator,
            max_depth=self.scene_depth,
            stock_integrator=self.stock_integrator,
            scene_depth=self.scene_depth,
            sampler=STOCK_SAMPLER,
        )


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
        rr_depth=pair.rr_depth or direct.RR_DEPTH,
        rules=tuple(rule.check(facts) for rule in RULES),
    )
    # Without this rule nothing is known to replace Mitsuba's own integrator.
    if not LIGHT_BY_LIGHT.check(facts).applies:
        return stock
    kinds = [lights.of(light.kind) for light in facts.lights]
    if stock.calls_for(INTERREFLECTION) and pair.max_depth != 2:
        is_diffuse = all(graph.plugin(i) in ("diffuse", "twosided") for i in graph.nodes(BSDF))
        if sum(kind.exact for kind in kinds) > 1 and is_diffuse:
            return replace(stock, integrator="direct_all", rr_depth=direct.RR_DEPTH)
        # Behind hidden lamps only the stock integrator is right.
        return stock if facts.sees_through_lamps else replace(stock, integrator="path")
    tabulated = TABULATED_ENVIRONMENT.check(facts).applies
    # Random numbers besides the place on the film: wavelength, lens, or an extent.
    is_random = (
        mi.is_spectral
        or facts.camera.plugin not in ("perspective", "orthographic")
        or not all(kind.exact or (tabulated and kind.uniform) for kind in kinds)
    )
    return replace(
        stock.directly(),
        spp=SPP if is_random else EXACT_SPP,
        passes=PASSES if is_random else EXACT_PASSES,
        exact=not is_random,
        tabulated_environment=tabulated,
    )


def _stock(facts: Facts) -> str:
    """Return Mitsuba's integrator for a scene: the one that it names, if it is right there.

    ``direct`` is not a ``path`` of depth 2, which loses light at masks.
    """
    pair = facts.pair
    if facts.sees_through_lamps and not pair.media and pair.integrator != "volpathmis":
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
