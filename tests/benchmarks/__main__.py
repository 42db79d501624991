"""Run the named benchmarks, or all of them."""

import sys
from importlib import import_module
from pathlib import Path

import click

from fotismos.heuristic.errors import FotismosError

# Each module here is a benchmark, with `run(rounds)`.
BENCHMARKS = [
    module.stem for module in Path(__file__).parent.glob("*.py") if not module.stem.startswith("__")
]


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(sorted(BENCHMARKS)))
@click.option(
    "--rounds", default=30, show_default=True, type=click.IntRange(2), help="Repetitions."
)
def main(names, rounds):
    """Measure, and print tables."""
    for name in names or sorted(BENCHMARKS):
        import_module(f"tests.benchmarks.{name}").run(rounds)


if __name__ == "__main__":
    try:
        main()
    except FotismosError as error:
        click.echo(str(error), err=True)
        sys.exit(error.exit_code)
