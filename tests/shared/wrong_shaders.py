"""Shaders that are wrong on purpose: Phong's in GLSL or Python, with one piece of it replaced."""

from dataclasses import dataclass
from pathlib import Path

import mitsuba as mi
import numpy as np

from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.pairing import halves
from fotismos.reference.scene.source import Source
from tests.shared.parts import camera, look_at, moved

SHADERS = Path(__file__).parents[2] / "docs/shaders"


@dataclass(frozen=True)
class Wrong:
    """A mistake: the piece of phong.py or phong.glsl, what replaces it, and its message."""

    name: str
    suffix: str
    piece: str
    wrong: str
    message: str

    def write(self, folder: Path) -> Path:
        """Write the shader to a folder, and return its path."""
        text = (SHADERS / f"phong{self.suffix}").read_text(encoding="utf-8")
        assert self.piece in text
        path = folder / f"wrong{self.suffix}"
        path.write_text(text.replace(self.piece, self.wrong), encoding="utf-8")
        return path


GLSL, PYTHON = ".glsl", ".py"
RETURN = "return value;"
LAST = "    return value"

WRONG = (
    Wrong("missing 1/π", GLSL, RETURN, "return 3.14159 * value;", "a missing division by pi"),
    Wrong("1/π twice", PYTHON, LAST, "    return value / 3.14159", "a division by pi too many"),
    Wrong("1/π in the diffuse term alone", GLSL, "material.k_d * cosine",
          "material.k_d / 3.14159 * cosine", "diffuse light .* division by pi too many"),
    Wrong("channels swapped", GLSL, RETURN, "return value.bgr;",
          "channels look like blue, green, red"),
    Wrong("encoded for the display", GLSL, RETURN, "return pow(value, vec3(1.0 / 2.2));",
          "encoded by a power of 1/2.2"),
    Wrong("gamma twice", GLSL, RETURN, "return pow(value, vec3(2.2));",
          "decoded by a power of 2.2"),
    Wrong("colours decoded twice", GLSL, "Material material = point.material;",
          "Material material = point.material; material.k_a = pow(material.k_a, vec3(2.2));"
          " material.k_d = pow(material.k_d, vec3(2.2));"
          " material.k_s = pow(material.k_s, vec3(2.2));",
          "colours are decoded by a power of 2.2"),
    Wrong("normal in another space", GLSL, "vec3 shade(Point point) {",
          "vec3 shade(Point point) { point.normal = vec3(1, 1, -1) * point.normal.xzy;",
          r"the normal is in another space: it looks like \(x, z, -y\)"),
    Wrong("normal not normalised", GLSL, "vec3 shade(Point point) {",
          "vec3 shade(Point point) { point.normal *= 0.7;",
          "the normal is not normalised: it has a length of 0.7"),
    Wrong("normal still encoded", GLSL, "vec3 shade(Point point) {",
          "vec3 shade(Point point) { point.normal = 0.5 * point.normal + 0.5;",
          "the normal is encoded as N / 2"),
    Wrong("light vector reversed", GLSL, "Light light = point.lights[i];",
          "Light light = point.lights[i]; light.toward = -light.toward;",
          "the light vector is reversed"),
    Wrong("light vector not normalised", GLSL, "Light light = point.lights[i];",
          "Light light = point.lights[i]; light.toward *= 1.5;",
          "the light vector is not normalised: it has a length of 1.5"),
    Wrong("reflect() of the wrong vector", GLSL,
          "2.0 * cosine * point.normal - light.toward", "reflect(light.toward, point.normal)",
          r"mirrored vector is reversed, .* GLSL's reflect"),
    Wrong("half vector for the reflection", GLSL, "dot(mirrored, point.view)",
          "dot(point.normal, normalize(light.toward + point.view))", "about the half vector"),
    Wrong("view vector of another space", GLSL, "dot(mirrored, point.view)",
          "dot(mirrored, normalize(-point.position))", "view vector is the position reversed"),
    Wrong("view vector not normalised", GLSL, "dot(mirrored, point.view)",
          "dot(mirrored, 1.5 * point.view)", "the view vector is not normalised: .* length of 1.5"),
    Wrong("exponent times 4", PYTHON, "** material.n", "** (4 * material.n)",
          "the exponent is 4 times"),
    Wrong("fall-off twice", GLSL, "_intensity *",
          "_intensity / (light.distance * light.distance) *", "a second time"),
    Wrong("fall-off left out", PYTHON, "_intensity *",
          "_intensity * dr.minimum(light.distance, 9) ** 2 *", "fall-off .* is missing"),
    Wrong("N·L not clamped", GLSL, "if (cosine > 0.0) {", "if (true) {", "Clamp what can be"),
    Wrong("N·L without its sign", GLSL, "float cosine = dot(point.normal, light.toward);",
          "float cosine = abs(dot(point.normal, light.toward));", "N.L has lost its sign"),
    Wrong("ambient light twice", GLSL, "point.ambient *", "2.0 * point.ambient *",
          "ambient light is 2 times"),
    Wrong("ambient light for each light", PYTHON, "point.ambient *",
          "len(point.lights) * point.ambient *", "ambient light is 3 times .* for each light"),
    Wrong("the first light alone", GLSL, "i < point.lights.length()", "i < 1",
          "only the first light"),
)  # fmt: skip
"""All of them, each with its message, as a regular expression."""


SMALL = {"resolution": (24, 24), "spp": 8}


def image(scene, name, **more):
    case = open_case(scene, Options(heuristic=name, **{**SMALL, **more}))
    return np.array(prepare(case.source, case.options).heuristic.render(3))


FACING = look_at((1, 0, 3), (1, 0, 0), (0, 1, 0))
SIZES = (
    ({"type": "point", "position": (1, 0, 3)}, (0, 0)),
    ({"type": "sphere", "center": (1, 0, 3), "radius": 0.5}, (0.5, 0)),
    ({"type": "disk", "to_world": FACING.scale(0.3)}, (0.3, 0)),
    ({"type": "rectangle", "to_world": FACING.scale((2, 0.7, 1))}, (7, 2)),
    ({"type": "cube", "to_world": moved((1, 0, 3), 0.2)}, (0, 0)),
)
"""Lamps, with the radius, or ten times the length of v; and how far u extends along x."""


def require_sizes(name):
    """Require a shader that returns these numbers, and the distance to a lamp's middle."""
    for lamp, size in SIZES:
        shines = {} if lamp["type"] == "point" else {"emitter": {"type": "area"}}
        scene = {
            "type": "scene", "floor": {"type": "rectangle"}, "lamp": lamp | shines,
            "sensor": camera((0, 0, 2), up=(0, 1, 0), size=1, fov=0.1),
        }  # fmt: skip
        half = halves.pair(Source("lamp", scene), halves.PairOptions(heuristic=name)).heuristic
        shown = np.array(mi.render(half.instantiate(), spp=1))[0, 0]
        np.testing.assert_allclose(shown, (*size, np.sqrt(10)), atol=2e-3, err_msg=lamp["type"])
