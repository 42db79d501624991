"""``fotismos doctor``: check the installation."""

import click

from reports import jobs


@click.command()
def doctor():
    """Check the installation: versions, LLVM, and a test rendering in each variant."""
    from reports.doctor import examine

    for line in examine(jobs.VARIANTS):
        click.echo(line)
