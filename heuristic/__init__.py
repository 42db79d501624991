"""The heuristic side: the textbook illumination model as a Dr.Jit kernel and as Mitsuba plugins."""

from heuristic import backend

backend.configure()  # Dr.Jit looks for LLVM once, at its first import, which comes below

from heuristic.lights import DirectionalLight, PointLight, SpotLight  # noqa: E402
from heuristic.materials import Material  # noqa: E402
from heuristic.shading import shade  # noqa: E402
from heuristic.version import __version__  # noqa: E402

__all__ = [
    "DirectionalLight",
    "Material",
    "PointLight",
    "SpotLight",
    "__version__",
    "register",
    "shade",
]


def register():
    """Make the Mitsuba plugins known for the current variant (:mod:`heuristic.plugins`)."""
    from heuristic import plugins  # the kernel alone needs no Mitsuba

    plugins.register()
