"""Obstacles of light: shadows, and whether it may be reflected more than once.

Each is left out by a rule of pruning (:mod:`reference.planning.premises`), which states its proof
and premises. If a premise is not known to hold, the effect is simulated.
"""

from dataclasses import dataclass, replace
from functools import reduce
from operator import or_

import numpy as np
from numpy.typing import ArrayLike

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
from reference.planning.shape_tree import Queries

KNOWN_SURFACES = (NO_MEDIUM, OPAQUE, STILL, CONVEX, SEEN_FROM_OUTSIDE)
"""The premises of both rules: light hits only the outer sides of convex shapes."""

FAR = 1e6
"""Start of the shadow of a directional light, in multiples of the scene's size."""


@dataclass(frozen=True)
class Ways:
    """Boxes that hold the paths of light to surfaces.

    Each holds the surface's own box, the same moved towards the light, and the light's places.

    Attributes
    ----------
    low, high
        Box of the light's places, (3,); inf and -inf for none.
    back, forth
        Least and largest move along each axis, (3,).
    """

    low: np.ndarray
    high: np.ndarray
    back: np.ndarray
    forth: np.ndarray

    @classmethod
    def between(cls, low: ArrayLike, high: ArrayLike, move: ArrayLike = (0, 0, 0)) -> "Ways":
        """Return the ways from the places in a box, or along one move."""
        zero, ends = np.zeros(3), (np.asarray(low, float), np.asarray(high, float))
        return cls(*ends, np.minimum(zero, move), np.maximum(zero, move))

    @classmethod
    def of(cls, structure: Structure, light: LightFacts) -> "Ways":
        """Return the ways from one light."""
        if light.position is not None:
            return cls.between(light.position, light.position)
        if light.toward is not None:
            toward = light.toward / np.linalg.norm(light.toward)
            move = FAR * max(structure.tree.largest_coordinate, 1.0) * toward
            return cls.between(np.full(3, np.inf), np.full(3, -np.inf), move)
        if light.shape is not None:
            shape = structure.shapes[structure.numbers[light.shape]]
            return cls.between(shape.low, shape.high)
        # An environment shines from everywhere that the receiver faces.
        return cls.between(np.full(3, -np.inf), np.full(3, np.inf))

    def __or__(self, other: "Ways") -> "Ways":
        """Return the smallest ways that hold both."""
        return Ways(
            np.minimum(self.low, other.low),
            np.maximum(self.high, other.high),
            np.minimum(self.back, other.back),
            np.maximum(self.forth, other.forth),
        )

    def to(self, structure: Structure, receivers: np.ndarray, shining: int = -1) -> Queries:
        """Return the queries for shapes on the ways to others, except for one that shines."""
        own = structure.tree.shapes.take(receivers)
        low = np.minimum(own.low + self.back, self.low)
        high = np.maximum(own.high + self.forth, self.high)
        return Queries(receivers, low, high, np.full(len(receivers), shining))


def _between(facts: Facts) -> str | None:
    """Name an obstacle that may hide a light from a surface that reflects."""
    structure, tree = facts.structure, facts.structure.tree
    hiding = next((light for light in structure.lights if _hides_itself(structure, light)), None)
    judged = structure.lights[: structure.lights.index(hiding)] if hiding else structure.lights
    ways = [Ways.of(structure, light) for light in judged]
    if ways:
        # One query about all lights settles most receivers.
        receivers = structure.reflecting
        receivers = receivers[tree.answered(reduce(or_, ways).to(structure, receivers))]
        for light, way in zip(judged, ways, strict=True):
            shining = structure.numbers.get(light.shape, -1)
            if found := tree.first(way.to(structure, receivers, shining)):
                receiver, obstacle = receivers[found[0]], found[1]
                names = structure.shapes[obstacle].name, light.name, structure.shapes[receiver].name
                return "{} may stand between {} and {}".format(*names)
    return f"{hiding.shape}: may hide its own light" if hiding else None


def _hides_itself(structure: Structure, light: LightFacts) -> bool:
    shape = structure.shape(light.shape)
    return light.shape is not None and (shape is None or shape.hides_itself)


NO_SHADOWS = Pruning(
    name="no shadow rays",
    absent="no shape can stand between a light and a reflecting surface",
    proof="Light from a point y reaches a surface point x along a segment, which lies in the box"
    " around y and the shape of x. A shape whose box does not touch that one does not touch the"
    " segment. The shape of x itself is not an obstacle: x lies on its outer side and is seen from"
    " outside, and a segment that passes through the shape arrives from behind, where an opaque"
    " BSDF returns nothing. A light that is flat, or convex and shines outwards, does not hide the"
    " side that shines.",
    premises=(
        *KNOWN_SURFACES,
        Premise(
            "No shape's box touches the box around a light and a shape that reflects, unless it"
            " lies"
            " behind that one's only reflecting side; no light hides itself.",
            _between,
        ),
    ),
)

OCCLUSION = Effect(
    order=80,
    label="occlusion",
    heuristic="none, or if requested",
    reference="shadow rays",
    cost="a ray per light",
    pruning=NO_SHADOWS,
    part="visibility",
    colour="#0072b2",
    differs=lambda facts, called_for: called_for and not facts.has_shadows,
    # A sample of the BSDF would hit what hides a light.
    without=lambda plan: replace(plan, shadows=False, bsdf_samples=0),
    step="shadows",
)


def _facing(facts: Facts) -> str | None:
    """Name two shapes that may send each other light."""
    structure = facts.structure
    found = structure.reflecting_tree.first(Queries.everywhere(structure.reflecting), mutual=True)
    if found is None:
        return None
    first, second = (structure.shapes[i].name for i in (structure.reflecting[found[0]], found[1]))
    return f"{first} and {second} may see each other"


NO_SECOND_REFLECTION = Pruning(
    name="direct light alone",
    absent="no point of a reflecting surface sees another one",
    proof="A second reflection needs two surface points that see each other, both on sides that"
    " reflect. Two points on the outer side of one convex shape never do, nor do two of a flat one."
    " No path that begins outside reaches the inside of a closed shape. Two points of"
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
    cost="samples, two rays per reflection",
    pruning=NO_SECOND_REFLECTION,
    part="transport",
    colour="#e69f00",
    differs=lambda facts, called_for: called_for and facts.pair.max_depth != 2,
    without=lambda plan: replace(plan, max_depth=2),
    step="light reflected more than once",
)
