"""What a person sees while a command runs and when it has ended."""

from contextlib import contextmanager
from functools import partial

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn
from rich.text import Text

from comparisons.departure.metrics import LEADING
from heuristic.heuristics import PHONG
from reports.terminal import verbosity
from reports.terminal.printing import seconds
from reports.terminal.tables import printed

SPEED_OVER_S = 600.0
"""Seconds over which the speed is taken that the time left follows from: scenes differ."""


class Bar:
    """Progress bars on standard error, one per scene; silent where no person is watching.

    Parameters
    ----------
    progress : rich.progress.Progress
        Which shows them.
    unit
        What a scene's bar counts.
    total
        Of the line for the whole run, in the weights that :meth:`begin` names; None for none.
    """

    def __init__(self, progress, unit="passes", total=None):
        self._progress, self._unit = progress, unit
        self._whole = total and progress.add_task("", total=total, unit="", is_whole=True)
        self._stage, self._done, self._count, self._weight = "", 0, 0, 0.0

    def of(self, scene):
        """Return the callback ``(stage, done, total)`` for one scene."""
        task = self._progress.add_task(scene, total=None, unit=self._unit, is_whole=False)
        return partial(self._update, task)

    def begin(self, stage, count, weight, skipped=0):
        """Begin a stage of the run: how many tasks it has, of which weight; others are skipped."""
        self._stage, self._done, self._count, self._weight = stage, 0, count, weight
        if self._whole is not None:
            total = self._progress.tasks[0].total - skipped * weight
            self._progress.update(self._whole, total=total, description=self._words())

    def over(self, update):
        """End the task whose callback is ``update``: its bar goes, and that of the run goes on."""
        if update is not None:
            self._progress.remove_task(update.args[0])
        self._done += 1
        if self._whole is not None:
            self._progress.update(self._whole, advance=self._weight, description=self._words())

    def _words(self):
        return f"{self._stage}, {self._done} of {self._count}"

    def _update(self, task, stage, done, total):
        self._progress.update(task, completed=done, total=total)


class _Count(MofNCompleteColumn):
    """How much of a task is done: of the whole run in percent."""

    def render(self, task):
        return Text(f"{task.percentage:.0f} %") if task.fields["is_whole"] else super().render(task)


@contextmanager
def shown(unit="passes", total=None):
    """Show progress on standard error while the block runs, if that is a terminal.

    ``unit`` and ``total`` are those of :class:`Bar`.
    """
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


def summary(records):
    """Yield a line for each scene: departure, noise, shape, and times."""
    records = list(records)
    for record in records:
        if record.picture:
            yield from _picture(record)
    yield from printed(_table(records), right=1)
    for record in records:
        if record.heuristic != PHONG.name and not record.picture:
            yield f"{record.scene}: heuristic {record.heuristic}"
            yield from record.suspicions
        if record.noise_target:
            yield _noise(record)
        guard = record.plan.guard
        if guard and guard.state == "disagreed":
            yield (
                f"{record.scene}: a probe disagreed with the plan by {guard.departure:+.1%} of the"
                " light, so that everything was simulated. Please report this scene."
            )


def _picture(record):
    """Yield where a picture lies, and what is odd about it: all numbers rest on that."""
    shift, ratio = record.picture.shift, ", ".join(f"{value:.3g}" for value in record.picture.ratio)
    place = "not known" if shift is None else f"{shift[0]:+.2f}, {shift[1]:+.2f} pixels"
    yield f"{record.scene}: {record.heuristic}"
    yield f"shift {place}; red, green, blue {ratio} times those of the reference"
    yield from record.picture.odd
    yield ""


def _table(records):
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


def details(record):
    """Yield what a verbose command says of a scene: simulation, pairing, warnings, times."""
    plan, pairing = record.plan, record.pairing
    shadows = "" if plan.shadows else ", no shadow rays"
    yield (
        f"{record.scene}: {plan.integrator}{shadows}, {plan.spp} samples a pixel in"
        f" {plan.passes} passes, {plan.sampler}"
    )
    for light in pairing.emitters:
        note = f" ({light.note})" if light.note else ""
        yield f"  {light.name}: {light.given} as {light.derived}{note}"
    for material in pairing.bsdfs:
        if material.note:
            yield f"  {material.name}: {material.given} as {material.derived} ({material.note})"
    for miss in pairing.misses:
        yield f"  missed: {miss.what}, {miss.wanted:.3g} wanted, {miss.reached:.3g} reached"
    for warning in record.warnings:
        yield f"  warning: {warning}"
    stages = record.time.stages
    yield "  " + ", ".join(f"{name} {seconds(value)}" for name, value in stages.items())


def _noise(record):
    """Say what a noise target came to, and what stopped the run."""
    stop = record.noise_target
    asked = f"target {stop.target:g}"
    if stop.stopped_by == "samples":
        asked += f" not reached: stopped by the limit of {stop.limit_spp} samples a pixel"
    return (
        f"{record.scene}: 95 % of pixels have noise under {LEADING.label} = {stop.reached:.3g}"
        f" after {record.plan.spp} samples a pixel ({asked})"
    )
