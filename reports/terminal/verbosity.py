"""How much a command says: results on standard output, everything else on standard error."""

import os
import re
import unicodedata
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any

import click

LEVEL = "fotismos.verbosity"
"""Key of the level in click's context: -1 quiet, 0 normal, 1 verbose."""


def _remember(context: click.Context, parameter: click.Parameter, is_set: bool) -> None:
    if is_set:
        context.meta[LEVEL] = -1 if parameter.name == "quiet" else 1


def _option(letter: str, name: str, help: str) -> Callable[[Any], Any]:
    return click.option(
        letter, name, is_flag=True, expose_value=False, callback=_remember, help=help
    )


quiet_option = _option("-q", "--quiet", "Print only where the results are, no progress or tables.")
verbose_option = _option(
    "-v",
    "--verbose",
    "Also print the simulation, the pairing of lights, warnings, and times.",
)


def level() -> int:
    """Return -1 for a quiet command, 1 for a verbose one, else 0."""
    context = click.get_current_context(silent=True)
    return context.meta.get(LEVEL, 0) if context else 0


def is_quiet() -> bool:
    """Return whether the command is quiet."""
    return level() < 0


def visible(text: str) -> str:
    """Return a line that no terminal or CI service takes for a command.

    Control characters, which names from a scene may have, are shown as escapes. GitHub reads lines
    that begin with ``::``, Azure and TeamCity ``##name[``.
    """
    shown = "".join(
        c if c.isprintable() or unicodedata.category(c) == "Zs" else ascii(c)[1:-1] for c in text
    )
    return re.sub(r"##(?=\w*\[)", "# #", re.sub(r"^(\s*)::", r"\1\\::", shown))


def echo(text: str, err: bool = False) -> None:
    """Print text, each line as :func:`visible` returns it."""
    click.echo("\n".join(map(visible, text.split("\n"))), err=err)


def tell(lines: Iterable[str]) -> None:
    """Print lines of a result, unless the command is quiet."""
    if not is_quiet():
        for line in lines:
            click.echo(visible(line))


def tell_where(path: Path) -> None:
    """Print where the results are; a quiet command prints nothing else."""
    name = os.fsencode(path)  # unchanged, even if it is not in UTF-8
    click.echo(name if is_quiet() else b"\n" + name)


def remark(lines: Iterable[str]) -> None:
    """Print lines on standard error, if the command is verbose."""
    if level() > 0:
        for line in lines:
            click.echo(visible(line), err=True)
