"""``fotismos compare``: how far textbook shading is from physics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from fotismos.reports import jobs
from fotismos.reports.run import batch
from fotismos.reports.terminal.words import echo, is_quiet

if TYPE_CHECKING:
    from fotismos.heuristic.errors import FotismosError
    from fotismos.reports.page.scene_view import SceneView


@jobs.command()
@jobs.scenes_argument
@jobs.output_option("out")
@jobs.figures_option
@jobs.fresh_option
@jobs.process_options
@jobs.scene_options
@jobs.option("image")
@jobs.option("transfer")
@jobs.verbosity_options
@jobs.option("noise")
@jobs.option("colour_science")
@click.option(
    "--why/--no-why",
    "with_causes",
    default=True,
    help="Find causes and remedies, at a small size; of a picture, none. [default: why]",
)
@jobs.open_option
@jobs.within_option
@click.option(
    "--max-visible",
    type=jobs.percentage,
    metavar="P%",
    help="Exit code 1 unless at most this share of each scene's pixels differs visibly.",
)
@jobs.ci_options
@click.pass_context
def compare(
    context: click.Context,
    scenes: tuple[str, ...],
    output: Path,
    figures: bool,
    fresh: bool,
    with_causes: bool,
    timeout: float,
    workers: int | None,
    scheduler: str | None,
    is_opened: bool,
    within: float,
    max_visible: float | None,
    junit: Path | None,
    summary: Path | None,
    **rendering: Any,
) -> None:
    """Measure how far textbook shading is from physics, where, and whether it is more than noise.

    SCENE is a built-in name (`fotismos scenes`), a Mitsuba file (.xml), or a Python file (.py) in
    which `scene` is a dictionary or returns one. Writes OUTPUT/index.html and tables of all
    scenes, and for each scene comparison.json, comparison.exr and pictures. If one scene fails,
    the others are still compared. An interrupted run keeps its finished scenes: the same command
    resumes it.

    \b
    Examples:
      fotismos compare fig-8-9
      fotismos compare my_scene.xml cornell-box --resolution 640x480 -o results
      fotismos compare cornell-box --noise 0.5 --spp 2048
      fotismos compare fig-8-8a fig-8-9 --figures -q
      fotismos compare my_scene.xml -D roughness=0.2 --sensor 1
      fotismos compare plastic-spheres --no-why
      fotismos compare my_scenes/*.xml
      fotismos compare my_scene.xml --heuristic my_shader.py
      fotismos compare my_scene.xml --image theirs.exr
      fotismos compare my_scenes/*.xml --max-visible 5% --summary summary.md
    """  # noqa: D301 click reads the \b as: keep these lines
    if rendering["image"] and len(scenes) > 1:
        raise click.UsageError("--image goes with one scene.")
    request = jobs.request(rendering)
    has_summary = max_visible is not None or junit is not None or summary is not None
    if has_summary:
        from fotismos.reports.ci.summary import (
            require_free,  # loaded late: most comparisons need no CI
        )

        named = [rendering["heuristic"] or "", *rendering["image"]]
        files = (word.partition(":")[0] for word in named)
        require_free(junit, summary, [*scenes, *filter(None, files)])
    code = 0

    def finish(
        folder: Path, views: Sequence[SceneView], errors: Mapping[str, FotismosError]
    ) -> None:
        """Print the gates, and write the files for CI."""
        from fotismos.reports.ci import summary as ci  # loaded late: most comparisons need no CI

        nonlocal code
        ci.require_free(junit, summary, [])  # nor what this command wrote
        studied = [view.studied for view in views]
        gates = ci.gates([record for record, _ in studied], max_visible, within)
        code = int(any(gate.state != "pass" for gate in gates))
        for line in ci.gate_lines(gates) if gates else ():
            if code or not is_quiet():  # the reason of a failure is never lost
                echo(line, err=is_quiet())
        ci.write_junit(junit, lambda: ci.junit_of_gates(gates, errors))
        page = str(folder / "index.html") if views else ""
        ci.append(summary, lambda: ci.of_comparison(studied, gates, errors, page, within))

    batch.run(
        scenes,
        output,
        jobs.Job(request, figures, with_causes=with_causes, fresh=fresh, within=within),
        jobs.pool(timeout, len(scenes), workers, scheduler),
        on_page=jobs.open_page if is_opened else None,
        finish=finish if has_summary else None,
    )
    context.exit(code)
