"""The plugins in plain Mitsuba: the programs of docs/mitsuba.md, and gradients."""

import json
import re
import subprocess
import sys
from pathlib import Path

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from tests.shared.oracle import Light, Material, shade
from tests.shared.programs import ROOT, python
from tests.shared.spheres import seen_on_the_unit_sphere

PAGE = (ROOT / "docs/mitsuba.md").read_text()
(SCENE,) = re.findall(r"```xml\n(.*?)```", PAGE, re.DOTALL)
PROGRAM = "".join(re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL))
SHOWN = """
import json
print(json.dumps([image.numpy().tolist(), goal.numpy().tolist(), losses, optimizer[key][0]]))
"""
MATERIAL, LIGHT = Material(k_d=(0.5, 0.3, 0.2), k_s=0.4, n=20), Light("point", 1, (-3, -4, 4))


@pytest.fixture
def folder(tmp_path):
    """A folder with the page's scene."""
    (tmp_path / "scene.xml").write_text(SCENE)
    return tmp_path


def test_the_pages_programs_render_the_textbook_and_find_the_exponent(folder):
    done = python("-c", PROGRAM + SHOWN, cwd=folder, PYTHONWARNINGS="error")
    assert done.returncode == 0, done.stderr
    *images, losses, n = json.loads(done.stdout)
    viewer, within = np.array((0.0, -4.0, 1.0)), (np.arange(8) - 3.5) / 8
    for x, y in ((9, 10), (12, 12), (16, 20), (22, 16)):
        places = [(x + across, y + down) for across in within for down in within]
        point = np.array([seen_on_the_unit_sphere(*place, 32, viewer) for place in places])
        expected = shade(point, point, viewer - point, MATERIAL, [LIGHT]).mean(axis=0)
        for image in images:
            assert image[y][x] == pytest.approx(expected, rel=0.02)
    assert losses[-1] < losses[0] / 1000
    assert n == pytest.approx(20, abs=0.5)


@pytest.mark.parametrize(
    "variant", ["llvm_ad_rgb", "llvm_ad_spectral", "llvm_ad_mono"], indirect=True
)
def test_gradients_are_those_of_small_steps(variant, folder):
    scene = mi.load_file(str(folder / "scene.xml"))
    prb, params = mi.load_dict({"type": "prb"}), mi.traverse(scene)

    def mean(**seeds):
        return dr.mean(mi.render(scene, params, integrator=prb, spp=16, **seeds), axis=None)

    for key in ("ball.bsdf.n", "ball.bsdf.k_s.value", "lamp.scale"):
        given = dr.detach(params[key])
        dr.enable_grad(params[key])
        params.update()
        dr.backward(mean(seed=1, seed_grad=2))
        gradient = dr.sum(dr.grad(params[key]) * given, axis=None)[0]
        ends = []
        for factor in (0.99, 1.01, 1.0):
            params[key] = given * factor
            params.update()
            ends.append(mean(seed=2).array[0])
        assert abs(gradient) > 1e-3 * ends[2], key
        assert gradient == pytest.approx((ends[1] - ends[0]) / 0.02, rel=5e-3), key


def test_mitsubas_own_command_does_not_know_the_plugins(folder):
    command = [Path(sys.executable).parent / "mitsuba", "-m", "llvm_ad_rgb", "scene.xml"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)
    assert done.returncode != 0
    assert re.search('Plugin "(phong|heuristic_point)" not found', done.stderr)
