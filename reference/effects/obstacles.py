"""What light meets on its way: shadows, and whether it may be reflected more than once.

A rule that says *no* is a proof, written in its docstring. Where it says *yes*, no proof was found,
and the effect is simulated.
"""

from dataclasses import replace

import numpy as np

from reference.effects.effect import Effect
from reference.planning.facts import LightFacts, ShapeFacts, Structure

FAR = 1e6
"""Where the shadow of a directional light begins, in multiples of the scene's size."""


def occlusion(structure: Structure) -> tuple[bool, str]:
    """Whether a shape may hide a light from another shape, or from itself.

    *Proof of no.* Light from a point ``y`` reaches a surface point ``x`` along a segment, which
    lies in the convex hull of ``y`` and the bounding box of ``x``'s shape, and so in the box around
    both. A shape whose box does not meet that one does not meet the segment. The shape of ``x``
    itself is no obstacle where it is convex: a segment that passes through it arrives from behind
    the surface, where its opaque BSDF returns nothing.

    Returns
    -------
    called_for : bool
    evidence : str
    """
    for shape in structure.shapes:
        if not shape.opaque:
            return True, f"{shape.name}: its BSDF may let light through"
        if shape.reflects and not shape.convex:
            return True, f"{shape.name}: not convex, or with smoothed normals, so may shadow itself"
    for light in structure.lights:
        for receiver in structure.shapes:
            if not receiver.reflects:
                continue
            for obstacle in structure.shapes:
                if obstacle is not receiver and _may_hide(structure, light, receiver, obstacle):
                    return (
                        True,
                        f"{obstacle.name} may stand between {light.name} and {receiver.name}",
                    )
    return False, "no shape can stand between a light and a reflecting surface"


def _may_hide(
    structure: Structure, light: LightFacts, receiver: ShapeFacts, obstacle: ShapeFacts
) -> bool:
    """Tell whether an obstacle may be met on the way from a light to a receiver."""
    if light.shape == obstacle.name and obstacle.convex:
        return False  # a convex light does not hide its own near side
    if light.position is not None:
        ends = light.position[None]
    elif light.toward is not None:
        size = max(np.max(np.abs([shape.low, shape.high])) for shape in structure.shapes)
        ends = receiver.corners() + FAR * max(size, 1.0) * light.toward / np.linalg.norm(
            light.toward
        )
    elif light.shape is not None:
        ends = next(shape for shape in structure.shapes if shape.name == light.shape).corners()
    else:  # an environment comes from everywhere that the receiver faces
        return receiver.may_face(obstacle)
    if not receiver.may_face(obstacle):
        return False
    low = np.minimum(receiver.low, ends.min(axis=0))
    high = np.maximum(receiver.high, ends.max(axis=0))
    return bool(np.all(low <= obstacle.high) and np.all(obstacle.low <= high))


OCCLUSION = Effect(
    order=80,
    label="occlusion",
    heuristic="none, or where asked for",
    reference="shadow rays",
    cost="a ray a light",
    rule=lambda facts: occlusion(facts.structure),
    undecided=True,
    part="visibility",
    colour="#0072b2",
    differs=lambda facts, called_for: called_for and not facts.has_shadows,
    # A sample of the BSDF would meet what hides a light.
    without=lambda plan: replace(plan, shadows=False, bsdf_samples=0),
    step="shadows",
)


def interreflection(structure: Structure) -> tuple[bool, str]:
    """Whether light that one surface reflects may reach another surface that reflects.

    *Proof of no.* A second reflection needs two surface points, both on shapes whose BSDFs reflect,
    that see each other. Two points of one convex shape never do. Two points of different shapes do
    not where one of the shapes is flat, reflects on one side, and the other lies behind it. A shape
    that reflects nothing takes no part. A camera inside a convex shape would see its inside, where
    the first argument fails.
    """
    reflecting = [shape for shape in structure.shapes if shape.reflects]
    for shape in structure.shapes:
        if not shape.opaque:
            return True, f"{shape.name}: its BSDF may let light through"
    for shape in reflecting:
        if not shape.convex:
            return True, f"{shape.name}: not convex, or with smoothed normals, so may light itself"
        if shape.plane is None and any(_inside(camera, shape) for camera in structure.cameras):
            return True, f"{shape.name}: a camera may look at it from inside"
    for number, first in enumerate(reflecting):
        for second in reflecting[number + 1 :]:
            if first.may_face(second) and second.may_face(first):
                return True, f"{first.name} and {second.name} may see each other"
    if not reflecting:
        return False, "nothing reflects"
    if len(reflecting) == 1:
        return False, f"only {reflecting[0].name} reflects, and it is convex"
    return False, "no two reflecting shapes see each other"


def _inside(point: np.ndarray, shape: ShapeFacts) -> bool:
    return bool(np.all(point >= shape.low) and np.all(point <= shape.high))


INTERREFLECTION = Effect(
    order=120,
    label="interreflection",
    heuristic="none",
    reference="paths",
    cost="samples, two rays a reflection",
    rule=lambda facts: interreflection(facts.structure),
    undecided=True,
    part="transport",
    colour="#e69f00",
    differs=lambda facts, called_for: called_for and facts.pair.max_depth != 2,
    without=lambda plan: replace(plan, max_depth=2),
    step="light reflected more than once",
)
