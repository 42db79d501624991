"""Rules of pruning: the part left out, the proof that it is absent, and the proof's premises.

A rule is one :class:`PruningRule`. Its premises are checked in order, and the first that is not
known to hold rejects it. A rule is only as good as its list of premises; the guard looks for
missing ones (:mod:`fotismos.reference.planning.guard`).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from fotismos.reference.pairing import kinds
from fotismos.reference.planning.decisions import RuleResult
from fotismos.reference.planning.facts import (
    BSDF,
    ROUNDING,
    SHAPE,
    Facts,
    LightFacts,
    ShapeFacts,
)

FAR = 1e6
"""Start of the shadow of a directional light, in multiples of the scene's size."""

MOST_SHAPES = 500
"""Each shape is compared with each other one, for each light."""

MOST_LIGHTS = 4096
"""With more, evaluating each at every sample costs more than the noise of picking one."""


@dataclass(frozen=True)
class Premise:
    """An assumption of a proof; ``against(facts)`` returns an objection if it may not hold."""

    sentence: str
    against: Callable[[Facts], str | None]


@dataclass(frozen=True)
class PruningRule:
    """A rule of pruning: what it leaves out if it applies, and why that changes nothing.

    ``omits`` is what is not simulated, as a noun, and ``absent`` the reason, as a clause.
    """

    name: str
    omits: str
    absent: str
    proof: str
    premises: tuple[Premise, ...]

    def check(self, facts: Facts) -> RuleResult:
        """Check the premises, once for all callers: some compare every shape with every other."""
        if self.name not in facts.rule_results:
            objections = ((p.sentence, p.against(facts)) for p in self.premises)
            premise, fault = next((pair for pair in objections if pair[1] is not None), ("", None))
            evidence = self.absent if fault is None else fault
            facts.rule_results[self.name] = RuleResult(
                name=self.name, applies=fault is None, premise=premise, evidence=evidence
            )
        result: RuleResult = facts.rule_results[self.name]
        return result

    def objection(self, facts: Facts) -> str | None:
        """Return why the rule does not apply; None if it does."""
        result = self.check(facts)
        return None if result.applies else result.evidence


# --- Premises of several rules ---------------------------------------------------------------


def _clear(facts: Facts) -> str | None:
    names = (shape.name for shape in facts.shapes if not shape.opaque)
    return next((f"{name}: its BSDF may let light through" for name in names), None)


def _seen_from_inside(facts: Facts) -> str | None:
    for shape in filter(facts.may_be_seen_from_inside, facts.shapes):
        if facts.camera.origins is None:
            return f"{shape.name}: where the rays of {facts.camera.plugin} begin is not known"
        return f"{shape.name}: a camera ray may begin inside"
    return None


def _concave(facts: Facts) -> str | None:
    for shape in facts.shapes:
        if shape.reflects and not shape.is_convex:
            return f"{shape.name}: not convex on a side that reflects, or with smoothed normals"
    return None


OPAQUE = Premise(
    "Every BSDF is known only to reflect: a plain one, `principled` without `spec_trans`, or"
    " such inside of `twosided`; masks, blends, bumps, instances and plugins from outside are not"
    " known.",
    _clear,
)
NO_MEDIUM = Premise(
    "No participating medium is in the scene.",
    lambda facts: next((f"{name}: a participating medium" for name, _ in facts.pair.media), None),
)
FEW = Premise(
    f"The scene has at most {MOST_SHAPES} shapes: comparing more takes longer than it saves.",
    lambda facts: f"{len(facts.shapes):,} shapes" if len(facts.shapes) > MOST_SHAPES else None,
)
STILL = Premise(
    "The shutter opens for an instant, so nothing moves.",
    lambda facts: None if facts.camera.is_still else "the camera's shutter stays open",
)
CONVEX = Premise(
    "Every side that reflects is flat, the outer side of a convex shape, or inside a closed one;"
    " normals are those of Mitsuba's renderings, including flips, and shading normals equal them.",
    _concave,
)
SEEN_FROM_OUTSIDE = Premise(
    "No camera ray begins inside a closed shape that reflects there, including near clip plane,"
    " lens and the width of an orthographic camera.",
    _seen_from_inside,
)
KNOWN_SURFACES = (NO_MEDIUM, OPAQUE, FEW, STILL, CONVEX, SEEN_FROM_OUTSIDE)
"""Light hits only the outer sides of convex shapes."""


# --- Cases in which Mitsuba's integrators agree ----------------------------------------------


def _shallow(facts: Facts) -> str | None:
    depth = facts.pair.max_depth
    return f"the scene's depth is {depth}" if 0 <= depth < 2 else None


def _sampled_elsewhere(facts: Facts) -> str | None:
    for light in facts.lights:
        shape = facts.by_name.get(light.shape)
        if light.shape is not None and (shape is None or not shape.sampled_as_hit):
            return f"{light.shape}: samples of it may not be what rays hit"
    return None


def _seen_inside_a_lamp(facts: Facts) -> str | None:
    for shape in facts.lamps:
        if shape and facts.may_be_seen_from_inside(shape):
            return f"{shape.name}: shines, and may be seen from inside"
    return None


SAMPLED_AS_HIT = Premise(
    "Every lamp's shape is a mesh, a rectangle or a disk whose shading normals are those of its"
    " surface, a sphere, or a cylinder that is round and not mirrored: on other shapes, Mitsuba"
    " samples points that rays do not hit.",
    _sampled_elsewhere,
)

LIGHT_BY_LIGHT = PruningRule(
    name="light by light",
    omits="the random choice of one light",
    absent="all lights are summed: the sum is the mean of one light divided by its probability",
    proof="The mean is the sum over all lights, which `direct_all` takes at each sample, if each"
    " estimate of a light has the right mean, however samples of the BSDF are weighted against it.",
    premises=(
        SAMPLED_AS_HIT,
        NO_MEDIUM,
        OPAQUE,
        Premise("The scene's paths have a depth of 2 or more.", _shallow),
        Premise(
            f"The scene has at most {MOST_LIGHTS:,} lights: with more, evaluating each costs more"
            " than the noise of picking one.",
            lambda facts: (
                f"{len(facts.lights):,} lights" if len(facts.lights) > MOST_LIGHTS else None
            ),
        ),
        Premise(
            "No closed shape that shines and reflects inside is seen from inside: Mitsuba's"
            " sampling of a sphere finds light there that a sample of the BSDF does not.",
            _seen_inside_a_lamp,
        ),
    ),
)


# --- Shadows ---------------------------------------------------------------------------------


class Boxes:
    """The bounding boxes of N shapes, from ``low`` to ``high`` (N, 3).

    ``is_before`` (N, N) is whether box j reaches in front of the only reflecting side of shape i,
    by more than rounding; always if shape i may receive light from anywhere.
    """

    def __init__(self, shapes: Sequence[ShapeFacts]) -> None:
        # The box of a mesh without faces is empty, from inf to -inf.
        self.shapes = [shape for shape in shapes if np.all(shape.low <= shape.high)]
        self.low = np.array([shape.low for shape in self.shapes]).reshape(-1, 3)
        self.high = np.array([shape.high for shape in self.shapes]).reshape(-1, 3)
        facing = [shape.facing for shape in self.shapes]
        # Receivers in rows, (N, 1, 3); boxes (N, 3) in columns.
        direction = np.array([d for d, _ in facing]).reshape(-1, 1, 3)
        offset = np.array([o for _, o in facing]).reshape(-1, 1)
        margin = ROUNDING * np.maximum((self.high - self.low).max(axis=1, initial=0), 1e-30)
        # The corner of each box that lies farthest in the receiver's direction.
        reach = np.maximum(self.low * direction, self.high * direction).sum(axis=2)
        self.is_before = reach - offset > margin
        np.fill_diagonal(self.is_before, False)

    def hidden_from(self, light: LightFacts) -> tuple[str, str] | None:
        """Return an obstacle that may stand between a light and a receiver, and that receiver.

        The ways of parallel light lie in a box around the receiver and its box moved far away.
        """
        # For each receiver a box around all ways of light to it.
        low = self.low
        high = self.high
        shining = np.array([shape.name == light.shape for shape in self.shapes], bool)
        if light.position is not None:
            low = np.minimum(low, light.position)
            high = np.maximum(high, light.position)
        elif light.toward is not None:
            size = max(np.abs([low, high]).max(initial=1.0), 1.0)
            move = FAR * size * light.toward / np.linalg.norm(light.toward)
            low = low + np.minimum(move, 0)
            high = high + np.maximum(move, 0)
        elif shining.any():
            low = np.minimum(low, self.low[shining][0])
            high = np.maximum(high, self.high[shining][0])
        else:  # an environment shines from everywhere that the receiver faces
            low = np.full_like(low, -np.inf)
            high = np.full_like(high, np.inf)
        # Boxes touch if they overlap along every axis.
        hides = self.is_before & np.all(
            (low[:, None] <= self.high) & (self.low <= high[:, None]), axis=2
        )
        # Whether a lamp hides itself is asked elsewhere; what reflects nothing needs no light.
        hides &= ~shining & np.array([[shape.reflects] for shape in self.shapes], bool)
        if not hides.any():
            return None
        receiver, obstacle = np.argwhere(hides)[0]
        return self.shapes[obstacle].name, self.shapes[receiver].name


def occluder(facts: Facts) -> str | None:
    """Name an obstacle that may hide a light from a surface that reflects."""
    boxes = Boxes(facts.shapes)
    for light in facts.lights:
        shape = facts.by_name.get(light.shape)
        if light.shape is not None and (shape is None or shape.hides_itself):
            return f"{light.shape}: may hide its own light"
        if pair := boxes.hidden_from(light):
            obstacle, receiver = pair
            return f"{obstacle} may stand between {light.name} and {receiver}"
    return None


NO_SHADOWS = PruningRule(
    name="no shadow rays",
    omits="shadow rays",
    absent="no shape can stand between a light and a reflecting surface",
    proof="Light from a point y reaches a surface point x along a segment in the box around y and"
    " the shape of x. A shape whose box does not touch that one does not touch the segment. The"
    " shape of x itself hides nothing: x is seen from outside, and a segment that passes through"
    " the shape arrives from behind, where an opaque BSDF returns nothing. A light that is flat, or"
    " convex and shines outwards, does not hide the side that shines.",
    premises=(
        *KNOWN_SURFACES,
        Premise(
            "No shape's box touches the box around a light and a shape that reflects, unless it"
            " lies behind that one's only reflecting side; no light hides itself.",
            occluder,
        ),
    ),
)


# --- Interreflection -------------------------------------------------------------------------


def facing_pair(facts: Facts) -> str | None:
    """Name two shapes that may send each other light."""
    boxes = Boxes([shape for shape in facts.shapes if shape.reflects])
    for first, second in np.argwhere(boxes.is_before & boxes.is_before.T)[:1]:
        return f"{boxes.shapes[first].name} and {boxes.shapes[second].name} may see each other"
    return None


NO_SECOND_REFLECTION = PruningRule(
    name="direct light alone",
    omits="interreflection",
    absent="no point of a reflecting surface sees another one",
    proof="A second reflection needs two points that see each other, both on sides that reflect."
    " Two points on the outer side of one convex shape never do, nor do two of a flat one. No path"
    " that begins outside reaches the inside of a closed shape. Two points of different shapes do"
    " not where one shape is flat, reflects on one side, and the other lies behind it.",
    premises=(
        *KNOWN_SURFACES,
        Premise(
            "No two shapes that reflect lie before each other's reflecting sides.", facing_pair
        ),
    ),
)


# --- Environment from a table ----------------------------------------------------------------


def _not_one(facts: Facts) -> str | None:
    graph = facts.pair.physical
    shapes = len(graph.nodes(SHAPE))
    bsdfs = len(graph.nodes(BSDF))
    wrapped = [index for index in graph.nodes(BSDF) if graph.plugin(index) == "twosided"]
    if shapes != 1:
        return f"{shapes} shapes"
    return "two sides that reflect differently" if bsdfs - len(wrapped) != 1 else None


def _not_uniform(facts: Facts) -> str | None:
    present = [kinds.of(light.kind) for light in facts.lights]
    extended = [kind for kind in present if not kind.exact]
    if len(extended) == 1 and extended[0].uniform:
        return None
    return f"{facts.light_kinds}: not one constant environment plus points and directions"


ISOTROPIC = ("diffuse", "plastic", "roughplastic", "conductor", "roughconductor", "twosided")


def _uneven(facts: Facts) -> str | None:
    graph = facts.pair.physical
    for index in graph.nodes(mi.ObjectType.Texture):
        return f"texture: {graph.plugin(index)}"
    for index in graph.nodes(BSDF):
        props = graph.props(index)
        if graph.plugin(index) not in ISOTROPIC or "alpha_u" in props or "alpha_v" in props:
            return f"{graph.label(index)}: {graph.plugin(index)} may differ with the azimuth"
    return None


TABULATED_ENVIRONMENT = PruningRule(
    name="environment from a table",
    omits="the sampled environment",
    absent="what is reflected is the environment's radiance times an albedo",
    proof="If nothing is hidden, a surface point reflects the radiance L times the albedo of its"
    " BSDF for the view direction. For an isotropic BSDF that is the same everywhere this depends"
    " only on the cosine; for a two-sided one, on its absolute value.",
    premises=(
        Premise("There is one shape, and one BSDF, the same on both sides that reflect.", _not_one),
        Premise(
            "One light is a constant environment; the others are points, spots and directions.",
            _not_uniform,
        ),
        Premise("Nothing is textured, and the BSDF is known to be isotropic.", _uneven),
        Premise(
            "The variant is RGB.", lambda facts: None if mi.is_rgb else f"variant {mi.variant()}"
        ),
        Premise(
            "No light can be hidden, by the premises of leaving out shadow rays.",
            NO_SHADOWS.objection,
        ),
        Premise(
            "Light is reflected once, by the premises of direct light alone or by the scene's own"
            " depth.",
            lambda facts: (
                None if facts.pair.max_depth == 2 else NO_SECOND_REFLECTION.objection(facts)
            ),
        ),
    ),
)

RULES = (LIGHT_BY_LIGHT, NO_SHADOWS, NO_SECOND_REFLECTION, TABULATED_ENVIRONMENT)
