"""``fotismos doctor``: what the installation consists of, and whether it renders."""

import platform
from importlib import metadata

import click

from comparisons.processes.worker import Task
from heuristic import backend
from heuristic.errors import InstallationError
from heuristic.version import __version__
from reports import jobs

LIBRARIES = ("mitsuba", "drjit", "numpy", "scipy", "colour-science", "OpenEXR")

TIMEOUT_S = 300
"""Seconds for a test rendering, which takes some ten where nothing is compiled yet."""


@click.command()
def doctor():
    """Check the installation: versions, LLVM, a rendering in each variant, colour differences.

    \b
    Examples:
      fotismos doctor
    """  # noqa: D301 click reads the \b as: keep these lines
    for line in examine(backend.VARIANTS):
        click.echo(line)


def examine(variants):
    """Yield lines on versions, LLVM and a test rendering for each variant.

    Raises
    ------
    InstallationError
        When Dr.Jit found no LLVM that it can work with.
    LostProcessError
        When rendering ends the process that does it.
    """
    yield f"fotismos        {__version__}"
    yield f"python          {platform.python_version()} on {platform.platform()}"
    for library in LIBRARIES:
        yield f"{library:<15} {metadata.version(library)}"
    info = backend.check()
    version = ".".join(map(str, info.version))
    yield f"LLVM            {version}, from {info.source}: {info.path or 'path unknown'}"
    if info.note:
        yield f"                {info.note}"
    with jobs.pool(TIMEOUT_S) as pool:
        for variant in variants:
            yield f"{variant:<15} {pool.do(Task(variant, rendered, (variant,)))}"
        apart = pool.do(Task("colour differences", compared, ()))
        yield f"metrics         at most {apart:.0e} from those of colour-science"


def rendered(variant):
    """Render a small figure in a variant, and say how that went."""
    from reference.scene.graph import set_variant

    set_variant(variant)
    from comparisons.compare import Options, compare
    from comparisons.gallery.builtin import builtin

    compare(builtin("fig-8-9").source(), Options(spp=2, resolution=(16, 16)))
    return "renders"


def compared():
    """Return how far colour differences are from those of colour-science.

    Raises
    ------
    InstallationError
        When they are too far.
    """
    from comparisons.departure import definitions

    apart = definitions.farthest()
    if not apart <= definitions.AGREEMENT:
        raise InstallationError(
            f"colour differences are {apart:.1e} from those of colour-science, and"
            f" {definitions.AGREEMENT:g} is allowed. Install the pinned versions: `./run` does."
        )
    return apart
