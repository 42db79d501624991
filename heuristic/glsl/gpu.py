"""The OpenGL context of shaders: one per thread, without a window."""

import os
import threading
from dataclasses import dataclass, field
from typing import Any

from heuristic import program
from heuristic.errors import InstallationError

VERSION = 430
"""OpenGL 4.3, the first with compute shaders."""

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")
"""Parts of the names of OpenGL renderers that do not use a graphics card."""

_kept = threading.local()


@dataclass(frozen=True, eq=False)
class Device:
    """An OpenGL context of moderngl, the renderer's name, and buffers kept for reuse."""

    context: Any
    renderer: str
    kept: dict[int, Any] = field(default_factory=dict)

    def buffer(self, number: int, size: int) -> Any:
        """Return a binding's buffer of at least ``size`` bytes; making a new one is slow."""
        found = self.kept.get(number)
        if found is None or found.size < size:
            if found is not None:
                found.release()
            found = self.kept[number] = self.context.buffer(reserve=size)
        return found

    @property
    def is_software(self) -> bool:
        """Whether the processor does the work of a graphics card."""
        return any(name in self.renderer.lower() for name in SOFTWARE)


def device() -> Device:
    """Return this thread's device, made at the first call.

    Raises
    ------
    InstallationError
        If moderngl, or a driver for OpenGL 4.3 that EGL finds, is missing.
    """
    pid, found = getattr(_kept, "device", (None, None))
    if found is None or pid != os.getpid():  # a context does not outlive a fork
        found = _opened()
        _kept.device = os.getpid(), found
    return found


def _opened() -> Device:
    try:
        import moderngl
    except ImportError as error:
        raise InstallationError(
            "moderngl is not installed, and heuristics in GLSL need it. Install it:"
            f" {program.installation('moderngl')}"
        ) from error
    try:
        options: Any = {"backend": "egl"}  # moderngl annotates all options as one
        context = moderngl.create_context(standalone=True, require=VERSION, **options)
    except Exception as error:  # its type depends on which library is missing
        raise InstallationError(
            f"EGL finds no OpenGL {VERSION / 100:.1f}, and heuristics in GLSL need it:"
            f" {str(error).strip().rstrip('.')}. Install a driver; Mesa's works without a"
            " graphics card (Debian, Ubuntu: apt-get install libegl1 libgl1-mesa-dri)."
        ) from error
    return Device(context, context.info["GL_RENDERER"])
