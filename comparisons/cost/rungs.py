"""The rungs of the ladder, each declared once: here, or from outside the package.

A rung has a name and a method: the heuristic kernel with options, or a scene's plan with effects
left out or paths of limited depth. Rungs from outside come before the full plan::

    from comparisons.cost.rungs import Physical, Rung, declare
    from reference.effects.obstacles import OCCLUSION

    declare(Rung("path 2 without shadows", "physical", Physical(frozenset({OCCLUSION}), 2)))

or an installed package names one as an entry point of the group ``fotismos.rungs``.
"""

from dataclasses import dataclass
from typing import Literal

from heuristic.declared import Declared
from heuristic.errors import InputError
from heuristic.interpolation import Interpolation
from reference.effects import EFFECTS
from reference.effects.effect import Effect
from reference.effects.light_forms import ENVIRONMENT
from reference.effects.obstacles import INTERREFLECTION, OCCLUSION

DEPTHS = (3, 4, 5)
"""Depths of ``path`` that are rungs, as Mitsuba counts: 2 is direct light."""

Family = Literal["kernel", "phong BSDF", "physical"]
"""Kind of shading: charts give each family a colour and a shape."""

BSDF_FORMS = frozenset(effect for effect in EFFECTS if effect.part == "BSDF form")


@dataclass(frozen=True)
class Kernel:
    """The heuristic kernel; its only random numbers are the pixel filter's.

    Attributes
    ----------
    interpolation
        Interpolation of its shading.
    shadows
        Whether it traces shadow rays.
    heuristic
        Name of the declared heuristic that shades; empty for the one under study.
    """

    interpolation: Interpolation = Interpolation.PHONG
    shadows: bool = False
    heuristic: str = ""


@dataclass(frozen=True)
class Physical:
    """Mitsuba's integrators, as the scene's plan uses them.

    Attributes
    ----------
    without
        Effects to leave out.
    max_depth
        Limit of path length as Mitsuba counts, None for the scene's own.

    Raises
    ------
    InputError
        When an effect cannot be left out: it needs the kernel, or a second image.
    """

    without: frozenset[Effect] = frozenset()
    max_depth: int | None = None

    def __post_init__(self) -> None:
        allowed = {e for e in EFFECTS if e.without or (e.graft and not e.glow)}
        for effect in self.without - allowed:
            labels = ", ".join(e.label for e in EFFECTS if e in allowed)
            raise InputError(
                f"a rung without {effect.label} is not possible: leave out some of {labels}."
            )


@dataclass(frozen=True)
class Rung:
    """A method of the ladder.

    Attributes
    ----------
    name
        Its name in tables and charts.
    family
        Kind of shading.
    method
        What is simulated.
    stands_in_for
        Effects of which the scene must have at least one; empty for a rung of every scene.
    """

    name: str
    family: Family
    method: Kernel | Physical
    stands_in_for: frozenset[Effect] = frozenset()


KERNELS = (
    Rung("flat kernel", "kernel", Kernel(Interpolation.FLAT)),
    Rung("Gouraud kernel", "kernel", Kernel(Interpolation.GOURAUD)),
    Rung("Phong kernel", "kernel", Kernel()),
    Rung("kernel with shadows", "kernel", Kernel(shadows=True)),
)
INDIRECT = frozenset({INTERREFLECTION, ENVIRONMENT})
STAND_INS = tuple(
    Rung(name, "kernel", Kernel(shadows="map" not in heuristic, heuristic=heuristic), effects)
    for name, heuristic, effects in (
        ("shadow map", "shadow-map", frozenset({OCCLUSION})),
        ("filtered shadow map", "soft-shadow-map", frozenset({OCCLUSION})),
        ("constant ambient", "mean-ambient", INDIRECT),
        ("hemisphere ambient", "hemisphere-ambient", INDIRECT),
        ("spherical harmonics", "harmonics-ambient", frozenset({ENVIRONMENT})),
        ("ambient occlusion", "ambient-occlusion", frozenset({OCCLUSION})),
        ("ambient occlusion, depth image", "screen-occlusion", frozenset({OCCLUSION})),
    )
)
"""What engines use instead of transport, each with shadows and a textbook's lights."""

PHONG_BSDF = Rung("phong BSDF, full transport", "phong BSDF", Physical(BSDF_FORMS))
DIRECT = Rung("direct", "physical", Physical(frozenset({INTERREFLECTION})))
FULL_PLAN = Rung("full plan", "physical", Physical())

RUNGS: Declared[Rung] = Declared("rung", "fotismos.rungs")
"""Built-in rungs, with paths of :data:`DEPTHS`, and those from outside."""

declare = RUNGS.declare
"""Add a rung to every ladder and return it; it replaces one of the same name from outside."""


def rungs(depths: tuple[int, ...] = DEPTHS) -> tuple[Rung, ...]:
    """Return all rungs, cheapest idea first.

    Parameters
    ----------
    depths
        Depths of ``path`` that are rungs.
    """
    *cheaper, full = _own(depths)
    return (*cheaper, *RUNGS.others(), full)


def _own(depths: tuple[int, ...]) -> tuple[Rung, ...]:
    paths = [Rung(f"path {depth}", "physical", Physical(max_depth=depth)) for depth in depths]
    return (*KERNELS, *STAND_INS, PHONG_BSDF, DIRECT, *paths, FULL_PLAN)


for _rung in _own(DEPTHS):
    RUNGS.own(_rung)
