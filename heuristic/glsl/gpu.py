"""The OpenGL context that shaders run in: one for each thread, without a window."""

import os
import threading
from dataclasses import dataclass, field
from typing import Any

from heuristic.errors import InstallationError

VERSION = 430
"""OpenGL 4.3, the first with compute shaders."""

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")
"""What the renderers of OpenGL that use no graphics card have in their names."""

_kept = threading.local()


@dataclass(frozen=True, eq=False)
class Device:
    """An OpenGL context of moderngl's, the renderer's own name, and buffers that are kept."""

    context: Any
    renderer: str
    kept: dict[int, Any] = field(default_factory=dict)

    def buffer(self, number: int, size: int) -> Any:
        """Return the buffer of a binding, of so many bytes at least; a new one takes long."""
        found = self.kept.get(number)
        if found is None or found.size < size:
            if found is not None:
                found.release()
            found = self.kept[number] = self.context.buffer(reserve=size)
        return found

    @property
    def is_software(self) -> bool:
        """Whether the processor does the graphics card's work."""
        return any(name in self.renderer.lower() for name in SOFTWARE)


def device() -> Device:
    """Return this thread's device, made at the first call.

    Raises
    ------
    InstallationError
        When moderngl, or a driver of OpenGL 4.3 that EGL finds, is missing.
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
            "moderngl is not installed, and heuristics in GLSL need it. Install the extra `glsl`,"
            " as by pip install 'fotismos[glsl]'."
        ) from error
    try:
        options: Any = {"backend": "egl"}  # moderngl's own annotation is of all options as one
        context = moderngl.create_context(standalone=True, require=VERSION, **options)
    except Exception as error:  # of several kinds, by which library is missing
        raise InstallationError(
            f"there is no OpenGL {VERSION / 100:.1f} by EGL, and heuristics in GLSL need it:"
            f" {str(error).strip().rstrip('.')}. Install a driver; one that needs no graphics card"
            " is Mesa's (Debian, Ubuntu: apt-get install libegl1 libgl1-mesa-dri)."
        ) from error
    return Device(context, context.info["GL_RENDERER"])
