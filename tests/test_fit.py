"""Fits: gradients, recovery of known parameters, and what an image does not tell."""

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from drjit.llvm.ad import Array3f64

from comparisons.compare import prepare
from comparisons.departure.spaces import DEFAULT_VIEWING
from comparisons.fit import identify, optimise
from comparisons.fit.fit import FitOptions, fit
from comparisons.fit.loss import LOSSES
from comparisons.fit.model import Model
from comparisons.fit.parameters import bounds, parameters, start
from comparisons.fit.recorder import Recorder
from comparisons.fit.rendering import filter_by_box, render
from comparisons.gallery.builtin import builtin
from comparisons.options import Options
from heuristic.errors import InputError
from heuristic.interpolation import Interpolation
from heuristic.terms import normalisation
from reference.rendering.gbuffer import gbuffer
from reference.rendering.renderer import Renderer
from reference.scene.source import Source

SIZE = 40
RED = {"k_a": (0.3, 0.1, 0.1), "k_d": (0.6, 0.2, 0.1), "k_s": 0.4, "n": 12.0}
GREY = {"k_a": 0.1, "k_d": 0.3, "k_s": 0.6, "n": 40.0}
FLOOR = {"k_a": 0.2, "k_d": 0.5, "k_s": 0.1, "n": 3.0}
LIGHTS = (((-3, -4, 5), (1.0, 0.9, 0.8)), ((4, -3, 3), (0.3, 0.3, 0.5)))


def bsdf(name, form="phong", **coefficients):
    colours = {
        key: {"type": "rgb", "value": value} if isinstance(value, tuple) else value
        for key, value in coefficients.items()
    }
    return {"type": "phong", "id": name, "form": form, **colours}


def spheres(form="phong", red=RED, grey=GREY, floor=FLOOR, lights=LIGHTS, **integrator):
    """Two spheres over a floor, each of its own material."""
    camera = mi.ScalarTransform4f().look_at((0, -8, 3), (0, 0, 0), (0, 0, 1))
    film = {"type": "hdrfilm", "width": SIZE, "height": SIZE, "rfilter": {"type": "box"}}
    sampler = {"type": "multijitter", "sample_count": 4}
    sensor = {"type": "perspective", "fov": 40.0, "film": film, "sampler": sampler}
    scene = {
        "type": "scene",
        "integrator": {"type": "heuristic", "ambient": 1.0, **integrator},
        "sensor": {**sensor, "to_world": camera},
        "a": {"type": "sphere", "center": (-1.2, 0, 0), "bsdf": bsdf("red", form, **red)},
        "b": {"type": "sphere", "center": (1.2, 0, 0), "bsdf": bsdf("grey", form, **grey)},
        "c": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate((0, 0, -1)).scale(4),
            "bsdf": bsdf("floor", form, **floor),
        },
    }
    for number, (position, colour) in enumerate(lights):
        intensity = {"type": "rgb", "value": colour}
        light = {"type": "heuristic_point", "position": position, "intensity": intensity}
        scene[f"light {number}"] = light
    return scene


def surface_of(scene, passes=2, spp=4):
    """Return the surface of a scene, and its image by the integrator ``heuristic``."""
    renderer = Renderer(mi.load_dict(scene, optimize=False), None, spp, "heuristic image")
    recorder, image = Recorder(renderer), 0.0
    for seed in range(passes):
        recorder.render(seed)
        image = image + np.array(renderer.render(seed), float) / passes
    return recorder.surface(), image.reshape(-1, 3)


def in_double(surface):
    """Return a surface whose kernel computes in double precision."""
    samples = [
        replace(
            part, **{key: Array3f64(getattr(part, key)) for key in ("position", "normal", "view")}
        )
        for part in surface.samples
    ]
    return replace(surface, samples=tuple(samples))


def residuals_of(surface, image, form="phong", loss="perceptual", intensities=False):
    loss = LOSSES[loss]
    found = parameters(surface, form, loss.sees_colour, intensities)
    return optimise.Residuals(Model(surface, form, found), image, loss, DEFAULT_VIEWING)


def inside(residuals, seed=0):
    """Return parameters well within their bounds."""
    low, high = bounds(residuals.model.parameters)
    shares = np.random.default_rng(seed).uniform(0.3, 0.6, len(low))
    return low + shares * (high - low)


def central_differences(function, x, step):
    sides = [
        [np.asarray(function(x + sign * step * unit)) for sign in (1, -1)]
        for unit in np.eye(len(x))
    ]
    return np.stack([(up - down) / (2 * step) for up, down in sides])


@pytest.mark.parametrize("case", ["plain", "blinn", "occlusion", "texture", "normalised"])
def test_the_model_at_the_paired_parameters_is_the_integrators_image(case, rgb):
    scene = spheres("blinn" if case == "blinn" else "phong", occlusion=case == "occlusion")
    if case == "texture":
        for key in ("k_d", "k_s"):
            scene["c"]["bsdf"][key] = {"type": "checkerboard", "color0": 0.1, "color1": 0.7}
    if case == "normalised":
        scene["a"]["bsdf"] |= {"normalised": True, "k_s": 0.1}
    surface, image = surface_of(scene)
    found = parameters(surface, "blinn" if case == "blinn" else "phong")
    model = Model(surface, "blinn" if case == "blinn" else "phong", found)
    assert image.max() > 0.5
    # n known to be moderate lets the integrator do without double precision: 1e-4 at most.
    np.testing.assert_allclose(model.image(start(found)), image, rtol=1e-4, atol=1e-5)
    assert np.mean(np.abs(model.image(start(found)) - image)) < 1e-6


@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_the_jacobian_is_that_of_central_differences_in_double_precision(form, rgb):
    surface, image = surface_of(spheres(form))
    residuals = residuals_of(in_double(surface), image, form, intensities=True)
    model, x = residuals.model, inside(residuals)
    names = [parameter.name for parameter in model.parameters]
    assert set(names) == {"k_a", "k_d", "k_s", "n", "intensity"}
    expected = central_differences(model.image, x, 1e-5)
    found = model.columns(x)
    for name, one, other in zip(names, found, expected, strict=True):
        assert np.abs(other).max() > 1e-3, f"{name} should change the image"
        np.testing.assert_allclose(one, other, atol=1e-7 * np.abs(other).max(), err_msg=name)


@pytest.mark.parametrize("loss", LOSSES)
def test_the_gradient_of_each_loss_is_that_of_central_differences(loss, rgb):
    surface, image = surface_of(spheres())
    residuals = residuals_of(in_double(surface), image, loss=loss)
    x = inside(residuals)
    gradient, second = residuals.quadratic(x)
    expected = central_differences(residuals.loss, x, 1e-5)
    np.testing.assert_allclose(gradient, expected, atol=2e-5 * np.abs(expected).max())
    assert np.linalg.eigvalsh(second).min() > -1e-9 * np.abs(second).max()


def test_the_second_derivative_is_exact_where_the_model_is_linear(rgb):
    """Curvature of the distance itself, in coordinates linear in the coefficients: RGB."""
    surface, image = surface_of(spheres())
    residuals = residuals_of(in_double(surface), image, loss="linear")
    residuals.distance = replace(residuals.distance, rounding=0.05)
    x, linear = inside(residuals), residuals.model.linear
    expected = central_differences(lambda y: residuals.quadratic(y)[0], x, 1e-5)
    found = residuals.quadratic(x)[1]
    np.testing.assert_allclose(
        found[np.ix_(linear, linear)],
        expected[np.ix_(linear, linear)],
        atol=1e-6 * np.abs(found).max(),
    )


@pytest.mark.parametrize("loss", LOSSES)
@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_known_parameters_are_recovered_from_an_image_made_with_them(form, loss, rgb):
    _, image = surface_of(spheres(form))
    wrong = {"k_a": 0.5, "k_d": 0.5, "k_s": 0.2, "n": 5.0}
    tint = RED if loss == "log-luminance" else {"k_a": (0.5, 0.4, 0.3), "k_d": (0.2, 0.3, 0.4)}
    red = wrong | {key: tint[key] for key in ("k_a", "k_d")}
    surface, _ = surface_of(spheres(form, red, wrong, wrong))
    residuals = residuals_of(surface, image, form, loss)
    x = optimise.minimise(residuals).x
    truth = dict(enumerate((RED, GREY, FLOOR)))
    for owner, material in truth.items():
        n = residuals.model.exponent(x, owner)
        assert n == pytest.approx(material["n"], rel=1e-3)
        for name in ("k_a", "k_d", "k_s"):
            found = residuals.model.coefficients(x, name)[owner]
            scale = normalisation(form, n) if name == "k_s" else 1.0
            expected = np.broadcast_to(material[name], 3)
            np.testing.assert_allclose(found * scale, expected, rtol=1e-3, err_msg=name)


def test_intensities_are_recovered_against_the_first(rgb):
    _, image = surface_of(spheres())
    dimmed = [(LIGHTS[0][0], LIGHTS[0][1]), (LIGHTS[1][0], tuple(np.divide(LIGHTS[1][1], 2.5)))]
    surface, _ = surface_of(spheres(lights=dimmed))
    residuals = residuals_of(surface, image, intensities=True)
    assert np.exp(optimise.minimise(residuals).x[-1]) == pytest.approx(2.5, rel=1e-3)


def verdicts_of(scene, image=None, noise=0.0):
    surface, own = surface_of(scene)
    residuals = residuals_of(surface, own if image is None else image)
    x = optimise.minimise(residuals).x
    reached = np.full(len(x), len(own))
    error = np.full((len(own), 3), noise)
    verdicts, covariance = identify.identify(residuals, x, reached, error)
    names = [f"{p.name} of {surface.names[p.owner]}" for p in residuals.model.parameters]
    return dict(zip(names, verdicts, strict=True)), dict(
        zip(names, np.diag(covariance), strict=True)
    )


def test_an_exponent_without_a_highlight_is_not_identifiable(rgb):
    verdicts, _ = verdicts_of(spheres(grey=GREY | {"k_s": 0.0}))
    assert verdicts["n of grey"].reason == "does not show in the image"
    assert verdicts["k_s of grey"].at_bound
    assert not verdicts["k_s of grey"].reason
    assert not verdicts["n of red"].reason


def flat(**integrator):
    """A floor alone, seen from above under parallel light: all of it has one colour."""
    scene = spheres(lights=(), **integrator)
    scene["sensor"]["to_world"] = mi.ScalarTransform4f().look_at((0, 0, 5), (0, 0, 0), (0, 1, 0))
    scene["sun"] = {"type": "heuristic_directional", "direction": (1, 0, -1), "intensity": 1.0}
    return {key: value for key, value in scene.items() if key not in ("a", "b")}


@pytest.mark.parametrize("k_a", [0.2, 0.0], ids=["inside", "at its bound"])
def test_ambient_and_constant_light_cannot_be_told_apart(k_a, rgb):
    scene = flat()
    scene["c"]["bsdf"]["k_a"] = k_a
    verdicts, _ = verdicts_of(scene)
    assert verdicts["k_a of floor"].reason == verdicts["k_d of floor"].reason
    assert verdicts["k_a of floor"].reason == "others make up for it"
    assert 1 in verdicts["k_a of floor"].partners
    assert 0 in verdicts["k_d of floor"].partners


def test_an_unlit_and_an_unseen_material_are_not_identifiable(rgb):
    scene = spheres()
    scene["b"]["center"] = (0, -30, 0)
    verdicts, _ = verdicts_of(scene)
    unseen = [verdicts[f"{name} of grey"] for name in ("k_a", "k_d", "k_s", "n")]
    scene = spheres(lights=(((0, 0, -9), (1, 1, 1)),))
    verdicts, _ = verdicts_of(scene)
    unlit = [verdicts[f"{name} of floor"] for name in ("k_d", "k_s", "n")]
    assert {verdict.reason for verdict in unseen + unlit} == {"does not show in the image"}
    assert not verdicts["k_a of floor"].reason


def test_a_parameter_under_the_noise_is_not_identifiable(rgb):
    faint = GREY | {"k_s": 0.2}
    clear, _ = verdicts_of(spheres(grey=faint), noise=1e-4)
    lost, _ = verdicts_of(spheres(grey=faint), noise=3.0)
    assert clear["n of grey"].reason == ""
    assert lost["n of grey"].reason == "lost in the reference's noise"


def test_the_standard_error_is_the_spread_of_fits_to_noisy_images(rgb):
    surface, image = surface_of(spheres())
    rng, noise, fits = np.random.default_rng(3), 0.01, []
    for _ in range(24):
        noisy = image + noise * rng.normal(size=image.shape)
        residuals = residuals_of(surface, noisy, loss="linear")
        fits.append(optimise.descend(residuals, start(residuals.model.parameters))[0])
    reached = np.full(len(fits[0]), len(image))
    error = np.full(image.shape, noise)
    _, covariance = identify.identify(residuals, fits[-1], reached, error)
    ratio = np.std(fits, axis=0, ddof=1) / np.sqrt(np.diag(covariance))
    # 24 fits give a standard deviation within 15 % (one standard error), for each of 16 parameters.
    assert np.all((ratio > 0.5) & (ratio < 1.6))
    assert 0.85 < np.sqrt(np.mean(ratio**2)) < 1.15


def test_the_fit_of_figure_8_9_leaves_what_fresnel_makes(rgb):
    """Roughplastic reflects more towards the rim, which no parameter of the model does."""
    result = fit(builtin("fig-8-9").source(), Options(resolution=(48, 48), spp=16))
    best = result.record.nearest
    for departure in best.departure.values():
        assert departure.before > 2 * departure.after
        assert departure.after > 10 * departure.noise_floor
    assert best.parameter_error > best.loss > 0
    images = result.images
    rim = unlit_rim(48)
    assert images.reference[rim].mean() > 1.05 * images.after[rim].mean()
    assert images.maps["dE2000"][rim].mean() > 2 * best.departure["dE2000"].after


@pytest.mark.parametrize("loss", LOSSES)
def test_the_errors_are_those_of_the_loss_that_was_minimised(loss, rgb):
    result = fit(
        builtin("fig-8-9").source(), Options(resolution=(24, 24), spp=4), FitOptions(loss=loss)
    )
    images, distance = result.images, LOSSES[loss]
    counted = gbuffer(mi.load_dict(builtin("fig-8-9").make()), 24, 24).hit
    found = []
    for image in (images.before, images.after):
        pair = (distance.coordinates(part[counted], DEFAULT_VIEWING)
                for part in (image, images.reference))  # fmt: skip
        square = np.sum(np.subtract(*pair) ** 2, axis=1)
        c = distance.rounding
        found.append(np.mean(square / 2 if np.isinf(c) else np.sqrt(square + c * c) - c))
    best = result.record.nearest
    assert best.loss == pytest.approx(found[1], rel=1e-4)
    assert best.loss + best.parameter_error == pytest.approx(found[0], rel=1e-4)


@pytest.mark.parametrize("name", ["fig-8-7a", "fig-8-9"])
def test_no_coefficient_does_better_at_one_of_its_bounds(name, rgb):
    """In the plain mean distance, too: a loss that is rounded where it is seen ends elsewhere.

    With a rounding of 1 the fit of figure 8.7a has a mean of 1.741 at k_d = 8e-5, and 1.718 at 0.
    """
    rendered = rendered_for_a_fit(name)
    counted = rendered.counted
    surface = rendered.surface.within(counted.ravel())
    residuals = residuals_of(surface, rendered.reference.mean[counted])

    def mean_distance(x):
        return np.linalg.norm(residuals.differences(x), axis=1).mean()

    solution = optimise.minimise(residuals)
    assert mean_distance(solution.x) == pytest.approx(solution.loss, abs=0.1)
    low, high = bounds(residuals.model.parameters)
    for place in np.flatnonzero(residuals.model.linear):
        for bound in (low[place], high[place]):
            x = solution.x.copy()
            x[place] = bound
            assert residuals.loss(x) >= solution.loss
            assert mean_distance(x) >= mean_distance(solution.x)


def rendered_for_a_fit(name):
    options = Options(resolution=(96, 96), spp=16)
    ready = prepare(builtin(name).source().edited(filter_by_box), options)
    return render(ready, options, lambda *_: None)


def unlit_rim(size):
    """Return the mask of the upper outline of the sphere, which the ambient light alone reaches."""
    y, x = np.mgrid[:size, :size] - (size - 1) / 2
    # The sphere of radius 1 at distance 10^(1/2) fills asin(10^(-1/2)) of the 20 degrees.
    outline = size / 2 * np.tan(np.arcsin(10**-0.5)) / np.tan(np.deg2rad(20))
    radius = np.hypot(x, y) / outline
    return (radius > 0.9) & (radius < 0.98) & (y < -abs(x))


def test_an_exact_pair_has_no_error_of_either_kind(rgb):
    result = fit(builtin("fig-8-5a").source(), Options(resolution=(16, 16), spp=4))
    best = result.record.nearest
    assert best.departure["dE2000"].before == pytest.approx(0, abs=1e-4)
    found = {p.name: p for p in best.materials[0].parameters}
    assert found["k_a"].fitted == pytest.approx(0.5, rel=1e-5)
    assert [found[name].fitted for name in ("k_d", "k_s", "n")] == [None] * 3


def test_a_form_and_its_normalised_variant_are_one_fit_with_another_k_s(rgb):
    result = fit(builtin("fig-8-9").source(), Options(resolution=(24, 24), spp=4))
    for plain, normalised in zip(*(result.record.fits[i::2] for i in (0, 1)), strict=True):
        assert (plain.normalised, normalised.normalised) == (False, True)
        assert plain.departure == normalised.departure
        one, other = (
            {p.name: p.fitted for p in f.materials[0].parameters} for f in (plain, normalised)
        )
        assert one["k_s"] == pytest.approx(other["k_s"] * normalisation(plain.form, one["n"]))
        assert one["k_d"] == other["k_d"]


def test_what_cannot_be_fitted_is_refused(rgb):
    source = builtin("fig-8-9").source()
    with pytest.raises(InputError, match="--interpolation phong"):
        fit(source, Options(interpolation=Interpolation.FLAT))
    with pytest.raises(InputError, match="choose one of perceptual"):
        FitOptions(loss="L1")
    with pytest.raises(InputError, match="phong, blinn"):
        FitOptions(forms=())
    away = builtin("fig-8-6a").make()
    away["sensor"]["to_world"] = mi.ScalarTransform4f().look_at((0, -8, 3), (0, -9, 3), (0, 0, 1))
    with pytest.raises(InputError, match="no pixel sees a surface"):
        fit(Source("away", away), Options(resolution=(8, 8), spp=4))


def test_spectral_shading_is_refused(spectral):
    with pytest.raises(InputError, match="--heuristic-variant llvm_ad_rgb"):
        fit(builtin("fig-8-5a").source(), Options(resolution=(8, 8), spp=4))


def test_one_kernel_serves_all_exponents(rgb, kernel_history):
    surface, _ = surface_of(spheres())
    model = Model(surface, "phong", parameters(surface, "phong"))
    model._specular(0, 3.0, list(surface.lights))
    kernels = kernel_history(lambda: model._specular(0, 700.0, list(surface.lights))[0].sum())
    assert all(kernel["cache_hit"] for kernel in kernels)
    dr.sync_thread()
