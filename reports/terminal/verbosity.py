"""How much a command says: results on standard output, everything else on standard error."""

import os

import click

LEVEL = "fotismos.verbosity"
"""Key of the number in click's context: -1 quiet, 0 as usual, 1 verbose."""


def _remember(context, parameter, given):
    if given:
        context.meta[LEVEL] = -1 if parameter.name == "quiet" else 1


def _option(letter, name, help):
    return click.option(
        letter, name, is_flag=True, expose_value=False, callback=_remember, help=help
    )


quiet_option = _option("-q", "--quiet", "No progress and no tables: only where the results are.")
verbose_option = _option(
    "-v",
    "--verbose",
    "Say more: what is simulated, how lights are paired, what is missed, where time goes.",
)


def level():
    """Return -1 for a quiet command, 1 for a verbose one, else 0."""
    context = click.get_current_context(silent=True)
    return context.meta.get(LEVEL, 0) if context else 0


def is_quiet():
    """Tell whether the command was asked to be quiet."""
    return level() < 0


def tell(lines):
    """Print lines of a result, unless the command is quiet."""
    if not is_quiet():
        for line in lines:
            click.echo(line)


def tell_where(path):
    """Print where the results are; of a quiet command it is all that is printed."""
    name = os.fsencode(path)  # as it is, also where it is not in UTF-8
    click.echo(name if is_quiet() else b"\n" + name)


def remark(lines):
    """Print lines on standard error, if the command is verbose."""
    if level() > 0:
        for line in lines:
            click.echo(line, err=True)
