"""Heuristics in GLSL files, which a command names as ``FILE.glsl``."""

from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic import trial
from heuristic.errors import InputError
from heuristic.glsl import gpu, shader_text
from heuristic.heuristics import Heuristic, Parameter
from heuristic.points import INPUTS, LightAtPoint, Point

SIGNATURE = "vec3 shade(Point point)"

LARGEST = 1 << 20
"""Bytes of a file at most: a longer one is not a shader."""

LIGHTS = 64
"""Lights at most: each point's record holds them all."""

FLOATS = 1 << 24
"""Floats sent at once: half of what every OpenGL allows in a buffer (128 MiB with Mesa)."""

POINTS = 1 << 20
"""Points shaded at once, at most; OpenGL allows 65,535 work groups."""

_opened: dict[tuple[str, Path], Heuristic] = {}


def opened(word: str) -> Heuristic:
    """Return the heuristic in a GLSL file, after a trial; a file that changed is read again.

    Raises
    ------
    InputError
        If there is no such file or function, it does not compile, or it fails the trial.
    InstallationError
        If there is no OpenGL to run it.
    """
    path = Path(word)
    content = _content(path)
    code = sha256(content).hexdigest()
    key = word, path.resolve()
    if key not in _opened or _opened[key].code != code:
        _opened[key] = replace(tried(word, _text(word, content)), code=code)
    return _opened[key]


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
        self._programs: dict[int, tuple[gpu.Device, Any]] = {}

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
        floats = self._floats(point, lights)
        count = dr.width(point.given.position)
        program, device = self._program(max(len(lights), 1))
        for name, value in vars(point.parameters).items():
            if name in program:  # compilers drop unused names
                program[name] = float(np.ravel(value)[0])
        colours = np.empty((count, 3), np.float32)
        step = max(min(POINTS, FLOATS // len(floats)), 1)
        for start in range(0, count, step):
            part = slice(start, min(start + step, count))
            chunk = [each if len(each) == 1 else each[part] for each in floats]
            colours[part] = _run(device, program, chunk, part.stop - start)
        return mi.Spectrum(*(mi.Float(np.ascontiguousarray(each)) for each in colours.T))

    def compile(self, lights: int = 2) -> None:
        """Compile it for a number of lights; raise InputError with the faulty lines."""
        self._program(lights)

    def _program(self, lights: int) -> tuple[Any, gpu.Device]:
        device = gpu.device()
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

    def _floats(self, point: Point, lights: tuple[LightAtPoint, ...]) -> list[np.ndarray]:
        """Return the arrays of a point, float by float; length 1 where all points agree."""
        fields = shader_text.values(max(len(lights), 1))
        found = [self._value(point, lights, each) for each in fields]
        dr.eval([each for each in found if each is not None])
        columns = [_columns(one, each.size) for one, each in zip(found, fields, strict=True)]
        return [column for several in columns for column in several]

    def _value(
        self, point: Point, lights: tuple[LightAtPoint, ...], value: shader_text.Value
    ) -> Any:
        """Return a field of the record as a Dr.Jit value; None if the shader does not read it."""
        owner, _, field = value.name.rpartition(".")
        if field not in self.words:
            return None
        if not owner:
            return getattr(point, field)
        if owner == "material":
            return getattr(point.material, field)
        number = int(owner[len("lights[") : -1])
        if number >= len(lights):
            return None  # a scene without lights gets a dark one
        found = getattr(lights[number], field)
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


def tried(word: str, text: str) -> Heuristic:
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
    label, remarks = _told(word)
    found = Heuristic(
        word,
        shader,
        label,
        frozenset(name for name in INPUTS if name in shader.words),
        parameters=tuple(Parameter(*each) for each in shader_text.parameters(text)),
        traced=False,
        remarks=remarks,
    )
    with mi.scoped_set_variant(trial.DEFAULT_VARIANT):
        return replace(found, reads=trial.examine(found))


def _text(word: str, content: bytes) -> str:
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{word} is not text in UTF-8: {error}.") from error


def _told(word: str) -> tuple[str, tuple[str, ...]]:
    """Return the label, and the remarks of records; both mention a software GPU."""
    device, label = gpu.device(), Path(word).stem
    if not device.is_software:
        return label, ()
    remark = f"{word} ran on {device.renderer}, a software GPU: its times are not those of a"
    return f"{label}, software GPU", (f"{remark} graphics card.",)


def _columns(value: Any, size: int) -> list[np.ndarray]:
    """Return a value as arrays of floats, one per component; zeros for None."""
    if value is None:
        return [np.zeros(1, np.float32)] * size
    value = dr.detach(value)
    is_vector = dr.is_array_v(value) and dr.depth_v(value) == 2
    parts = list(value) if is_vector else [value] * size
    return [np.array(part, np.float32).reshape(-1) for part in parts]


def _run(device: gpu.Device, program: Any, floats: list[np.ndarray], count: int) -> np.ndarray:
    """Return the colours (points, 3) of a chunk of points."""
    context = device.context
    lengths = np.array([len(each) for each in floats])
    offsets = np.concatenate([[0], np.cumsum(lengths)[:-1]])
    places = np.stack([offsets, lengths > 1], axis=1).astype(np.int32)
    sizes = 4 * int(lengths.sum()), places.nbytes, 12 * count
    values, at, colours = (device.buffer(number, size) for number, size in enumerate(sizes))
    for column, offset in zip(floats, offsets, strict=True):  # saves one copy
        values.write(column, offset=4 * int(offset))
    at.write(places)
    for number, buffer in enumerate((values, at, colours)):
        buffer.bind_to_storage_buffer(number)
    program["fotismos_count"] = count
    program.run(group_x=-(-count // shader_text.GROUP))
    context.memory_barrier()
    found = np.frombuffer(colours.read(sizes[-1]), np.float32).reshape(count, 3)
    if (said := context.error) != "GL_NO_ERROR":
        raise InputError(f"the shader failed on the graphics card: {said}. Does it end?")
    return found
