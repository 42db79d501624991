"""One scene of a command: compared and written, or found finished."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING

from msgspec import structs

if TYPE_CHECKING:
    from comparisons.case import Case, Request
    from comparisons.compare import Progress
    from comparisons.cost.cost import Study
    from comparisons.record import Comparison
    from reports.page.scene_view import SceneView
    from reports.run.kept import KeptPasses
    from reports.run.stages import Stages

SKETCH_WIDTH, SKETCH_SPP = 64, 8
"""Pixels and samples per pixel of a scene's coarse first pictures."""


@dataclass(frozen=True)
class Wanted:
    """The work that a command requests for each of its scenes.

    ``request`` says how; ``sketched`` begins with all scenes at a small size; ``fresh`` renders
    finished scenes again; ``with_scripts`` runs scripts found in folders; ``coarse`` prices effects
    with less effort.
    """

    request: Request
    figures: bool = False
    sketched: bool = False
    with_cost: bool = False
    fresh: bool = False
    with_scripts: bool = False
    coarse: bool = False


def compare(
    name: str, folder: Path, place: str, wanted: Wanted, progress: Progress
) -> tuple[SceneView, Stages]:
    """Compare a scene and write its files to ``folder/place``, unless they exist already.

    Parameters
    ----------
    name
        A built-in scene or a file.
    progress
        Called as ``progress(stage, done, total)`` after each pass.

    Returns
    -------
        The scene's part of the page, and where the time went.
    """
    from comparisons.case import open_case
    from comparisons.compare import compare
    from reports.run import output
    from reports.run.stages import Stages

    spent = Stages()
    case = open_case(name, wanted.request)
    with spent.timing("finished scenes"):
        passes, key, found = _finished(case, folder, place, wanted)
    if found is not None:
        return found, spent
    begin = perf_counter()
    result = compare(case.source, case.options, progress, case.command(), passes)
    spent.compared(result.record.time, perf_counter() - begin)
    study = None
    if wanted.with_cost:
        with spent.timing("cost"):
            result, study = _explained(case, progress, result, wanted.coarse)
    with spent.timing("files"):
        if wanted.figures:  # first, since the folder marks the scene as finished
            from reports.charts import figures

            figures.write_scene(folder / output.FIGURES, place, result)
        view = output.write_scene(folder, place, result, study, key)
    passes.remove()
    return view, spent


def sketch(name: str, folder: Path, place: str, wanted: Wanted, progress: Progress) -> SceneView:
    """Return the view of a finished scene, or a coarse one without causes and files."""
    from comparisons.case import open_case
    from comparisons.compare import compare
    from comparisons.cost.effort import reduced
    from reports.run import output

    case = open_case(name, wanted.request)
    *_, found = _finished(case, folder, place, wanted)
    if found is not None:
        return found
    size = reduced(case.source, case.options, SKETCH_WIDTH)
    small = replace(case.options, resolution=size, spp=SKETCH_SPP, noise=None)
    made = compare(case.source, small, progress, case.command(), with_terms=False)
    return structs.replace(output.view_of(made), is_coarse=True)


def _finished(
    case: Case, folder: Path, place: str, wanted: Wanted
) -> tuple[KeptPasses, str, SceneView | None]:
    """Return a scene's kept passes, the key of its result, and the result if finished."""
    from reports.run import finished, kept

    passes = kept.of_scene(folder, place, case)
    base = passes.key + " coarse" * wanted.coarse
    key = finished.key_of(base, case.options, wanted.with_cost, wanted.figures)
    return passes, key, None if wanted.fresh else finished.load(folder / place, key)


def _explained(
    case: Case, progress: Progress, comparison: Comparison, coarse: bool
) -> tuple[Comparison, Study | None]:
    """Return a comparison with its causes, and its study of cost if there is one."""
    from heuristic.errors import FotismosError

    try:
        return _priced(case, progress, comparison, coarse)
    except FotismosError as error:
        warnings = (*comparison.record.warnings, f"The causes are unknown: {error}")
        record = structs.replace(comparison.record, warnings=warnings)
        return replace(comparison, record=record), None


def _priced(
    case: Case, progress: Progress, comparison: Comparison, coarse: bool
) -> tuple[Comparison, Study | None]:
    """Study what accuracy costs, name the dominating effects, and record the time.

    A picture cannot be studied; it names the renderings that it is nearest to.
    """
    from comparisons.comparison import CAUSES
    from comparisons.cost.cost import quick
    from comparisons.cost.effort import COARSE, QUICK
    from comparisons.effects.naming import named
    from comparisons.pictures import likeness

    begin = perf_counter()
    study = None
    if case.options.image:
        record = likeness.named(comparison, case.source, case.options, progress)
    else:
        effort = COARSE if coarse else QUICK
        study = quick(case.source, case.options, progress, case.command() + " --why", effort)
        record = named(comparison, study.effects)
    stages = record.time.stages | {CAUSES: perf_counter() - begin}
    time = structs.replace(record.time, stages=stages)
    return replace(comparison, record=structs.replace(record, time=time)), study
