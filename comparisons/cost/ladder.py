"""The ladder of methods on one scene, from flat shading to the full plan.

A method is a name and what it simulates. What the planning rules prove absent is struck out of
that first, so that methods which the scene cannot tell apart come out equal, and become one rung
that keeps their names.
"""

from dataclasses import dataclass, replace

from heuristic.interpolation import Interpolation
from reference.planning.effects import Effect

DEPTHS = (3, 4, 5)
"""Depths of ``path`` that are rungs, as Mitsuba counts: 2 is direct light."""

UNLIMITED = -1

NAMES = {
    Interpolation.FLAT: "flat",
    Interpolation.GOURAUD: "Gouraud",
    Interpolation.PHONG: "Phong",
}


@dataclass(frozen=True)
class Method:
    """What is simulated.

    Attributes
    ----------
    interpolation
        Of the kernel; None where Mitsuba's integrators render.
    occlusion
        Shadows in the kernel.
    physical_bsdfs
        The physical half's BSDFs, or phong in their place.
    max_depth
        As Mitsuba counts; of the kernel always 2.
    """

    interpolation: Interpolation | None = None
    occlusion: bool = True
    physical_bsdfs: bool = True
    max_depth: int = 2

    @property
    def is_kernel(self):
        """Whether the kernel renders, without random numbers but the pixel filter's."""
        return self.interpolation is not None


@dataclass(frozen=True)
class Rung:
    """A method, and the names that it has in this scene.

    ``monte_carlo`` tells whether its error falls with the samples by more than the pixel filter.
    """

    names: tuple[str, ...]
    method: Method
    monte_carlo: bool

    @property
    def name(self):
        """The plainest of the names: of a kernel the first, else the last, such as full plan."""
        return self.names[0] if self.method.is_kernel else self.names[-1]

    @property
    def family(self):
        """What shades: charts give each family a colour and a shape."""
        if self.method.is_kernel:
            return "kernel"
        return "physical" if self.method.physical_bsdfs else "phong BSDF"


@dataclass(frozen=True)
class Scope:
    """What the scene has, as the plan proves it.

    Attributes
    ----------
    occlusion, interreflection
        Whether they are called for.
    kernel_occlusion
        Whether the heuristic half has shadows of its own.
    exact_bsdfs
        Whether the phong twins of all BSDFs are exact.
    max_depth
        The scene's own limit of path length; -1 is none.
    random
        Whether direct light needs random numbers.
    """

    occlusion: bool
    interreflection: bool
    kernel_occlusion: bool
    exact_bsdfs: bool
    max_depth: int
    random: bool


def scope(plan, pair, differences, kernel_occlusion):
    """Read the :class:`Scope` of a planned pair off its plan and the halves' differences."""
    lit_by_area = plan.calls_for(Effect.EXTENDED)
    by_environment = Effect.ENVIRONMENT in differences and not plan.tabulate_environment
    return Scope(
        occlusion=plan.calls_for(Effect.OCCLUSION),
        interreflection=plan.calls_for(Effect.INTERREFLECTION) and pair.max_depth != 2,
        kernel_occlusion=kernel_occlusion,
        exact_bsdfs=not {Effect.MICROFACETS, Effect.TRANSMISSION} & set(differences),
        max_depth=pair.max_depth,
        random=lit_by_area or by_environment or plan.calls_for(Effect.SPECTRAL),
    )


def ladder(scope, interpolations=tuple(Interpolation), depths=DEPTHS):
    """Return the rungs of a scene, cheapest idea first.

    Parameters
    ----------
    scope : Scope
        What the scene has.
    interpolations
        Those that its shapes allow.
    depths
        Depths of ``path`` that are rungs.
    """
    rungs = {}
    for name, method in _methods(scope.max_depth, interpolations, depths):
        distinct = _distinguished(method, scope)
        names = rungs[distinct].names if distinct in rungs else ()
        monte_carlo = not distinct.is_kernel and (scope.random or distinct.max_depth != 2)
        rungs[distinct] = Rung((*names, name), distinct, monte_carlo)
    return tuple(rungs.values())


def _methods(max_depth, interpolations, depths):
    """Yield the ladder's methods by name, as if every scene could tell them apart."""
    for interpolation in interpolations:
        yield f"{NAMES[interpolation]} kernel", Method(interpolation, occlusion=False)
    yield "kernel with shadows", Method(Interpolation.PHONG)
    yield "phong BSDF, full transport", Method(physical_bsdfs=False, max_depth=max_depth)
    yield "direct", Method()
    for depth in depths:
        if depth <= max_depth or max_depth == UNLIMITED:
            yield f"path {depth}", Method(max_depth=depth)
    yield "full plan", Method(max_depth=max_depth)


def _distinguished(method, scope):
    """Strike out of a method what the scene does not have."""
    if method.is_kernel:
        shadows = scope.kernel_occlusion or (method.occlusion and scope.occlusion)
        return replace(method, occlusion=shadows)
    return replace(
        method,
        max_depth=method.max_depth if scope.interreflection else 2,
        physical_bsdfs=method.physical_bsdfs or scope.exact_bsdfs,
    )
