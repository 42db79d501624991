"""``fotismos completion``: a script for shells, to complete commands, options and scenes."""

import click
from click.shell_completion import get_completion_class

VARIABLE = "_FOTISMOS_COMPLETE"
"""Environment variable with which a shell requests completions."""

SHELLS = ("bash", "zsh", "fish")


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion(context: click.Context, shell: str) -> None:
    """Print a script with which a shell completes commands, options and scenes.

    \b
    Examples, for this session or a shell's start file:
      source <(fotismos completion bash)
      source <(fotismos completion zsh)
      fotismos completion fish | source
    In bash, for the run script of a copy of the project, from its folder:
      source <(./run completion bash); complete -o nosort -F _fotismos_completion ./run
    """  # noqa: D301 click reads the \b as: keep these lines
    made = get_completion_class(shell)
    assert made is not None, "click knows these shells"
    program = made(context.find_root().command, {}, "fotismos", VARIABLE)
    # Not .source(), which starts a bash to look at its version.
    click.echo(program.source_template % program.source_vars())
