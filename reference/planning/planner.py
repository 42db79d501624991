"""The cheapest reference that is right, chosen by what a scene calls for.

======================================  ===========================================================
What the scene calls for                What is simulated
======================================  ===========================================================
neither occlusion nor interreflection   ``direct_all`` without shadow rays; a constant environment
                                        from a table of the BSDF's albedo where there is one BSDF
no interreflection                      ``direct_all``: points and directions exactly, the rest
                                        sampled
interreflection between diffuse         ``direct_all`` with the indirect part sampled, and that
surfaces, several points or directions  alone (2, 4, 12 lights: 1.3, 1.3, 2.6 times as efficient as
                                        ``path``, which picks one of them for each sample)
interreflection                         ``path``, as deep as the scene allows; with glossy surfaces
                                        their noise decides, and it is the faster
a BSDF that may let light through       ``path``, whatever the depth
participating media                     ``volpath``, or ``volpathmis`` where the scene asks for it
                                        or its extinction has a colour
======================================  ===========================================================

All take the sampler of least noise for its time. Where no light needs random numbers, only the
pixel filter is left to sample; the same samples are then better in few passes of many, within which
they are stratified, and four passes are enough to see what noise is left.
"""

from dataclasses import dataclass

import mitsuba as mi

from heuristic.interpolation import Interpolation
from reference.pairing import lights
from reference.pairing.nearest import WRAPPERS
from reference.pairing.nearest.operations import plain
from reference.planning import rules
from reference.planning.effects import Decision, Effect
from reference.planning.structure import BSDF, EMITTER, examine
from reference.rendering.indirect import RR_DEPTH
from reference.scene import values

SAMPLER = "multijitter"
"""Of the stock samplers the one of least noise for its time, on figures and the Cornell box alike:
at 64 samples a pixel, 10 times the efficiency of ``independent`` there (``stratified`` 5 times)."""

SPECTRAL_TEXTURES = ("regular", "irregular", "blackbody")

STOCK_SAMPLER = "independent"
SPP = 256
PASSES, DETERMINISTIC_PASSES = 16, 4


@dataclass(frozen=True)
class Plan:
    """How both halves are rendered.

    Attributes
    ----------
    decisions
        One for each effect, in the order of the enumeration.
    kernel_terms
        The terms that the heuristic kernel holds.
    integrator, max_depth
        Of the reference; ``max_depth`` counts as Mitsuba's: 2 is direct light, -1 no limit.
    sampler, spp, passes
        Of both halves; ``spp`` over all passes, unless the user gives another.
    rr_depth
        Of ``path``: where Russian roulette begins to end paths.
    shadows, tabulate_environment
        Parameters of ``direct_all``.
    """

    decisions: tuple[Decision, ...]
    kernel_terms: tuple[str, ...]
    integrator: str
    max_depth: int
    sampler: str
    spp: int
    passes: int
    rr_depth: int = 5
    shadows: bool = True
    tabulate_environment: bool = False

    def calls_for(self, effect):
        """Tell whether an effect is called for."""
        return next(d.called_for for d in self.decisions if d.effect is effect)


def sampler(everything=False):
    """Return the sampler of a plan; it is known before the scene is, which is made with it."""
    return STOCK_SAMPLER if everything else SAMPLER


def plan(pair, scene, interpolation=Interpolation.PHONG, everything=False):
    """Decide on each effect, and choose the reference.

    Parameters
    ----------
    pair : reference.pairing.halves.Pair
        Both halves.
    scene : mitsuba.Scene
        The physical half, instantiated.
    interpolation : Interpolation
        Of the heuristic half.
    everything
        Switch all pruning off: what a user of Mitsuba gets without thinking, ``path`` with the
        independent sampler.
    """
    if everything:
        decisions = tuple(Decision(effect, True, "asked", "--everything") for effect in Effect)
        terms = ("k_i", "k_a", "k_d", "k_s")
        stock = _stock(pair)
        return Plan(decisions, terms, stock, pair.max_depth, sampler(True), SPP, PASSES)
    structure = examine(pair.physical, scene)
    occlusion, interreflection = rules.occlusion(structure), rules.interreflection(structure)
    decisions = _decisions(pair, structure, interpolation, occlusion, interreflection)
    terms = tuple(name for name in ("k_i", "k_a", "k_d", "k_s") if _present(pair.heuristic, name))
    exact = [light for light in structure.lights if lights.of(light.kind).exact]
    rr_depth = pair.rr_depth or RR_DEPTH
    is_clear = any(not shape.opaque for shape in structure.shapes)
    if pair.media or is_clear or 0 <= pair.max_depth < 2:
        stock = _stock(pair)
        return Plan(decisions, terms, stock, pair.max_depth, SAMPLER, SPP, PASSES, rr_depth)
    if interreflection[0] and pair.max_depth != 2 and len(exact) > 1 and _diffuse(pair.physical):
        return Plan(decisions, terms, "direct_all", pair.max_depth, SAMPLER, SPP, PASSES)
    if interreflection[0] and pair.max_depth != 2:
        return Plan(decisions, terms, "path", pair.max_depth, SAMPLER, SPP, PASSES, rr_depth)
    tabulated = not occlusion[0] and _can_tabulate(pair.physical)
    random = [
        light
        for light in structure.lights
        if not (kind := lights.of(light.kind)).exact and not (tabulated and kind.uniform)
    ]
    passes = PASSES if random or mi.is_spectral else DETERMINISTIC_PASSES
    return Plan(
        decisions,
        terms,
        "direct_all",
        2,
        SAMPLER,
        SPP,
        passes,
        shadows=occlusion[0],
        tabulate_environment=tabulated,
    )


def _stock(pair):
    """Return Mitsuba's integrator for a scene: the one that it names, if that can follow media."""
    if pair.integrator in ("volpath", "volpathmis"):
        return pair.integrator
    if not pair.media:
        return "path"
    graph = pair.physical
    extinctions = (
        graph.props(index).get(key, 0.0)
        for index in graph.nodes(mi.ObjectType.Medium)
        for key in ("sigma_t", "sigma_s")
    )
    coloured = any(isinstance(plain(value), tuple) for value in extinctions)
    return "volpathmis" if coloured else "volpath"


def wants_spectra(graph):
    """Tell whether a scene holds spectra that three numbers cannot stand for.

    Those are tabulated spectra, black bodies and spectral films; uniform values, RGB and Mitsuba's
    own daylight (``d65``), which RGB values are relative to, are not.
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


def _decisions(pair, structure, interpolation, occlusion, interreflection):
    """Return a decision for each effect."""

    def structural(effect, called_for, evidence):
        rule = "simulated" if called_for and effect in _UNDECIDED else "structural"
        return Decision(effect, bool(called_for), rule, evidence)

    heuristic, physical = pair.heuristic, pair.physical
    kinds = [light.kind for light in structure.lights]
    listing = ", ".join(sorted(set(kinds))) or "none"
    plugins = {physical.plugin(index) for index in physical.nodes(BSDF)}
    has_environment = any(
        light.shape is None and lights.of(light.kind).surrounds for light in structure.lights
    )
    found = {
        Effect.EMISSION: _coefficient(heuristic, "k_i"),
        Effect.AMBIENT: _coefficient(heuristic, "k_a")
        if "ambient" in heuristic.props(heuristic.nodes(mi.ObjectType.Integrator)[0])
        else (False, "no ambient light"),
        Effect.DIFFUSE: _coefficient(heuristic, "k_d"),
        Effect.SPECULAR: _coefficient(heuristic, "k_s"),
        Effect.ATTENUATION: _attenuation(heuristic),
        Effect.CONE: (_cones(heuristic) or _cones(physical), f"lights: {listing}"),
        Effect.POLYGONS: (
            interpolation is not Interpolation.PHONG,
            f"interpolation {interpolation.value}",
        ),
        Effect.OCCLUSION: occlusion,
        Effect.MICROFACETS: (
            bool(plugins - {"diffuse", "null", *WRAPPERS}),
            f"BSDFs: {', '.join(sorted(plugins))}",
        ),
        Effect.EXTENDED: (
            any(light.shape is not None for light in structure.lights),
            f"lights: {listing}",
        ),
        Effect.ENVIRONMENT: (has_environment, f"lights: {listing}"),
        Effect.INTERREFLECTION: interreflection,
        Effect.TRANSMISSION: (
            any(not shape.opaque for shape in structure.shapes),
            "a BSDF may let light through"
            if any(not shape.opaque for shape in structure.shapes)
            else "every BSDF is opaque",
        ),
        Effect.SPECTRAL: (mi.is_spectral, f"variant {mi.variant()}"),
    }
    return tuple(structural(effect, *found[effect]) for effect in Effect)


_UNDECIDED = (Effect.OCCLUSION, Effect.INTERREFLECTION, Effect.TRANSMISSION)
"""Effects whose rule proves absence only: called for means that no proof was found."""


def _present(graph, name):
    return any(
        values.may_be_nonzero(graph.props(index)[name])
        for index in graph.nodes(BSDF)
        if graph.plugin(index) == "phong" and name in graph.props(index)
    )


def _coefficient(graph, name):
    present = _present(graph, name)
    return present, f"{name} is {'not 0 in some material' if present else '0 in every material'}"


def _attenuation(graph):
    """Distance attenuation: any point or spot whose ``f_att`` is not 1."""
    attenuated = [
        graph.label(index)
        for index in graph.nodes(EMITTER)
        if lights.of(graph.plugin(index)).has("attenuation")
        and (graph.props(index).get("k1", 0.0), graph.props(index).get("k2", 0.0)) != (0.0, 0.0)
    ]
    if attenuated:
        return True, f"{attenuated[0]} falls off with distance"
    return False, "no light of the heuristic half falls off with distance"


def _cones(graph):
    return any(lights.of(graph.plugin(index)).has("cutoff") for index in graph.nodes(EMITTER))


def _diffuse(graph):
    return all(graph.plugin(index) in ("diffuse", "twosided") for index in graph.nodes(BSDF))


def _can_tabulate(graph):
    """Tell whether the environment can be tabulated: one plain BSDF, one constant light, RGB."""
    shapes = graph.nodes(mi.ObjectType.Shape)
    kinds = [lights.of(graph.plugin(index)) for index in graph.nodes(EMITTER)]
    extended = [kind.uniform for kind in kinds if not kind.exact]
    textures = graph.nodes(mi.ObjectType.Texture)
    return len(shapes) == 1 and extended == [True] and not textures and mi.is_rgb
