"""What is decided on effects and rules, and why, as records hold it."""

from fotismos.reference.records import Record


class Decision(Record):
    """Whether a scene needs an effect, and why.

    Attributes
    ----------
    rule
        The kind of reason, and the reason: ``structural`` follows from the scene's structure,
        ``simulated`` means that a premise of leaving it out is not known to hold, ``asked`` that
        pruning is off, ``guard`` that a probe disagreed with the plan.
    """

    name: str
    called_for: bool
    rule: str


class RuleResult(Record):
    """Whether a rule of pruning applies to a scene.

    Attributes
    ----------
    name
        What is done when it applies.
    applies
        Whether all its premises are known to hold.
    premise
        The first premise not known to hold; empty if it applies.
    evidence
        What is absent, or what contradicts the premise.
    """

    name: str
    applies: bool
    premise: str
    evidence: str
