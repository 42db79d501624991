"""The command line.

Exit codes: 0 done; 1 a check failed; 2 bad input or installation; 130, 143 and 129 after Ctrl-C,
SIGTERM and SIGHUP. A user's mistake gets one message on standard error, never a traceback.
"""

import os
import shlex
import signal
import sys
from importlib import import_module
from itertools import chain
from typing import Any, ClassVar, Literal

import click
from click.shell_completion import get_completion_class

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.processes import interruption
from fotismos.heuristic import llvm
from fotismos.heuristic.errors import FotismosError, InstallationError, suggestion
from fotismos.heuristic.program import __version__, program
from fotismos.reports.command import Command, Helped, click_command, help_of
from fotismos.reports.jobs import Terminal
from fotismos.reports.terminal.words import echo

COMMANDS = {
    "One scene": ("compare", "plan", "cost", "fit"),
    "Many scenes": ("report", "study"),
    "Baselines, shaders, other renderers": ("check", "audit", "export"),
    "This installation": ("doctor", "scenes", "completion"),
}
"""The commands by groups of the help; most are a module of `fotismos.reports.commands`."""

COMPLETION = "_FOTISMOS_COMPLETE"
"""Environment variable with which a shell requests completions."""


class Scenes(Command, frozen=True):
    """List the built-in scenes, each with a sentence.

    Examples
    --------
      fotismos scenes
      fotismos scenes | grep sphere
    """

    def run(self, terminal: Terminal) -> int:
        """Print the scenes."""
        width = max(map(len, SCENES))
        for scene in SCENES.values():
            click.echo(f"{scene.name:<{width}}  {scene.title}")
        return 0


class Completion(Command, frozen=True):
    """Print a script with which a shell completes commands, options and scenes.

    Examples, for this session or a shell's start file:
      source <(fotismos completion bash)
      fotismos completion fish | source
    In bash, for the run script of a copy of the project, from its folder:
      source <(./run completion bash); complete -o nosort -F _fotismos_completion ./run
    """

    argument = "{bash|zsh|fish}"
    shell: Literal["bash", "zsh", "fish"]

    def run(self, terminal: Terminal) -> int:
        """Print the script."""
        completer = get_completion_class(self.shell)
        assert completer is not None, "click knows these shells"
        script = completer(cli, {}, "fotismos", COMPLETION)
        # Not .source(), which starts a bash to look at its version.
        click.echo(script.source_template % script.source_vars())
        return 0


class Group(Helped, click.Group):
    """The commands in groups; a module is imported when its command is looked up."""

    own: ClassVar[dict[str, type[Command]]] = {"scenes": Scenes, "completion": Completion}

    def list_commands(self, context: click.Context) -> list[str]:
        """Return the names in the order of the groups."""
        return list(chain.from_iterable(COMMANDS.values()))

    def get_command(self, context: click.Context, name: str) -> click.Command | None:
        """Return a command by its name."""
        # Only a name in COMMANDS may reach the import: other words come from the user.
        if name not in self.list_commands(context) or name in self.commands:
            return self.commands.get(name)
        kind = self.own.get(name)
        if kind is None:
            module = import_module(f"fotismos.reports.commands.{name}")
            kind = getattr(module, name.capitalize())
        self.commands[name] = click_command(kind, name)
        return self.commands[name]

    def format_options(self, context: click.Context, formatter: click.HelpFormatter) -> None:
        """Write the options, and the commands with their whole summaries."""
        super().format_options(context, formatter)
        for group, names in COMMANDS.items():
            with formatter.section(group):
                rows = ((name, self.get_command(context, name)) for name in names)
                formatter.write_dl(
                    [(n, command.get_short_help_str(1000)) for n, command in rows if command]
                )

    def resolve_command(self, context: click.Context, arguments: list[str]) -> Any:
        """Find the command that the first word names."""
        word = arguments[0]
        if self.get_command(context, word) is None and not word.startswith("-"):
            names = self.list_commands(context)
            near = suggestion(word, names)
            context.fail(f"{word!r} is not a command{near}: choose one of {', '.join(names)}.")
        return super().resolve_command(context, arguments)


def _start() -> None:
    """Textbook shading against physically based rendering, scene by scene.

    Examples
    --------
      fotismos compare fig-8-9              how far, where, and is it more than noise?
      fotismos compare my_scene.xml         the same for your own Mitsuba scene
      fotismos plan cornell-box             which effects does it need?
      fotismos cost cornell-box             what does accuracy cost in time?
      fotismos fit fig-8-9                  the model's fault, or its parameters'?
      fotismos report                       all built-in scenes in one page

    Colours and bars appear only on terminals; NO_COLOR=1 switches colours off.
    """
    llvm.require_libraries()
    if sys.flags.optimize > 1:
        raise InstallationError(
            f"Python is at level {sys.flags.optimize} of optimisation, without the docstrings that"
            " Altair needs for charts. Unset PYTHONOPTIMIZE and omit -OO; level 1 is allowed."
        )


cli = Group(
    callback=_start,
    help=help_of(_start.__doc__),
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
click.version_option(__version__, prog_name="fotismos")(cli)


def main() -> None:
    """Run the command line, and exit with its code."""
    standard_output = sys.stdout
    try:
        code = cli(prog_name=shlex.join(program()), complete_var=COMPLETION, standalone_mode=False)
    except (click.exceptions.Abort, KeyboardInterrupt) as error:
        click.echo(
            "fotismos: interrupted; finished scenes are kept, and the same command resumes.",
            err=True,
        )
        # click turns an interruption into Abort, whose cause knows the signal.
        sys.exit(interruption.code_of(error.__cause__ or error))
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except FotismosError as error:
        echo(f"fotismos: error: {error}", err=True)
        sys.exit(error.exit_code)
    except SystemExit:
        # If the reader of the output closed it, click replaces standard output and exits with 1.
        if sys.stdout is not standard_output:
            sys.exit(128 + signal.SIGPIPE)
        raise
    except OSError as error:  # standard output on a full disk, above all
        where = error.filename or "output"
        echo(f"fotismos: error: {where}: {error.strerror}.", err=True)
        # Python flushes standard output at exit, which would fail again.
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        sys.exit(2)
    else:
        if code:  # None if the command set none
            sys.exit(code)
