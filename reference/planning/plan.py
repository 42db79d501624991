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
thousands of lights, in any case        ``direct_all``, which picks some of them for each sample in
                                        proportion to their light; ``path`` picks them evenly
a BSDF that may let light through       ``path``, whatever the depth
participating media                     ``volpath``, or ``volpathmis`` where the scene asks for it
                                        or its extinction is coloured
======================================  ===========================================================

All take the sampler of :mod:`reference.scene.sampler`: stratified, with the right mean at any
number of samples. Samples are stratified within a pass, so few passes of many samples are better
than many of few; eight passes are enough for standard errors. If neither lights nor lens need
random numbers, only the pixel filter is sampled, and four passes are enough to see the remaining
noise.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi

from heuristic.interpolation import Interpolation
from heuristic.plugins.phong import COEFFICIENTS
from reference.effects import EFFECTS
from reference.effects.effect import Decision, Effect
from reference.effects.obstacles import (
    INTERREFLECTION,
    NO_SECOND_REFLECTION,
    NO_SHADOWS,
    OCCLUSION,
)
from reference.pairing import lights
from reference.pairing.halves import Pair
from reference.pairing.nearest.operations import plain
from reference.planning.facts import BSDF, Facts, examine
from reference.planning.light_by_light import EVERY_LIGHT, LIGHT_BY_LIGHT
from reference.planning.premises import Pruning, Ruling
from reference.planning.tabulation import TABULATED_ENVIRONMENT
from reference.rendering.direct import RR_DEPTH
from reference.rendering.light_choice import PICKS
from reference.scene.graph import Graph
from reference.scene.sampler import SAMPLER, STOCK_SAMPLER

STOCK_RR_DEPTH = 5
SPP, PASSES = 512, 8
"""64 samples per pass take half the time of 16 for the same noise (``./run bench samplers``)."""

EXACT_SPP, EXACT_PASSES = 64, 4
"""Of plans whose only random numbers are the places of camera rays: only edges have noise, and four
times as many samples move mean departures by 1e-5."""


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How both halves are rendered.

    Attributes
    ----------
    decisions
        One per effect, in their order.
    kernel_terms
        The terms in the heuristic kernel.
    integrator, max_depth
        Integrator of the reference; ``max_depth`` counts like Mitsuba's: 2 is direct light, -1 no
        limit.
    stock_integrator, scene_depth
        The integrator that Mitsuba's users get by default, and the scene's own limit of path
        length.
    sampler, spp, passes
        For both halves; ``spp`` over all passes, unless the user gives another.
    exact
        Whether only camera rays are random: both halves are then functions of the ray alone, and
        their difference has no noise.
    rr_depth
        Depth at which Russian roulette of ``path`` begins.
    shadows, bsdf_samples, tabulate_environment, light_samples
        Parameters of ``direct_all``.
    rulings
        For each of :data:`RULES`: whether it applies, and if not, which premise failed.
    """

    decisions: tuple[Decision, ...]
    kernel_terms: tuple[str, ...]
    integrator: str
    max_depth: int
    stock_integrator: str
    scene_depth: int
    sampler: str = SAMPLER
    spp: int = SPP
    passes: int = PASSES
    exact: bool = False
    rr_depth: int = STOCK_RR_DEPTH
    shadows: bool = True
    bsdf_samples: int = 1
    tabulate_environment: bool = False
    light_samples: int = 0
    rulings: tuple[Ruling, ...] = ()

    @property
    def simulated(self) -> tuple:
        """What distinguishes its integrator from another plan's for the same scene."""
        own: tuple[Any, ...] = (
            self.shadows,
            self.bsdf_samples,
            self.tabulate_environment,
            self.light_samples,
        )
        if self.integrator != "direct_all":
            own = (self.rr_depth,)
        return self.integrator, self.max_depth, *own

    def calls_for(self, effect: Effect) -> bool:
        """Return whether the scene needs an effect."""
        return next(d.called_for for d in self.decisions if d.effect is effect)

    def simulating(self, effects: Collection[Effect], max_depth: int | None = None) -> "Plan":
        """Return this plan with only some of its effects.

        A plan covers only the integrator's part: other effects change the scene
        (:meth:`comparisons.effects.between.Between.of`). Leaving out an effect that is not needed
        changes nothing.

        Parameters
        ----------
        effects
            Effects to simulate.
        max_depth
            Depth of paths, in place of the plan's own; at 2 interreflection is left out.
        """
        if max_depth == 2:
            effects = set(effects) - {INTERREFLECTION}
        omitted = [e for e in EFFECTS if e.without and e not in effects and self.calls_for(e)]
        plan = self.directly() if omitted else self
        for effect in omitted:
            assert effect.without  # as checked above
            plan = effect.without(plan)
        is_limited = self.calls_for(INTERREFLECTION) and INTERREFLECTION not in omitted
        if max_depth in (None, plan.max_depth) or not is_limited:
            return plan
        # `path` always has shadows.
        return replace(plan, integrator="direct_all" if omitted else "path", max_depth=max_depth)

    def directly(self) -> "Plan":
        """Return this plan with ``direct_all``, which can leave out more than ``path``."""
        return replace(
            self,
            integrator="direct_all",
            max_depth=self.max_depth if self.calls_for(INTERREFLECTION) else 2,
            shadows=self.calls_for(OCCLUSION),
            bsdf_samples=1,
        )

    def unpruned(self, rule: str = "asked", evidence: str = "--everything") -> "Plan":
        """Return the plan that prunes nothing: Mitsuba's default.

        ``rule`` and ``evidence`` give the reason, in place of each effect's.
        """
        return Plan(
            decisions=tuple(Decision(effect, True, rule, evidence) for effect in EFFECTS),
            kernel_terms=COEFFICIENTS,
            integrator=self.stock_integrator,
            max_depth=self.scene_depth,
            stock_integrator=self.stock_integrator,
            scene_depth=self.scene_depth,
            sampler=STOCK_SAMPLER,
        )


RULES = (LIGHT_BY_LIGHT, EVERY_LIGHT, NO_SHADOWS, NO_SECOND_REFLECTION, TABULATED_ENVIRONMENT)
"""The rules of pruning."""

SPECTRAL_TEXTURES = ("regular", "irregular", "blackbody")


def sampler(everything: bool = False) -> str:
    """Return the sampler of a plan; it is known before the scene, which is made with it."""
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
        Switch all pruning off, for Mitsuba's default: ``path`` with the independent sampler.
    """
    facts = Facts(pair, examine(pair.physical, scene), interpolation)
    decisions = tuple(effect.decide(facts) for effect in EFFECTS)
    chosen = _reference(facts, decisions)
    return chosen.unpruned() if everything else chosen


def _reference(facts: Facts, decisions: tuple[Decision, ...]) -> Plan:
    """Return the cheapest correct plan, by the table of the module's docstring."""
    pair, graph = facts.pair, facts.pair.physical
    stock = Plan(
        decisions=decisions,
        kernel_terms=facts.kernel_terms,
        integrator=_stock(pair),
        max_depth=pair.max_depth,
        stock_integrator=_stock(pair),
        scene_depth=pair.max_depth,
        rr_depth=pair.rr_depth or RR_DEPTH,
        rulings=tuple(rule.judge(facts) for rule in RULES),
    )
    if not _holds(stock, LIGHT_BY_LIGHT):
        return stock
    if not _holds(stock, EVERY_LIGHT):
        stock = replace(stock, light_samples=PICKS)
    if stock.calls_for(INTERREFLECTION) and pair.max_depth != 2:
        exact = [light for light in facts.structure.lights if lights.of(light.kind).exact]
        if stock.light_samples or (len(exact) > 1 and _diffuse(graph)):
            return replace(stock, integrator="direct_all", rr_depth=STOCK_RR_DEPTH)
        return replace(stock, integrator="path")
    tabulated = _holds(stock, TABULATED_ENVIRONMENT)
    has_lens = facts.structure.camera.plugin not in ("perspective", "orthographic")
    is_random = (
        stock.light_samples > 0
        or has_lens
        or mi.is_spectral
        or any(
            not (kind := lights.of(light.kind)).exact and not (tabulated and kind.uniform)
            for light in facts.structure.lights
        )
    )
    return replace(
        stock.directly(),
        rr_depth=STOCK_RR_DEPTH,
        spp=SPP if is_random else EXACT_SPP,
        passes=PASSES if is_random else EXACT_PASSES,
        exact=not is_random,
        tabulate_environment=tabulated,
    )


def _holds(made: Plan, rule: Pruning) -> bool:
    return next(ruling.holds for ruling in made.rulings if ruling.rule is rule)


def _stock(pair: Pair) -> str:
    """Return Mitsuba's integrator for a scene: the one that it names, if it supports media.

    ``direct`` is not a ``path`` of depth 2, which loses light at masks.
    """
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

    These are tabulated spectra, black bodies and spectral films; not uniform values, RGB and
    Mitsuba's daylight (``d65``), to which RGB values are relative.
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
