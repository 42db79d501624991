"""``fotismos doctor``: check the installation."""

import click

from reports.asked import jobs


@click.command()
def doctor():
    """Check the installation: versions, LLVM, and a test rendering in each variant.

    \b
    Examples:
      fotismos doctor
    """  # noqa: D301 click reads the \b as: keep these lines
    from reports.doctor import examine

    for line in examine(jobs.VARIANTS):
        click.echo(line)
