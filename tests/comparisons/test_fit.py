"""Fits: gradients, recovery of known parameters, what an image does not tell, and the command."""

import json
import re
import shlex
from dataclasses import replace
from pathlib import Path

import jsonschema
import mitsuba as mi
import numpy as np
import pytest
from drjit.llvm.ad import Array3f64
from msgspec import structs

from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.fit.fit import fit
from fotismos.comparisons.fit.model import OwnModel, PhongModel, see
from fotismos.comparisons.fit.search import LOSSES, Objective, descend, identify, search
from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import named
from fotismos.heuristic.terms import normalisation
from fotismos.reference.rendering.gbuffer import gbuffer
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reference.scene.source import Source
from fotismos.reports.run import fit_files
from fotismos.reports.terminal.words import percent
from tests.shared.misplanned import scene as described
from tests.shared.parts import look_at, moved, rgb_of
from tests.shared.schemas import schema

SIZE = 20
RED = {"k_a": (0.3, 0.1, 0.1), "k_d": (0.6, 0.2, 0.1), "k_s": 0.4, "n": 12.0}
GREY = {"k_a": 0.1, "k_d": 0.3, "k_s": 0.6, "n": 40.0}
FLOOR = {"k_a": 0.2, "k_d": 0.5, "k_s": 0.1, "n": 3.0}
LIGHTS = (((-3, -4, 5), (1.0, 0.9, 0.8)), ((4, -3, 3), (0.3, 0.3, 0.5)))


def bsdf(name, form="phong", **coefficients):
    colours = {
        key: rgb_of(*value) if isinstance(value, tuple) else value
        for key, value in coefficients.items()
    }
    return {"type": "phong", "id": name, "form": form, **colours}


def spheres(form="phong", red=RED, grey=GREY, floor=FLOOR, lights=LIGHTS, **integrator):
    """Two spheres over a floor, each of its own material."""
    shapes = {
        "a": {"type": "sphere", "center": (-1.2, 0, 0), "bsdf": bsdf("red", form, **red)},
        "b": {"type": "sphere", "center": (1.2, 0, 0), "bsdf": bsdf("grey", form, **grey)},
        "c": {
            "type": "rectangle",
            "to_world": moved((0, 0, -1), 4),
            "bsdf": bsdf("floor", form, **floor),
        },
    }
    for number, (position, colour) in enumerate(lights):
        light = {"type": "heuristic_point", "position": position}
        shapes[f"light {number}"] = light | {"intensity": rgb_of(*colour)}
    sampler = {"type": "multijitter", "sample_count": 4}
    return described(
        (0, -8, 3),
        integrator={"type": "heuristic", "ambient": 1.0, **integrator},
        lens={"sampler": sampler},
        size=SIZE,
        **shapes,
    )


def surface_of(scene, passes=2, spp=4):
    """Return the surface of a scene, and its image by the integrator ``heuristic``."""
    renderer = Renderer(mi.load_dict(scene, optimize=False), None, spp, "heuristic image")
    image = sum(np.array(renderer.render(seed), float) for seed in range(passes)) / passes
    return see(renderer, range(passes)), image.reshape(-1, 3)


def objective_of(surface, image, form="phong", loss="perceptual", vector=None):
    model = PhongModel(surface, form, vector=vector)
    return Objective(model, image, LOSSES[loss], DEFAULT_VIEWING)


def best(objective):
    return search(objective)[0]


def inside(objective):
    """Return parameters well within their bounds."""
    low, high = objective.model.bounds
    return low + np.random.default_rng(0).uniform(0.3, 0.6, len(low)) * (high - low)


def central_differences(function, x, step):
    sides = [
        [np.asarray(function(x + sign * step * unit)) for sign in (1, -1)]
        for unit in np.eye(len(x))
    ]
    return np.stack([(up - down) / (2 * step) for up, down in sides])


# --- The model ------------------------------------------------------------------------------------


@pytest.mark.parametrize("case", ["blinn", "occlusion", "texture", "normalised", "dark"])
def test_the_model_at_the_paired_parameters_is_the_integrators_image(case, rgb):
    form = "blinn" if case == "blinn" else "phong"
    lights = () if case == "dark" else LIGHTS
    scene = spheres(form, lights=lights, occlusion=case == "occlusion")
    if case == "texture":
        for key in ("k_d", "k_s"):
            scene["c"]["bsdf"][key] = {"type": "checkerboard", "color0": 0.1, "color1": 0.7}
    if case == "normalised":
        scene["a"]["bsdf"] |= {"normalised": True, "k_s": 0.1}
    surface, image = surface_of(scene)
    model = objective_of(surface, image, form).model
    modelled = model.image(np.clip(model.paired, *model.bounds))
    assert image.max() > 0.1
    # n known to be moderate lets the integrator do without double precision: 1e-4 at most.
    np.testing.assert_allclose(modelled, image, rtol=1e-4, atol=1e-5)
    assert np.mean(np.abs(modelled - image)) < 1e-6


@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_the_derivatives_are_those_of_central_differences_in_double_precision(form, rgb):
    surface, image = surface_of(spheres(form))
    objective = objective_of(surface, image, form, "linear", Array3f64)
    model, x = objective.model, inside(objective)
    names = [parameter.name for parameter in model.parameters]
    assert set(names) == {"k_a", "k_d", "k_s", "n"}
    expected = central_differences(model.image, x, 1e-5)
    for name, one, other in zip(names, model.columns(x), expected, strict=True):
        assert np.abs(other).max() > 1e-3, f"{name} should change the image"
        np.testing.assert_allclose(one, other, atol=1e-7 * np.abs(other).max(), err_msg=name)
    for loss in LOSSES.values():
        objective = Objective(model, image, loss, DEFAULT_VIEWING)
        gradient, second = objective.quadratic(x)
        expected = central_differences(objective.value, x, 1e-5)
        np.testing.assert_allclose(gradient, expected, atol=2e-5 * np.abs(expected).max())
        assert np.linalg.eigvalsh(second).min() > -1e-9 * np.abs(second).max()
    # The second derivative is exact where the coordinates are linear in the parameters: RGB.
    rounded = replace(LOSSES["linear"], rounding=0.05)
    objective = Objective(model, image, rounded, DEFAULT_VIEWING)
    expected = central_differences(lambda y: objective.quadratic(y)[0], x, 1e-5)
    linear = np.ix_(model.linear, model.linear)
    found = objective.quadratic(x)[1]
    np.testing.assert_allclose(found[linear], expected[linear], atol=1e-6 * np.abs(found).max())


# --- The search -----------------------------------------------------------------------------------


@pytest.mark.guarantee("pairing", "A fit recovers the parameters that made an image.")
@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_known_parameters_are_recovered_from_an_image_made_with_them(form, loss, rgb):
    _, image = surface_of(spheres(form))
    wrong = {"k_a": 0.5, "k_d": 0.5, "k_s": 0.2, "n": 5.0}
    red = wrong | {"k_a": (0.5, 0.4, 0.3), "k_d": (0.2, 0.3, 0.4)}
    surface, _ = surface_of(spheres(form, red, wrong, wrong))
    objective = objective_of(surface, image, form, loss)
    model, x = objective.model, best(objective)
    for owner, material in enumerate((RED, GREY, FLOOR)):
        n = np.exp(x[model.place_of_exponent(owner)])
        assert n == pytest.approx(material["n"], rel=1e-3)
        for name in ("k_a", "k_d", "k_s"):
            found = model.coefficients(x, name)[owner]
            scale = normalisation(form, n) if name == "k_s" else 1.0
            expected = np.broadcast_to(material[name], 3)
            np.testing.assert_allclose(found * scale, expected, rtol=1e-3, err_msg=name)


def test_an_orthographic_camera_has_one_view_for_all_pixels(rgb):
    """The kernel's view has width 1 there."""
    kept = described(
        lens={"type": "orthographic"},
        ball={"type": "sphere", "bsdf": {"type": "phong", "k_d": 0.5, "k_s": 0.4, "n": 9}},
        lamp={"type": "heuristic_directional", "direction": [1, 1, -1], "intensity": 0.8},
    )
    record = fit(Source("orthographic", kept), Options(spp=16)).record
    departure = record.nearest.departure[LEADING.name]
    assert departure.after <= departure.before


# --- What an image determines ---------------------------------------------------------------------


def certainties_of(scene, noise=0.0):
    surface, image = surface_of(scene)
    objective = objective_of(surface, image)
    x = best(objective)
    found, _ = identify(objective, x, np.full((len(image), 3), noise))
    names = [f"{p.name} of {surface.names[p.owner]}" for p in objective.model.parameters]
    return dict(zip(names, found, strict=True))


def flat(k_a):
    """A floor alone, seen from above under parallel light: all of it has one colour."""
    scene = spheres(lights=(), floor=FLOOR | {"k_a": k_a})
    scene["sensor"]["to_world"] = look_at((0, 0, 5), up=(0, 1, 0))
    scene["sun"] = {"type": "heuristic_directional", "direction": (1, 0, -1), "intensity": 1.0}
    return {key: value for key, value in scene.items() if key not in ("a", "b")}


def test_what_does_not_show_is_not_identifiable(rgb):
    found = certainties_of(spheres(grey=GREY | {"k_s": 0.0}))  # no highlight
    assert found["n of grey"].reason == "does not show in the image"
    assert found["k_s of grey"].at_bound
    assert not found["k_s of grey"].reason
    assert not found["n of red"].reason
    hidden = spheres()
    hidden["b"]["center"] = (0, -30, 0)
    unlit = certainties_of(spheres(lights=(((0, 0, -9), (1, 1, 1)),)))
    reasons = {unlit[f"{name} of floor"].reason for name in ("k_d", "k_s", "n")}
    unseen = certainties_of(hidden)
    reasons |= {unseen[f"{name} of grey"].reason for name in ("k_a", "k_d", "k_s", "n")}
    assert reasons == {"does not show in the image"}
    assert not unlit["k_a of floor"].reason


@pytest.mark.parametrize("k_a", [0.2, 0.0], ids=["inside", "at its bound"])
def test_ambient_and_constant_light_cannot_be_told_apart(k_a, rgb):
    found = certainties_of(flat(k_a))
    assert found["k_a of floor"].reason == "others make up for it" == found["k_d of floor"].reason
    assert "k_d of floor" in found["k_a of floor"].partners
    assert "k_a of floor" in found["k_d of floor"].partners


def test_a_parameter_under_the_noise_is_not_identifiable(rgb):
    clear, lost = (
        certainties_of(spheres(grey=GREY | {"k_s": 0.2}), noise=noise) for noise in (1e-4, 3.0)
    )
    assert clear["n of grey"].reason == ""
    assert lost["n of grey"].reason == "lost in the noise of the physical picture"


def test_the_standard_error_is_the_spread_of_fits_to_noisy_images(rgb):
    surface, image = surface_of(spheres())
    rng, noise, fits = np.random.default_rng(3), 0.01, []
    for _ in range(24):
        noisy = image + noise * rng.normal(size=image.shape)
        objective = objective_of(surface, noisy, loss="linear")
        fits.append(descend(objective, objective.model.paired)[0])
    _, covariance = identify(objective, fits[-1], np.full(image.shape, noise))
    ratio = np.std(fits, axis=0, ddof=1) / np.sqrt(np.diag(covariance))
    # 24 fits give a standard deviation within 15 % (one standard error), for each of 16 parameters.
    assert np.all((ratio > 0.5) & (ratio < 1.6))
    assert 0.85 < np.sqrt(np.mean(ratio**2)) < 1.15


# --- Whole fits -----------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.parametrize("name", LOSSES)
def test_the_errors_are_those_of_the_loss_that_was_minimised(name, rgb):
    loss = LOSSES[name]
    options = Options(resolution=(48, 48), spp=16)
    fitted = fit(builtin("fig-8-9").source(), options, name)
    counted = gbuffer(mi.load_dict(builtin("fig-8-9").make()), (48, 48)).hit
    found = []
    for image in (fitted.before, fitted.after):
        pair = (loss.coordinates(part[counted], DEFAULT_VIEWING)
                for part in (image, fitted.reference))  # fmt: skip
        square, c = np.sum(np.subtract(*pair) ** 2, axis=1), loss.rounding
        found.append(np.mean(square / 2 if np.isinf(c) else np.sqrt(square + c * c) - c))
    nearest = fitted.record.nearest
    assert nearest.loss == pytest.approx(found[1], rel=1e-4)
    assert nearest.loss + nearest.parameter_error == pytest.approx(found[0], rel=1e-4)
    for image, share in zip((fitted.before, fitted.after), nearest.differ, strict=True):
        above = LEADING(image, fitted.reference, DEFAULT_VIEWING)[counted] > 2
        assert share.value == pytest.approx(above.mean(), abs=0.01)


# --- A heuristic's own parameters -----------------------------------------------------------------

GAIN = """
import drjit as dr
from fotismos.heuristic import Range

def shade(point, gain: Range(0, 4) = 1, tint: Range(-1, 1) = 0.25):
    cosines = [dr.maximum(dr.dot(point.normal, each.toward), 0) for each in point.lights]
    lit = sum(c * each.intensity for c, each in zip(cosines, point.lights))
    return gain * lit * point.material.base_color + 0.1 * dr.square(1 + tint) * point.ambient
"""


def test_derivatives_of_a_users_shader_are_those_of_the_image(rgb, written):
    """Against differences of images, at another place than the default."""
    options = Options(heuristic=written(GAIN), resolution=(16, 16), spp=16)
    ready = prepare(builtin("fig-8-9").source(), options)
    model = OwnModel(ready.heuristic, named("mine.py"), [1, 2], np.ones((16, 16), bool))
    x = np.array([1.5, -0.5])
    slopes = central_differences(model.image, x, 0.05)
    assert abs(slopes).max(axis=(1, 2)).min() > 0.01
    np.testing.assert_allclose(model.columns(x), slopes, atol=2e-5 * max(1, abs(slopes).max()))


def test_a_gain_is_that_of_least_squares(rgb, written):
    """In linear RGB the best gain has a closed form: the image is proportional to it."""
    name = written(GAIN.replace(" + 0.1 * dr.square(1 + tint) * point.ambient", ""))
    options = Options(resolution=(24, 24), spp=32, heuristic=name)
    found = fit(builtin("fig-8-9").source(), options, "linear")
    h, r = found.before, found.reference
    (nearest,) = found.record.fits
    gain, tint = nearest.materials[0].parameters
    assert gain.fitted == pytest.approx(np.sum(h * r) / np.sum(h * h), rel=1e-3)
    assert gain.fitted != pytest.approx(1, abs=0.02)
    assert gain.interval[0] <= gain.fitted <= gain.interval[1]
    assert gain.bounds == (0, 4)
    assert nearest.parameter_error > 0
    assert (tint.fitted, tint.reason) == (None, "does not show in the image")


# --- The command ----------------------------------------------------------------------------------

CORPUS = Path(__file__).parents[1] / "corpus"
SMALL = ("--resolution", "16x12", "--spp", 4)


def test_the_command_writes_a_record_and_a_picture_and_repeats_itself(run, tmp_path):
    words = ("fig-8-6a", "fig-8-5a", "--seed", 5, *SMALL)
    code, printed, _ = run("fit", *words, "-o", tmp_path / "a")
    assert code == 0
    file = Path("fit/fig-8-6a/fit.json")
    data = json.loads((tmp_path / "a" / file).read_text())
    jsonschema.validate(data, schema("fit"))
    assert [one["form"] for one in data["fits"]] == ["phong", "blinn"]
    losses = [one["loss"] for one in data["fits"]]
    assert losses[data["best"]] == min(losses)
    assert "fig-8-5a: the paired parameters show no visible difference" in printed
    for word in ("paired", "blinn", "noise alone", "parameter error", "model error"):
        assert word in printed
    page = (tmp_path / "a/fit/fig-8-6a/index.html").read_text(encoding="utf-8")
    assert len(set(re.findall(r'src="data:image/webp[^"]*"', page))) == 5
    paired, fitted = (share["value"] for share in data["fits"][data["best"]]["differ"])
    assert paired > fitted > 0.05
    judged = f"ΔE2000 2: paired {percent(paired)} (fail), fitted {percent(fitted)} (fail)."
    assert judged in printed
    assert "paired 0 % (pass), fitted 0 % (pass)." in printed  # the exact one
    for word in (
        "the best parameters remove",
        "noise alone",
        "95 %, by noise alone",
        data["command"],
        judged,
    ):
        assert word in page
    code, printed, _ = run(*shlex.split(data["command"])[1:], "--json", "-o", tmp_path / "b")
    (again,) = json.loads(printed)
    assert (code, again["fits"]) == (0, data["fits"])


def test_intervals_have_enough_digits_and_the_exponent_of_blinn_is_explained(rgb):
    found = fit(builtin("fig-8-9").source(), Options(resolution=(8, 8), spp=4), forms=["blinn"])
    form = found.record.nearest
    material = form.materials[0]

    def printed(interval):
        parameters = [structs.replace(one, interval=interval) for one in material.parameters]
        changed = structs.replace(material, parameters=tuple(parameters))
        fits = (structs.replace(form, materials=(changed,)),)
        return "\n".join(fit_files.lines(structs.replace(found.record, fits=fits)))

    assert "below the last digit" in printed((0.30591, 0.30592))
    assert "0.3059 to 0.306" in printed((0.30591, 0.306))
    n = float(builtin("fig-8-9").make()["sphere"]["bsdf"]["n"])
    assert (
        f"paired n {4 * n:g} of blinn: its lobe is as wide as that of n {n:g} of phong"
        in printed(None)
    )


def test_what_cannot_be_fitted_is_refused(run, rgb, written, tmp_path):
    plain = written("def shade(point): return point.ambient\n")
    away = builtin("fig-8-6a").make()
    away["sensor"]["to_world"] = look_at((0, -8, 3), (0, -9, 3))
    with pytest.raises(InputError, match="no pixel sees a surface"):
        fit(Source("away", away), Options(resolution=(8, 8), spp=4))
    with pytest.raises(InputError, match="phong, blinn"):
        fit(builtin("fig-8-9").source(), forms=())
    for words, expected in (
        (("fig-6-10",), "--interpolation phong"),
        (("fig-8-6a", "--variant", "llvm_ad_mono"), "--heuristic-variant llvm_ad_rgb"),
        (("fig-8-9", "--heuristic", plain), f"heuristic {plain} has no parameters to fit"),
        ((CORPUS / "bsdf-mask.xml",), "material of shape-.* needs opaque materials"),
        ((CORPUS / "bsdf-principled.xml",), "material of shape-.* n varies over the surface"),
    ):
        code, _, messages = run("fit", *words, "-o", tmp_path, *SMALL)
        assert code == 2
        assert re.search(f"(?s){expected}", " ".join(messages.split())), messages
