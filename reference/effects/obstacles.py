"""What light meets on its way: shadows, and whether it may be reflected more than once.

Each is left out by a rule of pruning (:mod:`reference.planning.premises`): its proof stands beside
the premises that it rests on. Where one of these is not known to hold, the effect is simulated.
"""

from dataclasses import replace

import numpy as np

from reference.effects.effect import Effect
from reference.planning.facts import Facts, LightFacts, Structure
from reference.planning.premises import (
    CONVEX,
    NO_MEDIUM,
    OPAQUE,
    SEEN_FROM_OUTSIDE,
    STILL,
    Premise,
    Pruning,
)
from reference.planning.shapes import ShapeFacts

KNOWN_SURFACES = (NO_MEDIUM, OPAQUE, STILL, CONVEX, SEEN_FROM_OUTSIDE)
"""What both rules rest on: light meets nothing but the outer sides of convex shapes."""

FAR = 1e6
"""Where the shadow of a directional light begins, in multiples of the scene's size."""


def _between(facts: Facts) -> str | None:
    """Name an obstacle that may hide a light from a surface that reflects."""
    structure = facts.structure
    for light in structure.lights:
        shining = structure.shape(light.shape) if light.shape is not None else None
        if light.shape is not None and (shining is None or shining.hides_itself):
            return f"{light.shape}: may hide its own light"
        for receiver in structure.shapes:
            if not receiver.reflects:
                continue
            for obstacle in structure.shapes:
                if obstacle is receiver or obstacle is shining:
                    continue  # neither hides its own near side
                if _may_hide(structure, light, receiver, obstacle):
                    return f"{obstacle.name} may stand between {light.name} and {receiver.name}"
    return None


def _may_hide(
    structure: Structure, light: LightFacts, receiver: ShapeFacts, obstacle: ShapeFacts
) -> bool:
    """Tell whether an obstacle may be met on the way from a light to a receiver."""
    if not receiver.may_face(obstacle):
        return False
    if light.position is not None:
        ends = light.position[None]
    elif light.toward is not None:
        size = max(np.max(np.abs([shape.low, shape.high])) for shape in structure.shapes)
        toward = light.toward / np.linalg.norm(light.toward)
        ends = receiver.corners() + FAR * max(size, 1.0) * toward
    elif light.shape is not None:
        ends = structure.shape(light.shape).corners()
    else:  # an environment comes from everywhere that the receiver faces
        return True
    low = np.minimum(receiver.low, ends.min(axis=0))
    high = np.maximum(receiver.high, ends.max(axis=0))
    return bool(np.all(low <= obstacle.high) and np.all(obstacle.low <= high))


NO_SHADOWS = Pruning(
    name="no shadow rays",
    absent="no shape can stand between a light and a reflecting surface",
    proof="Light from a point y reaches a surface point x along a segment, which lies in the box"
    " around y and the shape of x. A shape whose box does not meet that one does not meet the"
    " segment. The shape of x itself is no obstacle: x lies on its outer side and is seen from"
    " outside, and a segment that passes through the shape arrives from behind, where an opaque"
    " BSDF returns nothing. A light that is flat, or convex and shines outwards, does not hide the"
    " side that shines.",
    premises=(
        *KNOWN_SURFACES,
        Premise(
            "No shape's box meets the box around a light and a shape that reflects, unless it lies"
            " behind that one's only reflecting side; no light hides itself.",
            _between,
        ),
    ),
)

OCCLUSION = Effect(
    order=80,
    label="occlusion",
    heuristic="none, or where asked for",
    reference="shadow rays",
    cost="a ray a light",
    pruning=NO_SHADOWS,
    part="visibility",
    colour="#0072b2",
    differs=lambda facts, called_for: called_for and not facts.has_shadows,
    # A sample of the BSDF would meet what hides a light.
    without=lambda plan: replace(plan, shadows=False, bsdf_samples=0),
    step="shadows",
)


def _facing(facts: Facts) -> str | None:
    """Name two shapes that may send each other light."""
    reflecting = [shape for shape in facts.structure.shapes if shape.reflects]
    for number, first in enumerate(reflecting):
        for second in reflecting[number + 1 :]:
            if first.may_face(second) and second.may_face(first):
                return f"{first.name} and {second.name} may see each other"
    return None


NO_SECOND_REFLECTION = Pruning(
    name="direct light alone",
    absent="no point of a reflecting surface sees another one",
    proof="A second reflection needs two surface points that see each other, both on sides that"
    " reflect. Two points on the outer side of one convex shape never do, nor do two of a flat one."
    " The inside of a closed shape is reached by no path that begins outside. Two points of"
    " different shapes do not where one of the shapes is flat, reflects on one side, and the other"
    " lies behind it. A shape that reflects nothing takes no part.",
    premises=(
        *KNOWN_SURFACES,
        Premise("No two shapes that reflect lie before each other's reflecting sides.", _facing),
    ),
)

INTERREFLECTION = Effect(
    order=120,
    label="interreflection",
    heuristic="none",
    reference="paths",
    cost="samples, two rays a reflection",
    pruning=NO_SECOND_REFLECTION,
    part="transport",
    colour="#e69f00",
    differs=lambda facts, called_for: called_for and facts.pair.max_depth != 2,
    without=lambda plan: replace(plan, max_depth=2),
    step="light reflected more than once",
)
