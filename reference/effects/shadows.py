"""Shadows: whether light may be blocked.

The rule that says *no* is a proof, written in its docstring. Where it says *yes*, no proof was
found, and shadows are simulated.
"""

from dataclasses import replace

import numpy as np

from reference.effects.effect import Effect
from reference.planning.structure import LightFacts, ShapeFacts, Structure

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
