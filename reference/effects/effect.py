"""The declaration of an effect of light, and the decision of planning on it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from reference.planning.facts import Facts
from reference.planning.premises import Pruning
from reference.scene.graph import Graph

PARTS = ("interpolation", "spectral", "visibility", "light form", "BSDF form", "transport")
"""The parts of a departure that effects cause, in the order in which they are split off."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Effect:
    """An effect of light. Two are equal only if they are the same.

    Attributes
    ----------
    order
        Its position among all effects, ascending.
    label
        Its name in records and reports.
    noun
        What an image without it lacks; the label if omitted.
    heuristic, reference, cost
        Text: its form in each half, and its cost.
    rule
        ``rule(facts)`` returns whether the scene needs the effect, and the evidence.
    pruning
        In place of ``rule``: the rule of pruning that leaves the effect out. If it does not apply,
        the effect may be present, and is simulated.
    undecided
        Whether a yes of ``rule`` only means that the effect is not ruled out.
    part, colour
        One of :data:`PARTS`, and a CSS colour in charts; None for effects equal in both halves.
    sampled
        Whether its direct light needs random numbers.
    differs
        ``differs(facts, called_for)`` returns whether the two halves differ in it.
    graft
        ``graft(graph, facts)`` leaves the effect out of a copy of the physical half: the heuristic
        half's form takes its place. None if the scene stays the same.
    glow
        ``glow(phong, facts)`` returns the light of a heuristic material that a camera ray sees
        without the effect, as parameters of ``heuristic_glow``.
    without
        ``without(plan)`` returns a plan of ``direct_all`` that leaves the effect out. None if the
        integrator has no part in it.
    step
        Text: what it changes in an image; empty if studies have no step for it.
    """

    order: int
    label: str
    noun: str = ""
    heuristic: str
    reference: str
    cost: str
    rule: Callable[[Facts], tuple[bool, str]] | None = None
    pruning: Pruning | None = None
    undecided: bool = False
    part: str | None = None
    colour: str | None = None
    sampled: bool = False
    differs: Callable[[Facts, bool], bool] = lambda facts, called_for: False
    graft: Callable[[Graph, Facts], None] | None = None
    glow: Callable[[Any, Facts], dict] | None = None
    without: Callable[[Any], Any] | None = None
    step: str = ""

    def decide(self, facts: Facts) -> "Decision":
        """Apply the rule."""
        if self.pruning is not None:
            ruling = self.pruning.judge(facts)
            rule = "structural" if ruling.holds else "simulated"
            return Decision(self, not ruling.holds, rule, ruling.words)
        assert self.rule, "an effect has a rule or a way to be pruned"
        called_for, evidence = self.rule(facts)
        rule = "simulated" if called_for and self.undecided else "structural"
        return Decision(self, bool(called_for), rule, evidence)

    def __repr__(self):
        return f"<effect {self.label}>"

    def __reduce__(self):
        # A copy in another process must be the same effect, for sets and `is`.
        from reference.effects import labelled

        return labelled, (self.label,)


@dataclass(frozen=True)
class Decision:
    """Whether a scene needs an effect, and the rule and evidence that decided.

    ``rule`` is the kind of reason: ``structural`` if it follows from the scene's contents,
    ``simulated`` if a premise of leaving it out is not known to hold, ``asked`` if pruning is off,
    ``guard`` if a probe of the scene disagreed with the plan.
    """

    effect: Effect
    called_for: bool
    rule: str
    evidence: str
