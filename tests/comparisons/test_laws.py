"""A comparison says which laws of reflection a user's shader breaks."""

import re

import pytest

import fotismos
from fotismos.comparisons.audit import laws
from tests.shared.shader_bugs import write_right
from tests.shared.wrong_shaders import SHADERS

BREAKS = {
    "lambert": (),
    "oren nayar": (),
    "half lambert": ("energy", "reciprocity", "opacity"),
    "phong": ("energy", "reciprocity"),
}


@pytest.mark.parametrize("name", BREAKS)
def test_the_laws_that_a_shader_breaks_are_named(rgb, tmp_path, name):
    said = " ".join(laws.broken(str(write_right(name, tmp_path))))
    assert tuple(re.findall("energy|reciprocity|opacity", said)) == BREAKS[name]
    assert ("audit --heuristic" in said) == bool(BREAKS[name])


@pytest.mark.thorough
def test_the_energy_is_that_of_the_whole_audit(rgb):
    (said,) = laws.broken(str(SHADERS / "wrapped.py"))
    shown = float(re.search(r"returns ([\d.]+) times", said)[1])
    curves = fotismos.audit(str(SHADERS / "wrapped.py")).curves
    (matte,) = (curve for curve in curves if curve.material == "matte")
    assert shown == pytest.approx(matte.returned[6], rel=0.01)  # at 80 degrees


def test_nothing_is_said_of_built_in_ones(rgb):
    assert laws.broken("phong") == ()
