"""Options that commands share, and the requests and processes made from them."""

import gc
import logging
import math
import os
import re
import shlex
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any, TypeAlias, cast

import click
from click.shell_completion import CompletionItem
from msgspec import inspect

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import CAN_SHARE, Pool
from fotismos.heuristic import llvm, program
from fotismos.heuristic.errors import InputError, unknown
from fotismos.heuristic.program import cores
from fotismos.reports.terminal.words import as_typed, echo, level, quiet_option, verbose_option

Decorator: TypeAlias = Callable[[Any], Any]


def resolution(text: str) -> tuple[int, int]:
    """Parse ``WIDTHxHEIGHT``, two integers of at least 1."""
    sides = re.fullmatch(r"(?i)0*([1-9]\d*)x0*([1-9]\d*)", text)
    if sides is None:
        raise click.BadParameter(
            f"{text!r} is not a resolution; write it like 512x512, with sides of at least 1."
        )
    return int(sides[1]), int(sides[2])


def definition(text: str) -> tuple[str, str]:
    """Parse ``NAME=VALUE``, such as for a placeholder ``$NAME`` of a scene file."""
    name, separator, value = text.partition("=")
    if not (separator and name):
        raise click.BadParameter(f"{text!r} is not a definition; write it like name=value.")
    return name, value


def complete_scene(
    context: click.Context, parameter: click.Parameter, beginning: str
) -> list[CompletionItem]:
    """Complete a SCENE: built-in ones with this beginning, or else files."""
    named = [name for name in SCENES if name.startswith(beginning)]
    items = [CompletionItem(name, help=SCENES[name].title) for name in named]
    return items or [CompletionItem(beginning, type="file")]


# --- Help ------------------------------------------------------------------------------------

GROUPS = {
    "What is rendered": set(Options.__struct_fields__),
    "Results": {"output", "as_json", "figures", "fresh", "is_opened", "quiet", "verbose"},
    "Bounds and CI": {"max_visible", "within", "junit", "summary"},
    "Processes": {"timeout", "workers", "scheduler"},
}
"""The groups of options in help; a command's own options come first."""


class Helped(click.Command):
    """A command whose help groups its options, and begins examples as the user began."""

    def format_options(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, one group after the other."""
        rows: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(context):
            shown = parameter.get_help_record(context)
            if shown and isinstance(parameter, click.Option):
                groups = (group for group, names in GROUPS.items() if parameter.name in names)
                rows.setdefault(next(groups, "Options"), []).append(shown)
        for group in ("Options", *GROUPS):
            if group in rows:
                with formatter.section(group):
                    formatter.write_dl(rows[group])

    def get_help(self, context: click.Context) -> str:
        """Return the help, with commands as the user types them."""
        text = super().get_help(context)
        return re.sub(r"(?m)(^ +|[`(])fotismos (?=\w)", rf"\1{program.command()} ", text)


command = partial(click.command, cls=Helped)
"""The decorator of all commands."""


# --- Options ---------------------------------------------------------------------------------

scene_argument = click.argument("scene", metavar="SCENE", shell_complete=complete_scene)
scene_or_pictures_argument = click.argument(
    "scene", metavar="[SCENE]", required=False, shell_complete=complete_scene
)
scenes_argument = click.argument(
    "scenes", nargs=-1, required=True, metavar="SCENE...", shell_complete=complete_scene
)
scenes_or_pictures_argument = click.argument(
    "scenes", nargs=-1, metavar="[SCENE...]", shell_complete=complete_scene
)
json_option = click.option("--json", "as_json", is_flag=True, help="Print JSON.")


class OutputFolder(click.Path):
    """A folder's path, which is not empty: that would be the current folder."""

    def convert(self, value: Any, *context: Any) -> Any:
        """Return the path of a folder."""
        if value == "":
            self.fail("it is empty. Name a folder; the current one is '.'.", *context)
        return super().convert(value, *context)


def output_option(default: str, below: str = "") -> Decorator:
    """Return the option for the folder of the results, which go to ``below`` in it."""
    return click.option(
        "-o",
        "--output",
        default=default,
        show_default=True,
        type=OutputFolder(path_type=Path),
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


class OneOf(click.Choice):  # type: ignore[type-arg]  # older ones take none
    """A word; the message on another suggests the nearest, and says why a variant is not there."""

    def get_invalid_choice_message(self, value: Any, ctx: click.Context | None) -> str:
        if llvm.VARIANTS[0] in self.choices:
            return str(llvm.unknown_variant("variant", value))
        return str(unknown("word", value, self.choices))


class Within(click.FloatRange):
    """A number in an interval; NaN is in none."""

    def convert(
        self, value: Any, parameter: click.Parameter | None, context: click.Context | None
    ) -> float:
        number = super().convert(value, parameter, context)
        # Comparisons with NaN are false, so click's range lets it pass.
        if math.isnan(number):
            self.fail(
                f"{value!r} is not in the range {self._describe_range()}.", parameter, context
            )
        return number


def with_options(options: Sequence[Decorator]) -> Decorator:
    """Return a decorator that adds options to a command."""

    def add(command: Any) -> Any:
        # Reversed, as decorators apply: help lists the options in the given order.
        for option in reversed(options):
            command = option(command)
        return command

    return add


FIELDS = cast(inspect.StructType, inspect.type_info(Options)).fields

METAVARS = {
    "heuristic": "NAME|FILE.py[:FUNCTION]|FILE.glsl", "noise": "DE", "tessellation": "N",
    "pixels_per_degree": "N", "resolution": "WxH", "define": "NAME=VALUE", "sensor": "N",
    "image": "FILE", "reference": "FILE", "mask": "FILE",
}  # fmt: skip

SHORT = {"image": "-t", "reference": "-r", "variant": "-m"}
"""Short names of options, as other programs have them: Mitsuba, and those that compare pictures."""


def option(name: str, command_default: str = "") -> Decorator:
    """Return the command line's form of a field of :class:`fotismos.comparisons.options.Options`.

    ``command_default`` is what a command does without the option, if that is its own.
    """
    field = next(known for known in FIELDS if known.name == name)
    assert isinstance(field.type, inspect.Metadata), "each field has its help"
    description = (field.type.extra_json_schema or {})["description"]
    default = command_default or (field.type.extra or {}).get("default")
    is_stated = default is None and isinstance(field.default, (int, str))
    return click.option(
        *_names(name),
        **_kind(field.type.type),
        default=field.default if is_stated else None,
        show_default=is_stated and not isinstance(field.default, bool),
        metavar=METAVARS.get(name),
        help=as_typed(description + (f" [default: {default}]" if default else "")),
    )


def _names(name: str) -> tuple[str, ...]:
    """Return how the command line calls an option."""
    if name == "define":
        return "-D", name
    long = f"--{name.replace('_', '-')}"
    return (SHORT[name], long) if name in SHORT else (long,)


def _kind(kind: Any) -> dict[str, Any]:
    """Return what click needs to know of an option's type."""
    # The second type of a union is None, which stands for an omitted option.
    match kind.types[0] if isinstance(kind, inspect.UnionType) else kind:
        case inspect.LiteralType(values):
            return {"type": OneOf(sorted(values))}
        case inspect.IntType(ge=low, le=high):
            return {"type": click.IntRange(low, high)}
        case inspect.FloatType(gt=above, ge=low, le=high):
            smallest = low if above is None else above
            return {"type": Within(smallest, high, min_open=above is not None)}
        case inspect.BoolType():
            return {"is_flag": True}
        case inspect.TupleType():
            return {"type": resolution}
        case inspect.DictType():
            return {"type": definition, "multiple": True}
        case inspect.VarTupleType():
            return {"multiple": True}
    return {}


RENDERING = (
    "variant", "heuristic_variant", "seed", "spp", "resolution", "heuristic", "interpolation",
    "tessellation", "vertex_weights", "everything", "pairing", "pixels_per_degree", "allow_empty",
)  # fmt: skip


def options_of_scenes(without: Sequence[str] = (), **defaults: str) -> Decorator:
    """Return the options of a scene, some left out, with a command's own defaults."""
    names = [name for name in (*RENDERING, "define", "sensor") if name not in without]
    return with_options([option(name, defaults.get(name, "")) for name in names])


rendering_options = with_options([option(name) for name in RENDERING])
scene_options = options_of_scenes()
picture_options = with_options([option(name) for name in ("reference", "mask", "transfer", "over")])

timeout_option = click.option(
    "--timeout",
    default=1800,
    show_default=True,
    type=Within(min=0, min_open=True),
    metavar="SECONDS",
    help="End a scene that makes no progress for this long.",
)
workers_option = click.option(
    "--workers",
    show_default="one per core",
    type=click.IntRange(min=0),
    metavar="N",
    help="Processes that render at the same time, each with its share of the cores, and at most one"
    " per scene; 0 renders in the command's own process, as on Windows.",
)
scheduler_option = click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Use the Dask cluster with this scheduler, such as tcp://host:8786.",
)
process_options = with_options([timeout_option, workers_option, scheduler_option])
verbosity_options = with_options([quiet_option, verbose_option])


def share_of(text: str) -> float:
    """Return the share from 0 to 1 of a percentage, with or without its sign; NaN for others."""
    digits, _, rest = text.strip().partition("%")
    try:
        share = float(digits) / 100.0
    except ValueError:
        return math.nan
    return share if not rest and 0.0 <= share <= 1.0 else math.nan


def percentage(text: str) -> float:
    """Parse a percentage of the command line as a share; see :func:`share_of`."""
    share = share_of(text)
    if math.isnan(share):
        raise click.BadParameter(
            f"{text!r} is not a percentage: give one from 0% to 100%, such as 5%."
        )
    return share


within_option = click.option(
    "--within",
    type=float,
    default=2,
    show_default=True,
    metavar="DE",
    help="Pixels differ visibly if ΔE2000 is above this: 1 to 10 in steps of 0.25.",
)
_file = click.Path(path_type=Path, dir_okay=False)
junit_option = click.option("--junit", type=_file, metavar="FILE", help="Write a JUnit XML file.")
summary_option = click.option(
    "--summary",
    type=_file,
    metavar="FILE",
    help="Append a summary in Markdown, such as for a comment on a pull request.",
)
ci_options = with_options([junit_option, summary_option])

open_option = click.option(
    "--open", "is_opened", is_flag=True, help="Open the page in a browser as soon as it exists."
)


def open_page(page: Path) -> None:
    """Open a page in the user's browser."""
    import webbrowser  # takes as long to import as a short command

    if not webbrowser.open(page.resolve().as_uri()):
        click.echo(f"fotismos: no browser was found to open {page}. Open it yourself.", err=True)


def pool(
    timeout: float, tasks: int = 1, workers: int | None = None, scheduler: str | None = None
) -> Pool:
    """Return processes or a cluster in which scenes are read and rendered.

    They are separate, since a scene may run its own code, and native code may crash or hang. There
    are at most as many as ``tasks``, ``workers`` or else cores. ``timeout`` is in seconds without
    any progress; a Dask cluster, by its scheduler's address, has its own limits. With no workers,
    this process does it all.
    """
    if scheduler is None and (workers == 0 or not CAN_SHARE):
        return Pool(0, ProcessSetup(level(), None))
    if scheduler is None:
        workers = min(workers or cores(), max(1, tasks))
        # Dr.Jit takes all cores by default: processes that run together share them.
        threads = max(1, cores() // workers) if workers > 1 else None
        return Pool(workers, ProcessSetup(level(), threads), timeout)
    if workers and workers > 1:
        raise click.UsageError("--workers and --scheduler exclude each other.")
    from fotismos.comparisons.processes import cluster  # loaded late: Dask is an extra

    set_up = ProcessSetup(
        level=level(), threads=None, folder=os.getcwd(), program=shlex.join(program.program())
    )
    return cluster.connected(scheduler, set_up)


def work(command_name: str, processes: Pool, /, **arguments: Any) -> Any:
    """Run the worker of a command: ``run(processes, ...)`` in :mod:`fotismos.reports.work`.

    It is imported here, since the help of a command needs none of it, and beside the processes,
    which take as long to start.
    """
    with processes as pool:
        pool.start()
        worker = import_module(f"fotismos.reports.work.{command_name}")
        return worker.run(pool, **arguments)


@dataclass(frozen=True)
class ProcessSetup:
    """Sets a process up to render, as verbose as this one; a `folder` becomes its own.

    ``threads`` are Dr.Jit's, by default one per core; ``program`` begins printed commands.
    """

    level: int
    threads: int | None = None
    folder: str | None = None
    program: str | None = None

    def __call__(self) -> None:
        """Set this process up."""
        if self.program is not None:
            os.environ[program.VARIABLE] = self.program
        # Scenes and results are named relative to the user's folder.
        if self.folder is not None:
            try:
                os.chdir(self.folder)
            except OSError as error:
                raise InputError(
                    f"{self.folder}: {error.strerror}, on a worker of the cluster. Workers need the"
                    " same folders as this machine."
                ) from error
        llvm.check()
        llvm.use_threads(self.threads)

        # Unless verbose, a message is ignored: the record has the warnings that concern it.
        from fotismos.reference.scene.source import divert_messages

        divert_messages(partial(echo, err=True) if self.level > 0 else lambda _: None)
        if self.level > 0:
            logging.basicConfig(level=logging.INFO)
        import fotismos.comparisons.compare  # noqa: F401  part of start-up

        gc.freeze()  # modules stay: garbage collections need not look at them


@dataclass(frozen=True)
class Job:
    """What a command does with each of its scenes.

    ``options`` say how to render; ``fresh`` renders finished scenes again; pixels differ
    visibly above the ΔE2000 ``within``. The methods of the scenes ``ladders`` are measured, too.
    """

    options: Options
    figures: bool = False
    with_causes: bool = False
    fresh: bool = False
    within: float = 2.0
    ladders: frozenset[str] = frozenset()


def command_line() -> str:
    """Return the command that the user gave, as a shell takes it."""
    return program.command(*sys.argv[1:])


def refuse_reading(given: Mapping[str, Any], option: str) -> None:
    """Refuse options that say how pictures are read: none are given, which ``option`` would do."""
    for name in ("transfer", "over"):
        if given[name] is not None:
            raise InputError(f"--{name}: it says how pictures are read. Give {option}.")


def chosen_options(given: Mapping[str, Any]) -> Options:
    """Return the options of a comparison among those of a command."""
    return Options.of({**given, "define": dict(given.get("define") or ())})
