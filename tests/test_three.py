"""three.js, run for real: its pictures against the closed forms of its shading."""

import json

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from comparisons.case import Request, open_case
from comparisons.compare import compare, prepare
from comparisons.hard import furnace
from heuristic.errors import InputError, InstallationError
from heuristic.heuristics import Heuristic, declare, named
from heuristic.three_js import browser, three_lobes

SIDE = 64


def missing():
    """Return why three.js cannot be run here; empty where it can."""
    try:
        browser.require()
    except InstallationError as error:
        return str(error)
    return ""


MISSING = missing()
three = pytest.mark.skipif(bool(MISSING), reason=MISSING)


def shaded(with_lobe):
    """Return I N.L (k_d + F (n + 2) / 8 (N.H)^n), emission and ambient light; n is 4 times Phong's.

    It is three.js' formula as its sources have it, in units of the pair.
    """

    def shade(point):
        material = point.material
        n = 4 * material.n
        specular = 8 * material.k_s / (n + 2)
        value = material.k_i + point.ambient * material.k_a
        for light in point.lights:
            half = dr.normalize(light.toward + point.view)
            opposite = dr.dot(point.view, half)
            away = dr.exp2((-5.55473 * opposite - 6.98316) * opposite)
            fresnel = specular + (1 - specular) * away
            lobe = dr.maximum(dr.dot(point.normal, half), 1e-6) ** n
            reflected = material.k_d + fresnel * (n + 2) / 8 * lobe * with_lobe
            value += light.intensity * dr.maximum(dr.dot(point.normal, light.toward), 0) * reflected
        return value

    return shade


FORMS = {
    "three:phong": declare(Heuristic("three-phong-form", shaded(1))).name,
    "three:lambert": declare(Heuristic("three-lambert-form", shaded(0))).name,
}


def image(scene, heuristic):
    asked = Request(heuristic=heuristic, resolution=(SIDE, SIDE), spp=16)
    case = open_case(scene, asked)
    ready = prepare(case.source, case.options)
    return np.array(ready.heuristic.render(3), float), ready.counted


def plane(light):
    """A plane and a ball under a light of one's choice, all of it plain."""
    look = mi.ScalarTransform4f().look_at((0, -4, 2.5), (0, 0, 0.3), (0, 0, 1))
    film = {"type": "hdrfilm", "width": SIDE, "height": SIDE}
    glossy = {"type": "phong", "k_a": 0.2, "k_d": 0.5, "k_s": 0.4, "n": 20.0}
    return {
        "type": "scene",
        "integrator": {"type": "heuristic", "ambient": 0.5},
        "sensor": {"type": "perspective", "fov": 40, "to_world": look, "film": film},
        "floor": {"type": "rectangle", "bsdf": glossy,
                  "to_world": mi.ScalarTransform4f().scale(2)},
        "ball": {"type": "sphere", "center": [0.3, 0, 0.6], "radius": 0.5, "bsdf": glossy},
        "light": light,
    }  # fmt: skip


POINT = {"type": "heuristic_point", "position": [1.0, -2.0, 2.0], "intensity": 3.0,
         "k0": 0.0, "k2": 1.0}  # fmt: skip
LIGHTS = {
    "inverse square": POINT,
    "inverse": POINT | {"k2": 0.0, "k1": 1.0},
    "constant": POINT | {"k2": 0.0, "k0": 0.5},
    "directional": {"type": "heuristic_directional", "direction": [-1, 1, -2], "intensity": 0.8},
    "spot": POINT | {"type": "heuristic_spot", "direction": [-1, 2, -1.7], "cutoff": 25.0},
}


def require_alike(scene, heuristic):
    """Compare three.js with its closed form where no outline or edge of light is near."""
    seen, counted = image(scene, heuristic)
    formed, _ = image(scene, FORMS[heuristic])
    assert formed[counted].max() > 0.2
    relative = np.abs(seen - formed)[counted] / np.maximum(formed[counted], 0.02)
    assert np.percentile(relative, 90) < 2e-3
    assert np.median(relative) < 4e-4
    assert seen[counted].mean() == pytest.approx(formed[counted].mean(), rel=3e-3)


@three
@pytest.mark.guarantee(
    "kernel",
    "three.js draws a sphere and a plane as the closed form of its shading says.",
)
@pytest.mark.parametrize("light", LIGHTS)
def test_three_js_is_its_closed_form(rgb, light):
    require_alike(lambda: plane(LIGHTS[light]), "three:phong")


@three
@pytest.mark.parametrize("heuristic", FORMS)
@pytest.mark.parametrize("scene", ["fig-8-9", "lambert-sphere"])
def test_three_js_is_its_closed_form_in_built_in_scenes(rgb, heuristic, scene):
    require_alike(scene, heuristic)


@three
def test_a_wrong_closed_form_is_found_out(rgb, monkeypatch):
    for wrong in (lambda p: 1.01 * shaded(1)(p), lambda p: named("blinn").shade(p)):
        other = declare(Heuristic("three-wrong-form", wrong))
        monkeypatch.setitem(FORMS, "three:phong", other.name)
        with pytest.raises(AssertionError):
            require_alike("fig-8-9", "three:phong")


@three
def test_what_three_js_does_not_have_is_said(rgb):
    lamp = LIGHTS["spot"] | {"exponent": 4.0, "clamped": True}
    case = open_case(lambda: plane(lamp), Request(heuristic="three:lambert", spp=4,
                                                  resolution=(16, 16)))  # fmt: skip
    said = " ".join(compare(case.source, case.options).record.warnings)
    for words in ("power of the cosine", "limit of 1 on its attenuation", "highlight, which"):
        assert words in said


@three
def test_a_light_that_three_js_does_not_have_is_refused(rgb):
    case = open_case(lambda: plane(POINT | {"k0": 1.0}), Request(heuristic="three:phong"))
    with pytest.raises(InputError, match="one power of the distance"):
        compare(case.source, case.options)


def form(material, kind, light, view):
    """Return the closed form of three.js for a normal along z, in float64."""
    n = 4 * material["n"]
    specular = 8 * np.array(material["k_s"])[:, None] / (n + 2)
    half = light + view
    half /= np.linalg.norm(half, axis=0)
    facing = (view * half).sum(axis=0)
    away = 2 ** ((-5.55473 * facing - 6.98316) * facing)
    lobe = (specular + (1 - specular) * away) * (n + 2) / 8 * half[2] ** n
    base = np.array(material["k_d"])[:, None]
    return np.maximum(light[2], 0) * (base + (kind == "phong") * lobe)


@three
@pytest.mark.parametrize("kind", ["phong", "lambert"])
def test_its_lobes_are_the_closed_form_for_pairs_of_directions(rgb, kind):
    random = [furnace.random_pairs(5000), [-each for each in furnace.random_pairs(50)]]
    materials = [
        {"k_i": [0] * 3, "k_a": [0] * 3, "k_d": [0.5, 0.2, 0.7], "k_s": [0.3 * n] * 3, "n": n}
        | {"form": "phong", "normalised": False}
        for n in (1.0, 40.0)
    ]
    asked = [
        three_lobes.Asked(material, light, view, np.tile([[0.0], [0.0], [1.0]], light.shape[1]))
        for material in materials
        for light, view in random
    ]
    for each, found in zip(asked, three_lobes.values(kind, asked), strict=True):
        if each.light[2].min() < 0:
            np.testing.assert_array_equal(found, 0)
        else:
            expected = form(each.material, kind, each.light, each.view)
            np.testing.assert_allclose(found, expected, rtol=2e-4, atol=1e-5)


@three
def test_an_audit_asks_the_real_library(run, tmp_path, monkeypatch):
    monkeypatch.setattr("comparisons.audit.shaded.ALPHAS", (0.3,))
    code, _, _ = run("audit", "--heuristic", "three:lambert", "-o", tmp_path)
    record = json.loads((tmp_path / "audit/three-lambert/audit.json").read_text(encoding="utf-8"))
    verdicts = {check["name"]: check["verdict"] for check in record["checks"]}
    assert code == 0
    assert verdicts["values"] == verdicts["energy"] == verdicts["reciprocity"] == "holds"
    matte = next(curve for curve in record["curves"] if curve["material"] == "matte")
    np.testing.assert_allclose(matte["seen"], 1, atol=2e-3)
    np.testing.assert_allclose(matte["returned"], 1, atol=2e-3)


def test_what_is_missing_is_said(monkeypatch, tmp_path):
    monkeypatch.setattr(browser, "BUILD", tmp_path)
    with pytest.raises(InstallationError, match="npm ci"):
        browser.require()
    (tmp_path / "three.module.js").touch()
    monkeypatch.setattr(browser, "PROGRAMS", ("no-such-browser",))
    with pytest.raises(InstallationError, match="apt-get install chromium"):
        named("three:phong")


def test_the_lock_has_a_hash_and_no_address():
    lock = json.loads(browser.LOCK.read_text(encoding="utf-8"))
    package = lock["packages"]["node_modules/three"]
    assert package["integrity"].startswith("sha512-")
    assert "resolved" not in package


def test_another_kind_is_refused():
    with pytest.raises(
        InputError, match=r"'three:toon' is not declared: choose one of three:phong, three:lambert"
    ):
        named("three:toon")
