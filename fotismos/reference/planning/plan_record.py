"""The record of a plan: how both halves are rendered, and the effects that a scene needs."""

from collections.abc import Collection
from typing import Annotated, Literal

from msgspec import Meta
from msgspec.structs import replace

from fotismos.reference.planning.decisions import Decision, RuleResult
from fotismos.reference.planning.effects import EFFECTS, INTERREFLECTION, OCCLUSION, PRUNED, Effect
from fotismos.reference.records import (
    PATHS,
    RR_DEPTH,
    SAMPLER,
    STOCK_RR_DEPTH,
    STOCK_SAMPLER,
    Amount,
    Count,
    Record,
    Size,
)

Depth = Annotated[
    int, Meta(ge=-1, description="As Mitsuba counts: 2 is direct light alone, -1 is unlimited.")
]

SPP = 512
PASSES = 8
"""64 samples per pass take half the time of 16 for the same noise."""


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
    """How both halves are rendered, and the effects that the scene needs.

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
            rr_depth=RR_DEPTH,
            max_depth=self.max_depth if self.calls_for(INTERREFLECTION) else 2,
            shadows=self.calls_for(OCCLUSION),
            bsdf_samples=1,
        )

    def omissions(self) -> tuple[str, ...]:
        """Return what the plan leaves out by proof, as nouns."""
        from fotismos.reference.planning.rules import RULES  # loaded late: it loads Mitsuba

        applied = {result.name for result in self.rules if result.applies}
        return tuple(rule.omits for rule in RULES if rule.name in applied)

    def unpruned(self, rule: str = "asked", evidence: str = "pruning is off") -> "Plan":
        """Return the plan that prunes nothing, Mitsuba's default, and the reason for it."""
        from fotismos.heuristic.materials import COEFFICIENTS  # loaded late: it loads Dr.Jit

        return Plan(
            effects=tuple(effect.decision(True, rule, evidence) for effect in EFFECTS),
            kernel_terms=COEFFICIENTS,
            integrator=self.stock_integrator,
            max_depth=self.scene_depth,
            stock_integrator=self.stock_integrator,
            scene_depth=self.scene_depth,
            sampler=STOCK_SAMPLER,
        )
