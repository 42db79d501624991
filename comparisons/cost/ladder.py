"""The ladder of one scene, from flat shading to the full plan.

Each rung's method first loses what the plan leaves out. Methods that do not differ in this scene
then become equal, and are merged; the result keeps all their names.
"""

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType

from comparisons.cost.rungs import DEPTHS, Family, Kernel, Physical, Rung, rungs
from heuristic.heuristics import PHONG, Heuristic
from reference.effects import EFFECTS
from reference.effects.effect import Effect
from reference.effects.light_forms import ENVIRONMENT
from reference.effects.obstacles import INTERREFLECTION, OCCLUSION
from reference.planning.plan import Plan

UNLIMITED = -1

NOTHING: Mapping[str, str] = MappingProxyType({})


@dataclass(frozen=True)
class Distinct:
    """A method that differs from all others in the scene, and its rungs.

    ``monte_carlo`` is whether its error falls with the samples beyond the pixel filter's part.
    """

    rungs: tuple[Rung, ...]
    method: Kernel | Physical
    monte_carlo: bool

    @property
    def names(self) -> tuple[str, ...]:
        """The names of all rungs."""
        return tuple(rung.name for rung in self.rungs)

    @property
    def name(self) -> str:
        """The plainest name."""
        return self._plainest.name

    @property
    def family(self) -> Family:
        """The family of the rung with that name."""
        return self._plainest.family

    @property
    def _plainest(self) -> Rung:
        """The first of kernels, else the last, such as full plan."""
        return self.rungs[0 if isinstance(self.method, Kernel) else -1]


@dataclass(frozen=True)
class Scope:
    """What the scene has, according to its plan.

    Attributes
    ----------
    effects
        Effects that make a difference when left out.
    kernel_shadows
        Whether the heuristic half has its own shadows.
    max_depth
        The scene's own limit of path length; -1 is unlimited.
    random
        Whether direct light needs random numbers.
    background
        Whether the heuristic half has an environment, which its own ``I_a`` does not need.
    """

    effects: frozenset[Effect]
    kernel_shadows: bool
    max_depth: int
    random: bool
    background: bool = True

    @property
    def indirect(self) -> frozenset[Effect]:
        """The effects for which a stand-in has inputs in the heuristic half."""
        return self.effects - (frozenset() if self.background else {ENVIRONMENT})


def scope(
    plan: Plan, differences: Collection[Effect], kernel_shadows: bool, background: bool
) -> Scope:
    """Return the scope of a scene, from its plan and its halves' differences."""
    # If both halves have shadows, a method without them differs from both.
    shadows = {OCCLUSION} if plan.calls_for(OCCLUSION) else set()
    sampled = {effect for effect in EFFECTS if effect.sampled}
    if plan.tabulate_environment:
        sampled.remove(ENVIRONMENT)
    return Scope(
        effects=frozenset(differences) | shadows,
        kernel_shadows=kernel_shadows,
        max_depth=plan.scene_depth,
        random=plan.light_samples > 0
        or any(plan.calls_for(effect) or effect in differences for effect in sampled),
        background=background,
    )


def ladder(
    scope: Scope,
    refusals: Mapping[str, str] = NOTHING,
    depths: tuple[int, ...] = DEPTHS,
) -> tuple[Distinct, ...]:
    """Return the methods of a scene, cheapest idea first.

    Parameters
    ----------
    scope
        What the scene has.
    refusals
        Why the scene does not allow an interpolation or heuristic, by name; empty if it does.
    depths
        Depths of ``path`` that are rungs.
    """
    found: dict[Kernel | Physical, tuple[Rung, ...]] = {}
    for rung in rungs(depths):
        if not why_not(rung, scope, refusals):
            method = _distinguished(rung.method, scope)
            found[method] = (*found.get(method, ()), rung)
    return tuple(
        Distinct(merged, method, _is_random(method, scope)) for method, merged in found.items()
    )


def shaded_by(heuristic: Heuristic, distinct: Distinct) -> Distinct:
    """Return a method; if a kernel, its name includes a heuristic other than Phong."""
    method = distinct.method
    if heuristic is PHONG or not isinstance(method, Kernel) or method.heuristic:
        return distinct
    first = distinct.rungs[0]
    told = replace(first, name=f"{first.name}: {heuristic.label}")
    return replace(distinct, rungs=(told, *distinct.rungs))


def why_not(rung: Rung, scope: Scope, refusals: Mapping[str, str]) -> str:
    """Return why a scene cannot have a rung, in words; empty if it can."""
    if rung.stands_in_for and not rung.stands_in_for & scope.indirect:
        labels = " or ".join(e.label for e in EFFECTS if e in rung.stands_in_for)
        return f"it stands in for {labels}, which the scene does not have"
    method = rung.method
    if isinstance(method, Kernel):
        words = (refusals.get(name, "") for name in (method.interpolation.value, method.heuristic))
        return next(filter(None, words), "")
    depth = method.max_depth
    if depth is None or scope.max_depth == UNLIMITED or depth <= scope.max_depth:
        return ""
    return f"the scene's own paths end at depth {scope.max_depth}"


def _distinguished(method: Kernel | Physical, scope: Scope) -> Kernel | Physical:
    """Remove from a method what the scene does not have."""
    if isinstance(method, Kernel):
        shadows = method.shadows and OCCLUSION in scope.effects
        return replace(method, shadows=shadows or scope.kernel_shadows)
    without = method.without | ({INTERREFLECTION} if method.max_depth == 2 else set())
    is_limited = INTERREFLECTION in scope.effects - without and method.max_depth != scope.max_depth
    return Physical(without & scope.effects, method.max_depth if is_limited else None)


def _is_random(method: Kernel | Physical, scope: Scope) -> bool:
    if isinstance(method, Kernel):
        return False
    return scope.random or INTERREFLECTION in scope.effects - method.without
