"""Shaders that are wrong in one respect are told so; those that are another model are not."""

import re
from dataclasses import replace

import pytest

from fotismos.comparisons.audit import diagnosis
from fotismos.comparisons.audit.textbook_mistakes import PACKAGES, Mistake
from fotismos.heuristic.errors import InputError
from tests.shared.opengl import opengl
from tests.shared.shader_bugs import BLINN, BUGS, CORRELATED, PHONG, RIGHT, SMITH, Bug, write_right
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
    for number, wrong in enumerate(each for each in WRONG if each.suffix == suffix):
        folder = tmp_path / str(number)
        folder.mkdir()
        (said,) = mistakes_of(wrong.write(folder))
        assert re.search(wrong.message, said), wrong.name


@pytest.mark.parametrize("suffix", LANGUAGES)
def test_nothing_is_told_of_right_shaders_and_other_models(rgb, suffix):
    for path in sorted(SHADERS.glob(f"*{suffix}")):
        shader = r"^def ([a-z]\w*)\(point(?:\)|, \w+: Range)"
        functions = re.findall(shader, path.read_text(), re.MULTILINE)
        for name in functions or [""]:
            assert mistakes_of(f"{path}:{name}" if name else path) == ()


@pytest.mark.thorough
@pytest.mark.parametrize("bug", BUGS, ids=lambda bug: bug.name)
def test_usual_bugs_are_named(rgb, tmp_path, bug):
    said = mistakes_of(bug.write(tmp_path))
    assert said
    assert re.search(bug.names, said[0]), said


@pytest.mark.parametrize("name", RIGHT)
def test_right_shaders_of_many_models_are_not_accused(rgb, tmp_path, name):
    assert mistakes_of(write_right(name, tmp_path)) == ()


NEIGHBOURS = [
    (base, bug)
    for bug in BUGS
    for base in ((BLINN,) if bug.base is PHONG else (SMITH, CORRELATED))
    if bug.base is not BLINN and bug.piece in base
]


@pytest.mark.thorough
def test_the_same_bugs_are_named_in_neighbouring_models(rgb, tmp_path):
    """In Blinn's lobe where they were in Phong's, and with other maskings of GGX."""
    missed = []
    for base, bug in NEIGHBOURS:
        said = mistakes_of(replace(bug, base=base).write(tmp_path))
        if not re.search(bug.in_blinn if base is BLINN else bug.names, " ".join(said) or "nothing"):
            missed.append((bug.name, said))
    assert missed == []


def test_the_documents_name_all_that_is_recognised():
    page = (SHADERS.parent / "shaders.md").read_text()
    listed = page.partition("made by ./run docs")[2]
    assert [words for words in diagnosis.recognised() if f"- {words}\n" not in listed] == []
    assert len(diagnosis.recognised()) >= 60


def test_a_package_adds_a_mistake(rgb, tmp_path, monkeypatch):
    doubled = Mistake("the exponent is squared", lambda m: {"n": m.n**2}, name="squared exponent")
    path = Bug("squared", PHONG, "m.n)", "m.n * m.n)", "squared").write(tmp_path)
    assert mistakes_of(path) == ()
    monkeypatch.setitem(PACKAGES.added, doubled.name, doubled)
    assert mistakes_of(path) == ("A likely mistake: the exponent is squared.",)
