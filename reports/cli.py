"""The command line.

Exit codes: 0 done; 1 a check failed; 2 bad input or installation; 130, 143 and 129 after Ctrl-C,
SIGTERM and SIGHUP. A user's mistake gets one message on standard error, never a traceback.
"""

import os
import shlex
import signal
import sys
from collections.abc import Iterator, Mapping
from importlib import import_module
from pkgutil import iter_modules
from typing import Any

import click

import reports.commands
from comparisons.processes import interruption
from heuristic import llvm
from heuristic.errors import FotismosError, InputError, suggestion
from heuristic.program import program
from heuristic.version import __version__
from reports.commands.completion import VARIABLE
from reports.terminal import verbosity


class Commands(Mapping[str, click.Command]):
    """The commands by their names: one per module of `reports.commands`, imported on demand."""

    def __getitem__(self, name: str) -> click.Command:
        if name not in set(self):
            raise KeyError(name)
        return getattr(import_module(f"reports.commands.{name}"), name)

    def __iter__(self) -> Iterator[str]:
        return (module.name for module in iter_modules(reports.commands.__path__))

    def __len__(self) -> int:
        return sum(1 for _ in self)


class Group(click.Group):
    """A group that suggests a command for a mistyped one."""

    def resolve_command(self, context: click.Context, words: list[str]) -> Any:
        """Find the command that the first word names."""
        word = words[0]
        if self.get_command(context, word) is None and not word.startswith("-"):
            near = suggestion(word, self.commands)
            context.fail(
                f"{word!r} is not a command{near}: choose one of {', '.join(self.commands)}."
            )
        return super().resolve_command(context, words)


@click.group(
    cls=Group,
    commands=Commands(),
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
)
@click.version_option(__version__, prog_name="fotismos")
def cli() -> None:
    """Textbook shading against physically based rendering, scene by scene.

    \b
    Examples:
      fotismos compare fig-8-9              how far, where, and is it more than noise?
      fotismos compare my_scene.xml         the same for your own Mitsuba scene
      fotismos plan cornell-box             which effects does it call for?
      fotismos cost cornell-box             what does accuracy cost in time?
      fotismos fit fig-8-9                  the model's fault, or its parameters'?
      fotismos report                       all built-in scenes in one page

    Colours and bars appear only on terminals; NO_COLOR=1 switches colours off.
    """  # noqa: D301 click reads the \b as: keep these lines
    llvm.require_libraries()
    _require_environment()


def _require_environment() -> None:
    """Reject surroundings that break a command after its work is done."""
    try:
        os.getcwd()
    except OSError as error:
        raise InputError(f"the current folder: {error.strerror}. Enter one that exists.") from error
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "0")
    if not epoch.isdecimal():  # Matplotlib dates pictures by it
        raise InputError(
            f"SOURCE_DATE_EPOCH={epoch!r} is not a number of seconds. Unset the variable, or set"
            " it to one."
        )


def main() -> None:
    """Run the command line, and exit with its code."""
    try:
        code = cli(
            prog_name=shlex.join(program()),
            complete_var=VARIABLE,
            standalone_mode=False,
        )
    except (click.exceptions.Abort, KeyboardInterrupt) as error:
        click.echo(
            "fotismos: interrupted; finished scenes are kept, and the same command resumes.",
            err=True,
        )
        sys.exit(interruption.code_of(error.__cause__ or error))
    except click.ClickException as error:
        error.show()
        sys.exit(2)
    except FotismosError as error:
        verbosity.echo(f"fotismos: error: {error}", err=True)
        sys.exit(error.exit_code)
    except BrokenPipeError:  # the reader of the output closed it
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        sys.exit(128 + signal.SIGPIPE)
    except OSError as error:  # standard output on a full disk, above all
        place = error.filename or "output"
        verbosity.echo(f"fotismos: error: {place}: {error.strerror}.", err=True)
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        sys.exit(2)
    else:
        if code:  # None if the command set none
            sys.exit(code)
