"""Options that commands share, and the requests and processes made from them."""

from __future__ import annotations

import gc
import logging
import math
import os
import shlex
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, TypeVar, cast

import click
from click.shell_completion import CompletionItem

from comparisons.processes.pool import Pool, cores
from heuristic import backend, program
from heuristic.backend import VARIANTS
from heuristic.errors import InputError, suggestion
from reports.terminal import verbosity

if TYPE_CHECKING:
    from comparisons.case import Request


Command = TypeVar("Command", bound=Callable[..., Any])
Decorator: TypeAlias = Callable[[Any], Any]


def resolution(text: str) -> tuple[int, int]:
    """Parse ``WIDTHxHEIGHT``, two positive integers."""
    width, separator, height = text.lower().partition("x")
    if not (separator and width.isdecimal() and height.isdecimal()):
        raise click.BadParameter(f"{text!r} is not a resolution; write it like 512x512.")
    return int(width), int(height)


def _definition(text: str) -> tuple[str, str]:
    """Parse ``NAME=VALUE`` for a placeholder ``$NAME`` of a scene file."""
    name, separator, value = text.partition("=")
    if not (separator and name):
        raise click.BadParameter(f"{text!r} is not a definition; write it like name=value.")
    return name, value


def complete_scene(
    context: click.Context, parameter: click.Parameter, beginning: str
) -> list[CompletionItem]:
    """Complete a SCENE: built-in ones with this beginning, or else files."""
    from comparisons.gallery.builtin import SCENES

    named = [name for name in SCENES if name.startswith(beginning)]
    found = [CompletionItem(name, help=SCENES[name].title) for name in named]
    return found or [CompletionItem(beginning, type="file")]


def require_known(names: Iterable[str]) -> None:
    """Ensure, before anything is loaded, that these files, folders or built-in scenes exist.

    Raises
    ------
    InputError
        With a suggestion.
    """
    from comparisons.gallery.builtin import builtin

    for name in names:
        path = Path(name)
        try:
            if name and path.exists():
                continue
        except OSError as error:
            raise InputError(f"{name[:60]!r}: {error.strerror}. Give a scene.") from error
        if path.suffix in (".xml", ".py") or path.parent.name:
            siblings = {str(path.with_name(one)) for one in _names_in(path.parent)}
            raise InputError(
                f"{name}: there is no such file{suggestion(name, siblings)}. Give a Mitsuba scene"
                " (.xml), a Python file that makes one (.py), a folder of scenes, or a built-in"
                f" scene; `{program.command('scenes')}` lists them."
            )
        builtin(name)


def _names_in(folder: Path) -> list[str]:
    try:
        return os.listdir(folder)
    except OSError:
        return []


scene_argument = click.argument("scene", metavar="SCENE", shell_complete=complete_scene)
scenes_argument = click.argument(
    "scenes", nargs=-1, required=True, metavar="SCENE...", shell_complete=complete_scene
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")


def output_option(default: str, below: str = "") -> Decorator:
    """Return the option for the folder of the results, which go to ``below`` in it."""
    return click.option(
        "-o",
        "--output",
        default=default,
        show_default=True,
        type=click.Path(path_type=Path),
        help="Folder for the results" + (f", which go to OUTPUT/{below}." if below else "."),
    )


figures_option = click.option(
    "--figures", is_flag=True, help="Write figures for print, as SVG and PDF, to OUTPUT/figures."
)
fresh_option = click.option(
    "--fresh",
    is_flag=True,
    help="Render all scenes again; without it, finished ones in OUTPUT are reused.",
)


def rendering_options(command: Command) -> Command:
    """Add the options of all commands that render."""
    return _with(
        command,
        click.option("--variant", type=click.Choice(VARIANTS),
                     help="Mitsuba variant. [default: llvm_ad_rgb, or llvm_ad_spectral for a scene"
                     " with tabulated spectra]"),
        click.option("--heuristic-variant", type=click.Choice(VARIANTS),
                     help="Variant of the heuristic half, such as RGB shading against a spectral"
                     " reference. [default: the scene's own, else --variant]"),
        click.option("--seed", default=0, show_default=True, type=click.IntRange(min=0),
                     help="Seed of the run, from which each pass derives its own."),
        click.option("--spp", type=click.IntRange(min=2),
                     help="Samples per pixel, over all passes. [default: the plan's]"),
        click.option("--resolution", type=resolution, metavar="WxH",
                     help="Width and height. [default: the film's]"),
        click.option("--heuristic", metavar="NAME|FILE.py[:FUNCTION]|FILE.glsl|three:phong",
                     help="The heuristic: phong, blinn, one that engines use (such as"
                     " mean-ambient), one that a package declares, or a function shade(point) in a"
                     " file. [default: phong]"),
        click.option("--interpolation", type=click.Choice(["flat", "gouraud", "phong"]),
                     help="Shading of polygons in the heuristic half. [default: the scene's own,"
                     " else phong]"),
        click.option("--tessellation", type=click.IntRange(min=1), metavar="N",
                     help="Mesh the shapes of the heuristic half: N edges per quarter turn or"
                     " straight side. [default: the scene's own, else 16 for flat and gouraud]"),
        click.option("--everything", is_flag=True,
                     help="Switch off all pruning: simulate every effect."),
        click.option("--pairing", default="matched", show_default=True,
                     type=click.Choice(["literal", "matched"]),
                     help="How roughplastic and phong are paired."),
        click.option("--pixels-per-degree", type=Within(min=1, max=1000), metavar="N",
                     help="FLIP: pixels per degree of vision. [default: 67]"),
        click.option("--allow-empty", is_flag=True,
                     help="Accept pictures in which no pixel sees a surface."),
    )  # fmt: skip


def scene_options(command: Command) -> Command:
    """Add the options for scene files."""
    return _with(
        command,
        click.option("-D", "define", type=_definition, multiple=True, metavar="NAME=VALUE",
                     help="Value for a placeholder $NAME of a scene file; may be repeated."),
        click.option("--sensor", type=click.IntRange(min=0), metavar="N",
                     help="Which sensor of the scene, from 0. [default: the first]"),
    )  # fmt: skip


def _with(command: Command, *options: Decorator) -> Command:
    for option in reversed(options):
        command = option(command)
    return command


scripts_option = click.option(
    "--scripts", is_flag=True, help="Run the Python files in folders, too; they are code."
)


class Within(click.FloatRange):
    """A number in an interval; NaN is in none."""

    def convert(
        self, value: Any, parameter: click.Parameter | None, context: click.Context | None
    ) -> float:
        number = super().convert(value, parameter, context)
        if math.isnan(number):
            self.fail(
                f"{value!r} is not in the range {self._describe_range()}.", parameter, context
            )
        return number


timeout_option = click.option(
    "--timeout",
    default=1800.0,
    show_default=True,
    type=Within(min=0, min_open=True),
    metavar="SECONDS",
    help="End a scene that makes no progress for this long.",
)


def _workers(default: int | None, shown: str | bool = True) -> Decorator:
    return click.option(
        "--workers",
        default=default,
        show_default=shown,
        type=click.IntRange(min=1),
        metavar="N",
        help="Processes that render at the same time, each with its share of the cores.",
    )


workers_option = _workers(1)
all_workers_option = _workers(None, "one per core")

IN_PROCESSES = True
"""Whether scenes are read and rendered in separate processes; tests use their own process."""


scheduler_option = click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Use the Dask cluster with this scheduler, such as tcp://host:8786.",
)


def pool(timeout: float, workers: int | None = 1, scheduler: str | None = None) -> Pool:
    """Return processes or a cluster in which scenes are read and rendered.

    They are separate, since a scene may run its own code, and native code may crash or hang.

    Parameters
    ----------
    timeout
        Seconds that a task may take without any progress; a Dask cluster has its own limits.
    workers
        Processes at the same time; None for one per core.
    scheduler
        Address of a Dask cluster that replaces processes here. Its workers need the same folders.
    """
    if scheduler is None:
        workers = workers or cores()
        return Pool(workers if IN_PROCESSES else 0, Ready.among(workers), timeout)
    if workers and workers > 1:
        raise click.UsageError("--workers and --scheduler exclude each other.")
    from comparisons.processes import cluster

    # As a context it gives a Cluster, which does what a Pool does.
    return cast(Pool, cluster.connected(scheduler, Ready.far_away()))


@dataclass(frozen=True)
class Ready:
    """Gets a process ready to render.

    Attributes
    ----------
    level
        Verbosity; at 1, verbose, Mitsuba's messages are printed.
    threads
        Dr.Jit's threads; if omitted, one per core.
    folder
        Folder to which file names are relative; if omitted, the process's.
    program
        Beginning of printed commands; if omitted, the way the process was started.
    """

    level: int
    threads: int | None = None
    folder: str | None = None
    program: str | None = None

    @classmethod
    def among(cls, workers: int) -> Ready:
        """Return the preparation of one of this many processes of this machine."""
        return cls(verbosity.level(), cores() // workers if workers > 1 else None)

    @classmethod
    def far_away(cls) -> Ready:
        """Return the preparation of a process on another machine."""
        return cls(verbosity.level(), None, os.getcwd(), shlex.join(program.program()))

    def __call__(self) -> None:
        """Get this process ready.

        Raises
        ------
        InputError
            If the folder does not exist.
        InstallationError
            If there is no usable LLVM.
        """
        if self.program is not None:
            os.environ[program.VARIABLE] = self.program
        if self.folder is not None:
            _enter(self.folder)
        backend.check()
        backend.use_threads(self.threads)
        from reference.scene import messages

        messages.divert(_print if self.level > 0 else _pass_over)
        if self.level > 0:
            logging.basicConfig(level=logging.INFO)
        import comparisons.compare  # noqa: F401  part of start-up

        gc.freeze()  # modules stay: garbage collections need not look at them


def _enter(folder: str) -> None:
    try:
        os.chdir(folder)
    except OSError as error:
        raise InputError(
            f"{folder}: {error.strerror}, on a worker of the cluster. Workers need the same"
            " folders as this machine."
        ) from error


def _print(text: str) -> None:
    click.echo(text, err=True)


def _pass_over(text: str) -> None:
    """Ignore a message: the record has the warnings that concern it."""


def command_line() -> str:
    """Return the command that the user gave, as a shell takes it."""
    return program.command(*sys.argv[1:])


def expand(names: Iterable[str], with_scripts: bool = False) -> list[str]:
    """Return the names of scenes, each folder replaced by the scenes in it.

    A folder's scripts are included only ``with_scripts``; a named script always is.

    Raises
    ------
    InputError
        For a folder without a scene.
    """
    return [scene for name in names for scene in _within(Path(name), with_scripts) or [name]]


def _within(folder: Path, with_scripts: bool) -> list[str]:
    """Return the scenes in a folder; none if the path is not a folder."""
    if not folder.is_dir():
        return []
    from reference.scene.folders import scenes_in

    found = scenes_in(folder)
    if with_scripts:
        return list(map(str, sorted((*found.written, *found.scripts))))
    if found.scripts:
        scripts = ", ".join(str(path.relative_to(folder)) for path in found.scripts)
        told = f"{folder}: {scripts}: scripts are code, run only with --scripts"
        if not found.written:
            raise InputError(f"{told}. The folder has no other scene.")
        click.echo(f"fotismos: {told}.", err=True)
    return list(map(str, found.written))


def requests(whole: Request, scenes: Sequence[str]) -> list[Request]:
    """Return the request for each scene: with values only for the placeholders that it has.

    Raises
    ------
    InputError
        For a value whose placeholder no scene has.
    """
    if len(scenes) == 1 or not whole.define:
        return [whole] * len(scenes)
    from reference.scene.reading import placeholders

    known = (placeholders(Path(scene)) for scene in scenes)
    own = [{key: value for key, value in whole.define.items() if key in names} for names in known]
    if unused := set(whole.define) - {key for each in own for key in each}:
        raise InputError(
            f"-D {', '.join(sorted(unused))}: no scene has such a placeholder. Write $name into a"
            " scene file, or leave the option out."
        )
    return [replace(whole, define=define) for define in own]


def request(words: Mapping[str, Any]) -> Request:
    """Return the rendering request of a command's options."""
    from comparisons.case import Request

    return Request.of({**words, "define": dict(words.get("define") or ())})
