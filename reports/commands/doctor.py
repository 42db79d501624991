"""``fotismos doctor``: what the installation consists of, and whether it renders."""

import platform
from importlib import metadata

import click

from comparisons.processes.worker import Task
from heuristic import backend
from heuristic.errors import InstallationError
from heuristic.version import __version__
from reports import jobs

LIBRARIES = ("mitsuba", "drjit", "numpy", "scipy", "colour-science", "flip-evaluator", "OpenEXR")

TIMEOUT_S = 300
"""Seconds for a test rendering, which takes some ten where nothing is compiled yet."""


@click.command()
def doctor():
    """Check the installation: versions, LLVM, OpenGL, a rendering in each variant, metrics.

    \b
    Examples:
      fotismos doctor
    """  # noqa: D301 click reads the \b as: keep these lines
    for line in examine(backend.VARIANTS):
        click.echo(line)


def examine(variants):
    """Yield lines on versions, LLVM, a test rendering for each variant, OpenGL and metrics.

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
        yield f"GLSL            {pool.do(Task('GLSL', shaded, ()))}"
        yield f"three.js        {pool.do(Task('three.js', drawn, ()))}"
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


def shaded():
    """Compile and run a small shader, and say where; or what is to be installed, which may wait."""
    from heuristic.glsl import gpu, shader_files

    try:
        device = gpu.device()
    except InstallationError as error:
        return f"cannot be run, which is needed for --heuristic FILE.glsl alone: {error}"
    shader_files.tried("doctor.glsl", "vec3 shade(Point point) { return vec3(0.5); }")
    return f"runs on {device.renderer}{', a software GPU' if device.is_software else ''}"


def drawn():
    """Draw nothing with three.js, and say by which version; or what is to be installed."""
    from heuristic.three_js import browser

    identity = [[float(row == column) for column in range(4)] for row in range(4)]
    empty = {"meshes": [], "lights": [], "view": identity, "projection": identity}
    try:
        browser.draw(empty | {"width": 2, "height": 2})
    except InstallationError as error:
        return f"cannot be run, which is needed for --heuristic three:phong alone: {error}"
    return f"draws, version {browser.version()}"


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
