"""Shaders in GLSL, which a command names as ``FILE.glsl``; OpenGL 4.3 runs them.

The file holds ``vec3 shade(Point point)``. Its text is put between declarations of the record and a
``main``, compiled in a context without a window and called for arrays of points. The background is
a texture behind ``environment(direction)``, read as :mod:`fotismos.heuristic.background` says;
``uniform sampler2D NAME;  // FILE.py`` is a table, which ``prepare(scene)`` of that file returns.
"""

import os
import re
from collections.abc import Callable
from dataclasses import replace
from operator import attrgetter
from pathlib import Path
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic import background, user_shaders
from fotismos.heuristic.convention import Scene
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.glsl import opengl, source
from fotismos.heuristic.glsl.opengl import Textures
from fotismos.heuristic.heuristics import (
    INPUTS,
    Heuristic,
    LightAtPoint,
    Point,
    content_digest,
)
from fotismos.heuristic.user_code import contained

ON_SOFTWARE = "{} ran on {}, a software GPU: its times are not those of a graphics card."

LARGEST = 1 << 20
"""Bytes of a file at most: a longer one is not a shader."""

LIGHTS = 64
"""Lights at most: each point's record holds them all."""

_known: dict[tuple[str, str], Heuristic] = {}


def from_file(word: str) -> Heuristic:
    """Return the heuristic in a GLSL file, after a trial; a file that changed is read again."""
    path = Path(word)
    key = word, os.path.realpath(path)  # `resolve` fails for links that go round
    known = _known.get(key)
    if known is None or known.code != content_digest(known.files):
        _known[key] = known = _read(word, path)
    return known


def _read(word: str, path: Path) -> Heuristic:
    if not path.is_file():
        raise InputError(
            f"{path}: there is no such file. Give a GLSL file with a function `{source.SIGNATURE}`."
        )
    size = path.stat().st_size
    if size > LARGEST:
        raise InputError(f"{path}: {size} bytes are too long for a shader: give {LARGEST} at most.")
    try:
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{word} is not text in UTF-8: {error}.") from error
    heuristic = of_text(word, text)
    files = {path.resolve(), *heuristic.files}
    return replace(heuristic, files=tuple(sorted(files)), code=content_digest(files))


def of_text(word: str, text: str) -> Heuristic:
    """Return the heuristic of a text, after a trial; InputError names the faulty line."""
    shader = Shader(word, text)
    if shader.line is None:
        raise InputError(
            f"{word}: there is no function `{source.SIGNATURE}`. Add it; it returns a"
            " display-linear colour."
        )
    if refused := source.refusal(text):
        raise InputError(f"{word}, line {refused[0]}: {refused[1]}.")
    shader.compiled(2)
    files = shader.read_table()
    renderer, is_software = opengl.device()
    heuristic = Heuristic(
        name=word,
        shade=shader,
        label=Path(word).stem + (", software GPU" if is_software else ""),
        needs=frozenset(name for name in INPUTS if name in shader.words),
        parameters=source.uniforms(text),
        prepare=shader.prepare if shader.table or "environment" in shader.words else None,
        files=tuple(files),
        traced=False,
        remarks=(ON_SOFTWARE.format(word, renderer),) if is_software else (),
    )
    with mi.scoped_set_variant(user_shaders.DEFAULT_VARIANT):
        return replace(heuristic, reads=user_shaders.examine(heuristic))


class Shader:
    """A user's GLSL as a function of a :class:`fotismos.heuristic.heuristics.Point`.

    It evaluates the point's arrays and sends those that its code may read. So it cannot be traced
    in a loop and has no derivatives.
    """

    def __init__(self, file: str, text: str) -> None:
        self.file = file
        self.text = text
        code = source.bare(text)
        self.words = frozenset(re.findall(r"\b[A-Za-z_]\w*", code))
        match = source.SHADE.search(code)
        self.line = match and code.count("\n", 0, match.start()) + 1
        self.__qualname__ = f"{file}, line {self.line}"  # its name in messages
        matches = [found for line in text.splitlines() if (found := source.TABLE.match(line))]
        self.table = matches[0].groups() if matches else None  # its name and file
        self.make_table: Callable[[Scene], Any] | None = None
        self._programs: dict[int, tuple[Any, Any]] = {}

    def __call__(self, point: Point) -> Any:
        """Return the colours (3, points) as a Dr.Jit colour; raise InputError if it cannot run."""
        if dr.flag(dr.JitFlag.SymbolicScope):
            raise InputError(
                f"{self.file}: Dr.Jit cannot record a shader in GLSL, so it cannot run in a"
                " symbolic loop. Evaluate that loop, or write the shader in Python."
            )
        if not mi.is_rgb:
            raise InputError(
                f"{self.file}: a shader in GLSL needs RGB colours, which {mi.variant()} does not"
                " have. Give `variant=llvm_ad_rgb`, or `heuristic_variant=llvm_ad_rgb`."
            )
        # The fields that the code may read, evaluated together.
        lights = point.lights if "lights" in self.words else ()
        fields = source.fields_read(self.words, max(len(lights), 1))
        values = {name: _value(point, lights, name) for name in fields}
        dr.eval(list(values.values()))
        rows = [row for name, size in fields.items() for row in _rows(values[name], size)]
        count = dr.width(point.arguments.position)
        compute = self.compiled(max(len(lights), 1))
        for name, value in vars(point.parameters).items():
            if name in compute:  # compilers drop unused names
                compute[name] = float(np.ravel(value)[0])
        if "environment" in self.words:
            point.require("environment")
        if point.prepared is not None:
            point.prepared.bind(compute)
        colours = opengl.shaded(compute, rows, count)
        return mi.Spectrum(*(mi.Float(np.ascontiguousarray(channel)) for channel in colours.T))

    def read_table(self) -> set[Path]:
        """Read the file that makes its table, and return it and what it imports."""
        if self.table is None:
            return set()
        name, file = self.table
        script = Path(self.file).parent / file
        with contained(script) as modules:
            names = user_shaders.names_of(script, "with a function `prepare(scene)`")
        if "prepare" not in names:
            raise InputError(
                f"{script}: there is no function `prepare(scene)`. Add it; it returns the table"
                f" {name} of {self.file}, (height, width, channels)."
            )
        self.make_table = names["prepare"]
        return {script.resolve(), *modules}

    def prepare(self, scene: Scene) -> Textures:
        """Return what it reads of a scene besides its points: the background, and its table."""
        found = Textures({}, np.eye(3))
        if "environment" in self.words:
            around = background.environment_map(scene)
            found = Textures({"fotismos_map": around.texels}, around.to_local)
        if self.table and self.make_table:
            name, file = self.table
            table = np.array(self.make_table(scene), np.float32)
            if table.ndim != 3 or not 1 <= table.shape[2] <= 4 or not np.isfinite(table).all():
                raise InputError(
                    f"{file}: prepare(scene) returned an array of shape {table.shape} for the table"
                    f" {name} of {self.file}: return (height, width, channels), with 1 to 4"
                    " channels, of finite numbers."
                )
            found.tables[name] = table
        return found

    def compiled(self, lights: int) -> Any:
        """Compile it for a number of lights; raise InputError with the faulty lines."""
        context = opengl.context()
        owner, compute = self._programs.get(lights, (None, None))
        if owner is context:
            return compute
        if lights > LIGHTS:
            raise InputError(
                f"{self.file}: the scene has {lights} lights; a shader in GLSL takes at most"
                f" {LIGHTS}. Write it in Python, or remove lights from the scene."
            )
        try:
            compute = context.compute_shader(source.source(self.text, self.words, lights))
        except Exception as error:  # moderngl's own, which has the compiler's message
            message = source.explained(str(error), self.file, self.text)
            raise InputError(f"{message}. It does not compile as GLSL 4.30.") from error
        self._programs[lights] = context, compute
        return compute


def _value(point: Point, lights: tuple[LightAtPoint, ...], name: str) -> Any:
    """Return a field of the record as a Dr.Jit value; a scene without lights gets a dark one."""
    owner, _, field = name.rpartition("].")
    if not owner:
        return attrgetter(field)(point)
    if not lights:
        return mi.Float(0)
    value = attrgetter(field)(lights[int(owner[len("lights[") :])])
    return dr.select(value(), mi.Float(1), 0) if field == "visible" else value


def _rows(value: Any, size: int) -> list[np.ndarray]:
    """Return a value as arrays of floats, one per component."""
    value = dr.detach(value)
    is_vector = dr.is_array_v(value) and dr.depth_v(value) == 2
    parts = list(value) if is_vector else [value] * size
    return [np.array(part, np.float32).reshape(-1) for part in parts]
