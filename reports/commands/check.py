"""``fotismos check``: whether a change moved anything that was measured before."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from heuristic.errors import InputError
from reports import jobs
from reports.ci import asked
from reports.terminal import verbosity


@click.command()
@click.argument("baseline", type=click.Path(path_type=Path), metavar="BASELINE")
@click.option("--update", is_flag=True, help="Write what moved to BASELINE, and print it.")
@click.option(
    "--scene",
    "scenes",
    multiple=True,
    metavar="SCENE",
    help="With --update: the scene of BASELINE; several for a folder, whose baselines are named"
    " after their scenes.",
)
@click.option(
    "--images",
    is_flag=True,
    help="With --update: keep small pictures next to BASELINE, for people to compare.",
)
@click.option(
    "--significance",
    default=0.01,
    show_default=True,
    type=jobs.Within(0, 1, min_open=True, max_open=True),
    help="Chance of an alarm though nothing changed, over all that is tested.",
)
@jobs.json_option
@asked.with_options(*asked.files)
@jobs.output_option("out", "check")
@jobs.timeout_option
@jobs.workers_option
@jobs.scheduler_option
@jobs.rendering_options
@jobs.scene_options
@verbosity.quiet_option
@verbosity.verbose_option
@click.pass_context
def check(
    context: click.Context,
    baseline: Path,
    update: bool,
    scenes: tuple[str, ...],
    images: bool,
    significance: float,
    as_json: bool,
    junit: Path | None,
    summary: Path | None,
    link: str | None,
    output: Path,
    timeout: float,
    workers: int,
    scheduler: str | None,
    **rendering: Any,
) -> None:
    """Report whether anything that was measured before moved by more than noise.

    BASELINE is a file that an earlier --update wrote, or a folder of them. Each scene is rendered
    again with its baseline's options and seed; --seed replaces the seed. If something moved, the
    exit code is 1, and OUTPUT/check/index.html shows what moved and where. If a baseline could not
    be checked, it is 2; the others are checked nevertheless.

    A scene or heuristic in Python is code, and so is a baseline that names one: it is executed.

    \b
    Examples:
      fotismos check baselines --update --scene cornell-box --scene my_scene.xml
      fotismos check baselines
      fotismos check baselines/cornell-box.json --update
    """  # noqa: D301 click reads the \b as: keep these lines
    given = {
        name: value
        for name, value in rendering.items()
        if context.get_parameter_source(name) is not ParameterSource.DEFAULT
    }
    _require_consistent(update, scenes, images, given)
    jobs.require_known(scenes)
    with jobs.pool(timeout, workers, scheduler) as pool:
        pool.start()
        from comparisons.records import to_json
        from reports.ci import annotations, check_record, lines, suite, summaries
        from reports.ci.junit import document
        from reports.page import check_page
        from reports.run.output import below, held

        page = None
        if update:
            results = suite.update(pool, baseline, scenes, images, significance, given)
        else:
            with held(output, jobs.command_line()) as held_folder:
                folder = below(held_folder, "check")
                results = suite.examine(pool, baseline, significance, given.get("seed"), folder)
                page = check_page.write(folder, results, significance)
    for result in results:
        if result.status == "error":
            click.echo(f"fotismos: error: {result.message}", err=True)
    asked.write_junit(junit, lambda: document(results))
    if summary is not None:
        address = (link or str(page)) if page else ""
        summaries.append(summary, summaries.of_check(results, significance, address))
    notes = annotations.annotate(results, output, significance, written=summary)
    if as_json:
        click.echo(to_json(check_record.of_all(results, significance)), nl=False)
    elif not verbosity.is_quiet():
        for line in lines.lines(results, significance):
            click.echo(line)
        if page:
            click.echo(f"page: {page}")
    elif any(result.exit_code for result in results):
        click.echo(lines.verdict(results, significance))
    for line in notes:
        click.echo(line, err=as_json)
    context.exit(max(result.exit_code for result in results))


def _require_consistent(
    update: bool, scenes: tuple[str, ...], images: bool, given: Mapping[str, Any]
) -> None:
    """Reject options that need --update: a check renders what the baseline says."""
    wanting = [f"--{name.replace('_', '-')}" for name in given if name != "seed"]
    wanting += ["--scene"] * bool(scenes) + ["--images"] * images
    if wanting and not update:
        raise InputError(
            f"{', '.join(wanting)}: a check renders its baseline's scene and options. Add --update"
            " to write another baseline."
        )
