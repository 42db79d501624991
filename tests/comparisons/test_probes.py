"""Mistakes are named in shaders of any model, and nothing is said of right ones."""

import re
from pathlib import Path

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.audit import diagnosis, probes
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.steps import steps
from fotismos.heuristic import heuristics
from fotismos.reports import verdict
from tests.shared.opengl import opengl
from tests.shared.parts import camera, look_at, moved
from tests.shared.planted_shaders import MESSAGES, SHADERS


def each_shader(quick):
    """Return parameters of all shaders, of which those of some names are quick."""
    parameters = []
    for shader in SHADERS:
        marks = [] if shader.name in quick else [pytest.mark.thorough]
        if shader.suffix == ".glsl":
            marks.append(opengl)
        parameters.append(pytest.param(shader, id=shader.name, marks=marks))
    return parameters


HEAD = """import fotismos  # isort: skip
import drjit as dr
import mitsuba as mi


def soft(low, high, x):
    t = dr.clip((x - low) / (high - low), 0, 1)
    return t * t * (3 - 2 * t)


def shade(point):
    m, n, v = point.material, point.normal, point.view
    facing = dr.maximum(dr.dot(n, v), 1e-3)
    value = point.ambient * m.base_color
    for light in point.lights:
        I, toward = light.intensity, light.toward
        signed = dr.dot(n, toward)
        c = dr.maximum(signed, 0)
        top = dr.maximum(dr.dot(n, dr.normalize(toward + v + 1e-6 * n)), 1e-6)
"""

OTHERS = {
    "half-Lambert": "value += I * m.base_color * (0.5 * signed + 0.5) ** 2",
    "Minnaert": "value += I * m.base_color * dr.maximum(c, 1e-6) ** 0.8 * facing ** -0.2",
    "sheen": "value += I * c * (m.base_color + 0.5 * (1 - facing) ** 5)",
    "a rim": "value += I * (c * m.base_color + dr.select(signed > 0, 0.3, 0) * (1 - facing) ** 3)",
    "a soft ramp": "value += I * m.base_color * (soft(0, 0.05, signed) + soft(0.5, 0.6, c)) / 2",
    "two tones": "value += I * m.base_color * dr.select(signed > 0.3, 1, 0.2)",
    "a toon highlight": "value += I * (m.base_color * dr.ceil(c * 4) / 4"
    " + m.k_s * dr.select((top > 0.95) & (signed > 0), 1, 0))",
    "steps of the sum": "value += I * m.base_color * c\n    value = dr.ceil(value * 8) / 8",
    "steps of the luminance": "value += I * c\n"
    "    value = m.base_color * dr.ceil(dr.mean(value) * 4) / 4",
    "no intensity": "value += m.base_color * dr.ceil(c * 3) / 3",
    "a pattern": "value += I * c * m.base_color * (1 + dr.sin(9 * point.position.x))",
    "leaves": "value += I * m.base_color * (c + 0.3 * dr.maximum(-signed, 0))",
    "mirrors alone": "value += I * m.k_s * dr.select(signed > 0, top ** (4 * m.n), 0)",
    "normals": "value = mi.Spectrum(0.5 * n + 0.5)",
    "fog": "value += I * c * m.base_color\n"
    "    value = dr.lerp(value, 0.5, dr.exp(-dr.norm(point.position)))",
    "Gooch": "value += I * dr.lerp(mi.Spectrum(0.1, 0.1, 0.4), m.base_color, 0.5 * signed + 0.5)",
    "red below the skin": "value += I * m.base_color *"
    " mi.Spectrum(dr.maximum((signed + 0.4) / 1.4, 0), c, c)",
    "F0 of its own": "value += I * c * (m.base_color + 0.04 * m.alpha ** 2 /"
    " (1 - top * top * (1 - m.alpha ** 2)) ** 2 / (c + facing + 0.1))",
}  # fmt: skip
"""What is added in the loop over the lights."""

BROKEN = {
    "fails": "value += I * c\n    if len(point.lights) == 1:\n        raise RuntimeError('no')",
    "is not finite": "value += I * c\n    if len(point.lights) == 1:\n        value /= mi.Float(0)",
}


def written(folder, body):
    path = folder / "mine.py"
    path.write_text(f"{HEAD}        {body}\n    return value\n", encoding="utf-8")
    return str(path)


@pytest.mark.guarantee("runs", "Twelve kinds of mistakes are named in five shaders, 60 in all.")
@pytest.mark.parametrize("shader", each_shader(quick={"Blinn"}))
def test_planted_mistakes_are_named(rgb, tmp_path, shader):
    for number, (kind, message) in enumerate(MESSAGES.items()):
        path = tmp_path / f"wrong{number}{shader.suffix}"
        path.write_text(shader.text(kind), encoding="utf-8")
        (said,) = diagnosis.describe(str(path))
        assert re.search(message, said), (kind, said)
        is_number = r"\d|\(x, z, -y\)"
        assert re.search(is_number, said), (kind, said)


@pytest.mark.parametrize("shader", each_shader(quick={"Lambert", "Blinn", "Cook-Torrance"}))
def test_nothing_is_said_of_the_right_ones(rgb, tmp_path, shader):
    path = tmp_path / f"right{shader.suffix}"
    path.write_text(shader.text(), encoding="utf-8")
    assert diagnosis.describe(str(path)) == ()


@pytest.mark.thorough
@pytest.mark.parametrize("body", OTHERS.values(), ids=OTHERS)
def test_nothing_is_said_of_what_is_meant(rgb, tmp_path, body):
    assert diagnosis.describe(written(tmp_path, body)) == ()


FURTHER = {
    "gates for highlights": (
        "value += I * (c + m.k_s * top ** m.n)", "gives highlights, .* N.L > 0"
    ),
    "a view reversed": (
        "value += I * c * (m.base_color + m.k_s * dr.maximum(dr.dot(n,"
        " dr.normalize(toward - v)), 1e-6) ** m.n)", "the view vector or the mirrored one",
    ),
    "a tone curve": ("value += I * c\n    value = value / (1 + value)", "tone-mapped by x / "),
    "another one": (
        "value += I * c\n    value = 1 - dr.exp(-value)", "1.9. times the value, not 2"
    ),
    "a length": ("value += I * dr.maximum(dr.dot(n, toward * dr.minimum(light.distance, 9)), 0)",
                 "0.5 times as large, not 0.25: .* is the light vector not normalised"),
    "the first light": ("value += I * c * m.base_color\n        break", "only the first light"),
    "the brighter light": ("value = dr.maximum(value, I * c)", "they are not added"),
    "grey light": ("value += dr.mean(I) * c * m.base_color", "channels are mixed: 67%"),
    "a view of another space": (
        "value += I * c * (1 + dr.dot(n, dr.normalize(point.position)) ** 2)", "another space"
    ),
}  # fmt: skip


@pytest.mark.parametrize(("body", "message"), FURTHER.values(), ids=FURTHER)
def test_further_mistakes_are_named(rgb, tmp_path, body, message):
    (said,) = diagnosis.describe(written(tmp_path, body))
    assert re.search(message, said), said


PREPARE = """

def prepare(scene):
    return {}


"""
"""A shader keeps what it makes of a scene, and adds it to the light of the lamps."""

KEPT = {
    "the mean of the background": "fotismos.environment(scene, mi.Vector3f(0, 0, 1))",
    "the lamps": "1 / len(scene.emitters())",
}
SHINING = "value += point.prepared * m.base_color + I * m.base_color * {}"


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("cosine", "message"),
    {
        "c": None,
        "1": "missing cosine",
        "c * c": "squared cosine",
        "dr.maximum(-signed, 0)": "below",
    }.items(),
)
@pytest.mark.parametrize("kept", KEPT)
def test_a_shader_that_prepares_a_scene_is_probed_in_the_dark(rgb, tmp_path, kept, cosine, message):
    path = Path(written(tmp_path, SHINING.format(cosine)))
    text = path.read_text(encoding="utf-8")
    path.write_text(text + PREPARE.format(KEPT[kept]), encoding="utf-8")
    said = diagnosis.describe(str(path))
    if message and kept != "the lamps":
        assert re.search(message, said[0])
    else:  # it fails without lamps, and what it makes of one says nothing of others
        assert said == ()


def test_the_chapters_models_pass_every_probe(rgb):
    for name in ("phong", "blinn"):
        assert probes.findings(heuristics.named(name)) == {}


@pytest.mark.parametrize("body", BROKEN.values(), ids=BROKEN)
def test_a_shader_that_breaks_in_a_probe_is_compared_all_the_same(rgb, tmp_path, body):
    path = written(tmp_path, body)
    assert diagnosis.describe(path) == ()


def compared(source, path, **options):
    case = open_case(source, Options(heuristic=path, resolution=(16, 12), spp=8, **options))
    return compare(case.source, case.options, then=steps(why=False)).record


def test_the_textbook_stands_beside_a_wrong_shader_and_no_advice_to_trace(rgb, tmp_path):
    path = tmp_path / "mine.py"
    path.write_text(SHADERS[1].text("reversed light"), encoding="utf-8")
    record = compared("lambert-sphere", str(path))
    assert record.textbook < 0.01 < 10 < record.metrics[LEADING.name].mean
    said = verdict.about(record)
    assert "the light vector is reversed" in said
    assert said.endswith("Correct the shader first.")
    assert (verdict.cause(record), verdict.most_missing([record])) == ("", "")
    assert verdict.price_at(record) is None


@pytest.mark.thorough
def test_the_textbooks_error_is_that_of_its_own_picture(rgb):
    path = Path(__file__).parents[2] / "docs/shaders/phong.py"
    for scene in ("plastic-spheres", "fig-8-11-n9"):
        record = compared(scene, str(path))
        assert record.textbook == pytest.approx(record.metrics[LEADING.name].mean, rel=1e-3)
        assert record.textbook > 0.1
    assert compared("fig-8-9", "blinn").textbook is None


@pytest.mark.thorough
def test_commands_tell_both(run, tmp_path):
    path, out = tmp_path / "mine.py", tmp_path / "out"
    path.write_text(SHADERS[1].text("reversed light"), encoding="utf-8")
    words = ("--no-why", "--spp", 4, "--resolution", "16x16", "-o", out)
    code, said, _ = run("compare", "lambert-sphere", "--heuristic", path, *words)
    page = (out / "index.html").read_text()
    finding = "the light vector is reversed, or the normal."
    assert code == 0
    assert said.count(finding) == 1
    assert re.search(r"mine\.py \d\d\.\d, Phong .* \(mean ΔE2000\)", said)
    assert "samples per pixel pass" not in said
    assert finding in page
    assert "Phong <data" in page
    assert "cheapest of all methods" not in page
    code, said, _ = run("audit", "--heuristic", path, "-o", out)
    assert finding in said
    assert finding in (out / "index.html").read_text()


# --- On scenes -------------------------------------------------------------------------------

FLOOR = {"type": "rectangle", "to_world": moved((0, 0, 0), 3), "bsdf": {"type": "diffuse"}}
BALL = {"type": "sphere", "center": (0, 0, 0.6), "radius": 0.6}
PLASTIC = {"type": "roughplastic", "alpha": 0.2}
LAMP = {"type": "area", "radiance": {"type": "rgb", "value": (9, 8, 7)}}
VIEW = camera((0, -4, 2), (0, 0, 0.5), up=(0, 0, 1))
POINT = {"type": "point", "position": (1, -2, 3), "intensity": {"type": "rgb", "value": 9}}
OWN = {
    "cornell box": None,
    "a point": {"light": POINT, "ball": BALL | {"bsdf": PLASTIC}},
    "a lamp": {"lamp": {"type": "sphere", "center": (1, 0, 3), "radius": 0.5, "emitter": LAMP},
               "ball": BALL | {"bsdf": {"type": "roughconductor", "alpha": 0.3}}},
    "a sky": {"sky": {"type": "constant"}, "sun": {"type": "directional", "direction": (1, 1, -2)},
              "ball": BALL | {"bsdf": {"type": "principled", "roughness": 0.4}}},
    "a spot": {"spot": {"type": "spot", "to_world": look_at((2, -2, 4), (0, 0, 0), (0, 0, 1)),
                        "intensity": 40.0}, "box": {"type": "cube", "bsdf": {"type": "plastic"}}},
}  # fmt: skip
"""Scenes of Mitsuba's own parts."""

BUILT_IN = ("fig-6-10", "fig-8-9", "plastic-spheres", "two-intensities", "narrow-band-lamp")


@pytest.mark.thorough
@opengl
@pytest.mark.guarantee(
    "runs", "Of five right shaders nothing is said, on built-in scenes and others."
)
def test_nothing_is_said_of_right_shaders_on_scenes(rgb, tmp_path):
    """What is said depends on the shader alone: scenes take turns."""
    for shader, parts, name in zip(SHADERS, OWN.values(), BUILT_IN, strict=True):
        path = tmp_path / f"right{shader.suffix}"
        path.write_text(shader.text(), encoding="utf-8")
        around = {"type": "scene", "view": VIEW, "floor": FLOOR}
        made = around | parts if parts else mi.cornell_box()
        for scene in (made, name):
            record = compared(scene, str(path), heuristic_variant="llvm_ad_rgb")
            assert record.mistakes == ()
            assert np.isfinite(record.textbook)
