"""Shaders that are wrong in one respect are told so; those that are another model are not."""

import re

import pytest

from fotismos.comparisons.audit import diagnosis
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
