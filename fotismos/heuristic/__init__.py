"""The heuristic side: the textbook illumination model as a Dr.Jit kernel and as Mitsuba plugins."""

if __name__ == "heuristic":
    raise ImportError("write `import fotismos.heuristic` in place of `import heuristic`")

from importlib import import_module
from typing import TYPE_CHECKING

from fotismos.heuristic import llvm
from fotismos.heuristic.program import __version__

if TYPE_CHECKING:
    from fotismos.heuristic.background import environment
    from fotismos.heuristic.heuristics import Heuristic, Parameter, Range
    from fotismos.heuristic.kernel import shade
    from fotismos.heuristic.lights import DirectionalLight, PointLight, SpotLight
    from fotismos.heuristic.materials import Material
    from fotismos.heuristic.plugins import register

llvm.configure()  # Dr.Jit looks for LLVM once, at its first import

HOMES = {
    "DirectionalLight": "fotismos.heuristic.lights",
    "Heuristic": "fotismos.heuristic.heuristics",
    "Material": "fotismos.heuristic.materials",
    "Parameter": "fotismos.heuristic.heuristics",
    "PointLight": "fotismos.heuristic.lights",
    "Range": "fotismos.heuristic.heuristics",
    "SpotLight": "fotismos.heuristic.lights",
    "environment": "fotismos.heuristic.background",
    "register": "fotismos.heuristic.plugins",
    "shade": "fotismos.heuristic.kernel",
}
"""The module of each name, imported at its first use: errors load without Dr.Jit, and the kernel
without Mitsuba."""

__all__ = [
    "DirectionalLight", "Heuristic", "Material", "Parameter", "PointLight", "Range", "SpotLight",
    "__version__", "environment", "register", "shade",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(HOMES[name]), name)
