"""Heuristics in GLSL: the same points as in Python, and every mistake in words."""

import json
import re
import sys
from pathlib import Path
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic import program, user_shaders
from fotismos.heuristic.errors import InputError, InstallationError
from fotismos.heuristic.glsl import opengl as contexts
from fotismos.heuristic.glsl import shader as glsl
from fotismos.heuristic.heuristics import INPUTS, Heuristic, named
from fotismos.reports.run import doctor
from tests.shared.opengl import opengl
from tests.shared.parts import camera
from tests.shared.wrong_shaders import SHADERS, SMALL, image, require_sizes

PHONG = str(SHADERS / "phong.glsl")


pytestmark = pytest.mark.thorough


def points(text, needs=INPUTS):
    """Return a shader, and the points of a trial."""
    shader = glsl.Shader("mine.glsl", text)
    return shader, user_shaders.trial_points(Heuristic("mine.glsl", shader, needs=frozenset(needs)))


def returning(expression):
    return f"vec3 shade(Point point) {{ return vec3({expression}); }}"


@opengl
@pytest.mark.guarantee("kernel", "Phong's model in GLSL gives the kernel's image to 1e-5.")
def test_phong_in_glsl_is_phong():
    spectral = {"variant": "llvm_ad_spectral", "heuristic_variant": "llvm_ad_rgb"}
    for scene, more in (
        ("fig-8-11-n3", {}),
        ("two-intensities", {}),
        ("cornell-box", {}),
        ("plastic-spheres", {}),
        ("fig-8-9", {"interpolation": "gouraud"}),
        ("fig-8-9", {"interpolation": "flat"}),
        ("fig-8-9", {"everything": True}),
        ("fig-8-9", spectral),
    ):
        own, theirs = (image(scene, name, **more) for name in ("phong", PHONG))
        assert own.max() > 0.1
        np.testing.assert_allclose(theirs, own, rtol=1e-5, atol=1e-5, err_msg=f"{scene} {more}")


@opengl
def test_a_light_has_the_size_of_its_lamp(rgb, written):
    light = "point.lights[0]"
    numbers = "{0}.extent.radius + 10 * length({0}.extent.v), abs({0}.extent.u.x), {0}.distance"
    require_sizes(written(returning(numbers.format(light)), "mine.glsl"))


def room(lights, **bsdf):
    """Return a sphere under a bright sky and some lights."""
    return {
        "type": "scene",
        "ball": {"type": "sphere", "bsdf": bsdf or {"type": "diffuse"}},
        "sky": {"type": "constant", "radiance": 0.4},
        "sensor": camera((0, 0, 5), up=(0, 1, 0), size=16),
        **{
            f"light{number}": {
                "type": "point", "intensity": 3 / lights,
                "position": [3 * np.cos(number), 3 * np.sin(number), 3],
            }
            for number in range(lights)
        },
    }  # fmt: skip


@opengl
def test_any_number_of_lights(rgb):
    for lights in (0, 1, glsl.LIGHTS):
        own, theirs = (image(room(lights), name) for name in ("phong", PHONG))
        np.testing.assert_allclose(theirs, own, rtol=1e-5, atol=1e-5)
    with pytest.raises(InputError, match=r"phong\.glsl: the scene has 65 lights; .* at most 64"):
        image(room(glsl.LIGHTS + 1), PHONG)


@opengl
def test_shadows_are_those_of_a_heuristic_in_python(rgb, written):
    written(
        "import drjit as dr\n"
        "def shade(point):\n"
        "    return sum(dr.select(l.visible(), l.intensity, 0) for l in point.lights)\n"
    )
    text = """vec3 shade(Point point) {
        vec3 sum = vec3(0.0);
        for (int i = 0; i < point.lights.length(); ++i)
            sum += point.lights[i].visible ? point.lights[i].intensity : vec3(0.0);
        return sum;
    }"""
    written(text, "mine.glsl")
    written(text.replace("point.lights[i].visible", "true"), "bright.glsl")
    python, glsl, bright = (
        image("cornell-box", name) for name in ("mine.py", "mine.glsl", "bright.glsl")
    )
    np.testing.assert_allclose(glsl, python, rtol=1e-5, atol=1e-5)
    assert abs(bright - glsl).max() > 0.01


def shown(colour):
    """Return a Dr.Jit colour as an array (3, points of the trial)."""
    return np.broadcast_to(np.array(colour, float).reshape(3, -1), (3, user_shaders.POINTS))


FIELDS = (
    [(name, name) for name in ("position", "normal", "view", "ambient")]
    + [(f"material.{name}", f"material.{name}") for name in glsl.MATERIAL]
    + [
        (f"lights[{number}].{name}", f"lights[{number}].{name}")
        for number in (0, 1)
        for name in ("toward", "intensity", "diffuse_intensity", "specular_intensity")
    ]
    + [("lights[0].distance", "lights[0].distance"), ("uv, 0.25", "uv")]
)


@opengl
def test_each_field_arrives_as_it_is(rgb):
    for name, field in FIELDS:
        shader, point = points(returning(f"point.{name}"))
        expected = eval(f"point.{field}", {"point": point})
        if field == "uv":
            expected = mi.Spectrum(expected.x, expected.y, 0.25)
        np.testing.assert_array_equal(shown(shader(point)), shown(mi.Spectrum(expected)), field)
    shader, point = points(returning("isinf(point.lights[1].distance) ? 1.0 : 0.0"))
    assert np.all(shown(shader(point)) == 1)


MISTAKES = {
    "syntax": (
        "vec3 shade(Point point) {\n    vec3 value = vec3(0)\n    return value;\n}",
        r"mine\.glsl, line 3: .*[Ss]yntax error",
    ),
    "field": (
        "// a comment\nvec3 shade(Point point) {\n\n    return point.normle;\n}",
        r"mine\.glsl, line 4: .*normle",
    ),
    "no shade": ("vec3 colour(Point point) { return vec3(1); }", "no function `vec3 shade"),
    "open brace": ("vec3 shade(Point point) { return vec3(1);", r"mine\.glsl, at its end: "),
    "recursion": (
        "vec3 f(vec3 a) { return f(a); }\nvec3 shade(Point point) { return f(point.normal); }",
        r"mine\.glsl: .*recursion",
    ),
    "include": ('\n#include "x"\n' + returning("1"), r"mine\.glsl, line 2: .* one file"),
    "main": (returning("1") + "\nvoid main() {}", r"mine\.glsl, line 2: leave out `main`"),
    "our names": (returning("fotismos_count"), r"mine\.glsl, line 1: .*are reserved"),
    "not a number": (returning("sqrt(-1.0 - point.uv.x)"), r"line 1: .* finite.* max\(x, 1e-6\)"),
    "negative": ("\n" + returning("point.normal"), r"line 2: .* 0 or more.* max\(cosine, 0\)"),
}


@opengl
def test_a_mistake_is_named_by_its_line(written):
    lines = "uniform float wrap;", "uniform vec3 tint = vec3(1); // 0 to 1"
    uniforms = [(f"{line}\n{returning('0.5')}", "line 1: a uniform is a") for line in lines]
    for text, message in (*MISTAKES.values(), *uniforms):
        with pytest.raises(InputError, match=rf"(?s){message}"):
            named(written(text, "mine.glsl"))


def test_what_is_not_a_shader_file_is_refused(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match=r"gone\.glsl: there is no such file"):
        named("gone.glsl")
    Path("noise.glsl").write_bytes(b"\xff\xfe\x00vec3")
    with pytest.raises(InputError, match=r"noise\.glsl is not text in UTF-8"):
        named("noise.glsl")
    Path("long.glsl").write_bytes(b" " * (glsl.LARGEST + 1))
    with pytest.raises(InputError, match=r"long\.glsl: 1048577 bytes are too long"):
        named("long.glsl")


@opengl
@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "llvm_ad_mono"])
def test_other_colours_than_rgb_are_refused(variant):
    with pytest.raises(InputError, match=rf"needs RGB colours, which {variant} does not have"):
        image("fig-8-9", PHONG, variant=variant)


@opengl
def test_a_record_says_that_the_gpu_is_software(monkeypatch, written):
    name = written(returning("0.5"), "mine.glsl")
    for renderer, is_software in (("llvmpipe (LLVM 15)", True), ("NVIDIA L4", False)):
        monkeypatch.setattr(contexts, "device", lambda shown=(renderer, is_software): shown)
        monkeypatch.setattr(glsl, "_known", {})
        case = open_case("fig-8-9", Options(heuristic=name, **SMALL))
        assert ("software GPU" in named(name).label) == is_software
        warnings = compare(case.source, case.options).record.warnings
        assert ("a software GPU" in json.dumps(warnings)) == is_software


def test_without_moderngl_it_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "moderngl", None)
    monkeypatch.setattr(contexts, "_kept", contexts.threading.local())
    with pytest.raises(InstallationError, match=re.escape(program.installation("moderngl"))):
        contexts.context()
    assert "pip install" in doctor.shaded()
    pool = SimpleNamespace(do=lambda task: task.function(*task.arguments))
    monkeypatch.setattr(doctor, "rendered", lambda _: "renders")
    monkeypatch.setattr(doctor, "compared", lambda: 0.0)
    *_, last = doctor.examine(pool, ["llvm_ad_rgb"])
    assert last == "fotismos works here."


def test_without_a_driver_it_says_what_to_install(monkeypatch):
    moderngl = pytest.importorskip("moderngl")

    def fail(**_):
        raise OSError("libEGL.so is not there")

    monkeypatch.setattr(moderngl, "create_context", fail)
    monkeypatch.setattr(contexts, "_kept", contexts.threading.local())
    with pytest.raises(InstallationError, match="apt-get install libegl1 libgl1-mesa-dri"):
        contexts.context()


WRAPPED = """uniform float wrap = 0.5;  // 0 to 1
uniform float unused = 2; // 1e-1 to 1e1
vec3 shade(Point point) {
    vec3 value = vec3(0);
    for (int i = 0; i < point.lights.length(); ++i) {
        float cosine = (dot(point.normal, point.lights[i].toward) + wrap) / (1.0 + wrap);
        value += point.material.base_color * point.lights[i].intensity * max(cosine, 0.0);
    }
    return value + point.ambient * point.material.base_color;
}
"""


@opengl
def test_a_uniform_with_bounds_is_a_parameter(rgb, tmp_path):
    path = tmp_path / "wrapped.glsl"
    path.write_text(WRAPPED, encoding="utf-8")
    found = [named(name).parameters for name in (str(path), str(SHADERS / "wrapped.py"))]
    assert found[0][0] == found[1][0]
    assert (found[0][1].low, found[0][1].high) == (0.1, 10)
    images = []
    for name in (str(path), str(SHADERS / "wrapped.py")):
        case = open_case("plastic-spheres", Options(heuristic=name, resolution=(24, 24)))
        half = prepare(case.source, case.options).heuristic
        for wrap in (0.5, 0.1):
            half.integrator.parameters["wrap"] = mi.Float(wrap)
            images.append(np.array(half.render(1)))
    np.testing.assert_allclose(images[:2], images[2:], rtol=1e-4, atol=1e-5)
    assert abs(images[0] - images[1]).mean() > 0.01
