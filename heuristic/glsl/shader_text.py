"""The text of a compute shader around a user's function, and the compiler's messages about it."""

import re

GROUP = 64
"""Points that one work group shades."""

POINT = {"position": 3, "normal": 3, "view": 3, "uv": 2, "ambient": 3}
MATERIAL = {
    "k_i": 3, "k_a": 3, "k_d": 3, "k_s": 3, "n": 1, "base_color": 3,
    "alpha": 1, "ior": 1, "metallic": 1,
}  # fmt: skip
LIGHT = {"toward": 3, "distance": 1, "intensity": 3, "visible": 1}
"""Fields of the structures, and how many floats each is."""

_TYPES = {1: "float", 2: "vec2", 3: "vec3"}
_OURS = 1_000_001
"""Our lines after the user's are numbered from here, so messages can be told apart. Mesa 22 gives
the right number of the source string only in some of its messages.
"""

_COMMENT = re.compile(r"//[^\n]*|/\*.*?\*/", re.DOTALL)
_SHADE = re.compile(r"\bvec3\s+shade\s*\(\s*(?:const\s+)?(?:in\s+)?Point\b")
_PLACE = re.compile(r"(?<![\w.])\d+(?::(\d+)\(\d+\)|\((\d+)\)|:(\d+))\s*:\s*")
_NUMBER = r"([-+]?[\d.]+(?:[eE][-+]?\d+)?)"
_PARAMETER = re.compile(
    rf"\s*uniform\s+float\s+(\w+)\s*=\s*{_NUMBER}\s*;\s*//\s*{_NUMBER}\s+to\s+{_NUMBER}\s*$"
)
_UNIFORM = re.compile(r"\s*(?:layout\s*\(.*\)\s*)?uniform\b")
_REFUSED = {
    re.compile(r"(?m)^[ \t]*#[ \t]*include\b"): "a shader is one file here: paste the included"
    " text in its place",
    re.compile(r"\bvoid\s+main\s*\("): "leave out `main`: fotismos calls `shade` for each point",
    re.compile(r"\b\w*fotismos_\w*"): "names with `fotismos_` are reserved: choose another one",
}


def bare(text: str) -> str:
    """Return GLSL without its comments, with the same lines."""
    return _COMMENT.sub(lambda found: "\n" * found[0].count("\n") or " ", text)


def line_of_shade(text: str) -> int | None:
    """Return the line on which ``vec3 shade(Point point)`` begins, None if it is missing."""
    code = bare(text)
    found = _SHADE.search(code)
    return code.count("\n", 0, found.start()) + 1 if found else None


def words(text: str) -> frozenset[str]:
    """Return the words of the code; it cannot read anything else."""
    return frozenset(re.findall(r"\b[A-Za-z_]\w*", bare(text)))


def values(text: str, lights: int) -> dict[str, int]:
    """Return the fields that a shader may read of a point, in the order of the buffer.

    They are such as ``lights[0].toward``, each with the number of its floats.
    """
    known = words(text)
    owners = [("", POINT), ("material.", MATERIAL)]
    owners += [(f"lights[{number}].", LIGHT) for number in range(lights)]
    return {
        owner + name: size
        for owner, fields in owners
        for name, size in fields.items()
        if name in known
    }


def program(text: str, lights: int) -> str:
    """Return the compute shader that calls a user's ``shade`` for all points.

    One buffer holds the floats, each for all points before the next.
    """
    whole = re.sub(r"(?m)^[ \t]*#[ \t]*version\b.*$", "", text)
    return f"""#version 430
layout(local_size_x = {GROUP}) in;
layout(std430, binding = 0) readonly buffer fotismos_In {{ float fotismos_values[]; }};
layout(std430, binding = 1) writeonly buffer fotismos_Out {{ float fotismos_colours[]; }};
uniform int fotismos_count;
{_structure("Material", MATERIAL)}
{_structure("Light", LIGHT).replace("float visible", "bool visible")}
{_structure("Point", POINT, f"Material material; Light lights[{lights}];")}
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
{_readings(text, lights)}
    vec3 colour = shade(point);
    for (int part = 0; part < 3; ++part) fotismos_colours[3 * index + part] = colour[part];
}}
"""


def parameters(text: str) -> list[tuple[str, float, float, float]]:
    """Return name, default and bounds of ``uniform float NAME = DEFAULT;  // LOW to HIGH``."""
    found = (each for line in text.splitlines() if (each := _PARAMETER.match(line)))
    return [(each[1], float(each[2]), float(each[3]), float(each[4])) for each in found]


def refusal(text: str) -> tuple[int, str] | None:
    """Return the line of a forbidden word, and what to do; None if there is none."""
    for number, (line, own) in enumerate(
        zip(text.splitlines(), bare(text).splitlines(), strict=False), 1
    ):
        if _UNIFORM.match(own) and not _PARAMETER.match(line):
            return number, (
                "a uniform is a parameter: write its default and bounds, as in"
                " `uniform float wrap = 0.5;  // 0 to 1`"
            )
    code = bare(text)
    for pattern, advice in _REFUSED.items():
        if found := pattern.search(code):
            return code.count("\n", 0, found.start()) + 1, advice
    return None


def explained(log: str, file: str, text: str) -> str:
    """Return the compiler's first errors, with places in a user's text as ``FILE, line N``.

    Compilers write a place as ``0:3(7)``, ``0(3)`` or ``0:3``: source, line, column. Of each line
    only the first counts, since others follow from it.
    """
    lines = [line.strip() for line in log.splitlines() if "error" in line.lower()]
    told: dict[str, str] = {}
    for line in lines:
        told.setdefault(*_placed(line, file, text.count("\n") + 1))
    found = [f"{place}: {message}" for place, message in told.items()]
    return "; ".join(found[:3]) or f"{file}: {' '.join(log.split())}"


def _placed(line: str, file: str, length: int) -> tuple[str, str]:
    found = _PLACE.search(line)
    message = re.sub(r"(?i)^error:\s*", "", line[found.end() :] if found else line).strip()
    number = int(next(filter(None, found.groups()))) if found else 0
    if number > length:
        return f"{file}, at its end", message
    return f"{file}, line {number}" if number else file, message


def _structure(name: str, fields: dict[str, int], more: str = "") -> str:
    declared = " ".join(f"{_TYPES[size]} {field};" for field, size in fields.items())
    return f"struct {name} {{ {declared} {more} }};"


def _readings(text: str, lights: int) -> str:
    """Return the statements that fill a point."""
    lines, number = [], 0
    for name, size in values(text, lights).items():
        parts = [f"fotismos_read({number + part}, index)" for part in range(size)]
        whole = f"{_TYPES[size]}({', '.join(parts)})"
        is_mask = name.endswith(".visible")
        lines.append(f"    point.{name} = {whole}{' > 0.5' if is_mask else ''};")
        number += size
    return "\n".join(lines)
