"""``fotismos completion``: what makes a shell complete commands, options and scenes."""

import click
from click.shell_completion import get_completion_class

VARIABLE = "_FOTISMOS_COMPLETE"
"""Environment variable by which a shell asks the program for words."""

SHELLS = ("bash", "zsh", "fish")


@click.command()
@click.argument("shell", type=click.Choice(SHELLS))
@click.pass_context
def completion(context, shell):
    """Print what makes a shell complete commands, options and names of scenes.

    \b
    Examples, for this session or a shell's start file:
      source <(fotismos completion bash)
      source <(fotismos completion zsh)
      fotismos completion fish | source
    In bash, for the run script of a copy of the project, from its folder:
      source <(./run completion bash); complete -o nosort -F _fotismos_completion ./run
    """  # noqa: D301 click reads the \b as: keep these lines
    program = get_completion_class(shell)(context.find_root().command, {}, "fotismos", VARIABLE)
    # Not .source(), which starts a bash to look at its version.
    click.echo(program.source_template % program.source_vars())
