"""Commands: types whose fields are their options, and whose docstrings are their help.

From such a type derive the options of the command line with help and completion, the keys of the
table ``[tool.fotismos]``, and the signature of the function in Python.
"""

import inspect
import os
import re
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any, ClassVar

import click
from click.core import ParameterSource
from msgspec.inspect import (
    BoolType,
    CustomType,
    DictType,
    Field,
    FloatType,
    IntType,
    LiteralType,
    Metadata,
    StructType,
    TupleType,
    UnionType,
    VarTupleType,
    type_info,
)

from fotismos.comparisons.options import Declaration, Options
from fotismos.heuristic import program
from fotismos.heuristic.errors import InputError, unknown
from fotismos.reports.jobs import Terminal
from fotismos.reports.terminal import parsing
from fotismos.reports.terminal.words import VERBOSITY, as_typed, verbosity_option

RENDERING = (
    "variant", "heuristic_variant", "seed", "spp", "resolution", "heuristic", "interpolation",
    "tessellation", "vertex_weights", "everything", "pairing", "pixels_per_degree", "allow_empty",
)  # fmt: skip
SCENES = (RENDERING, "define", "sensor")
PICTURES = ("reference", "mask", "transfer", "over")
PROCESSES = ("timeout", "workers", "scheduler")

Names = tuple["str | Names", ...]
"""Names of fields, in groups that several commands have."""

USUAL = (
    "resolution", "spp", "noise", "define", "heuristic", "interpolation", "image", "reference",
    "max_visible", "output", "is_opened", "quiet",
)  # fmt: skip
"""The common options that ``--help`` shows after a command's own; ``--help-all`` shows all."""

SETTINGS = (
    *PROCESSES, "variant", "heuristic_variant", "tessellation", "vertex_weights", "pairing",
    "pixels_per_degree", "colour_science", "allow_empty",
)  # fmt: skip
"""Options of a machine or a project, which ``[tool.fotismos]`` and variables set, too."""

PICTURE_OPTIONS = {"image", "tone_map", *PICTURES}

GROUPS = {
    "Settings, also in [tool.fotismos] and as variables such as FOTISMOS_WORKERS": set(SETTINGS),
    "Pictures of other renderers": PICTURE_OPTIONS,
    "What is rendered": set(Options.__struct_fields__),
    "Results": {"output", "as_json", "figures", "fresh", "is_opened", "quiet", "verbose"},
    "Bounds and CI": {"max_visible", "within", "junit", "summary"},
}
"""The groups of options in help, of which the first that has an option counts."""

ORDER = ("Options", *reversed(GROUPS))
"""The order in help: a command's own options come first."""


class Command(Declaration, frozen=True):
    """What a user may ask for. Its docstring is its help, and :meth:`run` does it.

    The command line has an ``argument``, which is the first field, and the ``options``: own fields
    and those of :class:`Options` and :class:`Terminal`. Results go ``below`` the folder
    ``output_folder``. ``own_defaults`` say what the command does where an option of others is
    omitted, and ``table`` which keys of ``[tool.fotismos]`` set which fields, beside SETTINGS.
    """

    argument: ClassVar[str] = ""
    options_shown: ClassVar[Names] = ()
    output_folder: ClassVar[str] = "out"
    below: ClassVar[str] = ""
    own_defaults: ClassVar[Mapping[str, str]] = {}
    table: ClassVar[Mapping[str, str]] = {}

    def run(self, terminal: Terminal) -> int:
        """Do it, and return the exit code."""
        raise NotImplementedError


class WithOptions(Options, Command, frozen=True):
    """A command with the options of a comparison."""

    @property
    def options(self) -> Options:
        """The options alone."""
        return Options(**{name: getattr(self, name) for name in Options.__struct_fields__})

    def refuse_reading(self, needed: str) -> None:
        """Refuse options that say how pictures are read: none are given, which need ``needed``."""
        for name in ("transfer", "over"):
            if getattr(self, name) is not None:
                raise InputError(f"--{name}: it says how pictures are read. Give {needed}.")


class OnScene(WithOptions, frozen=True):
    """A command on a scene: a built-in name, a file, a dictionary, or a function.

    ``name`` replaces the scene's name.
    """

    scene: Any = None
    name: str | None = None


# --- Options of the command line -------------------------------------------------------------


def click_command(kind: type[Command], name: str) -> click.Command:
    """Return the command line's form of a command."""

    @click.pass_context
    def call(context: click.Context, /, **values: Any) -> None:
        context.exit(_asked(kind, context, values))

    command = Configured(
        name=name, callback=call, params=list(_parameters(kind)), help=help_of(kind.__doc__)
    )
    command.declared = kind
    return command


def help_of(docstring: str | None) -> str:
    """Return a docstring as click takes it: it keeps the lines of examples as they are."""
    text = inspect.cleandoc(docstring or "")
    text = re.sub(r"(?m)^Examples\n-+$", "Examples:", text)
    return re.sub(r"(?m)^(?=Examples)", "\b\n", text)


def _asked(kind: type[Command], context: click.Context, values: Mapping[str, Any]) -> int:
    """Make a command from what the user typed, and run it."""
    stated = frozenset(
        name for name in values if context.get_parameter_source(name) is ParameterSource.COMMANDLINE
    )
    own = {}
    common: dict[str, Any] = {"stated": stated}
    others = {}
    for name, value in values.items():
        if name in kind.__struct_fields__:
            own[name] = dict(value) if name in ("define", "parameters") else value
        elif name in Terminal.__struct_fields__:
            common[name] = value
        elif name in stated:
            others[name] = dict(value) if name == "define" else value
    if others:
        own["changes"] = others
    return kind.of(own).run(Terminal.of(common))


def _fields(kind: type) -> dict[str, Field]:
    """Return the fields of a declaration by name."""
    known = type_info(kind)
    assert isinstance(known, StructType)
    return {field.name: field for field in known.fields}


def _parameters(kind: type[Command]) -> Iterator[click.Parameter]:
    """Yield the argument and the options of a command."""
    fields = _fields(Options) | _fields(Terminal) | _fields(kind)
    if kind.argument:
        yield _argument(fields[kind.__struct_fields__[0]], kind.argument)
    for name in _flat(kind.options_shown):
        if name in VERBOSITY:
            yield verbosity_option(name)
        else:
            yield _option(fields[name], kind)


def _flat(names: Names) -> Iterator[str]:
    for name in names:
        if isinstance(name, str):
            yield name
        else:
            yield from _flat(name)


def _argument(field: Field, metavar: str) -> click.Argument:
    is_scene = field.name == "scene"
    is_one = not metavar.strip("[]").endswith("...")
    return click.Argument(
        [field.name if is_one else f"{field.name}s"],
        metavar=metavar,
        nargs=1 if is_one else -1,
        required=not metavar.startswith("["),
        shell_complete=parsing.complete_scene if is_scene else None,
        **({} if is_scene else _kind(field.type)),
    )


def _option(field: Field, kind: type[Command]) -> click.Option:
    """Return the command line's form of a field."""
    assert isinstance(field.type, Metadata), "each field has its help"
    text = (field.type.extra_json_schema or {})["description"]
    more = field.type.extra or {}
    value = field.default
    if field.name == "output":
        text += f", which go to OUTPUT/{kind.below}." if kind.below else "."
        value = kind.output_folder
    default = kind.own_defaults.get(field.name) or more.get("default")
    is_stated = default is None and isinstance(value, (int, float, str))
    word = field.name.replace("_", "-")
    names = more.get("names", (f"--{word}/--no-{word}" if value is True else f"--{word}",))
    is_shown = is_stated and not isinstance(value, bool)
    return click.Option(
        [*names, field.name],
        envvar=variable(field.name) if field.name in SETTINGS else None,
        **_kind(field.type.type) | ({"type": more["type"]} if "type" in more else {}),
        default=value if is_stated else None,
        show_default=more.get("shown_default", is_shown),
        metavar=more.get("metavar"),
        help=as_typed(text + (f" [default: {default}]" if default else "")),
    )


def variable(name: str) -> str:
    """Return the environment's variable that sets a field."""
    return f"FOTISMOS_{name.upper()}"


PATH = click.Path(path_type=Path)


def _kind(kind: Any) -> dict[str, Any]:
    """Return what click needs to know of a type."""
    # The second type of a union is None, which stands for an omitted option.
    match kind.types[0] if isinstance(kind, UnionType) else kind:
        case Metadata(inner):
            return _kind(inner)
        case LiteralType(values):
            return {"type": parsing.OneOf(sorted(values))}
        case IntType(ge=low, le=high) if low is not None:
            return {"type": click.IntRange(low, high)}
        case FloatType(gt=above, ge=low, lt=below, le=high):
            smallest = low if above is None else above
            largest = high if below is None else below
            if smallest is None:
                return {"type": float}
            return {
                "type": parsing.Within(
                    smallest, largest, min_open=above is not None, max_open=below is not None
                )
            }
        case BoolType():
            return {"is_flag": True}
        case TupleType():
            return {"type": parsing.resolution}
        case DictType():
            return {"type": parsing.definition, "multiple": True}
        case VarTupleType():
            return {"multiple": True}
        case CustomType():
            return {"type": PATH}
    return {}


# --- Help ------------------------------------------------------------------------------------


class Helped(click.Command):
    """A command whose help groups its options, and begins examples as the user began."""

    def format_options(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, one group after the other."""
        rows: dict[str, list[tuple[str, str]]] = {}
        for parameter in self.get_params(context):
            record = parameter.get_help_record(context)
            if record and isinstance(parameter, click.Option):
                groups = (group for group, names in GROUPS.items() if parameter.name in names)
                rows.setdefault(next(groups, "Options"), []).append(record)
        for group in ORDER:
            if group in rows:
                with formatter.section(group):
                    formatter.write_dl(rows[group])

    def get_help(self, context: click.Context) -> str:
        """Return the help, with commands as the user types them."""
        text = super().get_help(context)
        return re.sub(r"(?m)(^ +|[`(])fotismos (?=\w)", rf"\1{program.command()} ", text)


WHOLE_HELP = "fotismos.whole_help"
"""Key of click's context: whether the help has all options."""

EXAMPLES_SHOWN = 6
"""Examples in the short help."""


def _show_all(context: click.Context, parameter: click.Parameter, is_set: bool) -> None:
    if is_set and not context.resilient_parsing:
        context.meta[WHOLE_HELP] = True
        click.echo(context.get_help())
        context.exit()


class ShortlyHelped(Helped):
    """A command whose ``--help`` fits a screen, and whose ``--help-all`` says everything."""

    declared: type[Command]

    def get_params(self, context: click.Context) -> list[click.Parameter]:
        """Return the parameters, with the option for the whole help."""
        whole = click.Option(
            ["--help-all"],
            is_flag=True,
            is_eager=True,
            expose_value=False,
            callback=_show_all,
            help="Show all options, and what is written.",
        )
        return [*super().get_params(context), whole]

    def format_options(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the usual options as one list, or all of them in groups."""
        if WHOLE_HELP in context.meta:
            super().format_options(context, formatter)
            return
        options = [
            option for option in self.get_params(context) if isinstance(option, click.Option)
        ]
        common = {*Options.__struct_fields__, *Terminal.__struct_fields__}
        own = [option for option in options if option.expose_value and option.name not in common]
        by_name = {option.name: option for option in options}
        usual = [by_name[name] for name in USUAL if name in by_name]
        # Click's own option and that of the whole help set nothing.
        helps = [
            option for option in options if not (option.expose_value or option.name in VERBOSITY)
        ]
        records = [option.get_help_record(context) for option in (*own, *usual, *helps)]
        with formatter.section("Options"):
            formatter.write_dl([record for record in records if record])

    def format_help_text(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the summary and examples, or the whole text."""
        whole = self.help or ""
        text, mark, examples = whole.partition("\b\nExamples")
        if WHOLE_HELP not in context.meta and mark:
            summary = text.partition("\n\n")[0]
            lines = "\n".join(examples.rstrip().split("\n")[: 1 + EXAMPLES_SHOWN])
            self.help = f"{summary}\n\n{mark}{lines}"
        super().format_help_text(context, formatter)
        self.help = whole


# --- The table [tool.fotismos] ---------------------------------------------------------------

FILE = "pyproject.toml"
TABLE = "[tool.fotismos]"


class Configured(ShortlyHelped):
    """A command whose defaults the table and the environment may set."""

    def make_context(
        self,
        info_name: str | None,
        args: list[str],
        parent: click.Context | None = None,
        **extra: Any,
    ) -> click.Context:
        """Read the table, then the command line."""
        is_help = bool({"-h", "--help", "--help-all"} & set(args))
        found = None if is_help or extra.get("resilient_parsing") else _table(Path.cwd())
        path = None
        if found is not None:
            path, table = found
            extra["default_map"] = _defaults(self.declared, path, table)
        try:
            return super().make_context(info_name, args, parent, **extra)
        except click.BadParameter as error:
            name = (error.param and error.param.name) or ""
            source = error.ctx and error.ctx.get_parameter_source(name)
            if source is ParameterSource.DEFAULT_MAP:
                raise InputError(f"{path}: {TABLE} {name}: {error.message}") from error
            if source is ParameterSource.ENVIRONMENT:
                raise InputError(f"{variable(name)}: {error.message}") from error
            raise


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


def _defaults(kind: type[Command], path: Path, table: dict[str, Any]) -> dict[str, str]:
    """Return the values of the table by the fields that they set, as the user would type them."""
    fields = _fields(Options) | _fields(Terminal) | _fields(kind)
    shown = set(_flat(kind.options_shown))
    keys = {name: name for name in SETTINGS if name in shown} | dict(kind.table)
    values = {}
    for key, value in table.items():
        if key not in keys:
            # A command without keys of its own leaves the others to the command that has them.
            if kind.table and key not in SETTINGS:
                raise unknown(f"{path}: {TABLE} key", key, {*kind.table, *SETTINGS})
            continue
        name = keys[key]
        is_folder = _kind(fields[name].type).get("type") == PATH
        if not isinstance(value, str if is_folder else (str, int, float)):
            allowed = "a folder" if is_folder else "a number or a text"
            raise InputError(f"{path}: {TABLE} {key} = {value!r} is not {allowed}. Correct it.")
        text = str(value)
        # Printed paths and commands are then as short as the user's own.
        values[name] = os.path.relpath(path.parent / text) if is_folder else text
    return values
