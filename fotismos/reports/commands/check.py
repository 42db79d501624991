"""``fotismos check``: whether a change moved anything that was measured before.

The table ``[tool.fotismos]`` of a project's pyproject.toml says what it does there::

    [tool.fotismos]
    baselines = "baselines"
    report = "out"
    significance = 0.001
    within = 2
    max_visible = "5%"

An option on the command line comes before the table. Folders are relative to the file.
"""

import os
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
from click.core import ParameterSource

from fotismos.comparisons.atomic import file_name
from fotismos.heuristic.errors import InputError, unknown
from fotismos.reports import jobs

READING = ("--transfer", "--over")
"""Options that say how pictures are read; they are kept in their baseline."""

FILE = "pyproject.toml"
TABLE = "[tool.fotismos]"
FOLDERS = {"baselines": "baseline", "report": "output"}
"""Keys that name a folder, with the parameter of `check` that each sets."""

KEYS = (*FOLDERS, "significance", "within", "max_visible")


def _table(folder: Path) -> tuple[Path, dict[str, Any]] | None:
    """Return the nearest pyproject.toml that has the table, and the table; None without one.

    It is searched for in this folder and in those above it.
    """
    for above in (folder, *folder.parents):
        path = above / FILE
        if not path.is_file():
            continue
        try:
            whole = tomllib.loads(path.read_text(encoding="utf-8"))
        # Values nested too deeply raise RecursionError.
        except (OSError, ValueError, RecursionError) as error:
            raise InputError(f"{path} cannot be read: {error}. Correct it.") from error
        tools = whole.get("tool")
        table = tools.get("fotismos") if isinstance(tools, dict) else None
        if isinstance(table, dict):
            return path, table
    return None


def _parameters(path: Path, table: dict[str, Any]) -> dict[str, str]:
    """Return the values of the table by the parameters of `check`, as the user would type them."""
    values = {}
    for key, value in table.items():
        if key not in KEYS:
            raise unknown(f"{path}: {TABLE} key", key, KEYS)
        is_folder = key in FOLDERS
        if not isinstance(value, str if is_folder else (str, int, float)):
            allowed = "a folder" if is_folder else "a number or a text"
            raise InputError(f"{path}: {TABLE} {key} = {value!r} is not {allowed}. Correct it.")
        text = str(value)
        # Printed paths and commands are then as short as the user's own.
        values[FOLDERS.get(key, key)] = os.path.relpath(path.parent / text) if is_folder else text
    return values


class Configured(jobs.Helped):
    """A command whose defaults the table may set."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Read the table, then the command line."""
        is_needed = not extra.get("resilient_parsing") and not {"-h", "--help"} & set(args)
        found = _table(Path.cwd()) if is_needed else None
        if found is None:
            return super().make_context(info_name, args, parent, **extra)
        path, table = found
        extra["default_map"] = _parameters(path, table)
        try:
            return super().make_context(info_name, args, parent, **extra)
        except click.BadParameter as error:
            name = (error.param and error.param.name) or ""
            source = error.ctx and error.ctx.get_parameter_source(name)
            if source is ParameterSource.DEFAULT_MAP:
                raise InputError(f"{path}: {TABLE} {name}: {error.message}") from error
            raise


@jobs.command(cls=Configured)
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
    "--picture",
    "pictures",
    multiple=True,
    type=jobs.definition,
    metavar="NAME=PATTERN",
    help="Repeats of a picture from any renderer, each with its own seed, such as"
    " 'hall=render_*.exr'; several for a folder, whose baselines have these names.",
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
@click.option(
    "--within",
    type=float,
    metavar="DE",
    help="With --picture: judge by a tolerance in place of drift. Pixels differ visibly if ΔE2000"
    " is above this.  [default: 2]",
)
@click.option(
    "--max-visible",
    type=jobs.percentage,
    metavar="P%",
    help="The share of the pixels that may differ visibly.  [default: 5%]",
)
@jobs.json_option
@jobs.ci_options
@jobs.output_option("out", "check")
@jobs.process_options
@jobs.options_of_scenes(resolution="the film's, reduced to 64 pixels at most")
@jobs.option("transfer")
@jobs.option("over")
@jobs.verbosity_options
@click.pass_context
def check(
    context: click.Context,
    /,
    baseline: Path,
    update: bool,
    scenes: tuple[str, ...],
    pictures: tuple[tuple[str, str], ...],
    images: bool,
    significance: float,
    within: float | None,
    max_visible: float | None,
    as_json: bool,
    junit: Path | None,
    summary: Path | None,
    output: Path,
    timeout: float,
    workers: int | None,
    scheduler: str | None,
    **rendering: Any,
) -> None:
    """Report whether anything that was measured before moved by more than noise.

    BASELINE is a file that an earlier --update wrote, or a folder of them. Each scene is rendered
    again with its baseline's options and seed; --seed replaces the seed. If something moved, the
    exit code is 1, and OUTPUT/check/index.html shows what moved and where. If a baseline could not
    be checked, it is 2; the others are checked nevertheless.

    The table [tool.fotismos] of the nearest pyproject.toml may set baselines, in place of BASELINE,
    report, in place of --output, significance, within and max_visible.

    With --picture, repeats of a picture are compared with earlier ones and not rendered; the scenes
    of a folder are checked, too. Repeats of a renderer without noise are equal, and any change is a
    drift. A tolerance, --within or --max-visible, allows what nobody sees, such as another GPU's
    rounding.

    A scene or shader in Python is code, and so is a baseline that names one: it is executed.

    \b
    Examples:
      fotismos check baselines --update --scene cornell-box --scene my_scene.xml
      fotismos check baselines
      fotismos check baselines/cornell-box.json --update
      fotismos check baselines --update --picture hall='render_*.exr'
      fotismos check baselines --picture hall='new_*.exr'
      fotismos check baselines --picture hall='new_*.png' --within 2 --max-visible 5%
    """  # noqa: D301 click reads the \b as: keep these lines
    # Only what the user gave: a default must not replace the baseline's option.
    changes = {
        name: value
        for name, value in rendering.items()
        if context.get_parameter_source(name) is not ParameterSource.DEFAULT
    }
    wanting = [f"--{name.replace('_', '-')}" for name in changes if name != "seed"]
    if scenes:
        wanting.append("--scene")
    if images:
        wanting.append("--images")
    if wanting and not update:
        raise InputError(
            f"{', '.join(wanting)}: a check renders its baseline's scene and options. Add --update"
            " to write another baseline."
        )
    if pictures and update and (others := [word for word in wanting if word not in READING]):
        raise InputError(f"{', '.join(others)}: pictures are not rendered. Omit it, or --picture.")
    patterns = _places(baseline, pictures)
    is_stated = any(
        context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        for name in ("within", "max_visible")
    )
    if update or not pictures:
        # A project's own tolerance is for its pictures alone.
        within = max_visible = None
    if is_stated and (update or not pictures):
        raise InputError(
            "--within, --max-visible: a tolerance judges new pictures. Give --picture, without"
            " --update."
        )
    inputs = list(baseline.glob("*")) if baseline.is_dir() else [baseline]
    code = jobs.work(
        "check",
        jobs.pool(timeout, max(len(scenes), len(inputs)), workers=workers, scheduler=scheduler),
        baseline=baseline,
        update=update,
        scenes=scenes,
        with_images=images,
        significance=significance,
        changes=changes,
        patterns=patterns,
        within=within,
        max_visible=max_visible,
        inputs=inputs,
        output=output,
        junit=junit,
        summary_file=summary,
        as_json=as_json,
    )
    context.exit(code)


def _places(baseline: Path, pictures: Sequence[tuple[str, str]]) -> dict[Path, str]:
    """Return the patterns of pictures by the files of their baselines."""
    is_file = baseline.suffix == ".json"
    places = {
        baseline if is_file else baseline / f"{file_name(name, '--picture')}.json": pattern
        for name, pattern in pictures
    }
    if len(places) < len(pictures):
        raise InputError("--picture: give each name once, and a folder for several pictures.")
    return places
