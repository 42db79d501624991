"""Rules of pruning: the part left out, the proof that it is absent, and the proof's premises.

A rule is one :class:`Pruning`. Its premises are checked in order, and the first that is not known
to hold rejects it. A rule is only as good as its list of premises; the guard looks for missing ones
(:mod:`reference.rendering.guard`).
"""

from collections.abc import Callable
from dataclasses import dataclass

from reference.planning.facts import Facts


@dataclass(frozen=True)
class Premise:
    """An assumption of a proof.

    Attributes
    ----------
    sentence
        What must hold.
    against
        ``against(facts)`` returns an objection as text; None if it is known to hold.
    """

    sentence: str
    against: Callable[[Facts], str | None]


@dataclass(frozen=True)
class Pruning:
    """A rule of pruning.

    Attributes
    ----------
    name
        What is done if it applies.
    absent
        What is absent if it applies, as evidence.
    proof
        Why it is absent, given the premises.
    premises
        Premises, in the order of their checks.
    """

    name: str
    absent: str
    proof: str
    premises: tuple[Premise, ...]

    def judge(self, facts: Facts) -> "Ruling":
        """Check the premises, once for all callers: some compare every shape with every other."""
        if self not in facts.rulings:
            facts.rulings[self] = self._checked(facts)
        return facts.rulings[self]

    def _checked(self, facts: Facts) -> "Ruling":
        for premise in self.premises:
            if (evidence := premise.against(facts)) is not None:
                return Ruling(self, premise, evidence)
        return Ruling(self)


@dataclass(frozen=True)
class Ruling:
    """Whether a rule of pruning applies to a scene, and if not, which premise failed and why."""

    rule: Pruning
    failed: Premise | None = None
    evidence: str = ""

    @property
    def holds(self) -> bool:
        """Whether all premises hold."""
        return self.failed is None

    @property
    def words(self) -> str:
        """What is absent, or the objection to a premise."""
        return self.rule.absent if self.holds else self.evidence


def _clear(facts: Facts) -> str | None:
    found = (shape.name for shape in facts.structure.shapes if not shape.opaque)
    return next((f"{name}: its BSDF may let light through" for name in found), None)


OPAQUE = Premise(
    "Every BSDF is known only to reflect: a plain one, `principled` without `spec_trans`, or"
    " such inside of `twosided`; masks, blends, bumps, instances and plugins from outside are not"
    " known.",
    _clear,
)


def _media(facts: Facts) -> str | None:
    return next((f"{name}: a participating medium" for name, _ in facts.pair.media), None)


NO_MEDIUM = Premise("No participating medium is in the scene.", _media)


def _moving(facts: Facts) -> str | None:
    return None if facts.structure.camera.is_still else "the camera's shutter stays open"


STILL = Premise("The shutter opens for an instant, so nothing moves.", _moving)


def _seen_from_inside(facts: Facts) -> str | None:
    structure, camera = facts.structure, facts.structure.camera
    for shape in structure.shapes:
        if structure.may_be_seen_from_inside(shape):
            if camera.origins is None:
                return f"{shape.name}: where the rays of {camera.plugin} begin is not known"
            return f"{shape.name}: a camera ray may begin inside"
    return None


SEEN_FROM_OUTSIDE = Premise(
    "No camera ray begins inside a closed shape that reflects there, including near clip plane,"
    " lens and the width of an orthographic camera.",
    _seen_from_inside,
)


def _concave(facts: Facts) -> str | None:
    for shape in facts.structure.shapes:
        if shape.reflects and not shape.is_convex:
            return f"{shape.name}: not convex on a side that reflects, or with smoothed normals"
    return None


CONVEX = Premise(
    "Every side that reflects is flat, the outer side of a convex shape, or inside a closed one;"
    " normals are those of Mitsuba's renderings, including flips, and shading normals equal them.",
    _concave,
)
