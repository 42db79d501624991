"""The effects of light, each declared once, in the order of :data:`EFFECTS`.

Whatever lists effects reads that tuple: plans, hybrids, attribution, parts of a departure, steps of
a study, charts, pages and the glossary.

A rule returns whether a scene needs an effect, and the evidence. Sites are the nodes or keys of the
physical half's graph that have it; ``put`` functions replace them in a copy of that graph by what
the textbook half has. All of them ask facts and graphs, so this module needs no Mitsuba: words and
colours serve pictures, too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

from fotismos.reference.pairing.pairing_record import SECOND_INTENSITY, SUN
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
    ``noun`` is what an image without it lacks, in words, unless its label says it; ``meaning`` is
    the glossary's sentence. ``colour`` is a CSS colour. Effects equal in both halves have neither.
    With ``undecided`` a yes of its ``rule`` only means that it is not ruled out. ``sampled`` is
    whether its direct light needs random numbers. The halves differ in it where it has ``sites``.
    """

    label: str
    noun: str = ""
    meaning: str = ""
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


# --- Terms of the heuristic kernel -----------------------------------------------------------


def has_coefficient(facts: Facts, coefficient: str) -> tuple[bool, str]:
    """Whether a material has a coefficient that is not 0."""
    present = coefficient in facts.kernel_terms
    where = "not 0 in some material" if present else "0 in every material"
    if coefficient == "k_s" and facts.has_mirror:
        where += ", mirrors aside: the kernel traces no rays"
    return present, f"{coefficient} is {where}"


EMISSION = Effect(
    label="emission",
    heuristic="k_i (8.1)",
    reference="area emitters, seen",
    cost="an addition",
    rule=partial(has_coefficient, coefficient="k_i"),
)


def has_ambient(facts: Facts) -> tuple[bool, str]:
    """Whether there is ambient light, and a material that reflects it."""
    if "ambient" not in facts.kernel:
        return False, "no ambient light"
    return has_coefficient(facts, "k_a")


AMBIENT = Effect(
    label="ambient",
    heuristic="I_a k_a (8.2)",
    reference="see environment",
    cost="an addition",
    rule=has_ambient,
)

DIFFUSE = Effect(
    label="diffuse",
    heuristic="k_d (N.L) (8.5)",
    reference="diffuse, or roughplastic's base",
    cost="a scalar product",
    rule=partial(has_coefficient, coefficient="k_d"),
)

SPECULAR = Effect(
    label="specular",
    heuristic="k_s (R.V)^n (8.9)",
    reference="roughplastic's coat",
    cost="a vector and a power",
    rule=partial(has_coefficient, coefficient="k_s"),
)


def is_interpolated(facts: Facts) -> tuple[bool, str]:
    """Whether colours are interpolated over polygons, or constant."""
    form = facts.interpolation.value
    return form != "phong", f"interpolation {form}"


POLYGONS = Effect(
    label="polygon interpolation",
    meaning="Flat and Gouraud shading, which interpolate over polygons.",
    heuristic="flat, Gouraud (6.35-6.38)",
    reference="none",
    cost="a sum per vertex or face, then a lookup: saves time with many lights",
    rule=is_interpolated,
    colour="#f0e442",
)


def is_spectral(facts: Facts) -> tuple[bool, str]:
    """Whether light has wavelengths."""
    return "spectral" in facts.variant, f"variant {facts.variant}"


SPECTRAL = Effect(
    label="spectral",
    noun="spectral light",
    meaning="Light by wavelength in place of three colours.",
    heuristic="as many values as given (8.11)",
    reference="wavelengths",
    cost="samples, 4 values each",
    rule=is_spectral,
    colour="#882255",
    sampled=True,
)

# --- Lights that differ in form: intensities, fall-off, cone, extent, surroundings -----------


def lights_of_two_intensities(facts: Facts) -> list[str]:
    """Find the lights whose specular intensity is lost."""
    lost = facts.pair.unrepresentable
    return [light.name for light in lost if light.lost == SECOND_INTENSITY]


def has_two_intensities(facts: Facts) -> tuple[bool, str]:
    """Whether a light has two intensities."""
    names = lights_of_two_intensities(facts)
    return bool(names), f"lights of two intensities: {', '.join(names) or 'none'}"


ONE_INTENSITY = Effect(
    label="one intensity",
    noun="one intensity for all reflection",
    meaning=(
        "Physical light has one intensity. The textbook’s may have one for each kind of reflection."
    ),
    heuristic="L_d and L_s (6.6, 6.8)",
    reference="one",
    cost="nothing",
    rule=has_two_intensities,
    colour="#332288",
    sites=lights_of_two_intensities,
)


def inexact_lights(facts: Facts, with_cone: bool) -> list[str]:
    """Find the keys of the scene's lights whose two forms differ by cone, or only by fall-off.

    A spot's attenuation goes with its cone: Mitsuba has no spot with another fall-off. An even cone
    (``m = 0``) is the same in both forms.
    """

    def has_uneven_cone(graph: Graph, index: int) -> bool:
        is_spot = facts.light_kind(graph.plugin(index)).has("cutoff")
        return is_spot and bool(graph.props(index).get("exponent", 0.0) != 0)

    heuristic = facts.pair.heuristic
    physical = dict(facts.pair.physical.emitters_of(0))
    inexact = {light.name for light in facts.pair.pairing.emitters if not light.exact}
    return [
        key
        for key, index in heuristic.emitters_of(0)
        if key in physical
        and facts.light_kind(heuristic.plugin(index)).has("attenuation")
        and has_uneven_cone(heuristic, index) is with_cone
        and heuristic.label(index) in inexact
    ]


def put_lights(graph: Graph, facts: Facts, keys: Sequence[str]) -> None:
    """Put the textbook half's lights into a graph."""
    emitters = dict(facts.pair.heuristic.emitters_of(0))
    for key in keys:
        graph.attach(0, key, graph.graft(facts.pair.heuristic, emitters[key]))


def is_attenuated(facts: Facts) -> tuple[bool, str]:
    """Distance attenuation: any point or spot whose ``f_att`` depends on the distance."""
    graph = facts.pair.heuristic
    for index in graph.emitters():
        props = graph.props(index)
        is_even = (props.get("k1", 0.0), props.get("k2", 0.0)) == (0.0, 0.0)
        if facts.light_kind(graph.plugin(index)).has("attenuation") and not is_even:
            return True, f"{graph.label(index)} falls off with distance"
    return False, "no light of the textbook half falls off with distance"


ATTENUATION = ReplacedEffect(
    label="distance attenuation",
    meaning="How light weakens with distance: physically, with its square.",
    heuristic="f_att (6.1, 8.6)",
    reference="1 / d^2",
    cost="a division per light",
    rule=is_attenuated,
    colour="#d55e00",
    sites=partial(inexact_lights, with_cone=False),
    put=put_lights,
)


def has_cone(facts: Facts) -> tuple[bool, str]:
    """Whether a light of either half has a cone."""
    halves = facts.pair.heuristic, facts.pair.physical
    plugins = (half.plugin(index) for half in halves for index in half.emitters())
    return any(facts.light_kind(plugin).has("cutoff") for plugin in plugins), facts.light_kinds


CONE = ReplacedEffect(
    label="spot cone",
    meaning="How a spot light weakens towards the edge of its cone.",
    heuristic="6.2-6.4",
    reference="spot",
    cost="a comparison and a power per light",
    rule=has_cone,
    colour="#999933",
    sites=partial(inexact_lights, with_cone=True),
    put=put_lights,
)


def detach(graph: Graph, facts: Facts, sites: Sequence[tuple[int, str]]) -> None:
    """Remove lights from a graph, and the shapes that shone if emitters are hidden."""
    for parent, key in sites:
        graph.detach(parent, key)
        if parent and facts.pair.hide_emitters:
            graph.remove(parent)


def shining_shapes(facts: Facts) -> list[int]:
    """Find the shapes that shine, but for those that are ambient light in the textbook half."""
    graph = facts.pair.physical
    surrounding = facts.surrounding_lamps
    return [
        shape
        for shape in graph.shapes()
        if graph.emitters_of(shape) and graph.label(shape) not in surrounding
    ]


def has_far_lights(facts: Facts) -> tuple[bool, str]:
    """Whether a shape shines that is a spot or point in the textbook half."""
    return bool(shining_shapes(facts)), facts.light_kinds


def put_far_lights(graph: Graph, facts: Facts, shapes: Sequence[int]) -> None:
    """Put the textbook half's lights into a graph, in place of shapes that shine."""
    for shape in shapes:
        for key, _ in graph.emitters_of(shape):
            detach(graph, facts, [(shape, key)])
    # The lights that only the textbook half has are those in place of shapes, and suns.
    added = textbook_lights(facts)
    put_lights(graph, facts, [key for key in added if not key.startswith(SUN)])


def textbook_lights(facts: Facts) -> list[str]:
    """Return the keys of the lights that only the textbook half has."""
    before = dict(facts.pair.physical.emitters_of(0))
    return [key for key, _ in facts.pair.heuristic.emitters_of(0) if key not in before]


def own_light(phong: mi.Properties, facts: Facts) -> dict[str, Any]:
    """Return the light of a textbook material itself, unless its shape surrounds the scene."""
    is_there = "k_i" in phong and not facts.surrounds(phong)
    return {"k_i": phong["k_i"]} if is_there else {}


EXTENDED = GlowingEffect(
    label="extended lights",
    meaning="Lights with an area, and so soft shadows. The textbook’s are points.",
    heuristic="a spot or point",
    reference="sampled area lights",
    cost="samples, two rays each",
    rule=has_far_lights,
    colour="#56b4e9",
    sampled=True,
    sites=shining_shapes,
    put=put_far_lights,
    emission=own_light,
)


def surroundings(facts: Facts) -> list[tuple[int, str]]:
    """Find the lights that shine from everywhere, as node of their parent, and key in it."""
    graph = facts.pair.physical
    surrounding = facts.surrounding_lamps
    shapes = [shape for shape in graph.shapes() if graph.label(shape) in surrounding]
    return [
        (parent, key)
        for parent in (0, *shapes)
        for key, index in graph.emitters_of(parent)
        if parent or not facts.light_kind(graph.plugin(index)).exact
    ]


def put_surroundings(graph: Graph, facts: Facts, sites: Sequence[tuple[int, str]]) -> None:
    """Remove the lights that shine from everywhere; the textbook has a sun in place of a sky's."""
    detach(graph, facts, sites)
    put_lights(graph, facts, [key for key in textbook_lights(facts) if key.startswith(SUN)])


def is_surrounded(facts: Facts) -> tuple[bool, str]:
    """Whether a light shines from everywhere."""
    kinds = (light.kind for light in facts.lights if light.shape is None)
    around = facts.surrounding_lamps
    evidence = f"; around the scene: {', '.join(around)}" if around else ""
    is_there = bool(around) or any(facts.light_kind(kind).surrounds for kind in kinds)
    return is_there, facts.light_kinds + evidence


def ambient_light(phong: mi.Properties, facts: Facts) -> dict[str, Any]:
    """Return the ambient light that a textbook material reflects, and its own if it surrounds."""
    emitted = {"k_i": phong["k_i"]} if facts.surrounds(phong) else {}
    if "k_a" in phong and "ambient" in facts.kernel:
        emitted |= {"k_a": phong["k_a"], "ambient": facts.kernel["ambient"]}
    return emitted


ENVIRONMENT = GlowingEffect(
    label="environment",
    noun="environment light",
    meaning="Light from all around. The textbook has one ambient colour.",
    heuristic="ambient light",
    reference="light from everywhere",
    cost="samples, or a table",
    rule=is_surrounded,
    colour="#009e73",
    sampled=True,
    sites=surroundings,
    put=put_surroundings,
    emission=ambient_light,
)

# --- Surfaces that differ in form: reflection and transmission -------------------------------


def put_materials(graph: Graph, facts: Facts, shapes: Sequence[int]) -> None:
    """Give shapes the materials of the textbook half; shared materials stay shared."""
    replaced: dict[int, int] = {}
    for shape in shapes:
        ((key, _),) = graph.bsdfs_of(shape)
        ((_, phong),) = facts.pair.heuristic.bsdfs_of(shape)
        if phong not in replaced:
            replaced[phong] = graph.graft(facts.pair.heuristic, phong)
        graph.attach(shape, key, replaced[phong])


def lossy_bumps(facts: Facts) -> list[int]:
    """Find the shapes with bumps of which the textbook half lacks shadows or layers."""
    graph = facts.pair.physical
    layered = facts.layered_bumps
    return [
        shape
        for shape in graph.shapes()
        if any(
            index in layered or facts.has_bump_shadows(graph.props(index))
            for index in graph.materials_of(shape)
        )
    ]


def put_bumps(graph: Graph, facts: Facts, shapes: Sequence[int]) -> None:
    """Take the shadows of bumps from shapes; those with layers get the textbook half's material."""
    layered = facts.layered_bumps
    for shape in shapes:
        materials = graph.materials_of(shape)
        if layered.intersection(materials):
            put_materials(graph, facts, [shape])
        for index in materials:
            if facts.has_bump_shadows(graph.props(index)):
                graph.props(index)["use_shadowing_function"] = False


def has_lossy_bumps(facts: Facts) -> tuple[bool, str]:
    """Whether bumps have shadows, or maps lie over others."""
    if lossy_bumps(facts):
        return True, "a map's bumps have shadows, or maps lie over each other"
    return False, "no map's bumps have shadows, and no maps lie over each other"


BUMPS = ReplacedEffect(
    label="bumps",
    noun="shadows or layers of bumps",
    meaning="Shadows that bumps cast on themselves, and maps over maps. The textbook has neither.",
    heuristic="one normal at a point",
    reference="shadowed bumps, maps over maps",
    cost="a factor per map",
    rule=has_lossy_bumps,
    colour="#661100",
    sites=lossy_bumps,
    put=put_bumps,
)


def inexact_surfaces(facts: Facts, opaque: bool) -> list[int]:
    """Find the opaque shapes, or the others, whose two BSDFs differ; diffuse ones do not.

    What differs of bumps is an effect of its own.
    """
    graph = facts.pair.physical
    surfaces = []
    for shape in graph.shapes():
        materials = graph.materials_of(shape)
        inner = [index for index in materials if not facts.is_wrapper(graph.plugin(index))]
        is_exact = all(graph.plugin(index) == "diffuse" for index in inner)
        is_masked = any(graph.plugin(index) == "mask" for index in materials)
        is_opaque = not is_masked and all(facts.only_reflects(index) for index in inner)
        if not is_exact and is_opaque is opaque:
            surfaces.append(shape)
    return surfaces


def is_reflected(facts: Facts) -> tuple[bool, str]:
    """Whether a BSDF is more than diffuse."""
    return facts.has_microfacets, f"BSDFs: {', '.join(facts.bsdfs)}"


MICROFACETS = ReplacedEffect(
    label="microfacets and Fresnel",
    meaning="Highlights of rough, transparent coats, stronger at grazing angles. Phong’s are not.",
    heuristic="none",
    reference="roughplastic",
    cost="a BSDF evaluation per light",
    rule=is_reflected,
    colour="#cc79a7",
    sites=partial(inexact_surfaces, opaque=True),
    put=put_materials,
)

TRANSMISSION = ReplacedEffect(
    label="transmission",
    meaning="Light that passes through surfaces, which the textbook’s cannot.",
    heuristic="none",
    reference="refraction and media",
    cost="samples, rays per surface",
    rule=lambda facts: (
        facts.is_clear,
        "a BSDF may let light through" if facts.is_clear else "every BSDF is opaque",
    ),
    undecided=True,
    colour="#44aa99",
    sites=partial(inexact_surfaces, opaque=False),
    put=put_materials,
)

# --- Obstacles of light ----------------------------------------------------------------------


def is_unshadowed(facts: Facts) -> RuleResult:
    """Check whether no surface hides a light from another one."""
    from fotismos.reference.planning.rules import NO_SHADOWS  # loaded late: it needs Mitsuba

    return NO_SHADOWS.check(facts)


OCCLUSION = PrunedEffect(
    label="occlusion",
    meaning="Shadows: surfaces that hide a light. The textbook’s light passes them.",
    heuristic="none, or if requested",
    reference="shadow rays",
    cost="a ray per light",
    pruning=is_unshadowed,
    colour="#0072b2",
    is_alike=lambda facts: facts.has_shadows,
    # A sample of the BSDF would hit what hides a light.
    without={"shadows": False, "bsdf_samples": 0},
    step="shadows",
)


def is_not_reflected_again(facts: Facts) -> RuleResult:
    """Check whether light is reflected once at most."""
    from fotismos.reference.planning.rules import NO_SECOND_REFLECTION  # as late

    return NO_SECOND_REFLECTION.check(facts)


INTERREFLECTION = PrunedEffect(
    label="interreflection",
    meaning=(
        "Light that reaches a surface from other surfaces. The textbook has ambient light instead."
    ),
    heuristic="none",
    reference="paths",
    cost="samples, two rays per reflection",
    pruning=is_not_reflected_again,
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
