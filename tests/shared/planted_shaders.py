"""Five right shaders, and twelve kinds of mistakes to plant in each: 60 wrong ones.

A shader is a text with named pieces; a kind of mistake replaces one of them.
"""

from dataclasses import dataclass
from string import Template

PYTHON = """import fotismos  # noqa: F401  isort: skip
import drjit as dr
import mitsuba as mi


def shade(point):
    material, view = point.material, point.view
    normal = $normal
    value = $first
    for light in point.lights:
        toward = $toward
        intensity = $intensity
        half = dr.normalize(toward + view + 1e-6 * normal)
        cosine = $cosine
        value $sum intensity * ($model)
    return $result
"""

GLSL = """vec3 shade(Point point) {
    Material material = point.material;
    vec3 normal = $normal, view = point.view;
    vec3 value = $first;
    for (int i = 0; i < point.lights.length(); ++i) {
        vec3 toward = $toward, intensity = $intensity;
        float cosine = $cosine, facing = max(dot(normal, view), 0.0);
        float s = dot(toward, view) - cosine * facing;
        float rough = 0.79 + 0.33 * max(s, 0.0) / max(max(cosine, facing), 1e-3);
        float top = max(dot(normal, normalize(toward + view + 1e-6 * normal)), 1e-6);
        value $sum intensity * ($model);
    }
    return $result;
}
"""

RIGHT = {
    "normal": "point.normal",
    "first": "point.ambient * material.base_color",
    "toward": "light.toward",
    "intensity": "light.intensity",
    "cosine": "dr.maximum(dr.dot(normal, toward), 0)",
    "sum": "+=",
    "result": "value",
}
RIGHT_GLSL = RIGHT | {
    "toward": "point.lights[i].toward",
    "intensity": "point.lights[i].intensity",
    "cosine": "max(dot(normal, toward), 0.0)",
}

LOBE = "dr.maximum(dr.dot(normal, half), 1e-6)"

KINDS = {
    "reversed light": {"toward": "-light.toward"},
    "light of either side": {"cosine": "dr.abs(dr.dot(normal, toward))"},
    "gamma": {"result": "dr.maximum(value, 0) ** (1 / 2.2)"},
    "cut at 1": {"result": "dr.minimum(value, 1)"},
    "factor of pi": {"result": "value * 3.14159"},
    "fall-off twice": {"intensity": "light.intensity / dr.square(light.distance)"},
    "fall-off left out": {
        "intensity": "light.intensity * dr.square(dr.minimum(light.distance, 9))"
    },
    "channels swapped": {"result": "mi.Spectrum(value[2], value[1], value[0])"},
    "sum overwritten": {"sum": f"= {RIGHT['first']} +"},
    "normal in another space": {
        "normal": "mi.Vector3f(point.normal.x, point.normal.z, -point.normal.y)"
    },
}
"""Ten kinds; the missing and the squared cosine depend on the model."""

KINDS_GLSL = {
    "reversed light": {"toward": "-point.lights[i].toward"},
    "light of either side": {"cosine": "abs(dot(normal, toward))"},
    "gamma": {"result": "pow(value, vec3(1.0 / 2.2))"},
    "cut at 1": {"result": "min(value, vec3(1.0))"},
    "factor of pi": {"result": "3.14159 * value"},
    "fall-off twice": {
        "intensity": "point.lights[i].intensity / pow(point.lights[i].distance, 2.0)"
    },
    "fall-off left out": {
        "intensity": "point.lights[i].intensity * pow(min(point.lights[i].distance, 9.0), 2.0)"
    },
    "channels swapped": {"result": "value.bgr"},
    "sum overwritten": {"sum": f"= {RIGHT['first']} +"},
    "normal in another space": {"normal": "vec3(1, 1, -1) * point.normal.xzy"},
}

MESSAGES = {
    "reversed light": "the light vector is reversed",
    "light of either side": r"N\.L (has lost its sign|> 0 missing)",
    "gamma": "encoded by a power of 1/2.2",
    "cut at 1": "values end at 1",
    "factor of pi": "division by pi",
    "fall-off twice": "square of the distance a second time",
    "fall-off left out": "square of the distance is missing",
    "channels swapped": "blue, green, red",
    "sum overwritten": "only the last light",
    "normal in another space": "in another space",
    "missing cosine": "missing cosine",
    "squared cosine": "squared cosine",
}
"""What names each kind, as a regular expression."""


@dataclass(frozen=True)
class Planted:
    """A right shader: its model with ``cosine``, and the pieces of two kinds of mistakes."""

    name: str
    model: str
    missing: str
    squared: str
    suffix: str = ".py"

    def text(self, kind: str = "") -> str:
        """Return the text of the shader with a kind of mistake, or the right one."""
        is_glsl = self.suffix == ".glsl"
        pieces = (RIGHT_GLSL if is_glsl else RIGHT) | {"model": self.model}
        kinds = (KINDS_GLSL if is_glsl else KINDS) | {
            "missing cosine": {"model": self.missing},
            "squared cosine": {"model": self.squared},
        }
        changed = kinds[kind] if kind else {}
        return Template(GLSL if is_glsl else PYTHON).substitute(pieces | changed)


_BLINN = (
    f"material.k_d * {{}} + material.k_s * dr.select(cosine > 0, {LOBE} ** (4 * material.n), 0)"
)
_GGX = (
    "{} * (material.base_color * (1 - material.metallic) + dr.square(material.alpha / (1 -"
    f" {LOBE} ** 2 * (1 - dr.square(material.alpha)))) / 4 * dr.lerp(dr.square((material.ior - 1) /"
    " (material.ior + 1)), material.base_color, material.metallic))"
)
_OREN = "material.base_color * {} * rough + material.k_s * pow(top, 4.0 * material.n) * {}"
_TOON = "material.base_color * {}"

SHADERS = (
    Planted("Lambert", "material.k_d * cosine", "material.k_d", "material.k_d * cosine * cosine"),
    Planted("Blinn", _BLINN.format("cosine"), _BLINN.format("1"), _BLINN.format("cosine * cosine")),
    Planted("Cook-Torrance", _GGX.format("cosine"), _GGX.format("1"), _GGX.format("cosine ** 2")),
    Planted(
        "toon",
        _TOON.format("dr.ceil(cosine * 3) / 3"),
        _TOON.format("1"),
        _TOON.format("cosine * dr.ceil(cosine * 3) / 3"),
    ),
    Planted(
        "Oren-Nayar in GLSL",
        _OREN.format("cosine", "step(1e-6, cosine)"),
        _OREN.format("1.0", "1.0"),
        _OREN.format("cosine * cosine", "step(1e-6, cosine)"),
        suffix=".glsl",
    ),
)
