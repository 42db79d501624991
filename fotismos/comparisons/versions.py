"""What results depend on: the versions of libraries, and for times the machine."""

import platform
from collections.abc import Iterable
from importlib import metadata
from pathlib import Path

from fotismos.comparisons.processes.pool import cores
from fotismos.heuristic import __version__
from fotismos.reference.records import Machine

PICTURE_LIBRARIES = ("numpy", "colour-science", "OpenEXR", "pillow")
"""What a comparison of two pictures depends on."""


LIBRARIES = ("mitsuba", "drjit", "numpy", "colour-science", "OpenEXR")
"""What a comparison of a scene depends on."""


def versions(libraries: Iterable[str] = LIBRARIES) -> dict[str, str]:
    """Return the versions that a result depends on, and with Dr.Jit LLVM's."""
    numbers = {"fotismos": __version__, "python": platform.python_version()}
    numbers |= {library: metadata.version(library) for library in libraries}
    if "drjit" in numbers:
        import drjit as dr  # loaded late: two pictures are compared without it

        numbers["LLVM"] = ".".join(map(str, dr.detail.llvm_version()))
    return numbers


def machine() -> Machine:
    """Return what times depend on."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    processor = names[0] if names else platform.processor() or platform.machine()
    return Machine(
        processor=processor, cores=cores(), system=f"{platform.system()} {platform.machine()}"
    )
