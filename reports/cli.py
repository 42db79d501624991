"""The command line.

Exit codes: 0 done; 1 a check failed; 2 bad input or installation. A mistake of the user's gets one
message on standard error, never a traceback. Mitsuba and colour-science are imported by the
commands that need them, so that ``--help`` and usage errors answer at once.
"""

import json
import sys
from pathlib import Path
from time import perf_counter

import click

from heuristic.errors import FotismosError
from heuristic.version import __version__
from reports import jobs

START = perf_counter()
VERIFIED_AT = (128, 128)
"""Resolution at which a report verifies its plans."""


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="fotismos")
def cli():
    """Textbook shading against physically based rendering, scene by scene."""


def _output_option(default):
    return click.option(
        "-o",
        "--output",
        default=default,
        show_default=True,
        type=click.Path(path_type=Path),
        help="Folder for the results.",
    )


@cli.command()
@click.argument("scenes", nargs=-1, required=True, metavar="SCENE...")
@_output_option("out")
@jobs.rendering_options
def compare(scenes, output, **rendering):
    """Say how far textbook shading is from physics, where, and whether that is more than noise.

    SCENE is a built-in name (`fotismos scenes`) or a Mitsuba file (.xml). Writes OUTPUT/index.html
    and, for each scene, comparison.json, comparison.exr and pictures.

    \b
    Examples:
      fotismos compare fig-8-9
      fotismos compare my_scene.xml cornell-box --resolution 640x480 -o results
    """  # noqa: D301 click reads the \b as: keep these lines
    _compare(scenes, output, rendering)


@cli.command()
@_output_option("out/report")
@jobs.rendering_options
def report(output, **rendering):
    """Compare all built-in scenes, verify their plans, and write one report."""
    from comparisons.scenes import SCENES
    from heuristic import equations

    names = tuple(SCENES)
    jobs.check_installation()
    verifications = [] if rendering["everything"] else _verify(names, rendering)
    _compare(names, output, rendering, equations.index(), verifications, with_hard_cases=True)


@cli.command()
@click.argument("scene", metavar="SCENE")
@click.option("--json", "as_json", is_flag=True, help="Print JSON.")
@click.option("--verify", is_flag=True, help="Render as planned and with everything, and compare.")
@jobs.rendering_options
def plan(scene, as_json, verify, **rendering):
    """Say which effects a scene calls for, by which rule, and what will be simulated.

    \b
    Examples:
      fotismos plan cornell-box
      fotismos plan --verify fig-8-9 --resolution 128x128
    """  # noqa: D301 click reads the \b as: keep these lines
    jobs.check_installation()
    from reference.scene import set_variant
    from reports import planning, progress

    source, chosen = jobs.job(scene, rendering)
    set_variant(chosen["variant"])
    options = jobs.options(chosen)
    if verify:
        from comparisons.verification import verify as run

        with progress.shown() as bar:
            data = run(source, options, bar.of(source.name)).data()
        lines = planning.verification_lines([data])
    else:
        from comparisons.compare import prepare

        data = planning.data(source.name, prepare(source, options), chosen["variant"])
        lines = planning.lines(data)
    if as_json:
        lines = [json.dumps(data, indent=2, ensure_ascii=False)]
    for line in lines:
        click.echo(line)


@cli.command()
def scenes():
    """List the built-in scenes."""
    from comparisons.scenes import SCENES

    width = max(map(len, SCENES))
    for scene in SCENES.values():
        click.echo(f"{scene.name:<{width}}  {scene.title}")


@cli.command()
def doctor():
    """Check the installation: versions, LLVM, and a test rendering in each variant."""
    from reports.doctor import examine

    for line in examine(jobs.VARIANTS):
        click.echo(line)


def main():
    """Run the command line; the exit code says how it went."""
    try:
        cli(prog_name="fotismos", standalone_mode=False)
    except click.exceptions.Abort:
        click.echo("fotismos: interrupted; finished scenes are kept.", err=True)
        sys.exit(130)
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except FotismosError as error:
        click.echo(f"fotismos: error: {error}", err=True)
        sys.exit(error.exit_code)


def _verify(names, rendering):
    """Hold the plan of each scene against everything simulated, at a small size."""
    from comparisons.verification import verify
    from reference.scene import set_variant
    from reports import progress

    with progress.shown() as bar:
        results = []
        for source, chosen in (jobs.job(name, rendering) for name in names):
            set_variant(chosen["variant"])
            options = jobs.options(chosen | {"resolution": VERIFIED_AT, "spp": None})
            results.append(verify(source, options, bar.of(source.name)).data())
    return results


def _compare(names, folder, rendering, equations=(), verifications=(), with_hard_cases=False):
    jobs.check_installation()
    from comparisons import hard_record
    from comparisons.compare import compare as run
    from reference.scene import set_variant
    from reports import hard_cases, output, progress

    folder = output.prepare(folder)
    wanted = [jobs.job(name, rendering) for name in names]
    views = {}
    with progress.shown() as bar:
        for source, chosen in wanted:
            start_up = perf_counter() - START if not views else 0.0
            set_variant(chosen["variant"])
            result = run(
                source, jobs.options(chosen), bar.of(source.name), jobs.command(source, chosen)
            )
            begin = perf_counter()
            name = output.folder_name(source.name, views)
            views[name] = output.write_scene(folder, name, result)
            stages = result.data["time"]["stages"]
            stages |= {"start-up": start_up, "files": perf_counter() - begin}
    begin = perf_counter()
    shown = hard_cases.view(hard_record.collect()) if with_hard_cases else None
    output.write_page(folder, list(views.values()), equations, verifications, shown)
    share = (perf_counter() - begin) / len(views)
    for name, view in views.items():
        view["record"]["time"]["stages"]["page"] = share
        output.rewrite_record(folder, name, view["record"])
    for line in progress.summary(view["record"] for view in views.values()):
        click.echo(line)
    click.echo(f"\n{folder / 'index.html'}")
