"""One scene of a command: compared, its files written, or found finished."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

from reports.asked import jobs
from reports.run.stages import Done


@dataclass(frozen=True)
class Wanted:
    """What a command wants of each of its scenes.

    ``rendering`` holds the options of `jobs.rendering_options`; ``fresh`` renders what is
    finished, too.
    """

    rendering: Mapping[str, Any]
    figures: bool = False
    with_cost: bool = False
    fresh: bool = False


def load():
    """Load what renders.

    Raises
    ------
    InstallationError
        When LLVM cannot be used.
    """
    jobs.check_installation()
    import comparisons.compare  # noqa: F401  part of start-up


def compare(name: str, folder: Path, place: str, wanted: Wanted, progress) -> Done:
    """Compare a scene and write its files to ``folder/place``, unless they are there already.

    Parameters
    ----------
    name
        Of a built-in scene or a file.
    progress : callable
        ``progress(stage, done, total)``, called after each pass.
    """
    from comparisons.compare import compare
    from reference.scene.graph import set_variant
    from reports.charts import figures as prints
    from reports.run import finished, kept, output

    source, chosen = jobs.job(name, wanted.rendering)
    set_variant(chosen["variant"])
    options, done = jobs.options(chosen), Done()
    with done.timing("finished scenes"):
        passes = kept.of_scene(folder, place, source, options, chosen["variant"])
        key = finished.key_of(passes.key, options, wanted.with_cost, wanted.figures)
        found = None if wanted.fresh else finished.load(folder / place, key)
    if found is not None:
        done.view = found
        return done
    begin = perf_counter()
    result = compare(source, options, progress, jobs.command(source, chosen), passes)
    done.compared = perf_counter() - begin
    study = None
    if wanted.with_cost:
        with done.timing("cost"):
            study = _cost(source, chosen, options, progress, result.data)
    with done.timing("files"):
        if wanted.figures:  # first, since a scene with its folder is finished
            prints.write_scene(folder / output.FIGURES, place, result)
        done.view = output.write_scene(folder, place, result, study, key)
    passes.remove()
    return done


def _cost(source, chosen, options, progress, data):
    """Study what accuracy costs, and name the effects that dominate the comparison's regions."""
    from comparisons.cost.cost import quick
    from comparisons.effects.dominance import in_region

    study = quick(source, options, progress, jobs.command(source, chosen) + " --cost")
    for region in data["regions"]:
        effect = in_region(region, data["resolution"], study.effects)
        if effect is not None:
            region["effect"] = effect
    return study
