"""Shaders that are wrong in one respect are told so; those that are another model are not."""

import re

import numpy as np
import pytest

from fotismos.comparisons.audit import diagnosis
from fotismos.comparisons.textbook import halfway, mirrored
from fotismos.heuristic import heuristics
from fotismos.heuristic.errors import InputError
from tests.shared.opengl import opengl
from tests.shared.wrong_shaders import GLSL, PYTHON, SHADERS, WRONG

LANGUAGES = [PYTHON, pytest.param(GLSL, marks=[pytest.mark.thorough, opengl])]


def mistakes_of(path):
    """Return all that is said of a shader, by a refusal or a diagnosis."""
    try:
        return diagnosis.describe(str(path))
    except InputError as error:
        return (str(error),)


@pytest.mark.guarantee("runs", "Well-known shader mistakes are named in words.")
@pytest.mark.parametrize("suffix", LANGUAGES)
def test_wrong_shaders_are_told_what_is_wrong(rgb, tmp_path, suffix):
    page = (SHADERS.parent / "shaders.md").read_text()
    for number, wrong in enumerate(each for each in WRONG if each.suffix == suffix):
        folder = tmp_path / str(number)
        folder.mkdir()
        (said,) = mistakes_of(wrong.write(folder))
        assert re.search(wrong.message, said), wrong.name
        assert f"{wrong.name}{'.' if wrong is WRONG[-1] else ';'}" in page


@pytest.mark.parametrize("suffix", LANGUAGES)
def test_nothing_is_told_of_right_shaders_and_other_models(rgb, suffix):
    for path in sorted(SHADERS.glob(f"*{suffix}")):
        shader = r"^def ([a-z]\w*)\(point(?:\)|, \w+: Range)"
        functions = re.findall(shader, path.read_text(), re.MULTILINE)
        for name in functions or [""]:
            assert mistakes_of(f"{path}:{name}" if name else path) == ()


OTHER = {
    "lambert": ("0", "material.k_d * cosine"),
    "rim": ("0.3 * (1 - dr.dot(point.normal, point.view))", "material.k_d * cosine"),
    "blinn": ("0", "material.k_d * cosine + material.k_s * dr.select(cosine > 0,"
              " dr.maximum(dr.dot(point.normal, half), 1e-6) ** (4 * material.n), 0)"),
    "white": ("1", "0 * cosine"),
}  # fmt: skip


def test_nothing_is_told_of_models_of_another_kind(rgb, tmp_path):
    for name, (first, light) in OTHER.items():
        path = tmp_path / f"{name}.py"
        path.write_text(
            "import drjit as dr\nimport mitsuba as mi\n"
            "def shade(point):\n"
            f"    material, value = point.material, mi.Spectrum({first})\n"
            "    for each in point.lights:\n"
            "        cosine = dr.maximum(dr.dot(point.normal, each.toward), 0)\n"
            "        half = dr.normalize(each.toward + point.view)\n"
            f"        value += each.intensity * ({light})\n"
            "    return value\n"
        )
        assert mistakes_of(path) == (), name


def test_the_model_written_out_is_the_kernel(rgb):
    for name, along in (("phong", mirrored), ("blinn", halfway)):
        model = diagnosis.sample(along)
        seen = diagnosis.evaluate(heuristics.named(name), model)
        np.testing.assert_allclose(seen, model.terms().sum(axis=0), rtol=2e-4, atol=1e-5)


def test_commands_tell_it(run, tmp_path):
    wrong = next(each for each in WRONG if each.name == "exponent times 4")
    path, out = wrong.write(tmp_path), tmp_path / "out"
    words = ("--no-why", "--spp", 4, "--resolution", "16x16", "-o", out)
    code, said, _ = run("compare", "fig-8-9", "--heuristic", path, *words)
    assert (code, "the exponent is 4 times the material's" in said) == (0, True)
    assert "the exponent is 4 times" in (out / "index.html").read_text()


def test_values_that_end_at_1_are_told(rgb, tmp_path):
    path = tmp_path / "cut.py"
    text = (SHADERS / "phong.py").read_text()
    path.write_text(text.replace("return value", "return dr.minimum(value, 1)"))
    assert mistakes_of(path) == ("Its values end at 1: brighter light is cut off.",)
