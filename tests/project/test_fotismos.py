"""The public door: `import fotismos`."""

import shutil

import pytest

from tests.shared.programs import ROOT, python

LAZY = """
import sys, fotismos
print({"mitsuba", "drjit", "numpy", "fotismos.reports"} & {*sys.modules})
print(dir(fotismos) == fotismos.__all__, [n for n in fotismos.__all__ if not getattr(fotismos, n)])
try:
    fotismos.nothing
except AttributeError as error:
    print(error)
"""
USED = """
import fotismos
from drjit.auto import Array3f
import mitsuba as mi
mi.set_variant("llvm_ad_rgb")
fotismos.register()
material = fotismos.Material(k_a=0.3, k_d=0.5)
light = fotismos.DirectionalLight(direction=(0, 0, -1), intensity=1.0)
up = Array3f(0, 0, 1)
print(fotismos.shade(Array3f(0), up, up, material, [light], ambient=1.0))
small = {"resolution": (12, 8), "spp": 4}
print(fotismos.plan("fig-8-9", **small).integrator)
print(fotismos.compare(mi.cornell_box(), "box", **small).comparison.record.scene)
print(fotismos.declare(fotismos.Heuristic(name="grey", shade=lambda point: 0.5)).name)
print(fotismos.fit("fig-8-9", resolution=(12, 8), spp=4).scene)
print(fotismos.check(BASELINE).status)
"""

DIGEST = "from fotismos.heuristic import program; print(program.source_digest())"


ROOMS = ("heuristic", "reference", "comparisons", "reports")


@pytest.mark.parametrize("room", ROOMS)
def test_a_room_is_imported_from_the_package_alone(room):
    """By a link at the top level, or not at all where a checkout has no links."""
    expected = f"ModuleNotFoundError: No module named '{room}'"
    if (ROOT / room).exists():
        expected = f"ImportError: write `import fotismos.{room}` in place of `import {room}`"
    assert python("-c", f"import {room}").stderr.splitlines()[-1] == expected


@pytest.mark.parametrize("file", ["heuristic/terms.py", "__init__.py"])
def test_a_changed_source_changes_the_digest_that_decides_on_reuse(file, tmp_path):
    shutil.copytree(ROOT / "fotismos", tmp_path / "fotismos")
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    before = python("-c", DIGEST, PYTHONPATH=str(tmp_path)).stdout
    with (tmp_path / "fotismos" / file).open("a") as source:
        source.write("# changed\n")
    after = python("-c", DIGEST, PYTHONPATH=str(tmp_path)).stdout
    assert len(before) == len(after) == 65
    assert before != after


def test_the_door_is_lazy_and_has_all_its_names():
    done = python("-c", LAZY)
    nothing = "module 'fotismos' has no attribute 'nothing'"
    assert done.stdout.splitlines() == ["set()", "True []", nothing], done.stderr


@pytest.mark.thorough
def test_what_comes_through_the_door_works(made_baselines):
    baseline = repr(str(made_baselines / "fig-8-6a.json"))
    done = python("-c", USED.replace("BASELINE", baseline))
    assert done.returncode == 0, done.stderr
    assert done.stdout.splitlines() == [
        "[0.8]", "direct_all", "box", "grey", "fig-8-9", "passed",
    ]  # fmt: skip
