"""What an effect of light is declared with, and what planning decides on it."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from reference.planning.facts import Facts
from reference.planning.premises import Pruning
from reference.scene.graph import Graph

PARTS = ("interpolation", "spectral", "visibility", "light form", "BSDF form", "transport")
"""The parts of a departure that effects make, in the order in which they are split off."""


@dataclass(frozen=True, eq=False, repr=False, kw_only=True)
class Effect:
    """An effect of light. Two are equal only if they are the same.

    Attributes
    ----------
    order
        Where it stands among all effects, ascending.
    label
        Its name in records and reports.
    heuristic, reference, cost
        In words: what it is in either half, and what it costs.
    rule
        ``rule(facts)`` returns whether the effect is called for, and the evidence.
    pruning
        In the place of ``rule``: the rule of pruning by which the effect is left out. Where it does
        not apply, the effect may be there, and is simulated.
    undecided
        Whether a yes of ``rule`` only means that nothing is known against the effect.
    part, colour
        One of :data:`PARTS`, and a CSS colour in charts; None for what both halves have alike.
    sampled
        Whether its direct light takes random numbers.
    differs
        ``differs(facts, called_for)`` tells whether the two halves as such differ in it.
    graft
        ``graft(graph, facts)`` edits a copy of the physical half where the effect is left out: the
        heuristic half's form takes the place. None where the scene is the same.
    glow
        ``glow(phong, facts)`` returns what a camera ray meets on a heuristic material where the
        effect is left out, as parameters of ``heuristic_glow``.
    without
        ``without(plan)`` returns a plan of ``direct_all`` that leaves the effect out. None where
        the integrator has no part in it.
    step
        What it changes in an image, in words; empty where a study takes no step for it.
    """

    order: int
    label: str
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
        # A copy in another process is the same effect, as sets and `is` need it.
        from reference.effects import labelled

        return labelled, (self.label,)


@dataclass(frozen=True)
class Decision:
    """Whether an effect is called for, and the rule and evidence that decided.

    ``rule`` says of what kind the reason is: ``structural`` where it follows from what the scene is
    made of, ``simulated`` where a premise of leaving it out is not known to hold, ``asked`` where
    pruning is switched off, ``guard`` where a probe of the scene disagreed with the plan.
    """

    effect: Effect
    called_for: bool
    rule: str
    evidence: str
