"""The work of ``fotismos doctor``."""

import platform
import re
import tomllib
from collections.abc import Iterable, Iterator
from importlib import metadata
from importlib.util import find_spec

import click

from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure import definitions
from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.heuristic import glsl, llvm
from fotismos.heuristic.errors import InstallationError
from fotismos.heuristic.program import ROOT, __version__, installation
from fotismos.reference.scene.graph import set_variant

LIBRARIES = ("mitsuba", "drjit", "numpy", "scipy", "colour-science", "OpenEXR")

PROJECT = ROOT / "pyproject.toml"

CHANGES = {
    "mitsuba": "The documentation's figures, baselines and kept images were made with the pinned"
    " one: images may differ, and `check` may report that they moved.",
    "drjit": "Mitsuba works only with the Dr.Jit that it was built with, and may not even load.",
}
"""What another version than the pinned one changes."""


def run(pool: Pool) -> None:
    """Print the lines on the installation."""
    for line in examine(pool, llvm.VARIANTS):
        click.echo(line)


def examine(pool: Pool, variants: Iterable[str]) -> Iterator[str]:
    """Yield lines on versions, LLVM, test renderings, OpenGL and metrics."""
    yield f"{'fotismos':<17} {__version__}"
    yield f"{'python':<17} {platform.python_version()} on {platform.platform()}"
    yield from version_lines()
    info = llvm.check()
    version = ".".join(map(str, info.version or ()))
    yield f"{'LLVM':<17} {version}, from {info.source}: {info.path or 'path unknown'}"
    for variant in variants:
        yield f"{variant:<17} {pool.do(Task(variant, rendered, (variant,)))}"
    state = pool.do(Task("GLSL", shaded, ()))
    yield f"{'GLSL':<17} {state}"
    apart = pool.do(Task("colour differences", compared, ()))
    yield f"{'metrics':<17} at most {apart:.0e} from those of colour-science"
    yield ""
    works = not state.startswith("cannot be run")
    yield "fotismos works here" + ("." if works else ", except for GLSL: see above for what to do.")


def rendered(variant: str) -> str:
    """Render a small figure in a variant, and return that it renders."""
    set_variant(variant)
    compare(builtin("fig-8-9").source(), Options(spp=2, resolution=(16, 16)))
    return "renders"


def shaded() -> str:
    """Compile and run a small shader, and return on which device, or what to install.

    The extra that this needs may be absent: the rest works without it.
    """
    if find_spec("moderngl") is None:
        command = installation("moderngl")
        return f"is an extra, which only --heuristic FILE.glsl needs. To install it: {command}"

    try:
        renderer, is_software = glsl.device()
    except InstallationError as error:
        return f"cannot be run; only --heuristic FILE.glsl needs it: {error}"
    glsl.of_text("doctor.glsl", "vec3 shade(Point point) { return vec3(0.5); }")
    return f"runs on {renderer}{', a software GPU' if is_software else ''}"


def compared() -> float:
    """Return how far the compiled colour differences are from colour-science's."""
    apart = definitions.farthest()
    if not apart <= definitions.AGREEMENT:
        raise InstallationError(
            f"colour differences are {apart:.1e} from colour-science's, and"
            f" {definitions.AGREEMENT:g} is allowed. Install the pinned versions: `./run` does."
        )
    return apart


def pinned() -> dict[str, str]:
    """Return the versions that the installed package, or else the checkout, requires exactly."""
    try:
        required = metadata.requires("fotismos") or []
    except metadata.PackageNotFoundError:
        project = tomllib.loads(PROJECT.read_text(encoding="utf-8"))["project"]
        required = project["dependencies"]
    matches = (re.fullmatch(r"([\w-]+) *== *([\w.]+)", text) for text in required)
    return {match[1]: match[2] for match in matches if match}


def version_lines() -> Iterator[str]:
    """Yield a line per library, and one on what changes if it has another version than pinned."""
    pins = pinned()
    for library in LIBRARIES:
        version = metadata.version(library)
        pin = pins.get(library, version)
        yield f"{library:<17} {version}" + (f"; {pin} is pinned" if version != pin else "")
        if version != pin:
            yield f"{'':<17} {CHANGES[library]}"
