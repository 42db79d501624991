"""OpenGL 4.3 without a window: compute shaders called for arrays of points."""

import os
import threading
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fotismos.heuristic import program
from fotismos.heuristic.convention import Doubles, Floats
from fotismos.heuristic.errors import InputError, InstallationError

VERSION = 430
"""OpenGL 4.3, the first with compute shaders."""

SOFTWARE = ("llvmpipe", "softpipe", "swrast", "swiftshader")
"""Parts of the names of OpenGL renderers that do not use a graphics card."""

FLOATS = 1 << 24
"""Floats sent at once: half of what every OpenGL allows in a buffer (128 MiB with Mesa)."""

POINTS = 1 << 20
"""Points shaded at once, at most; OpenGL allows 65,535 work groups."""

GROUP = 64
"""Points that one work group shades."""

_kept = threading.local()


def context() -> Any:
    """Return this thread's context of moderngl, made at the first call."""
    pid, made = getattr(_kept, "context", (None, None))
    if made is not None and pid == os.getpid():  # a context does not outlive a fork
        return made
    try:
        import moderngl  # loaded late: only shaders in GLSL need it
    except ImportError as error:
        raise InstallationError(
            "moderngl is not installed, and shaders in GLSL need it. Install it:"
            f" {program.installation('moderngl')}"
        ) from error
    try:
        options: Any = {"backend": "egl"}  # moderngl annotates all options as one
        made = moderngl.create_context(standalone=True, require=VERSION, **options)
    except Exception as error:  # its type depends on which library is missing
        raise InstallationError(
            f"EGL finds no OpenGL {VERSION / 100:.1f}, and shaders in GLSL need it:"
            f" {str(error).strip().rstrip('.')}. Install a driver; Mesa's works without a"
            " graphics card (Debian, Ubuntu: apt-get install libegl1 libgl1-mesa-dri)."
        ) from error
    _kept.context = os.getpid(), made
    return made


def device() -> tuple[str, bool]:
    """Return the name of OpenGL's renderer, and whether the processor does its work."""
    renderer = context().info["GL_RENDERER"]
    return renderer, any(name in renderer.lower() for name in SOFTWARE)


def shaded(compute: Any, rows: list[np.ndarray], count: int) -> Floats:
    """Return the colours (points, 3) of points whose floats are ``rows``, chunk by chunk."""
    colours = np.empty((count, 3), np.float32)
    # Within the limits of buffers and work groups.
    step = max(min(POINTS, FLOATS // max(len(rows), 1)), 1)
    for start in range(0, count, step):
        part = slice(start, min(start + step, count))
        chunk = [np.broadcast_to(row, count)[part] for row in rows]
        colours[part] = _run(compute, chunk, part.stop - start)
    return colours


def _run(compute: Any, rows: list[np.ndarray], count: int) -> np.ndarray:
    """Return the colours (points, 3) of a chunk of points."""
    own = context()
    # Floats (rows, count) in, colours (count, 3) out; each float has 4 bytes.
    values = own.buffer(reserve=max(4 * count * len(rows), 4))
    colours = own.buffer(reserve=12 * count)
    for number, row in enumerate(rows):  # saves one copy
        values.write(np.ascontiguousarray(row), offset=4 * count * number)
    for number, buffer in enumerate((values, colours)):
        buffer.bind_to_storage_buffer(number)
    compute["fotismos_count"] = count
    # Rounded up: `main` ignores the places beyond the last point.
    compute.run(group_x=-(-count // GROUP))
    own.memory_barrier()
    image = np.frombuffer(colours.read(), np.float32).reshape(count, 3)
    values.release()
    colours.release()
    if (fault := own.error) != "GL_NO_ERROR":
        raise InputError(f"the shader failed on the graphics card: {fault}. Does it end?")
    return image


@dataclass(frozen=True)
class Textures:
    """Tables (H, W, channels) by the name of their sampler, and the rotation of the map."""

    tables: dict[str, Floats]
    to_local: Doubles
    _sent: dict[int, tuple[Any, dict[str, Any]]] = field(default_factory=dict)

    def bind(self, compute: Any) -> None:
        """Let a program read them; the first time in a context they are sent to it."""
        own = context()
        _, sent = self._sent.setdefault(id(own), (own, {}))
        for number, (name, table) in enumerate(self.tables.items()):
            if name not in sent:
                height, width, channels = table.shape
                data = np.ascontiguousarray(table, np.float32)
                sent[name] = own.texture((width, height), channels, data, dtype="f4")
                sent[name].repeat_x = sent[name].repeat_y = False
            sent[name].use(number)
            if name in compute:  # compilers drop unused names
                compute[name] = number
        if "fotismos_to_local" in compute:
            columns = np.ascontiguousarray(self.to_local.T, np.float32)  # as OpenGL stores them
            compute["fotismos_to_local"].write(columns)
