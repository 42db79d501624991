"""The text of a shader in GLSL: what it may hold, and the compute shader around it."""

import re

from fotismos.heuristic.glsl.opengl import GROUP
from fotismos.heuristic.heuristics import Parameter

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


def source(text: str, names: frozenset[str], lights: int) -> str:
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
