"""Tasks for the process that reads and renders scenes, one function each."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from comparisons.audit.audit_record import Audit
    from comparisons.audit.checks import Kind
    from comparisons.cost.cost_record import Cost
    from comparisons.cost.front import Choice
    from comparisons.fit.fit import FitOptions
    from comparisons.fit.fit_record import FitRecord
    from comparisons.hard.hard_cases import HardCases
    from comparisons.options import Options
    from comparisons.verification import Verification
    from reports.terminal.tables import PlanReport


def timed(function: Callable[..., Any], *arguments: Any) -> tuple[Any, float]:
    """Return what a task returns, and the seconds that it took."""
    begin = perf_counter()
    return function(*arguments), perf_counter() - begin


def planned(name: str, request: Options) -> PlanReport:
    """Return the plan of a scene."""
    from comparisons.case import open_case
    from comparisons.prepared import prepare
    from reports.terminal import tables

    case = open_case(name, request)
    return tables.plan_report(case.name, prepare(case.source, case.options), case.variant)


def verified(
    name: str, request: Options, level: float | None, progress: Any = None
) -> Verification:
    """Compare the plan of a scene with everything simulated.

    ``level`` is the chance that a right plan is marked; None takes the default.
    """
    from comparisons.case import open_case
    from comparisons.verification import LEVEL, verify

    case = open_case(name, request)
    usual = LEVEL if level is None else level
    return verify(case.source, case.options, progress, usual)


def chosen(name: str, request: Options, within: float, metric: str, progress: Any) -> Choice:
    """Measure the ladder of a scene, and name the cheapest method within an error."""
    from comparisons.case import open_case
    from comparisons.cost.front import choose

    case = open_case(name, request)
    return choose(case.source, within, case.options, None, metric, progress)


def hard_cases() -> HardCases:
    """Evaluate the hard cases."""
    from comparisons.case import RGB
    from comparisons.hard.hard_cases import collect
    from heuristic import plugins
    from reference.scene.graph import set_variant

    set_variant(RGB)
    plugins.register()
    return collect()


def measured(
    name: str,
    request: Options,
    rounds: int | None,
    at: tuple[int, int] | None,
    is_measured: bool,
    place: Path,
    figures: Path | None,
    progress: Any,
) -> Cost:
    """Study what each step of accuracy costs, and write the study's files.

    ``at`` is a size to predict for, ``figures`` the folder for figures for print; None for none.
    """
    from comparisons.case import open_case
    from comparisons.cost.cost import cost
    from comparisons.cost.measure import Effort
    from reports.charts.figures import write_cost
    from reports.run import cost_files

    case = open_case(name, request)
    effort = Effort() if rounds is None else Effort(rounds=rounds)
    size = at and f"{at[0]}x{at[1]}"
    words = case.command("cost", rounds=rounds, at=size, measure=is_measured or None)
    study = cost(case.source, case.options, effort, progress, words, at, is_measured)
    cost_files.write(place, study)
    if figures is not None:
        write_cost(figures, place.name, study.record)
    return study.record


def exported(name: str, request: Options, place: Path) -> None:
    """Write the files that another program needs to render a scene."""
    from comparisons.case import open_case
    from comparisons.plain_scene import plain_scene
    from reports.files import export_files

    case = open_case(name, request)
    command = case.command(image="YOURS.exr")
    export_files.write(place, plain_scene(case.source, case.options), command)


def fitted(
    name: str,
    request: Options,
    chosen: FitOptions,
    words: dict[str, Any],
    place: Path,
    progress: Any,
) -> FitRecord:
    """Fit the heuristic to a scene, and write the fit's files.

    ``words`` are the named options of the command, for the record.
    """
    from comparisons.case import open_case
    from comparisons.fit.fit import fit
    from reports.run import fit_files

    case = open_case(name, request)
    result = fit(case.source, case.options, chosen, progress, case.command("fit", **words))
    fit_files.write(place, result)
    return result.record


def audited(kind: Kind, name: str, parameters: dict[str, Any], command: str, place: Path) -> Audit:
    """Audit a heuristic or a BSDF, and write the audit's files."""
    from comparisons.audit.checks import audit
    from comparisons.case import RGB
    from heuristic import plugins
    from reference.scene.graph import set_variant
    from reports.run import audit_files

    set_variant(RGB)
    plugins.register()
    record = audit(kind, name, parameters, command)
    audit_files.write(place, record)
    return record
