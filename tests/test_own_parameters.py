"""Checks of a user's own heuristics, which are files."""

import json

import pytest

from comparisons.case import open_case
from comparisons.compare import compare
from comparisons.options import Options
from tests.test_user_heuristics import SHADERS

# --- Checks --------------------------------------------------------------------------------------


@pytest.mark.thorough
def test_a_baseline_names_the_file_from_its_own_folder(run, written, tmp_path):
    name = written((SHADERS / "wrapped.py").read_text(encoding="utf-8"))
    words = ("--scene", "fig-8-9", "--heuristic", f"{name}:shade", "--resolution", "12x12")
    assert run("check", "kept/w.json", "--update", *words)[0] == 0
    kept = json.loads((tmp_path / "kept/w.json").read_text(encoding="utf-8"))
    assert kept["options"]["heuristic"] == "../mine.py:shade"
    assert run("check", "kept")[0] == 0
    code, said, _ = run("check", "kept/w.json", "--update", "--heuristic", f"{name}:shade")
    assert (code, "0 of 1 baselines written" in said) == (0, True)
    written((SHADERS / "wrapped.py").read_text(encoding="utf-8").replace("= 0.5", "= 0.55"))
    code, said, _ = run("check", "kept")
    assert (code, "1 of 1 moved" in said) == (1, True)
    (tmp_path / "mine.py").unlink()
    code, _, said = run("check", "kept")
    assert (code, "mine.py: there is no such file" in said) == (2, True)


def test_departure_of_a_comparison_is_that_of_its_shader(rgb, written):
    """A shader that returns the reference's own closed form leaves nothing."""
    name = written(
        "import drjit as dr\ndef shade(point):\n"
        "    lit = [each.intensity * dr.maximum(dr.dot(point.normal, each.toward), 0)\n"
        "           for each in point.lights]\n"
        "    return sum(lit) * point.material.base_color\n"
    )
    case = open_case("lambert-sphere", Options(heuristic=name, resolution=(24, 24), spp=32))
    assert compare(case.source, case.options).record.metrics["dE2000"].mean < 1e-3
