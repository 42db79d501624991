"""The ladder of one scene, from flat shading to the full plan.

What the plan leaves out is struck out of each rung's method first, so that methods
which the scene cannot tell apart come out equal. They become one, which keeps their names.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace

from comparisons.cost.rungs import DEPTHS, Family, Kernel, Physical, Rung, rungs
from heuristic.heuristics import PHONG, Heuristic
from heuristic.interpolation import Interpolation
from reference.effects import EFFECTS
from reference.effects.effect import Effect
from reference.effects.light_forms import ENVIRONMENT
from reference.effects.obstacles import INTERREFLECTION, OCCLUSION
from reference.planning.plan import Plan

UNLIMITED = -1


@dataclass(frozen=True)
class Distinct:
    """A method that the scene tells apart, and the rungs that it is.

    ``monte_carlo`` tells whether its error falls with the samples by more than the pixel filter.
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
        """The plainest of the names."""
        return self._plainest.name

    @property
    def family(self) -> Family:
        """The family of the rung that gives the name."""
        return self._plainest.family

    @property
    def _plainest(self) -> Rung:
        """Of kernels the first, else the last, such as full plan."""
        return self.rungs[0 if isinstance(self.method, Kernel) else -1]


@dataclass(frozen=True)
class Scope:
    """What the scene has, as far as the plan tells.

    Attributes
    ----------
    effects
        Those that make a difference where they are left out.
    kernel_shadows
        Whether the heuristic half has shadows of its own.
    max_depth
        The scene's own limit of path length; -1 is none.
    random
        Whether direct light needs random numbers.
    """

    effects: frozenset[Effect]
    kernel_shadows: bool
    max_depth: int
    random: bool


def scope(plan: Plan, differences: Collection[Effect], kernel_shadows: bool) -> Scope:
    """Read the :class:`Scope` of a scene off its plan and its halves' differences."""
    # Where both halves have shadows, a method without them differs from both.
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
    )


def ladder(
    scope: Scope,
    interpolations: Collection[Interpolation] = tuple(Interpolation),
    depths: tuple[int, ...] = DEPTHS,
) -> tuple[Distinct, ...]:
    """Return the methods of a scene, cheapest idea first.

    Parameters
    ----------
    scope
        What the scene has.
    interpolations
        Those that its shapes allow.
    depths
        Depths of ``path`` that are rungs.
    """
    found: dict[Kernel | Physical, tuple[Rung, ...]] = {}
    for rung in rungs(depths):
        if _is_possible(rung.method, scope, interpolations):
            method = _distinguished(rung.method, scope)
            found[method] = (*found.get(method, ()), rung)
    return tuple(
        Distinct(merged, method, _is_random(method, scope)) for method, merged in found.items()
    )


def shaded_by(heuristic: Heuristic, distinct: Distinct) -> Distinct:
    """Return a method; of the kernel, with a name that tells of a heuristic other than Phong."""
    if heuristic is PHONG or not isinstance(distinct.method, Kernel):
        return distinct
    first = distinct.rungs[0]
    told = replace(first, name=f"{first.name}: {heuristic.label}")
    return replace(distinct, rungs=(told, *distinct.rungs))


def _is_possible(method, scope, interpolations):
    if isinstance(method, Kernel):
        return method.interpolation in interpolations
    depth = method.max_depth
    return depth is None or scope.max_depth == UNLIMITED or depth <= scope.max_depth


def _distinguished(method, scope):
    """Strike out of a method what the scene does not have."""
    if isinstance(method, Kernel):
        shadows = method.shadows and OCCLUSION in scope.effects
        return replace(method, shadows=shadows or scope.kernel_shadows)
    without = method.without | ({INTERREFLECTION} if method.max_depth == 2 else set())
    is_limited = INTERREFLECTION in scope.effects - without and method.max_depth != scope.max_depth
    return Physical(without & scope.effects, method.max_depth if is_limited else None)


def _is_random(method, scope):
    if isinstance(method, Kernel):
        return False
    return scope.random or INTERREFLECTION in scope.effects - method.without
