"""The plugins in plain Mitsuba: the programs of docs/mitsuba.md, and gradients."""

import json
import re

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.heuristic.materials import COEFFICIENTS
from tests.shared.misplanned import scene as described
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


@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "llvm_ad_mono"], indirect=True)
def test_gradients_are_those_of_small_steps_in_other_variants(variant, folder):
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


LAMPS = {
    "point": {"k0": 0.5, "k1": 0.2, "k2": 0.1},
    "spot": {"direction": [3.0, 4.3, -3.8], "cutoff": 60.0, "exponent": 5.0, "shell": 0.1},
    "directional": {"direction": [3.0, 4.0, -4.0]},
}
PLACED = {"position": [-3.0, -4.0, 4.0]}
BEYOND_PRB = {"position", "direction", "cutoff", "shell"}
"""What light comes from where, which `prb` does not differentiate; a spot's direction it does."""
UNDIFFERENTIATED = {"cutoff", "shell"}
INTEGRATORS = {
    "heuristic": {"occlusion": False, "ambient": 0.5},
    "direct": {},
    "path": {"max_depth": 2},
    "prb": {"max_depth": 2},
}


def lit_ball(kind):
    """A ball of all coefficients under one kind of light."""
    bsdf = {"type": "phong", "k_d": 0.5, "k_s": 0.4, "k_a": 0.2, "k_i": 0.1, "n": 20.0}
    lamp = {"type": f"heuristic_{kind}", "intensity": 3.0, **LAMPS[kind]}
    return mi.load_dict(
        described(
            (0, -4, 1),
            (0, 0, 0),
            size=24,
            ball={"type": "sphere", "bsdf": bsdf},
            lamp=lamp | ({} if kind == "directional" else PLACED),
        )
    )


@pytest.mark.guarantee(
    "kernel", "Every gradient that `mitsuba.traverse` offers of a light is that of small steps."
)
@pytest.mark.parametrize(
    "integrator",
    [
        pytest.param(name, marks=() if name == "direct" else pytest.mark.thorough)
        for name in INTEGRATORS
    ],
)
@pytest.mark.parametrize("kind", LAMPS)
def test_offered_gradients_are_those_of_small_steps(rgb, kind, integrator):
    """And by positions and directions those of all integrators but `prb`, which has none."""
    scene = lit_ball(kind)
    renderer = mi.load_dict({"type": integrator} | INTEGRATORS[integrator])
    params = mi.traverse(scene)
    keys = [key for key, _ in params.items() if key.startswith("lamp.") and "sampling" not in key]
    lights = {key: key.removeprefix("lamp.") for key in keys}
    read = [name for name in COEFFICIENTS if name in "k_d k_s" or integrator == "heuristic"]
    shading = {f"ball.bsdf.{name}.value": name for name in read} | {"ball.bsdf.n": "n"}
    assert len(lights) >= 3
    for key, name in (lights | shading).items():
        is_offered = not params.flags(key) & mi.ParamFlags.NonDifferentiable.value
        is_spots = (kind, name) == ("spot", "direction")
        assert is_offered == (is_spots or name not in BEYOND_PRB), name
        if name in UNDIFFERENTIATED or not (is_offered or integrator != "prb"):
            continue
        given = dr.detach(params[key])
        along = type(given)(0.3, -0.5, 0.8) if name in BEYOND_PRB else type(given)(1)

        def image(step, seeds, key=key, given=given, along=along):
            params[key] = given + along * step
            params.update()
            return mi.render(scene, params, integrator=renderer, spp=16, **seeds)

        step = mi.Float(0)
        dr.enable_grad(step)
        value = image(step, {"seed": 1, "seed_grad": 2})
        dr.backward(dr.mean(value, axis=None))
        width = 0.005 * float(np.abs(np.ravel(given)).max() or 0.2)
        ends = [np.array(image(end, {"seed": 2}), float).mean() for end in (-width, width)]
        image(0, {"seed": 2})
        expected = (ends[1] - ends[0]) / (2 * width)
        assert dr.grad(step)[0] == pytest.approx(expected, rel=0.01), (name, integrator)
