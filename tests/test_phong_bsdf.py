"""The BSDF plugin ``phong``: values, sampling, parameters."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from comparisons.scenes import SCENES
from tests import checks

MATERIALS = {
    "diffuse": {"k_d": 0.7},
    "specular n=1": {"k_s": 0.9, "n": 1},
    "specular n=9": {"k_s": 0.9, "n": 9},
    "specular n=100": {"k_s": 0.9, "n": 100},
    "mixed n=1": {"k_d": 0.5, "k_s": 0.7, "n": 1},
    "mixed n=9": {"k_d": 0.5, "k_s": 0.7, "n": 9},
    "mixed n=100": {"k_d": 0.05, "k_s": 0.7, "n": 100},
    "even lobe": {"k_d": 0.2, "k_s": 0.7, "n": 0},
    "blinn n=9": {"k_d": 0.5, "k_s": 0.7, "n": 9, "form": "blinn"},
    "blinn n=100": {"k_s": 0.7, "n": 100, "form": "blinn"},
    "normalised n=9": {"k_d": 0.5, "k_s": 0.3, "n": 9, "normalised": True},
}
ANGLES = [0, 35, 80]


def phong(**values):
    return {"type": "phong", **values}


def direction(degrees, azimuth=0.0):
    theta, phi = np.deg2rad([degrees, azimuth])
    return [
        float(np.sin(theta) * np.cos(phi)),
        float(np.sin(theta) * np.sin(phi)),
        float(np.cos(theta)),
    ]


def interaction(wi, count=1):
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(wi)
    return si


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch, tmp_path):
    """Mitsuba's χ² test writes a file into the current folder when it rejects."""
    monkeypatch.chdir(tmp_path)


def chi2(values, wi, context=None):
    sample, pdf = mi.chi2.BSDFAdapter("phong", phong(**values), wi=wi, ctx=context)
    return mi.chi2.ChiSquareTest(
        domain=mi.chi2.SphericalDomain(),
        sample_func=sample,
        pdf_func=pdf,
        sample_dim=3,
        sample_count=200_000,
        res=101,
        ires=16,
    )


# --- Sampling --------------------------------------------------------------------------------


@pytest.mark.parametrize("degrees", ANGLES)
@pytest.mark.parametrize("values", MATERIALS.values(), ids=MATERIALS.keys())
def test_samples_follow_the_density(rgb, values, degrees):
    test = chi2(values, direction(degrees, 30))
    assert test.run(significance_level=0.01, test_count=len(MATERIALS) * len(ANGLES) + 4), (
        test.messages
    )


@pytest.mark.parametrize("degrees", [150, 100])
def test_samples_of_a_two_sided_surface_seen_from_below_follow_the_density(rgb, degrees):
    test = chi2({**MATERIALS["mixed n=9"], "twosided": True}, direction(degrees, 30))
    assert test.run(significance_level=0.01, test_count=len(MATERIALS) * len(ANGLES) + 4), (
        test.messages
    )


@pytest.mark.parametrize("component", ["GlossyReflection", "DiffuseReflection"])
def test_samples_of_one_component_follow_its_density(rgb, component):
    context = mi.BSDFContext()
    context.type_mask = +getattr(mi.BSDFFlags, component)
    test = chi2(MATERIALS["mixed n=9"], direction(35), context)
    assert test.run(significance_level=0.01, test_count=len(MATERIALS) * len(ANGLES) + 4), (
        test.messages
    )


def test_the_chi2_test_finds_a_density_that_is_wrong(rgb):
    """Samples for n = 9 against the density for n = 11."""
    sample, _ = mi.chi2.BSDFAdapter("phong", phong(k_s=0.7, n=9), wi=direction(35))
    _, pdf = mi.chi2.BSDFAdapter("phong", phong(k_s=0.7, n=11), wi=direction(35))
    test = mi.chi2.ChiSquareTest(
        mi.chi2.SphericalDomain(), sample, pdf, 3, sample_count=200_000, ires=16
    )
    assert not test.run(significance_level=0.01)


@pytest.mark.parametrize("degrees", [*ANGLES, 120])
@pytest.mark.parametrize("values", MATERIALS.values(), ids=MATERIALS.keys())
def test_weight_is_value_over_density(rgb, values, degrees):
    bsdf = mi.load_dict(phong(**values, twosided=True))
    rng = mi.PCG32(20_000)
    si = interaction(direction(degrees), 20_000)
    context = mi.BSDFContext()
    sample1, sample2 = rng.next_float32(), mi.Point2f(rng.next_float32(), rng.next_float32())
    bs, weight = bsdf.sample(context, si, sample1, sample2)
    value, density = bsdf.eval(context, si, bs.wo), bsdf.pdf(context, si, bs.wo)
    drawn = np.array(bs.pdf) > 0
    assert drawn.mean() > 0.3
    np.testing.assert_allclose(np.array(bs.pdf), np.array(density), rtol=1e-5)
    expected = np.array(value)[:, drawn] / np.array(density)[drawn]
    np.testing.assert_allclose(np.array(weight)[:, drawn], expected, rtol=1e-5)
    assert not np.array(weight)[:, ~drawn].any()


def spherical_grid(size=500):
    """Directions over the sphere and the solid angle of each, midpoints in cosine and azimuth."""
    cosine = (np.arange(2 * size) + 0.5) / size - 1
    azimuth = (np.arange(2 * size) + 0.5) * np.pi / size
    z, phi = (axis.ravel() for axis in np.meshgrid(cosine, azimuth))
    sine = np.sqrt(1 - z**2)
    wo = mi.Vector3f(mi.Float(sine * np.cos(phi)), mi.Float(sine * np.sin(phi)), mi.Float(z))
    return wo, np.pi / size**2


@pytest.mark.parametrize("degrees", [0, 35, 80, 89])
@pytest.mark.parametrize("values", MATERIALS.values(), ids=MATERIALS.keys())
def test_the_density_integrates_to_the_share_of_samples_above_the_horizon(rgb, values, degrees):
    """At most 1; what is missing is the part of the lobe that is cut off by the surface."""
    bsdf = mi.load_dict(phong(**values))
    wo, solid_angle = spherical_grid()
    si = interaction(direction(degrees), dr.width(wo))
    total = np.array(bsdf.pdf(mi.BSDFContext(), si, wo), float).sum() * solid_angle
    assert total < 1 + 2e-3
    rng = mi.PCG32(100_000)
    bs, _ = bsdf.sample(
        mi.BSDFContext(),
        interaction(direction(degrees), 100_000),
        rng.next_float32(),
        mi.Point2f(rng.next_float32(), rng.next_float32()),
    )
    share = np.mean(np.array(bs.pdf) > 0)
    assert abs(share - total) < 5 * np.sqrt(0.25 / 100_000) + 2e-3


# --- Values ----------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [0, 1, 3, 9, 30])
def test_the_lobes_albedo_under_light_from_the_normal(rgb, n):
    """``2 k_s / (n + 2)``: the light is fixed and the directions that it leaves in are summed.

    Phong's lobe is not reciprocal, so that the sum over the light's directions is another number.
    """
    bsdf = mi.load_dict(phong(k_s=0.7, n=n))
    viewers, solid_angle = spherical_grid()
    si = interaction([0, 0, 1], dr.width(viewers))
    si.wi = viewers
    light = mi.Vector3f(0, 0, 1)
    radiance = np.array(bsdf.eval(mi.BSDFContext(), si, light), float)[0]  # of unit irradiance
    leaving = np.sum(radiance * np.maximum(np.array(viewers.z, float), 0)) * solid_angle
    assert leaving == pytest.approx(2 * 0.7 / (n + 2), rel=1e-3)


@pytest.mark.parametrize("form", ["phong", "blinn"])
@pytest.mark.parametrize("n", [0, 3, 9, 30])
def test_a_normalised_lobe_has_the_albedo_k_s(rgb, form, n):
    bsdf = mi.load_dict(phong(k_s=0.3, n=n, form=form, normalised=True))
    viewers, solid_angle = spherical_grid()
    si = interaction([0, 0, 1], dr.width(viewers))
    si.wi = viewers
    radiance = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(0, 0, 1)), float)[0]
    leaving = np.sum(radiance * np.maximum(np.array(viewers.z, float), 0)) * solid_angle
    assert leaving == pytest.approx(0.3, rel=1e-3)


def test_values_are_those_of_the_equation(rgb):
    """``f cos = [k_d (N.L) + k_s (R.V)^n] / pi`` from above, and nothing from below."""
    bsdf = mi.load_dict(phong(k_d=0.5, k_s=0.7, n=9))
    rng = np.random.default_rng(0)
    wi, wo = (checks.oracle.unit(rng.normal(size=(5000, 3))) for _ in range(2))
    si = interaction([0, 0, 1], 5000)
    si.wi = mi.Vector3f(wi.T)
    found = np.array(bsdf.eval(mi.BSDFContext(), si, mi.Vector3f(wo.T)), float)
    mirrored = wi * [-1, -1, 1]
    lobe = np.maximum(np.sum(mirrored * wo, axis=1), 0) ** 9
    expected = (0.5 * wo[:, 2] + 0.7 * lobe) / np.pi
    expected[(wi[:, 2] <= 0) | (wo[:, 2] <= 0)] = 0
    np.testing.assert_allclose(found, np.tile(expected, (3, 1)), atol=1e-6)
    assert np.count_nonzero(expected) > 1000


# --- Parameters ------------------------------------------------------------------------------


def test_edited_coefficients_change_the_picture_and_compile_nothing(rgb, kernel_history):
    scene = mi.load_dict(checks.with_film(SCENES["fig-8-9"].make(), 32, 4))
    params = mi.traverse(scene)
    (k_d, n) = (
        next(key for key, _ in params if key.endswith(ending)) for ending in ("k_d.value", ".n")
    )

    def picture():
        return mi.render(scene, spp=4, seed=0)

    before = np.array(picture())
    kernels = kernel_history(picture)
    params[k_d], params[n] = 0.25, 30.0
    params.update()
    edited = kernel_history(picture)
    assert [kernel["hash"] for kernel in edited] == [kernel["hash"] for kernel in kernels]
    assert all(kernel["cache_hit"] for kernel in edited)
    fresh = SCENES["fig-8-9"].make()
    fresh["sphere"]["bsdf"] |= {"k_d": 0.25, "n": 30}
    fresh = checks.render(checks.with_film(fresh, 32, 4), 4, 0)
    after = np.array(picture())
    np.testing.assert_allclose(after, fresh, atol=1e-6)
    assert np.abs(after - before).max() > 0.1


def test_all_parameters_can_be_traversed(rgb):
    params = mi.traverse(mi.load_dict(phong(k_i=0.1, k_a=0.1, k_d=0.5, k_s=0.7, n=9)))
    names = {key.partition(".")[0] for key, _ in params}
    assert {"k_i", "k_a", "k_d", "k_s", "n"} <= names


@pytest.mark.parametrize(
    ("plugin", "edits"),
    [
        (
            {"type": "heuristic_point", "position": (-4, 0, 0), "k2": 0.1},
            {"position": (-3.0, 1.0, 0.0), "k2": 0.2, "intensity.value": 0.5, "scale": 2.0},
        ),
        (
            {"type": "heuristic_spot", "position": (-4, 0, 0), "direction": (1, 0, 0), "k2": 0.1},
            {"direction": (1.0, 0.1, 0.0), "cutoff": 10.0, "exponent": 3.0, "k0": 2.0},
        ),
        (
            {"type": "heuristic_directional", "direction": (1, 0, 0)},
            {"direction": (1.0, 0.5, 0.0), "intensity.value": 0.5},
        ),
    ],
    ids=["point", "spot", "directional"],
)
def test_edited_lights_are_lights_made_so(rgb, kernel_history, plugin, edits):
    """And the kernel stays the same, so that fits and sweeps do not compile at each step."""

    def scene(light):
        figure = SCENES["fig-8-9"].make()
        figure["light 1"] = light
        return checks.with_film(figure, 32, 4)

    edited = mi.load_dict(scene(plugin))
    params = mi.traverse(edited)
    (intensity,) = (key for key, _ in params if key.endswith("intensity.value"))
    prefix = intensity.removesuffix("intensity.value")
    before = np.array(mi.render(edited, spp=4, seed=0))
    kernels = kernel_history(lambda: mi.render(edited, spp=4, seed=0))
    for name, value in edits.items():
        params[prefix + name] = value
    params.update()
    after = np.array(mi.render(edited, spp=4, seed=0))
    again = kernel_history(lambda: mi.render(edited, spp=4, seed=0))
    assert [kernel["hash"] for kernel in again] == [kernel["hash"] for kernel in kernels]
    made = {name.removesuffix(".value"): value for name, value in edits.items()}
    fresh = checks.render(scene(plugin | made), 4, 0)
    np.testing.assert_allclose(after, fresh, atol=1e-6)
    assert np.abs(after - before).max() > 0.05


def test_it_describes_itself(rgb):
    text = str(mi.load_dict(phong(k_d=0.5, k_s=0.7, n=9)))
    assert text.startswith("PhongBSDF[")
    for name in ("k_i", "k_a", "k_d", "k_s", "n = [9]", "twosided = False"):
        assert name in text


def test_an_unknown_parameter_is_refused_by_name(rgb):
    with pytest.raises(RuntimeError, match="shininess"):
        mi.load_dict(phong(k_d=0.5, shininess=9))


@pytest.mark.parametrize("n", [-1.0, float("nan"), float("inf")])
def test_an_exponent_that_is_negative_or_not_finite_is_refused(rgb, n):
    with pytest.raises(RuntimeError, match=r"phong: n = .* is not allowed"):
        mi.load_dict(phong(k_s=0.5, n=n))


@pytest.mark.parametrize("name", ["k_i", "k_a", "k_d", "k_s"])
@pytest.mark.parametrize("value", [-0.1, float("nan"), (0.5, -1.0, 0.5)], ids=str)
def test_a_coefficient_that_is_negative_or_nan_is_refused(rgb, name, value):
    given = {"type": "rgb", "value": value} if isinstance(value, tuple) else value
    with pytest.raises(RuntimeError, match=rf"phong: {name} = .*finite values of 0 or more"):
        mi.load_dict(phong(**{name: given}))


def test_an_unknown_form_is_refused(rgb):
    with pytest.raises(RuntimeError, match=r"form = 'cook' is not known: .*phong, blinn"):
        mi.load_dict(phong(k_s=0.5, form="cook"))
