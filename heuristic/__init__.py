"""The heuristic side: the textbook illumination model as a Dr.Jit kernel and as Mitsuba plugins."""

from importlib import import_module
from typing import TYPE_CHECKING

from heuristic import llvm
from heuristic.program import __version__

if TYPE_CHECKING:
    from heuristic.heuristics import Heuristic, Parameter, Range
    from heuristic.kernel import shade
    from heuristic.lights import DirectionalLight, PointLight, SpotLight
    from heuristic.materials import Material

llvm.configure()  # Dr.Jit looks for LLVM once, at its first import

HOMES = {
    "DirectionalLight": "heuristic.lights",
    "Heuristic": "heuristic.heuristics",
    "Material": "heuristic.materials",
    "Parameter": "heuristic.heuristics",
    "PointLight": "heuristic.lights",
    "Range": "heuristic.heuristics",
    "SpotLight": "heuristic.lights",
    "shade": "heuristic.kernel",
}
"""Where names come from when they are asked for: errors and options need no Dr.Jit."""

__all__ = [
    "DirectionalLight", "Heuristic", "Material", "Parameter", "PointLight", "Range", "SpotLight",
    "__version__", "register", "shade",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(HOMES[name]), name)


def register() -> None:
    """Register the Mitsuba plugins for the current variant (:mod:`heuristic.plugins`)."""
    from heuristic import plugins  # the kernel alone does not need Mitsuba

    plugins.register()
