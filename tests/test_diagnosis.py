"""Shaders that are wrong in one respect are told so; those that are another model are not."""

import re

import numpy as np
import pytest

from comparisons.audit import diagnosis, mistakes
from heuristic import heuristics
from heuristic.errors import InputError
from tests.test_glsl import MISSING, opengl
from tests.wrong_shaders import GLSL, SHADERS, WRONG

OWN = sorted(path for path in SHADERS.iterdir() if path.suffix in (".py", GLSL))


def told(path):
    """Return all that is said of a shader, by a refusal or a diagnosis."""
    try:
        return diagnosis.told(str(path))
    except InputError as error:
        return (str(error),)


@pytest.mark.guarantee("runs", "Well-known shader mistakes are each named in words.")
@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: wrong.name)
def test_a_wrong_shader_is_told_what_is_wrong(rgb, tmp_path, wrong):
    if wrong.suffix == GLSL and MISSING:
        pytest.skip(MISSING)
    found = told(wrong.write(tmp_path))
    assert re.search(wrong.told, " ".join(found)), found
    assert len(found) == 1, found


@pytest.mark.parametrize("path", OWN, ids=lambda path: path.name)
def test_nothing_is_told_of_right_shaders_and_other_models(rgb, path):
    if path.suffix == GLSL and MISSING:
        pytest.skip(MISSING)
    functions = re.findall(r"^def ([a-z]\w*)\(point", path.read_text("utf-8"), re.MULTILINE)
    for name in functions or [""]:
        assert told(f"{path}:{name}" if name else path) == ()


OTHER = {
    "lambert": ("0", "material.k_d * cosine"),
    "rim": ("0.3 * (1 - dr.dot(point.normal, point.view))", "material.k_d * cosine"),
    "blinn": ("0", "material.k_d * cosine + material.k_s * dr.select(cosine > 0,"
              " dr.maximum(dr.dot(point.normal, half), 1e-6) ** (4 * material.n), 0)"),
    "white": ("1", "0 * cosine"),
}  # fmt: skip


@pytest.mark.parametrize("name", OTHER)
def test_nothing_is_told_of_models_of_another_kind(rgb, tmp_path, name):
    first, light = OTHER[name]
    path = tmp_path / "other.py"
    path.write_text(
        "import drjit as dr\nimport mitsuba as mi\n"
        "def shade(point):\n"
        f"    material, value = point.material, mi.Spectrum({first})\n"
        "    for each in point.lights:\n"
        "        cosine = dr.maximum(dr.dot(point.normal, each.toward), 0)\n"
        "        half = dr.normalize(each.toward + point.view)\n"
        f"        value += each.intensity * ({light})\n"
        "    return value\n",
        encoding="utf-8",
    )
    assert told(path) == ()


def test_the_model_written_out_is_the_kernel(rgb):
    for name, along in (("phong", mistakes.mirrored), ("blinn", mistakes.halfway)):
        points = diagnosis._points(along)
        seen = diagnosis._asked(heuristics.named(name), points)
        np.testing.assert_allclose(seen, points.terms().sum(axis=0), rtol=2e-4, atol=1e-5)


@pytest.mark.parametrize("wrong", WRONG, ids=lambda wrong: wrong.name)
def test_the_page_has_what_is_told(wrong):
    page = (SHADERS.parent / "shaders.md").read_text(encoding="utf-8")
    (row,) = [line for line in page.splitlines() if line.startswith(f"| {wrong.name} |")]
    assert re.search(wrong.told, row.rpartition(" | ")[2])


def test_commands_tell_it(run, tmp_path):
    wrong = next(each for each in WRONG if each.name == "exponent times 4")
    path, out = wrong.write(tmp_path), tmp_path / "out"
    words = ("--no-why", "--spp", 4, "--resolution", "16x16", "-o", out)
    code, said, _ = run("compare", "fig-8-9", "--heuristic", path, *words)
    assert (code, "the exponent is 4 times the material's" in said) == (0, True)
    assert "the exponent is 4 times" in (out / "index.html").read_text(encoding="utf-8")
    code, said, _ = run("audit", "--heuristic", path, "-o", out)
    assert (code, "the exponent is 4 times the material's" in said) == (0, True)


@opengl
def test_two_mistakes_are_both_told(rgb, tmp_path):
    text = (SHADERS / "phong.glsl").read_text(encoding="utf-8")
    text = text.replace("return value;", "return 3.14159 * value.bgr;")
    path = tmp_path / "two.glsl"
    path.write_text(text.replace("light.intensity *", "light.intensity / light.distance /"
                                 " light.distance *"), encoding="utf-8")  # fmt: skip
    said = " ".join(told(path))
    for part in ("a second time", "blue, green, red", "missing division by pi"):
        assert part in said


def test_values_that_end_at_1_are_told(rgb, tmp_path):
    path = tmp_path / "cut.py"
    text = (SHADERS / "phong.py").read_text(encoding="utf-8")
    path.write_text(text.replace("return value", "return dr.minimum(value, 1)"), encoding="utf-8")
    assert told(path) == ("Its values end at 1: brighter light is cut off.",)
