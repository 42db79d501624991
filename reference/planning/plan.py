"""Plans: how both halves are rendered, and the plans that simulate less or more than another."""

from collections.abc import Collection
from dataclasses import dataclass, replace

from heuristic.plugins.phong import COEFFICIENTS
from reference.effects.effect import Decision, Effect
from reference.effects.enumeration import EFFECTS
from reference.effects.interreflection import INTERREFLECTION
from reference.effects.shadows import OCCLUSION

SAMPLER = "multijitter"
"""Of the stock samplers the one of least noise for its time, on figures and the Cornell box alike:
at 64 samples per pixel 10 times the efficiency of ``independent`` there, ``stratified`` 5 times."""

STOCK_SAMPLER = "independent"
STOCK_RR_DEPTH = 5
SPP, PASSES = 256, 16


@dataclass(frozen=True, kw_only=True)
class Plan:
    """How both halves are rendered.

    Attributes
    ----------
    decisions
        One for each effect, in their order.
    kernel_terms
        The terms that the heuristic kernel holds.
    integrator, max_depth
        Of the reference; ``max_depth`` counts as Mitsuba's: 2 is direct light, -1 no limit.
    stock_integrator, scene_depth
        What a user of Mitsuba gets without thinking, and the scene's own limit of path length.
    sampler, spp, passes
        Of both halves; ``spp`` over all passes, unless the user gives another.
    rr_depth
        Of ``path``: where Russian roulette begins to end paths.
    shadows, bsdf_samples, tabulate_environment
        Parameters of ``direct_all``.
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
    rr_depth: int = STOCK_RR_DEPTH
    shadows: bool = True
    bsdf_samples: int = 1
    tabulate_environment: bool = False

    def calls_for(self, effect: Effect) -> bool:
        """Tell whether an effect is called for."""
        return next(d.called_for for d in self.decisions if d.effect is effect)

    def simulating(self, effects: Collection[Effect], max_depth: int | None = None) -> "Plan":
        """Return this plan, simulating these of its effects and leaving out the others.

        Only the integrator's part is a plan's: what other effects change is in the scene
        (:meth:`comparisons.effects.between.Between.of`). Leaving out what is not called for changes
        nothing.

        Parameters
        ----------
        effects
            Those to simulate.
        max_depth
            Of paths, in place of the plan's own; at 2 interreflection is left out.
        """
        if max_depth == 2:
            effects = set(effects) - {INTERREFLECTION}
        omitted = [e for e in EFFECTS if e.without and e not in effects and self.calls_for(e)]
        plan = self.directly() if omitted else self
        for effect in omitted:
            plan = effect.without(plan)
        is_limited = self.calls_for(INTERREFLECTION) and INTERREFLECTION not in omitted
        if max_depth in (None, plan.max_depth) or not is_limited:
            return plan
        # Without shadows there is no `path`.
        return replace(plan, integrator="direct_all" if omitted else "path", max_depth=max_depth)

    def directly(self) -> "Plan":
        """Return this plan with ``direct_all``, which can leave out what ``path`` cannot."""
        return replace(
            self,
            integrator="direct_all",
            max_depth=self.max_depth if self.calls_for(INTERREFLECTION) else 2,
            shadows=self.calls_for(OCCLUSION),
            bsdf_samples=1,
        )

    def unpruned(self) -> "Plan":
        """Return the plan that prunes nothing: what a user gets without thinking."""
        return Plan(
            decisions=tuple(Decision(effect, True, "asked", "--everything") for effect in EFFECTS),
            kernel_terms=COEFFICIENTS,
            integrator=self.stock_integrator,
            max_depth=self.scene_depth,
            stock_integrator=self.stock_integrator,
            scene_depth=self.scene_depth,
            sampler=STOCK_SAMPLER,
        )
