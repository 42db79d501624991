"""What a person sees while a command runs and when it has ended."""

from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn


class Bar:
    """A progress bar on standard error, one task a scene; silent where no person is watching."""

    def __init__(self, progress):
        self._progress = progress

    def of(self, scene):
        """Return the callback ``(stage, done, total)`` for one scene."""
        task = self._progress.add_task(scene, total=None)

        def update(stage, done, total):
            self._progress.update(task, completed=done, total=total)

        return update


@contextmanager
def shown(unit="passes"):
    """Show progress on standard error while the block runs, if that is a terminal."""
    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TextColumn(unit),
        TimeRemainingColumn(),
    )
    with Progress(
        *columns, console=console, transient=True, disable=not console.is_terminal
    ) as progress:
        yield Bar(progress)


def summary(records):
    """Yield a line for each scene: departure, noise, shape, and times."""
    records = list(records)
    width = max(5, *(len(record["scene"]) for record in records))
    yield (
        f"{'scene':<{width}}  {'mean ΔE2000':>11}  {'noise':>6}  {'shape':>6}  {'significant':>11}"
        f"  {'heuristic':>9}  {'reference':>9}"
    )
    for record in records:
        metric, time = record["metrics"]["dE2000"], record["time"]
        yield (
            f"{record['scene']:<{width}}  {metric['mean']:>11.3f}  {metric['noise_floor']:>6.3f}"
            f"  {metric['after_exposure']['mean']:>6.3f}"
            f"  {record['metrics']['significant']['fraction']:>11.1%}"
            f"  {time['heuristic']['total_s']:>7.2f} s  {time['reference']['total_s']:>7.2f} s"
        )
    for record in records:
        if "noise_target" in record:
            yield _noise(record)


def _noise(record):
    """Say what a noise target came to, and what stopped the run."""
    stop, plan = record["noise_target"], record["plan"]
    asked = f"target {stop['target']:g}"
    if stop["stopped_by"] == "samples":
        asked += f" not reached: stopped by the limit of {stop['limit_spp']} samples a pixel"
    return (
        f"{record['scene']}: 95 % of pixels have noise under ΔE2000 = {stop['reached']:.3g}"
        f" after {plan['spp']} samples a pixel ({asked})"
    )
