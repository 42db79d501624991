"""Progress bars while a command runs, and a run's results in lines."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import partial

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    Task,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from comparisons.comparison import ComparisonRecord, NoiseTarget, PictureRecord
from comparisons.departure.metrics import LEADING
from heuristic.heuristics import PHONG
from reports.terminal import nearest_lines, verbosity
from reports.terminal.printing import seconds
from reports.terminal.tables import printed

SPEED_OVER_S = 600.0
"""Seconds over which the speed is averaged to estimate the time left: scenes differ."""


class Bar:
    """Progress bars on standard error, one per scene; silent where no person is watching.

    Parameters
    ----------
    progress
        Shows the bars.
    unit
        What a scene's bar counts.
    total
        Of the whole run's bar, in the weights given to :meth:`begin`; if omitted, it has none.
    """

    def __init__(
        self, progress: Progress, unit: str = "passes", total: float | None = None
    ) -> None:
        self._progress, self._unit, self._whole = progress, unit, None
        if total:
            self._whole = progress.add_task("", total=total, unit="", is_whole=True)
        self._stage, self._done, self._count, self._weight = "", 0, 0, 0.0

    def of(self, scene: str) -> Callable[[str, int, int], None]:
        """Return the callback ``(stage, done, total)`` for one scene."""
        task = self._progress.add_task(scene, total=None, unit=self._unit, is_whole=False)
        return partial(self._update, task)

    def begin(self, stage: str, count: int, weight: float, skipped: int = 0) -> None:
        """Begin a stage of the run: ``count`` tasks of a weight each; ``skipped`` are not done."""
        self._stage, self._done, self._count, self._weight = stage, 0, count, weight
        if self._whole is not None:
            total = (self._progress.tasks[0].total or 0.0) - skipped * weight
            self._progress.update(self._whole, total=total, description=self._words())

    def over(self, update: Callable[..., None] | None, weight: float | None = None) -> None:
        """End the task with this callback: remove its bar, and advance the run's.

        A task with its own weight is not one of the stage's.
        """
        if isinstance(update, partial):
            self._progress.remove_task(update.args[0])
        self._done += weight is None
        if self._whole is not None:
            advance = self._weight if weight is None else weight
            self._progress.update(self._whole, advance=advance, description=self._words())

    def _words(self) -> str:
        return f"{self._stage}, {self._done} of {self._count}"

    def _update(self, task: TaskID, stage: str, done: int, total: int) -> None:
        self._progress.update(task, completed=done, total=total)


class _Count(MofNCompleteColumn):
    """The part of a task that is done; of the whole run, in percent."""

    def render(self, task: Task) -> Text:
        return Text(f"{task.percentage:.0f} %") if task.fields["is_whole"] else super().render(task)


@contextmanager
def shown(unit: str = "passes", total: float | None = None) -> Iterator[Bar]:
    """Show progress on standard error during the block, if that is a terminal; see :class:`Bar`."""
    console = Console(stderr=True)
    with Progress(
        TextColumn("{task.description}", markup=False),  # a name may hold brackets
        BarColumn(),
        _Count(),
        TextColumn("{task.fields[unit]}"),
        TimeRemainingColumn(),
        console=console,
        transient=True,
        speed_estimate_period=SPEED_OVER_S,
        disable=not console.is_terminal or verbosity.level() < 0,
    ) as progress:
        yield Bar(progress, unit, total)


def summary(records: Iterable[ComparisonRecord]) -> Iterator[str]:
    """Yield a line for each scene: departure, noise, shape, and times."""
    records = list(records)
    for record in records:
        if record.picture:
            yield from _picture(record, record.picture)
    yield from printed(_table(records), right=1)
    for record in records:
        yield from nearest_lines.lines(record)
        if record.heuristic != PHONG.name and not record.picture:
            yield f"{record.scene}: heuristic {record.heuristic}"
            yield from record.suspicions
        if record.noise_target:
            yield _noise(record, record.noise_target)
        guard = record.plan.guard
        if guard and guard.state == "disagreed":
            yield (
                f"{record.scene}: a probe disagreed with the plan by {guard.departure:+.1%} of the"
                " light, so everything was simulated. Please report this scene."
            )


def _picture(record: ComparisonRecord, picture: PictureRecord) -> Iterator[str]:
    """Yield a picture's shift, and what is odd about it: all numbers depend on that."""
    shift, ratio = picture.shift, ", ".join(f"{value:.3g}" for value in picture.ratio)
    place = "not known" if shift is None else f"{shift[0]:+.2f}, {shift[1]:+.2f} pixels"
    yield f"{record.scene}: {record.heuristic}"
    yield f"shift {place}; red, green, blue {ratio} times the reference's"
    yield from picture.odd
    yield ""


def _table(records: Iterable[ComparisonRecord]) -> Iterator[Sequence[str]]:
    yield (
        "scene",
        f"mean {LEADING.label}",
        "noise",
        "shape",
        "significant",
        "heuristic",
        "reference",
    )
    for record in records:
        metric = record.metrics[LEADING.name]
        means = (metric.mean, metric.noise_floor, metric.after_exposure.mean)
        times = (f"{half.total_s:.2f} s" for half in (record.time.heuristic, record.time.reference))
        significant = f"{record.significant.fraction:.1%}"
        yield record.scene, *(f"{mean:.3f}" for mean in means), significant, *times


def details(record: ComparisonRecord) -> Iterator[str]:
    """Yield the verbose lines of a scene: simulation, pairing, losses, warnings, times."""
    plan, pairing = record.plan, record.pairing
    shadows = "" if plan.shadows else ", no shadow rays"
    yield (
        f"{record.scene}: {plan.integrator}{shadows}, {plan.spp} samples per pixel in"
        f" {plan.passes} passes, {plan.sampler}"
    )
    for light in pairing.emitters:
        note = f" ({light.note})" if light.note else ""
        yield f"  {light.name}: {light.given} as {light.derived}{note}"
    for material in pairing.bsdfs:
        if material.note:
            yield f"  {material.name}: {material.given} as {material.derived} ({material.note})"
    for miss in pairing.misses:
        yield f"  missed: {miss.what}, {miss.wanted:.3g} requested, {miss.reached:.3g} reached"
    for loss in record.unrepresentable:
        yield f"  lost: {loss.name} ({loss.plugin}): {loss.lost}; {loss.nearest}"
    for setting in record.overridden:
        yield f"  not used: {setting.what} {setting.given}, but {setting.used}"
    for warning in record.warnings:
        yield f"  warning: {warning}"
    stages = record.time.stages
    yield "  " + ", ".join(f"{name} {seconds(value)}" for name, value in stages.items())


def _noise(record: ComparisonRecord, stop: NoiseTarget) -> str:
    """Return the noise that was reached, and what stopped the run."""
    asked = f"target {stop.target:g}"
    if stop.stopped_by == "samples":
        asked += f" not reached: stopped by the limit of {stop.limit_spp} samples per pixel"
    return (
        f"{record.scene}: 95 % of pixels have noise under {LEADING.label} = {stop.reached:.3g}"
        f" after {record.plan.spp} samples per pixel ({asked})"
    )
