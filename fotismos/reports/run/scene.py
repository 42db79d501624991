"""One scene of a command: compared and written, or found finished."""

import hashlib
import json
from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter
from typing import TYPE_CHECKING, Any

from fotismos.comparisons.case import Case, open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import METRICS
from fotismos.comparisons.names import file_of, name_of, picture_parts
from fotismos.comparisons.records.comparison import CAUSES, ComparisonRecord
from fotismos.comparisons.records.images import Comparison
from fotismos.comparisons.steps import steps
from fotismos.heuristic import program
from fotismos.heuristic.heuristics import named
from fotismos.heuristic.program import versions
from fotismos.reference.records import VERSION, plain
from fotismos.reference.scene.source import digest
from fotismos.reports import verdict
from fotismos.reports.files import results
from fotismos.reports.jobs import Job
from fotismos.reports.page.scene_view import SceneView
from fotismos.reports.run import scene_files
from fotismos.reports.run.batch import Subjects

if TYPE_CHECKING:  # only a report has hard cases
    from fotismos.comparisons.hard_cases import HardCases

Seconds = dict[str, float]
"""Wall time by stage of a run."""


def subjects(scenes: Sequence[str]) -> Subjects:
    """Return what a command compares: scenes, as the user named them."""
    files = tuple((name_of(word), file_of(word)) for word in scenes)
    return Subjects(words=tuple(scenes), files=files, compare=compared)


def compared(
    name: str, folder: Path, target: str, job: Job, progress: Any
) -> tuple[SceneView, Seconds]:
    """Compare a scene and write its files to ``folder/target``, unless it is finished there."""
    begin = perf_counter()
    # A finished scene is recognised by its key.
    case = open_case(name, job.options)
    key = key_of(case, job)
    view = None if job.fresh else scene_files.load(folder / target, key)
    if view is not None:
        return view, {"finished scenes": perf_counter() - begin}

    # Rendering, metrics and causes, again with more samples if that may decide.
    spent: defaultdict[str, float] = defaultdict(float)
    source = case.source
    first: list[SceneView] = []

    def show(comparison: Comparison) -> None:
        """Send what a page shows first."""
        first.append(scene_files.view_of(comparison))
        progress(first[-1])

    most = (case.options.spp or 0) * job.patience
    while True:
        begin = perf_counter()
        options = case.options
        comparison = compare(
            source,
            options,
            progress,
            command=case.command(),
            then=steps(why=job.with_causes),
            shown=show,
        )
        record = comparison.record
        for stage, seconds in _stages(record, perf_counter() - begin).items():
            spent[stage] += seconds
        is_open = verdict.decision(record, job.within) == "undecided" and not record.caution
        if not is_open or (options.spp or 0) >= most:
            break
        case = case.changed(spp=most)
    # The costs of methods, for a few scenes.
    costs = None
    causes = comparison.causes
    if case.word in job.ladders and causes:
        from fotismos.comparisons.ladder.cost import quick  # loaded late: for a handful of scenes

        begin = perf_counter()
        command = case.command("cost")
        costs = quick(
            source,
            options,
            causes=causes,
            progress=progress,
            command=command,
        )
        spent["methods"] = perf_counter() - begin
    begin = perf_counter()
    view = scene_files.write(
        folder,
        target,
        comparison,
        costs=costs,
        key=key,
        first=first[-1],
        with_figures=job.figures,
    )
    return view, spent | {"files": perf_counter() - begin}


def _stages(record: ComparisonRecord, seconds: float) -> Seconds:
    """Split the seconds of a comparison by its record of time."""
    stages = record.time.stages
    rendering = record.time.heuristic.total_s + record.time.reference.total_s
    spent = {
        "scenes and plans": stages["scene and pairing"] + stages["planning"] + stages["guard"],
        "rendering": rendering + stages.get("preparation", 0.0) + stages["sums of passes"],
        "times and samples": stages.get("price", 0.0),
        "terms": stages.get("terms", 0.0),
        CAUSES: stages.get(CAUSES, 0.0),
    }
    return spent | {"metrics": seconds - sum(spent.values())}


def hard_cases() -> "tuple[HardCases, float]":
    """Evaluate the hard cases; return them, and the seconds that it took."""
    from fotismos.comparisons.hard_cases import collect  # loaded late: only for a report

    begin = perf_counter()
    return collect(), perf_counter() - begin


# --- Finished scenes -------------------------------------------------------------------------


def key_of(case: Case, job: Job) -> str | None:
    """Return a digest of all that a result depends on; None for a scene or shader in Python.

    That is the scene with each file that it reads, the code of the heuristic or the pictures in its
    place, options, versions, and the sources of fotismos where it runs from a checkout. What a
    script reads is not known.
    """
    code = named(case.options.heuristic).digest()
    if Path(case.word).suffix == ".py" or code is None:
        return None
    files = [picture_parts(word)[0] for word in case.options.picture_files]
    parts: dict[str, Any] = {
        "record": VERSION,
        "metrics": list(METRICS),
        "why, figures, ladder": (job.with_causes, job.figures, case.word in job.ladders),
        "options": plain(case.options),
        "variant": case.variant,
        "versions": versions(),
        "sources": program.source_digest(),
        "heuristic": code,
        "pictures": [results.digest_of(path) for path in files if path.is_file()],
        "scene": digest(case.source),
    }
    return hashlib.sha256(json.dumps(parts, sort_keys=True).encode()).hexdigest()
