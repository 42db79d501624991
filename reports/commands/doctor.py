"""``fotismos doctor``: versions of the installation, and whether it renders."""

import platform
from collections.abc import Iterable, Iterator

import click

from comparisons.processes.worker import Task
from heuristic import backend
from heuristic.errors import InstallationError
from heuristic.version import __version__
from reports import jobs
from reports.terminal.version_lines import version_lines

TIMEOUT_S = 300
"""Seconds for a test rendering, which takes about ten if no kernel is compiled yet."""


@click.command()
def doctor() -> None:
    """Check the installation: versions, LLVM, OpenGL, a rendering in each variant, metrics.

    \b
    Examples:
      fotismos doctor
    """  # noqa: D301 click reads the \b as: keep these lines
    for line in examine(backend.VARIANTS):
        click.echo(line)


def examine(variants: Iterable[str]) -> Iterator[str]:
    """Yield lines on versions, LLVM, a test rendering for each variant, meshes, OpenGL and metrics.

    Raises
    ------
    InstallationError
        If Dr.Jit finds no usable LLVM.
    LostProcessError
        If rendering ends its process.
    """
    yield f"fotismos        {__version__}"
    yield f"python          {platform.python_version()} on {platform.platform()}"
    yield from version_lines()
    info = backend.check()
    version = ".".join(map(str, info.version or ()))
    yield f"LLVM            {version}, from {info.source}: {info.path or 'path unknown'}"
    if info.note:
        yield f"                {info.note}"
    with jobs.pool(TIMEOUT_S) as pool:
        for variant in variants:
            yield f"{variant:<15} {pool.do(Task(variant, rendered, (variant,)))}"
        yield f"meshes          {pool.do(Task('meshes', meshed, (backend.VARIANTS[0],)))}"
        yield f"GLSL            {pool.do(Task('GLSL', shaded, ()))}"
        yield f"three.js        {pool.do(Task('three.js', drawn, ()))}"
        apart = pool.do(Task("colour differences", compared, ()))
        yield f"metrics         at most {apart:.0e} from those of colour-science"


def rendered(variant: str) -> str:
    """Render a small figure in a variant, and return that it renders."""
    from reference.scene.graph import set_variant

    set_variant(variant)
    from comparisons.compare import Options, compare
    from comparisons.gallery.builtin import builtin

    compare(builtin("fig-8-9").source(), Options(spp=2, resolution=(16, 16)))
    return "renders"


def meshed(variant: str) -> str:
    """Make and read a mesh, and return through which interface, or what breaks."""
    from reference.scene.graph import set_variant

    set_variant(variant)
    from heuristic import mesh_arrays

    try:
        return f"are made and read, as {mesh_arrays.tried()}"
    except InstallationError as error:
        return (
            f"cannot be made or read ({error}), so scenes with meshes cannot be compared. Install"
            " the pinned version of Mitsuba: `./run` does."
        )


def shaded() -> str:
    """Compile and run a small shader, and return on which device, or what to install."""
    from heuristic.glsl import gpu, shader_files

    try:
        device = gpu.device()
    except InstallationError as error:
        return f"cannot be run; only --heuristic FILE.glsl needs it: {error}"
    shader_files.tried("doctor.glsl", "vec3 shade(Point point) { return vec3(0.5); }")
    return f"runs on {device.renderer}{', a software GPU' if device.is_software else ''}"


def drawn() -> str:
    """Draw nothing with three.js, and return its version, or what to install."""
    from heuristic.three_js import browser

    identity = [[float(row == column) for column in range(4)] for row in range(4)]
    empty = {"meshes": [], "lights": [], "view": identity, "projection": identity}
    try:
        browser.draw(empty | {"width": 2, "height": 2})
    except InstallationError as error:
        return f"cannot be run; only --heuristic three:phong needs it: {error}"
    return f"draws, version {browser.version()}"


def compared() -> float:
    """Return how far colour differences are from colour-science's.

    Raises
    ------
    InstallationError
        If they are too far.
    """
    from comparisons.departure import definitions

    apart = definitions.farthest()
    if not apart <= definitions.AGREEMENT:
        raise InstallationError(
            f"colour differences are {apart:.1e} from colour-science's, and"
            f" {definitions.AGREEMENT:g} is allowed. Install the pinned versions: `./run` does."
        )
    return apart
