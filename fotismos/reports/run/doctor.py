"""What ``fotismos doctor`` examines."""

import platform
from collections.abc import Iterable, Iterator
from importlib import metadata
from importlib.util import find_spec

from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure import definitions
from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.heuristic import llvm
from fotismos.heuristic.errors import InstallationError
from fotismos.heuristic.glsl import opengl, shader
from fotismos.heuristic.llvm import other_version
from fotismos.heuristic.program import __version__, installation
from fotismos.reference.scene.graph import set_variant

WIDTH = max(map(len, llvm.VARIANTS))
LIBRARIES = ("mitsuba", "drjit", "numpy", "scipy", "colour-science", "OpenEXR")


def examine(pool: Pool, variants: Iterable[str]) -> Iterator[str]:
    """Yield lines on versions, LLVM, test renderings, OpenGL and metrics."""
    yield line("fotismos", __version__)
    yield line("python", f"{platform.python_version()} on {platform.platform()}")
    yield from version_lines()
    info = llvm.check()
    version = ".".join(map(str, info.version or ()))
    yield line("LLVM", f"{version}, from {info.source}: {info.path or 'path unknown'}")
    for variant in variants:
        yield line(variant, pool.do(Task(variant, rendered, (variant,))))
    state = pool.do(Task("GLSL", shaded, ()))
    yield line("GLSL", state)
    apart = pool.do(Task("colour differences", compared, ()))
    yield line("metrics", f"at most {apart:.0e} from those of colour-science")
    yield ""
    works = not state.startswith("cannot be run")
    yield "fotismos works here" + ("." if works else ", except for GLSL: see above for what to do.")


def line(name: str, text: str) -> str:
    """Return a line of two columns, the first as wide as the longest variant's name."""
    return f"{name:<{WIDTH}}  {text}"


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
        return f"is an extra that only --heuristic FILE.glsl needs. To install it: {command}"

    try:
        renderer, is_software = opengl.device()
    except InstallationError as error:
        return f"cannot be run; only --heuristic FILE.glsl needs it: {error}"
    shader.of_text("doctor.glsl", "vec3 shade(Point point) { return vec3(0.5); }")
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


def version_lines() -> Iterator[str]:
    """Yield a line per library, and one where the documentation's numbers are of another."""
    for library in LIBRARIES:
        yield line(library, metadata.version(library))
        if library == "mitsuba" and (change := other_version()):
            yield line("", change)
