"""Run benchmarks by name, all of them where none is given."""

import json
import sys
from pathlib import Path

import click

from heuristic.errors import FotismosError
from tests.benchmarks import (
    batch,
    cost,
    growth,
    guard,
    kernel,
    lights,
    marks,
    samplers,
    scaling,
    stability,
    study,
    terms,
    variance,
)

BENCHMARKS = {
    "batch": batch.run,
    "cost": cost.run,
    "growth": growth.run,
    "guard": guard.run,
    "kernel": kernel.run,
    "lights": lights.run,
    "marks": marks.run,
    "samplers": samplers.run,
    "scaling": scaling.run,
    "stability": stability.run,
    "study": study.run,
    "terms": terms.run,
    "variance": variance.run,
}


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(sorted(BENCHMARKS)))
@click.option(
    "--rounds", default=30, show_default=True, type=click.IntRange(2), help="Repetitions."
)
@click.option("--json", "file", type=click.Path(dir_okay=False, path_type=Path), help="Write here.")
def main(names, rounds, file):
    """Measure, print tables, and write the numbers as JSON where asked to."""
    results = {name: BENCHMARKS[name](rounds) for name in names or sorted(BENCHMARKS)}
    if file:
        file.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    try:
        main()
    except FotismosError as error:
        click.echo(str(error), err=True)
        sys.exit(error.exit_code)
