"""``fotismos audit``: properties of a heuristic or a BSDF, before any scene."""

from pathlib import Path

import click

from fotismos.reports import jobs


def _parameter(text: str) -> tuple[str, float | bool | str]:
    """Parse ``NAME=VALUE``: a number, ``true`` or ``false``, or else a word."""
    name, separator, value = text.partition("=")
    if not (separator and name and value):
        raise click.BadParameter(f"{text!r} is not a parameter; write it like alpha=0.1.")
    try:
        return name, float(value)
    except ValueError:
        return name, {"true": True, "false": False}.get(value, value)


@jobs.command()
@click.option("--heuristic", metavar="NAME|FILE.py[:FUNCTION]",
              help="What `compare --heuristic` takes.")  # fmt: skip
@click.option("--bsdf", metavar="TYPE|FILE.py:NAME",
              help="A BSDF plugin of Mitsuba, or one that a file registers.")  # fmt: skip
@click.option("-p", "parameters", type=_parameter, multiple=True, metavar="NAME=VALUE",
              help="A parameter of the model or the BSDF; may be repeated.")  # fmt: skip
@jobs.output_option("out", "audit/NAME")
@jobs.timeout_option
@jobs.verbosity_options
@jobs.json_option
def audit(
    heuristic: str | None,
    bsdf: str | None,
    parameters: tuple[tuple[str, float | bool | str], ...],
    output: Path,
    timeout: float,
    as_json: bool,
) -> None:
    """Check a shading model or a BSDF: energy, reciprocity, continuity, gradients.

    Evaluates it on white materials for all directions, and prints a table of checks with the worst
    case of each. Writes a page (index.html), audit.json with all numbers, and audit.svg, the lobes,
    to OUTPUT/audit/NAME.
    Textbook shading fails most of the checks: the exit code is 1 only if a value is NaN, infinite
    or negative.

    \b
    Examples:
      fotismos audit --heuristic blinn
      fotismos audit --heuristic my_shader.py:toon
      fotismos audit --bsdf roughdielectric -p alpha=0.1
      fotismos audit --bsdf my_bsdf.py:my_name
    """  # noqa: D301 click reads the \b as: keep these lines
    name = heuristic or bsdf
    if not name or (heuristic and bsdf):
        raise click.UsageError("give one of --heuristic and --bsdf.")
    kind = "heuristic" if heuristic else "bsdf"
    has_faults = jobs.work(
        "audit",
        jobs.pool(timeout),
        kind=kind,
        name=name,
        parameters=dict(parameters),
        output=output,
        as_json=as_json,
    )
    if has_faults:
        click.get_current_context().exit(1)
