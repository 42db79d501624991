"""Heuristics in GLSL files, which a command names as ``FILE.glsl``."""

import os
import threading
from dataclasses import dataclass, field, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic import program, user_shaders
from heuristic.errors import InputError, InstallationError
from heuristic.glsl import shader_text
from heuristic.heuristics import Heuristic, Parameter
from heuristic.points import INPUTS, LightAtPoint, Point

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


def opengl() -> Device:
    """Return this thread's device, made at the first call."""
    pid, found = getattr(_kept, "device", (None, None))
    if found is None or pid != os.getpid():  # a context does not outlive a fork
        found = _created()
        _kept.device = os.getpid(), found
    return found


def _created() -> Device:
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


SIGNATURE = "vec3 shade(Point point)"

LARGEST = 1 << 20
"""Bytes of a file at most: a longer one is not a shader."""

LIGHTS = 64
"""Lights at most: each point's record holds them all."""

FLOATS = 1 << 24
"""Floats sent at once: half of what every OpenGL allows in a buffer (128 MiB with Mesa)."""

POINTS = 1 << 20
"""Points shaded at once, at most; OpenGL allows 65,535 work groups."""

_known: dict[tuple[str, Path], Heuristic] = {}


def from_file(word: str) -> Heuristic:
    """Return the heuristic in a GLSL file, after a trial; a file that changed is read again."""
    path = Path(word)
    content = _content(path)
    code = sha256(content).hexdigest()
    key = word, path.resolve()
    if key not in _known or _known[key].code != code:
        files = (path.resolve(),)
        _known[key] = replace(of_text(word, _text(word, content)), files=files, code=code)
    return _known[key]


class Shader:
    """A user's GLSL as a function of a :class:`heuristic.points.Point`.

    It evaluates the point's arrays and sends those that its code may read. So it cannot be traced
    in a loop and has no derivatives.
    """

    def __init__(self, file: str, text: str) -> None:
        self.file, self.text = file, text
        self.words = shader_text.words(text)
        self.line = shader_text.line_of_shade(text)
        self.__qualname__ = f"{file}, line {self.line}"  # its name in messages
        self._programs: dict[int, tuple[Device, Any]] = {}

    def __call__(self, point: Point) -> Any:
        """Return the colours (3, points) as a Dr.Jit colour; raise InputError if it cannot run."""
        if dr.flag(dr.JitFlag.SymbolicScope):
            raise InputError(
                f"{self.file}: Dr.Jit cannot record a shader in GLSL, so it cannot run in a"
                " symbolic loop. Evaluate that loop, or write the heuristic in Python."
            )
        if not mi.is_rgb:
            raise InputError(
                f"{self.file}: a shader in GLSL needs RGB colours, which {mi.variant()} does not"
                " have. Give --variant llvm_ad_rgb, or --heuristic-variant llvm_ad_rgb."
            )
        lights = point.lights if "lights" in self.words else ()
        fields = shader_text.values(self.text, max(len(lights), 1))
        values = {name: _value(point, lights, name) for name in fields}
        dr.eval(list(values.values()))
        rows = [row for name, size in fields.items() for row in _rows(values[name], size)]
        count = dr.width(point.arguments.position)
        program, device = self._program(max(len(lights), 1))
        for name, value in vars(point.parameters).items():
            if name in program:  # compilers drop unused names
                program[name] = float(np.ravel(value)[0])
        colours = np.empty((count, 3), np.float32)
        step = max(min(POINTS, FLOATS // max(len(rows), 1)), 1)
        for start in range(0, count, step):
            part = slice(start, min(start + step, count))
            chunk = [np.broadcast_to(row, count)[part] for row in rows]
            colours[part] = _run(device, program, chunk, part.stop - start)
        return mi.Spectrum(*(mi.Float(np.ascontiguousarray(each)) for each in colours.T))

    def compile(self, lights: int = 2) -> None:
        """Compile it for a number of lights; raise InputError with the faulty lines."""
        self._program(lights)

    def _program(self, lights: int) -> tuple[Any, Device]:
        device = opengl()
        known, made = self._programs.get(lights, (None, None))
        if known is device:
            return made, device
        if lights > LIGHTS:
            raise InputError(
                f"{self.file}: the scene has {lights} lights; a shader in GLSL takes at most"
                f" {LIGHTS}. Write it in Python, or remove lights from the scene."
            )
        import moderngl

        try:
            made = device.context.compute_shader(shader_text.program(self.text, lights))
        except moderngl.Error as error:
            told = shader_text.explained(str(error), self.file, self.text)
            raise InputError(f"{told}. It does not compile as GLSL 4.30.") from error
        self._programs[lights] = device, made
        return made, device


def _value(point: Point, lights: tuple[LightAtPoint, ...], name: str) -> Any:
    """Return a field of the record as a Dr.Jit value; a scene without lights gets a dark one."""
    owner, _, field = name.rpartition(".")
    if not owner:
        return getattr(point, field)
    if owner == "material":
        return getattr(point.material, field)
    if not lights:
        return mi.Float(0)
    found = getattr(lights[int(owner[len("lights[") : -1])], field)
    return dr.select(found(), mi.Float(1), 0) if field == "visible" else found


def _content(path: Path) -> bytes:
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file. Give a GLSL file with a function `{SIGNATURE}`."
        )
    size = path.stat().st_size
    if size > LARGEST:
        raise InputError(f"{path}: {size} bytes are too long for a shader: give {LARGEST} at most.")
    return path.read_bytes()


def of_text(word: str, text: str) -> Heuristic:
    """Return the heuristic of a text, after a trial; raises the errors of :func:`opened`."""
    if shader_text.line_of_shade(text) is None:
        raise InputError(
            f"{word}: there is no function `{SIGNATURE}`. Add it; it returns a display-linear"
            " colour."
        )
    if refused := shader_text.refusal(text):
        raise InputError(f"{word}, line {refused[0]}: {refused[1]}.")
    shader = Shader(word, text)
    shader.compile()
    label, remarks = _label(word)
    found = Heuristic(
        word,
        shader,
        label,
        frozenset(name for name in INPUTS if name in shader.words),
        parameters=tuple(Parameter(*each) for each in shader_text.parameters(text)),
        traced=False,
        remarks=remarks,
    )
    with mi.scoped_set_variant(user_shaders.DEFAULT_VARIANT):
        return replace(found, reads=user_shaders.examine(found))


def _text(word: str, content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{word} is not text in UTF-8: {error}.") from error


def _label(word: str) -> tuple[str, tuple[str, ...]]:
    """Return the label, and the remarks of records; both mention a software GPU."""
    device, label = opengl(), Path(word).stem
    if not device.is_software:
        return label, ()
    remark = f"{word} ran on {device.renderer}, a software GPU: its times are not those of a"
    return f"{label}, software GPU", (f"{remark} graphics card.",)


def _rows(value: Any, size: int) -> list[np.ndarray]:
    """Return a value as arrays of floats, one per component."""
    value = dr.detach(value)
    is_vector = dr.is_array_v(value) and dr.depth_v(value) == 2
    parts = list(value) if is_vector else [value] * size
    return [np.array(part, np.float32).reshape(-1) for part in parts]


def _run(device: Device, program: Any, rows: list[np.ndarray], count: int) -> np.ndarray:
    """Return the colours (points, 3) of a chunk of points."""
    values = device.buffer(0, max(4 * count * len(rows), 4))
    colours = device.buffer(1, 12 * count)
    for number, row in enumerate(rows):  # saves one copy
        values.write(np.ascontiguousarray(row), offset=4 * count * number)
    for number, buffer in enumerate((values, colours)):
        buffer.bind_to_storage_buffer(number)
    program["fotismos_count"] = count
    program.run(group_x=-(-count // shader_text.GROUP))
    device.context.memory_barrier()
    found = np.frombuffer(colours.read(12 * count), np.float32).reshape(count, 3)
    if (said := device.context.error) != "GL_NO_ERROR":
        raise InputError(f"the shader failed on the graphics card: {said}. Does it end?")
    return found
