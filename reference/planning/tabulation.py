"""Whether a constant environment can come from a table of the BSDF's albedo."""

import mitsuba as mi

from reference.effects.obstacles import NO_SECOND_REFLECTION, NO_SHADOWS
from reference.pairing import lights
from reference.planning.facts import BSDF, SHAPE, Facts
from reference.planning.premises import Premise, Pruning

TEXTURE = mi.ObjectType.Texture


def _not_one(facts: Facts) -> str | None:
    graph = facts.pair.physical
    shapes, bsdfs = len(graph.nodes(SHAPE)), len(graph.nodes(BSDF))
    wrapped = [index for index in graph.nodes(BSDF) if graph.plugin(index) == "twosided"]
    if shapes != 1:
        return f"{shapes} shapes"
    if bsdfs - len(wrapped) != 1:
        return "two sides that reflect differently"
    return None


def _not_uniform(facts: Facts) -> str | None:
    kinds = [lights.of(light.kind) for light in facts.structure.lights]
    extended = [kind for kind in kinds if not kind.exact]
    if len(extended) == 1 and extended[0].uniform:
        return None
    return f"{facts.lights_in_words}: not one constant environment plus points and directions"


def _textured(facts: Facts) -> str | None:
    textures = facts.pair.physical.nodes(TEXTURE)
    return f"texture: {facts.pair.physical.plugin(textures[0])}" if textures else None


def _anisotropic(facts: Facts) -> str | None:
    known = {"diffuse", "plastic", "roughplastic", "conductor", "roughconductor", "twosided"}
    graph = facts.pair.physical
    for index in graph.nodes(BSDF):
        props = graph.props(index)
        if graph.plugin(index) not in known or "alpha_u" in props or "alpha_v" in props:
            return f"{graph.label(index)}: {graph.plugin(index)} may differ with the azimuth"
    return None


def _coloured(facts: Facts) -> str | None:
    return None if mi.is_rgb else f"variant {mi.variant()}"


def _hidden(facts: Facts) -> str | None:
    ruling = NO_SHADOWS.judge(facts)
    return None if ruling.holds else ruling.evidence


def _lit_twice(facts: Facts) -> str | None:
    ruling = NO_SECOND_REFLECTION.judge(facts)
    return None if ruling.holds or facts.pair.max_depth == 2 else ruling.evidence


TABULATED_ENVIRONMENT = Pruning(
    name="environment from a table",
    absent="noise: the reflected environment is its radiance times an albedo",
    proof="If nothing is hidden, a surface point receives the radiance L from all directions of"
          " the half space that it is seen from. It reflects L times the albedo of its BSDF for"
          " the view direction. For an isotropic BSDF that is the same everywhere this depends"
          " only on the cosine; for a two-sided one, on its absolute value.",
    premises=(
        Premise("There is one shape, and one BSDF, the same on both sides that reflect.", _not_one),
        Premise("One light is a constant environment; the others are points, spots and directions.",
                _not_uniform),
        Premise("Nothing is textured.", _textured),
        Premise("The BSDF is known to be isotropic.", _anisotropic),
        Premise("The variant is RGB.", _coloured),
        Premise("No light can be hidden, by the premises of leaving out shadow rays.", _hidden),
        Premise("Light is reflected once, by the premises of direct light alone or by the scene's"
                " own depth.", _lit_twice),
    ),
)  # fmt: skip
