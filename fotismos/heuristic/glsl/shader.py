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
from fotismos.heuristic.glsl import opengl
from fotismos.heuristic.glsl.opengl import GROUP, Textures
from fotismos.heuristic.heuristics import (
    INPUTS,
    Heuristic,
    LightAtPoint,
    Parameter,
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
            f"{path}: there is no such file. Give a GLSL file with a function `{SIGNATURE}`."
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
            f"{word}: there is no function `{SIGNATURE}`. Add it; it returns a"
            " display-linear colour."
        )
    if refused := refusal(text):
        raise InputError(f"{word}, line {refused[0]}: {refused[1]}.")
    shader.compiled(2)
    files = shader.read_table()
    renderer, is_software = opengl.device()
    heuristic = Heuristic(
        name=word,
        shade=shader,
        label=Path(word).stem + (", software GPU" if is_software else ""),
        needs=frozenset(name for name in INPUTS if name in shader.words),
        parameters=uniforms(text),
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
        code = bare(text)
        self.words = frozenset(re.findall(r"\b[A-Za-z_]\w*", code))
        match = SHADE.search(code)
        self.line = match and code.count("\n", 0, match.start()) + 1
        self.__qualname__ = f"{file}, line {self.line}"  # its name in messages
        matches = [found for line in text.splitlines() if (found := TABLE.match(line))]
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
        fields = fields_read(self.words, max(len(lights), 1))
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
            compute = context.compute_shader(whole_program(self.text, self.words, lights))
        except Exception as error:  # moderngl's own, which has the compiler's message
            message = explained(str(error), self.file, self.text)
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


# --- The text of a shader: what it may hold, and the compute shader around it ------------------

SIGNATURE = "vec3 shade(Point point)"

POINT = {"position": 3, "normal": 3, "view": 3, "uv": 2, "ambient": 3}
MATERIAL = {
    "k_i": 3, "k_a": 3, "k_d": 3, "k_s": 3, "n": 1, "base_color": 3,
    "alpha": 1, "ior": 1, "metallic": 1,
}  # fmt: skip
EXTENT = {"radius": 1, "u": 3, "v": 3}
LIGHT = {
    "toward": 3, "distance": 1, "intensity": 3, "diffuse_intensity": 3, "specular_intensity": 3,
    "visible": 1,
}  # fmt: skip
"""Fields of the structures, and how many floats each is."""

_TYPES = {1: "float", 2: "vec2", 3: "vec3"}
_OURS = 1_000_001
"""Our lines after the user's are numbered from here, so messages can be told apart. Mesa 22 gives
the right number of the source string only in some of its messages.
"""

_ENVIRONMENT = """
uniform sampler2D fotismos_map;
uniform mat3 fotismos_to_local;
vec3 environment(vec3 direction) {
    vec3 d = fotismos_to_local * direction;
    ivec2 size = textureSize(fotismos_map, 0);
    float x = atan(d.x, -d.z) / 6.28318530718 * size.x - 0.5;
    float y = atan(length(d.xz), d.y) / 3.14159265359 * (size.y - 1);
    int left = int(floor(x)), top = clamp(int(y), 0, size.y - 2);
    vec3 rows[2];
    for (int row = 0; row < 2; ++row) {
        ivec2 a = ivec2((left + size.x) % size.x, top + row);
        ivec2 b = ivec2((left + 1 + size.x) % size.x, top + row);
        vec3 first = texelFetch(fotismos_map, a, 0).rgb;
        rows[row] = mix(first, texelFetch(fotismos_map, b, 0).rgb, x - left);
    }
    return mix(rows[0], rows[1], y - top);
}
"""
"""What reads the background: float textures, interpolated by hand, since OpenGL may round weights.
"""

_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
SHADE = re.compile(r"\bvec3\s+shade\s*\(\s*(?:const\s+)?(?:in\s+)?Point\b")
_PLACE = re.compile(r"(?<![\w.])\d+(?::(\d+)\(\d+\)|\((\d+)\)|:(\d+))\s*:\s*")
_NUMBER = r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)"
_PARAMETER = re.compile(
    rf"\s*uniform\s+float\s+(\w+)\s*=\s*{_NUMBER}\s*;\s*//\s*{_NUMBER}\s+to\s+{_NUMBER}\s*$"
)
TABLE = re.compile(r"\s*uniform\s+sampler2D\s+(\w+)\s*;\s*//\s*(\S.*\.py)\s*$")
_UNIFORM = re.compile(r"\s*(?:layout\s*\(.*\)\s*)?uniform\b")
_REFUSED = {
    re.compile(r"(?m)^[ \t]*#[ \t]*include\b"): "a shader is one file here: paste the included"
    " text in its place",
    re.compile(r"\bvoid\s+main\s*\("): "leave out `main`: fotismos calls `shade` for each point",
    re.compile(r"\b\w*fotismos_\w*"): "names with `fotismos_` are reserved: choose another one",
}


def bare(text: str) -> str:
    """Return GLSL without its comments, with the same lines."""
    return _COMMENT.sub(lambda comment: "\n" * comment[0].count("\n") or " ", text)


def uniforms(text: str) -> tuple[Parameter, ...]:
    """Return the parameters: ``uniform float NAME = DEFAULT;  // LOW to HIGH``."""
    matches = [match for line in text.splitlines() if (match := _PARAMETER.match(line))]
    return tuple(
        Parameter(name=name, default=float(default), low=float(low), high=float(high))
        for name, default, low, high in (match.groups() for match in matches)
    )


def refusal(text: str) -> tuple[int, str] | None:
    """Return the line of a forbidden word, and what to do; None if there is none."""
    code = bare(text)
    tables = 0
    for number, (line, stripped) in enumerate(
        zip(text.splitlines(), code.splitlines(), strict=False), 1
    ):
        is_table = TABLE.match(line) is not None
        tables += is_table
        if tables > 1:
            return number, "a shader has one table: join them, side by side or as channels"
        if _UNIFORM.match(stripped) and not (is_table or _PARAMETER.match(line)):
            return number, (
                "a uniform is a parameter: write its default and bounds, as in"
                " `uniform float wrap = 0.5;  // 0 to 1`; or it is a table, as in"
                " `uniform sampler2D table;  // table.py`"
            )
    for pattern, advice in _REFUSED.items():
        if match := pattern.search(code):
            return code.count("\n", 0, match.start()) + 1, advice
    return None


def explained(log: str, file: str, text: str) -> str:
    """Return the compiler's first errors, with places in a user's text as ``FILE, line N``.

    Compilers write a place as ``0:3(7)``, ``0(3)`` or ``0:3``: source, line, column. Of each line
    only the first counts, since others follow from it.
    """
    messages: dict[str, str] = {}
    for line in log.splitlines():
        if "error" not in line.lower():
            continue
        match = _PLACE.search(line)
        message = re.sub(r"(?i)^error:\s*", "", line[match.end() :] if match else line.strip())
        number = int(next(filter(None, match.groups()))) if match else 0
        position = f"{file}, line {number}" if number else file
        if number > text.count("\n") + 1:
            position = f"{file}, at its end"
        messages.setdefault(position, message.strip())
    shown = [f"{position}: {message}" for position, message in messages.items()]
    return "; ".join(shown[:3]) or f"{file}: {' '.join(log.split())}"


def _structure(name: str, fields: dict[str, int], more: str = "") -> str:
    declared = " ".join(f"{_TYPES[size]} {field};" for field, size in fields.items())
    return f"struct {name} {{ {declared} {more} }};"


def fields_read(names: frozenset[str], lights: int) -> dict[str, int]:
    """Return the fields of a point whose names code has, in the order of the buffer.

    They are such as ``lights[0].toward``, each with the number of its floats.
    """
    owners = [("", POINT), ("material.", MATERIAL)]
    for number in range(lights):
        owners += [(f"lights[{number}].", LIGHT), (f"lights[{number}].extent.", EXTENT)]
    return {
        owner + name: size
        for owner, fields in owners
        for name, size in fields.items()
        if name in names
    }


def whole_program(text: str, names: frozenset[str], lights: int) -> str:
    """Return the compute shader that calls the user's ``shade`` for all points.

    One buffer holds the floats, each for all points before the next.
    """
    readings = []
    number = 0
    for name, size in fields_read(names, lights).items():
        parts = [f"fotismos_read({number + part}, index)" for part in range(size)]
        is_mask = " > 0.5" if name.endswith(".visible") else ""
        readings.append(f"    point.{name} = {_TYPES[size]}({', '.join(parts)}){is_mask};\n")
        number += size
    whole = re.sub(r"(?m)^[ \t]*#[ \t]*version\b.*$", "", text)
    return f"""#version 430
layout(local_size_x = {GROUP}) in;
layout(std430, binding = 0) readonly buffer fotismos_In {{ float fotismos_values[]; }};
layout(std430, binding = 1) writeonly buffer fotismos_Out {{ float fotismos_colours[]; }};
uniform int fotismos_count;
{_structure("Material", MATERIAL)}
{_structure("Extent", EXTENT)}
{_structure("Light", LIGHT, "Extent extent;").replace("float visible", "bool visible")}
{_structure("Point", POINT, f"Material material; Light lights[{lights}];")}
{_ENVIRONMENT if "environment" in names else ""}
#line 1
{whole}

#line {_OURS}
float fotismos_read(int number, int point) {{
    return fotismos_values[number * fotismos_count + point];
}}
void main() {{
    int index = int(gl_GlobalInvocationID.x);
    if (index >= fotismos_count) return;
    Point point;
{"".join(readings)}
    vec3 colour = shade(point);
    for (int part = 0; part < 3; ++part) fotismos_colours[3 * index + part] = colour[part];
}}
"""
