"""Run the named benchmarks, or all of them."""

import json
import sys
from importlib import import_module
from pathlib import Path

import click

from heuristic.errors import FotismosError

# Each module here is a benchmark, with `run(rounds)`.
BENCHMARKS = [
    module.stem for module in Path(__file__).parent.glob("*.py") if not module.stem.startswith("__")
]


@click.command()
@click.argument("names", nargs=-1, type=click.Choice(sorted(BENCHMARKS)))
@click.option(
    "--rounds", default=30, show_default=True, type=click.IntRange(2), help="Repetitions."
)
@click.option("--json", "file", type=click.Path(dir_okay=False, path_type=Path), help="Write here.")
def main(names, rounds, file):
    """Measure, print tables, and write the numbers as JSON where asked to."""
    results = {
        name: import_module(f"tests.benchmarks.{name}").run(rounds)
        for name in names or sorted(BENCHMARKS)
    }
    if file:
        file.write_text(json.dumps(results, indent=2) + "\n", encoding="utf-8")


if __name__ == "__main__":
    try:
        main()
    except FotismosError as error:
        click.echo(str(error), err=True)
        sys.exit(error.exit_code)
