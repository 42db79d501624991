"""The plan of a scene, as ``fotismos plan`` prints it."""

from __future__ import annotations

from collections.abc import Iterator

from msgspec.structs import asdict

from fotismos.comparisons.prepared import Prepared
from fotismos.reference.planning.decisions import Decision
from fotismos.reference.planning.effects import labelled
from fotismos.reference.planning.plan_record import Plan
from fotismos.reference.records import VERSION, Amount, Record
from fotismos.reports.terminal.table import Column, Table, printed
from fotismos.reports.terminal.words import yes_or_no

EFFECTS = (
    Column("effect", "name"),
    Column("present", "called_for", yes_or_no),
    Column("rule", "rule"),
    Column("evidence", "evidence"),
    Column("cost", "cost"),
)
RULES = (
    Column("pruning rule", "name"),
    Column("applies", "applies", yes_or_no),
    Column("premise that may fail", "premise"),
    Column("evidence", "evidence"),
)
"""The tables of a plan."""


class PlannedEffect(Record):
    """Whether a scene has an effect, why, and what simulates it on either side."""

    name: str
    called_for: bool
    rule: str
    evidence: str
    heuristic: str
    reference: str
    cost: str


class PlanReport(Plan):
    """The output of ``fotismos plan --json``."""

    scene: str
    variant: str
    shading: str
    effects: tuple[PlannedEffect, ...]  # type: ignore[assignment]
    planning_s: Amount
    left_out: tuple[str, ...]
    record_version: int = VERSION


def plan_report(scene: str, ready: Prepared, variant: str) -> PlanReport:
    """Return the plan of a prepared comparison."""
    plan = ready.plan_record(ready.passes)
    return PlanReport(
        scene=scene,
        variant=variant,
        shading=ready.pair.shading,
        planning_s=ready.seconds["planning"],
        left_out=ready.plan.omissions(),
        **asdict(plan) | {"effects": tuple(map(_planned, plan.effects))},
    )


def _planned(decision: Decision) -> PlannedEffect:
    effect = labelled(decision.name)
    rule, _, evidence = decision.rule.partition(": ")
    return PlannedEffect(
        name=effect.label,
        called_for=decision.called_for,
        rule=rule,
        evidence=evidence,
        heuristic=effect.heuristic,
        reference=effect.reference,
        cost=effect.cost,
    )


def plan_lines(plan: PlanReport) -> Iterator[str]:
    """Yield the lines of a plan: the table of effects, then the simulation."""
    yield from printed(Table(EFFECTS, plan.effects))
    yield ""
    if plan.rules:
        yield from printed(Table(RULES, plan.rules))
        yield ""
    depth = "no limit" if plan.max_depth < 0 else plan.max_depth
    reads = ", ".join(plan.heuristic_reads) or "nothing"
    yield f"textbook      {plan.shading}, which reads {reads}"
    yield f"kernel terms  {', '.join(plan.kernel_terms) or 'none'}"
    yield f"variant       {plan.variant}"
    yield f"integrator    {plan.simulation}"
    yield f"depth         {depth}"
    yield f"left out      {', '.join(plan.left_out) or 'nothing'}"
    yield f"samples       {plan.spp} per pixel in {plan.passes} passes, {plan.sampler}"
    yield f"planning      {plan.planning_s * 1e3:.0f} ms"
