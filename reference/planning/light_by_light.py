"""Cases in which Mitsuba's integrators agree: every light instead of one, and masks."""

from reference.pairing import lights
from reference.pairing.halves import Pair
from reference.planning.facts import BSDF, EMITTER, Facts
from reference.planning.premises import NO_MEDIUM, OPAQUE, Premise, Pruning
from reference.rendering.light_choice import MOST_ASKED, PICKS


def _shallow(facts: Facts) -> str | None:
    depth = facts.pair.max_depth
    return f"the scene's depth is {depth}" if 0 <= depth < 2 else None


def _seen_inside_a_lamp(facts: Facts) -> str | None:
    structure = facts.structure
    for light in structure.lights:
        shape = structure.shape(light.shape) if light.shape is not None else None
        if shape and structure.may_be_seen_from_inside(shape):
            return f"{shape.name}: shines, and may be seen from inside"
    return None


def _sampled_elsewhere(facts: Facts) -> str | None:
    structure = facts.structure
    for light in structure.lights:
        if light.shape is not None:
            shape = structure.shape(light.shape)
            if shape is None or not shape.sampled_as_hit:
                return f"{light.shape}: samples of it may not be what rays hit"
    return None


SAMPLED_AS_HIT = Premise(
    "Every lamp's shape is a mesh, a rectangle, a disk, a sphere, or a cylinder that is round and"
    " not mirrored: Mitsuba's samples of other cylinders face the other way or lie beside what"
    " rays hit, so its mean depends on how both are weighted.",
    _sampled_elsewhere,
)


LIGHT_BY_LIGHT = Pruning(
    name="light by light",
    absent="noise of picking one light: the sum over all equals the mean of one over its chance",
    proof="Mitsuba picks a light at random and divides by its chance. The mean is the sum over"
    " all lights, which `direct_all` takes at each sample. The two are equal if each estimate of"
    " a light has the right mean, however a sample of the BSDF is weighted against it.",
    premises=(
        SAMPLED_AS_HIT,
        NO_MEDIUM,
        OPAQUE,
        Premise("The scene's paths have a depth of 2 or more.", _shallow),
        Premise(
            "No closed shape that shines and reflects inside is seen from inside: at points of its"
            " own surface Mitsuba's sampling of a sphere finds light that a sample of the BSDF"
            " does not, so its mean depends on how both are weighted.",
            _seen_inside_a_lamp,
        ),
    ),
)


def _many(facts: Facts) -> str | None:
    count = len(facts.structure.lights)
    if count <= MOST_ASKED:
        return None
    return f"{count:,} lights: {PICKS} per sample are picked, in proportion to their light"


EVERY_LIGHT = Pruning(
    name="every light at every sample",
    absent="noise of picking some of the lights",
    proof="If each light is evaluated at each sample, none is picked. Otherwise a light's"
    " contribution is divided by the expected number of picks, which is never 0: the mean is the"
    " sum over all lights.",
    premises=(
        Premise(
            f"The scene has at most {MOST_ASKED:,} lights: with more, evaluating each costs more"
            " than the noise of picking some.",
            _many,
        ),
    ),
)


def loses_light(integrator: str, pair: Pair) -> bool:
    """Return whether Mitsuba's ``path`` loses light that surfaces of a scene reflect.

    A camera ray that passes straight through every surface, and ends in nothing visible, counts as
    black, including the light gathered on its way. A closed mask of opacity ``o`` before nothing
    loses the share ``(1 - o)^2``. ``volpath`` keeps it.
    """
    graph = pair.physical
    passing = any(graph.plugin(index) in ("mask", "null") for index in graph.nodes(BSDF))
    emitters = (lights.of(graph.plugin(index)) for index in graph.nodes(EMITTER))
    is_shown = any(kind.surrounds for kind in emitters) and not pair.hide_emitters
    return integrator == "path" and passing and not is_shown
