"""An audit compares a lobe with a closed form, and shows the ratio where it differs most."""

import pytest

import fotismos
from fotismos.heuristic.errors import InputError
from tests.shared.shader_bugs import BUGS, GGX, HEAD
from tests.shared.wrong_shaders import SHADERS

RIGHT = [
    ({"bsdf": "roughconductor", "distribution": "ggx"}, "ggx"),
    ({"bsdf": "roughconductor", "distribution": "beckmann"}, "beckmann"),
    ({"heuristic": "phong"}, "phong"),
    ({"heuristic": "blinn"}, "blinn"),
    ({"heuristic": str(SHADERS / "phong.py")}, "lambert"),
    ({"bsdf": "diffuse"}, "lambert"),
    ({"heuristic": str(SHADERS / "oren_nayar.py"), "sigma": 0.3}, "oren-nayar"),
]


def compared(like, **subject):
    """Return the checks of the closed form."""
    record = fotismos.audit(like=like, **subject)
    return [check for check in record.checks if check.name.startswith("as ")]


@pytest.mark.thorough
@pytest.mark.parametrize(("subject", "like"), RIGHT)
def test_a_lobe_is_its_own_closed_form(rgb, subject, like):
    rows = compared(like, **subject)
    assert [check.value for check in rows] == pytest.approx([1, 1, 1], abs=1e-3)
    assert {check.verdict for check in rows} == {"holds"}


@pytest.mark.thorough
@pytest.mark.parametrize("name", ["D: NH not squared", "alpha squared again", "the 4 missing"])
def test_a_lost_bracket_shows_as_a_ratio(rgb, tmp_path, name):
    bug = next(bug for bug in BUGS if bug.name == name)
    rows = compared("ggx", heuristic=str(bug.write(tmp_path)))
    assert "does not hold" in {check.verdict for check in rows}
    assert all("viewer at" in check.worst for check in rows)


@pytest.mark.thorough
def test_the_right_shader_is_near_at_ordinary_angles(rgb, tmp_path):
    path = tmp_path / "ggx.py"
    path.write_text(HEAD + GGX, encoding="utf-8")
    assert all(0.75 < check.value < 1.05 for check in compared("ggx", heuristic=str(path)))


def test_an_unknown_closed_form_is_refused(rgb):
    with pytest.raises(InputError, match="closed form 'ggg' is not known"):
        fotismos.audit("phong", like="ggg")
