"""The effects of light, each declared once, in the order of :data:`EFFECTS`.

Whatever lists effects reads that tuple: plans, hybrids, attribution, parts of a departure, steps of
a study, charts and pages.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import mitsuba as mi

from fotismos.heuristic.heuristics import Interpolation
from fotismos.reference.pairing import lights
from fotismos.reference.pairing.bsdfs import WRAPPERS, is_mirror
from fotismos.reference.planning.facts import BSDF, EMITTER, SHAPE, Facts
from fotismos.reference.planning.rules import NO_SECOND_REFLECTION, NO_SHADOWS, PruningRule
from fotismos.reference.records import Record
from fotismos.reference.scene.graph import Graph, graft


class Decision(Record):
    """Whether a scene calls for an effect, and why.

    Attributes
    ----------
    rule
        The kind of reason, and the reason: ``structural`` follows from the scene's structure,
        ``simulated`` means that a premise of leaving it out is not known to hold, ``asked`` that
        pruning is off, ``guard`` that a probe disagreed with the plan.
    """

    name: str
    called_for: bool
    rule: str


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
        """Return whether the two halves differ in it, given whether the scene calls for it."""
        return bool(self.sites(facts))

    def __repr__(self) -> str:
        return f"<effect {self.label}>"

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy in another process must be the same effect, for sets and `is`.
        return labelled, (self.label,)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class PrunedEffect(Effect):
    """An effect that the integrator leaves out if the rule ``pruning`` allows it.

    ``without`` are the parameters of `direct_all` that do so. ``is_alike(facts)``: both halves
    treat it alike. ``step`` is what it changes in an image, in words.
    """

    rule: Rule = lambda facts: (False, "")
    pruning: PruningRule
    without: dict[str, Any]
    is_alike: Callable[[Facts], bool]
    step: str

    def decide(self, facts: Facts) -> Decision:
        """Apply the rule of pruning."""
        result = self.pruning.check(facts)
        kind = "structural" if result.applies else "simulated"
        return self.decision(not result.applies, kind, result.evidence)

    def differs(self, facts: Facts, called_for: bool) -> bool:
        """Return whether the scene calls for it, and the halves treat it differently."""
        return called_for and not self.is_alike(facts)


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class ReplacedEffect(Effect):
    """An effect that is left out by giving the physical half the heuristic half's form.

    ``put(graph, facts, sites)`` replaces the ``sites`` in a copy of the physical half's graph.
    """

    sites: Sites
    put: Callable[[Graph, Facts, Sequence[Any]], None]


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class GlowingEffect(ReplacedEffect):
    """A replaced effect without which a heuristic material shines of itself.

    ``emission(phong, facts)`` returns the light that a camera ray then sees, as parameters of
    ``heuristic_glow``.
    """

    emission: Callable[[mi.Properties, Facts], dict[str, Any]]


# --- Terms of the heuristic kernel -----------------------------------------------------------


def _coefficient(name: str) -> Callable[[Facts], tuple[bool, str]]:
    def rule(facts: Facts) -> tuple[bool, str]:
        present = name in facts.kernel_terms
        where = "not 0 in some material" if present else "0 in every material"
        if name == "k_s" and any(map(is_mirror, facts.materials)):
            where += ", mirrors aside: the kernel traces no rays"
        return present, f"{name} is {where}"

    return rule


EMISSION = Effect(
    label="emission",
    heuristic="k_i (8.1)",
    reference="area emitters, seen",
    cost="an addition",
    rule=_coefficient("k_i"),
)

AMBIENT = Effect(
    label="ambient",
    heuristic="I_a k_a (8.2)",
    reference="see environment",
    cost="an addition",
    rule=lambda facts: (
        _coefficient("k_a")(facts) if "ambient" in facts.kernel else (False, "no ambient light")
    ),
)

DIFFUSE = Effect(
    label="diffuse",
    heuristic="k_d (N.L) (8.5)",
    reference="diffuse, or roughplastic's base",
    cost="a scalar product",
    rule=_coefficient("k_d"),
)

SPECULAR = Effect(
    label="specular",
    heuristic="k_s (R.V)^n (8.9)",
    reference="roughplastic's coat",
    cost="a vector and a power",
    rule=_coefficient("k_s"),
)

POLYGONS = Effect(
    label="polygon interpolation",
    heuristic="flat, Gouraud (6.35-6.38)",
    reference="none",
    cost="a sum per vertex or face, then a lookup: saves time with many lights",
    rule=lambda facts: (
        facts.interpolation is not Interpolation.PHONG,
        f"interpolation {facts.interpolation.value}",
    ),
    colour="#f0e442",
)

SPECTRAL = Effect(
    label="spectral",
    noun="spectral light",
    heuristic="as many values as given (8.11)",
    reference="wavelengths",
    cost="samples, 4 values each",
    rule=lambda facts: (mi.is_spectral, f"variant {mi.variant()}"),
    colour="#882255",
    sampled=True,
)


# --- Lights that differ in form: intensities, fall-off, cone, extent, surroundings -----------


def _of_two_intensities(facts: Facts) -> list[str]:
    lost = facts.pair.unrepresentable
    return [light.name for light in lost if light.lost == lights.SECOND_INTENSITY]


ONE_INTENSITY = Effect(
    label="one intensity",
    noun="one intensity for all reflection",
    heuristic="L_d and L_s (6.6, 6.8)",
    reference="one",
    cost="nothing",
    rule=lambda facts: (
        bool(names := _of_two_intensities(facts)),
        f"lights of two intensities: {', '.join(names) or 'none'}",
    ),
    colour="#332288",
    sites=_of_two_intensities,
)


def _inexact_lights(with_cone: bool) -> Callable[[Facts], list[str]]:
    """Find the keys of the scene's lights whose two forms differ by cone, or only by fall-off.

    A spot's attenuation goes with its cone: Mitsuba has no spot with another fall-off. An even cone
    (``m = 0``) is the same in both forms.
    """

    def has_cone(graph: Graph, index: int) -> bool:
        is_spot = lights.of(graph.plugin(index)).has("cutoff")
        return is_spot and graph.props(index).get("exponent", 0.0) != 0

    def sites(facts: Facts) -> list[str]:
        heuristic = facts.pair.heuristic
        physical = dict(facts.pair.physical.children(0, EMITTER))
        inexact = {light.name for light in facts.pair.pairing.emitters if not light.exact}
        return [
            key
            for key, index in heuristic.children(0, EMITTER)
            if key in physical
            and lights.of(heuristic.plugin(index)).has("attenuation")
            and has_cone(heuristic, index) is with_cone
            and heuristic.label(index) in inexact
        ]

    return sites


def _put_lights(graph: Graph, facts: Facts, keys: Sequence[str]) -> None:
    emitters = dict(facts.pair.heuristic.children(0, EMITTER))
    for key in keys:
        graph.attach(0, key, graft(graph, facts.pair.heuristic, emitters[key]))


def _attenuated(facts: Facts) -> tuple[bool, str]:
    """Distance attenuation: any point or spot whose ``f_att`` depends on the distance."""
    graph = facts.pair.heuristic
    for index in graph.nodes(EMITTER):
        props = graph.props(index)
        is_even = (props.get("k1", 0.0), props.get("k2", 0.0)) == (0.0, 0.0)
        if lights.of(graph.plugin(index)).has("attenuation") and not is_even:
            return True, f"{graph.label(index)} falls off with distance"
    return False, "no light of the heuristic half falls off with distance"


def _coned(facts: Facts) -> tuple[bool, str]:
    halves = facts.pair.heuristic, facts.pair.physical
    plugins = (half.plugin(index) for half in halves for index in half.nodes(EMITTER))
    return any(lights.of(plugin).has("cutoff") for plugin in plugins), facts.light_kinds


def _shining(facts: Facts) -> list[int]:
    graph = facts.pair.physical
    return [shape for shape in graph.nodes(SHAPE) if graph.children(shape, EMITTER)]


def _put_far_lights(graph: Graph, facts: Facts, shapes: Sequence[int]) -> None:
    for shape in shapes:
        for key, _ in graph.children(shape, EMITTER):
            graph.detach(shape, key)
            if facts.pair.hide_emitters:
                graph.remove(shape)
    # The lights that only the heuristic half has are those in place of shapes.
    before = dict(facts.pair.physical.children(0, EMITTER))
    emitters = facts.pair.heuristic.children(0, EMITTER)
    _put_lights(graph, facts, [key for key, _ in emitters if key not in before])


def _surroundings(facts: Facts) -> list[str]:
    graph = facts.pair.physical
    children = graph.children(0, EMITTER)
    return [key for key, index in children if not lights.of(graph.plugin(index)).exact]


def _surrounded(facts: Facts) -> tuple[bool, str]:
    kinds = (light.kind for light in facts.lights if light.shape is None)
    return any(lights.of(kind).surrounds for kind in kinds), facts.light_kinds


def _detach(graph: Graph, facts: Facts, keys: Sequence[str]) -> None:
    for key in keys:
        graph.detach(0, key)


def _ambient_light(phong: mi.Properties, facts: Facts) -> dict[str, Any]:
    if "k_a" not in phong or "ambient" not in facts.kernel:
        return {}
    return {"k_a": phong["k_a"], "ambient": facts.kernel["ambient"]}


ATTENUATION = ReplacedEffect(
    label="distance attenuation",
    heuristic="f_att (6.1, 8.6)",
    reference="1 / d^2",
    cost="a division per light",
    rule=_attenuated,
    colour="#d55e00",
    sites=_inexact_lights(with_cone=False),
    put=_put_lights,
)

CONE = ReplacedEffect(
    label="spot cone",
    heuristic="6.2-6.4",
    reference="spot",
    cost="a comparison and a power per light",
    rule=_coned,
    colour="#999933",
    sites=_inexact_lights(with_cone=True),
    put=_put_lights,
)

EXTENDED = GlowingEffect(
    label="extended lights",
    heuristic="a spot or point",
    reference="sampled area lights",
    cost="samples, two rays each",
    rule=lambda facts: (len(facts.lamps) > 0, facts.light_kinds),
    colour="#56b4e9",
    sampled=True,
    sites=_shining,
    put=_put_far_lights,
    emission=lambda phong, facts: {"k_i": phong["k_i"]} if "k_i" in phong else {},
)

ENVIRONMENT = GlowingEffect(
    label="environment",
    noun="environment light",
    heuristic="ambient light",
    reference="light from everywhere",
    cost="samples, or a table",
    rule=_surrounded,
    colour="#009e73",
    sampled=True,
    sites=_surroundings,
    put=_detach,
    emission=_ambient_light,
)


# --- Surfaces that differ in form: reflection and transmission -------------------------------


def _inexact_surfaces(opaque: bool) -> Callable[[Facts], list[int]]:
    """Find the opaque shapes, or the others, whose two BSDFs differ; diffuse ones do not."""

    def sites(facts: Facts) -> list[int]:
        graph = facts.pair.physical
        surfaces = []
        for shape in graph.nodes(SHAPE):
            shape_facts = facts.by_name.get(graph.props(shape).id())
            for _, bsdf in graph.children(shape, BSDF):
                inner = [child for _, child in graph.children(bsdf, BSDF)] or [bsdf]
                is_exact = all(graph.plugin(index) == "diffuse" for index in inner)
                if not is_exact and (shape_facts is None or shape_facts.opaque) is opaque:
                    surfaces.append(shape)
        return surfaces

    return sites


def _put_materials(graph: Graph, facts: Facts, shapes: Sequence[int]) -> None:
    """Give shapes the materials of the heuristic half; shared materials stay shared."""
    replaced: dict[int, int] = {}
    for shape in shapes:
        ((key, _),) = graph.children(shape, BSDF)
        ((_, phong),) = facts.pair.heuristic.children(shape, BSDF)
        if phong not in replaced:
            replaced[phong] = graft(graph, facts.pair.heuristic, phong)
        graph.attach(shape, key, replaced[phong])


def _reflected(facts: Facts) -> tuple[bool, str]:
    graph = facts.pair.physical
    plugins = {graph.plugin(index) for index in graph.nodes(BSDF)}
    return bool(plugins - {"diffuse", "null", *WRAPPERS}), f"BSDFs: {', '.join(sorted(plugins))}"


MICROFACETS = ReplacedEffect(
    label="microfacets and Fresnel",
    heuristic="none",
    reference="roughplastic",
    cost="a BSDF evaluation per light",
    rule=_reflected,
    colour="#cc79a7",
    sites=_inexact_surfaces(opaque=True),
    put=_put_materials,
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
    sites=_inexact_surfaces(opaque=False),
    put=_put_materials,
)


# --- Obstacles of light ----------------------------------------------------------------------

OCCLUSION = PrunedEffect(
    label="occlusion",
    heuristic="none, or if requested",
    reference="shadow rays",
    cost="a ray per light",
    pruning=NO_SHADOWS,
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
    pruning=NO_SECOND_REFLECTION,
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
