"""The effects of light, each declared once, in the order of :data:`EFFECTS`.

Whatever lists effects reads that tuple: plans, hybrids, attribution, parts of a departure, steps of
a study, charts and pages. Their rules and sites are in
:mod:`fotismos.reference.planning.effect_rules`, which is loaded when a scene is planned: words and
colours need no Mitsuba.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fotismos.reference.planning.decisions import Decision, RuleResult

if TYPE_CHECKING:
    import mitsuba as mi

    from fotismos.reference.planning.facts import Facts
    from fotismos.reference.scene.graph import Graph

    Rule = Callable[[Facts], tuple[bool, str]]
    """Whether a scene needs an effect, and the evidence."""

    Sites = Callable[[Facts], Sequence[Any]]
    """The nodes or keys of the physical half's graph that have an effect."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Effect:
    """An effect of light. Two are equal only if they are the same.

    ``heuristic``, ``reference`` and ``cost`` are its form in each half and its cost, in words;
    ``noun`` is what an image without it lacks, in words, unless its label says it; ``colour`` is a
    CSS colour, None for effects equal in both halves. With ``undecided`` a yes of its ``rule`` only
    means that it is not ruled out. ``sampled`` is whether its direct light needs random numbers.
    The halves differ in it where it has ``sites``.
    """

    label: str
    noun: str = ""
    heuristic: str
    reference: str
    cost: str
    rule: Rule
    undecided: bool = False
    colour: str | None = None
    sampled: bool = False
    sites: Sites = lambda facts: ()

    def decide(self, facts: Facts) -> Decision:
        """Apply the rule."""
        called_for, evidence = self.rule(facts)
        kind = "simulated" if called_for and self.undecided else "structural"
        return self.decision(called_for, kind, evidence)

    def decision(self, called_for: bool, kind: str, evidence: str) -> Decision:
        """Return a decision on the effect."""
        return Decision(name=self.label, called_for=called_for, rule=f"{kind}: {evidence}")

    def differs(self, facts: Facts, called_for: bool) -> bool:
        """Return whether the two halves differ in it, given whether the scene needs it."""
        return bool(self.sites(facts))

    def __repr__(self) -> str:
        return f"<effect {self.label}>"

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy in another process must be the same effect, for sets and `is`.
        return labelled, (self.label,)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PrunedEffect(Effect):
    """An effect that the integrator leaves out if a rule of pruning applies.

    ``pruning(facts)`` checks that rule, ``without`` are the parameters of `direct_all` that leave
    the effect out. ``is_alike(facts)``: both halves treat it alike. ``step`` is what it changes in
    an image, in words.
    """

    rule: Rule = lambda facts: (False, "")
    pruning: Callable[[Facts], RuleResult]
    without: dict[str, Any]
    is_alike: Callable[[Facts], bool]
    step: str

    def decide(self, facts: Facts) -> Decision:
        """Apply the rule of pruning."""
        result = self.pruning(facts)
        kind = "structural" if result.applies else "simulated"
        return self.decision(not result.applies, kind, result.evidence)

    def differs(self, facts: Facts, called_for: bool) -> bool:
        """Return whether the scene needs it, and the halves treat it differently."""
        return called_for and not self.is_alike(facts)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ReplacedEffect(Effect):
    """An effect that is left out by giving the physical half the textbook half's form.

    ``put(graph, facts, sites)`` replaces the ``sites`` in a copy of the physical half's graph.
    """

    sites: Sites
    put: Callable[[Graph, Facts, Sequence[Any]], None]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class GlowingEffect(ReplacedEffect):
    """A replaced effect without which a textbook material shines of itself.

    ``emission(phong, facts)`` returns the light that a camera ray then sees, as parameters of
    ``heuristic_glow``.
    """

    emission: Callable[[mi.Properties, Facts], dict[str, Any]]


def _late(name: str, **given: Any) -> Callable[..., Any]:
    """Return a function of this folder, ``module:name``, which is loaded at its first call."""

    def call(*arguments: Any) -> Any:
        return pkgutil.resolve_name(f"{__package__}.{name}")(*arguments, **given)

    return call


# --- Terms of the heuristic kernel -----------------------------------------------------------

EMISSION = Effect(
    label="emission",
    heuristic="k_i (8.1)",
    reference="area emitters, seen",
    cost="an addition",
    rule=_late("effect_rules:has_coefficient", coefficient="k_i"),
)

AMBIENT = Effect(
    label="ambient",
    heuristic="I_a k_a (8.2)",
    reference="see environment",
    cost="an addition",
    rule=_late("effect_rules:has_ambient"),
)

DIFFUSE = Effect(
    label="diffuse",
    heuristic="k_d (N.L) (8.5)",
    reference="diffuse, or roughplastic's base",
    cost="a scalar product",
    rule=_late("effect_rules:has_coefficient", coefficient="k_d"),
)

SPECULAR = Effect(
    label="specular",
    heuristic="k_s (R.V)^n (8.9)",
    reference="roughplastic's coat",
    cost="a vector and a power",
    rule=_late("effect_rules:has_coefficient", coefficient="k_s"),
)

POLYGONS = Effect(
    label="polygon interpolation",
    heuristic="flat, Gouraud (6.35-6.38)",
    reference="none",
    cost="a sum per vertex or face, then a lookup: saves time with many lights",
    rule=_late("effect_rules:is_interpolated"),
    colour="#f0e442",
)

SPECTRAL = Effect(
    label="spectral",
    noun="spectral light",
    heuristic="as many values as given (8.11)",
    reference="wavelengths",
    cost="samples, 4 values each",
    rule=_late("effect_rules:is_spectral"),
    colour="#882255",
    sampled=True,
)

# --- Lights that differ in form: intensities, fall-off, cone, extent, surroundings -----------

ONE_INTENSITY = Effect(
    label="one intensity",
    noun="one intensity for all reflection",
    heuristic="L_d and L_s (6.6, 6.8)",
    reference="one",
    cost="nothing",
    rule=_late("effect_rules:has_two_intensities"),
    colour="#332288",
    sites=_late("effect_rules:lights_of_two_intensities"),
)

ATTENUATION = ReplacedEffect(
    label="distance attenuation",
    heuristic="f_att (6.1, 8.6)",
    reference="1 / d^2",
    cost="a division per light",
    rule=_late("effect_rules:is_attenuated"),
    colour="#d55e00",
    sites=_late("effect_rules:inexact_lights", with_cone=False),
    put=_late("effect_rules:put_lights"),
)

CONE = ReplacedEffect(
    label="spot cone",
    heuristic="6.2-6.4",
    reference="spot",
    cost="a comparison and a power per light",
    rule=_late("effect_rules:has_cone"),
    colour="#999933",
    sites=_late("effect_rules:inexact_lights", with_cone=True),
    put=_late("effect_rules:put_lights"),
)

EXTENDED = GlowingEffect(
    label="extended lights",
    heuristic="a spot or point",
    reference="sampled area lights",
    cost="samples, two rays each",
    rule=_late("effect_rules:has_far_lights"),
    colour="#56b4e9",
    sampled=True,
    sites=_late("effect_rules:shining_shapes"),
    put=_late("effect_rules:put_far_lights"),
    emission=_late("effect_rules:own_light"),
)

ENVIRONMENT = GlowingEffect(
    label="environment",
    noun="environment light",
    heuristic="ambient light",
    reference="light from everywhere",
    cost="samples, or a table",
    rule=_late("effect_rules:is_surrounded"),
    colour="#009e73",
    sampled=True,
    sites=_late("effect_rules:surroundings"),
    put=_late("effect_rules:detach"),
    emission=_late("effect_rules:ambient_light"),
)

# --- Surfaces that differ in form: reflection and transmission -------------------------------

BUMPS = ReplacedEffect(
    label="bumps",
    noun="shadows or layers of bumps",
    heuristic="one normal at a point",
    reference="shadowed bumps, maps over maps",
    cost="a factor per map",
    rule=_late("effect_rules:has_lossy_bumps"),
    colour="#661100",
    sites=_late("effect_rules:lossy_bumps"),
    put=_late("effect_rules:put_bumps"),
)

MICROFACETS = ReplacedEffect(
    label="microfacets and Fresnel",
    heuristic="none",
    reference="roughplastic",
    cost="a BSDF evaluation per light",
    rule=_late("effect_rules:is_reflected"),
    colour="#cc79a7",
    sites=_late("effect_rules:inexact_surfaces", opaque=True),
    put=_late("effect_rules:put_materials"),
)

TRANSMISSION = ReplacedEffect(
    label="transmission",
    heuristic="none",
    reference="refraction and media",
    cost="samples, rays per surface",
    rule=lambda facts: (
        facts.is_clear,
        "a BSDF may let light through" if facts.is_clear else "every BSDF is opaque",
    ),
    undecided=True,
    colour="#44aa99",
    sites=_late("effect_rules:inexact_surfaces", opaque=False),
    put=_late("effect_rules:put_materials"),
)

# --- Obstacles of light ----------------------------------------------------------------------

OCCLUSION = PrunedEffect(
    label="occlusion",
    heuristic="none, or if requested",
    reference="shadow rays",
    cost="a ray per light",
    pruning=_late("rules:NO_SHADOWS.check"),
    colour="#0072b2",
    is_alike=lambda facts: facts.has_shadows,
    # A sample of the BSDF would hit what hides a light.
    without={"shadows": False, "bsdf_samples": 0},
    step="shadows",
)

INTERREFLECTION = PrunedEffect(
    label="interreflection",
    heuristic="none",
    reference="paths",
    cost="samples, two rays per reflection",
    pruning=_late("rules:NO_SECOND_REFLECTION.check"),
    colour="#e69f00",
    is_alike=lambda facts: facts.pair.max_depth == 2,
    without={"max_depth": 2},
    step="light reflected more than once",
)

PRUNED = (OCCLUSION, INTERREFLECTION)

EFFECTS: tuple[Effect, ...] = (
    EMISSION,
    AMBIENT,
    DIFFUSE,
    SPECULAR,
    ONE_INTENSITY,
    ATTENUATION,
    CONE,
    POLYGONS,
    OCCLUSION,
    BUMPS,
    MICROFACETS,
    EXTENDED,
    ENVIRONMENT,
    INTERREFLECTION,
    TRANSMISSION,
    SPECTRAL,
)


def labelled(label: str) -> Effect:
    """Return the effect with a label."""
    return next(effect for effect in EFFECTS if effect.label == label)
