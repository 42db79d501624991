"""Interreflection: whether light may be reflected more than once.

The rule that says *no* is a proof, written in its docstring. Where it says *yes*, no proof was
found, and paths are simulated.
"""

from dataclasses import replace

import numpy as np

from reference.effects.effect import Effect
from reference.planning.structure import ShapeFacts, Structure


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
