"""The pairing of heuristic and physical values: factors, conventions, misses, refusals."""

from math import pi, sqrt

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy.integrate import quad

from comparisons.gallery.builtin import SCENES
from heuristic.errors import InputError
from reference import Convention, Source
from reference.pairing import albedo, factors, halves
from reference.pairing.factors import Phong
from tests.programs import ROOT
from tests.test_physics import look_at

MATCHED, LITERAL = Convention.MATCHED, Convention.LITERAL
BSDF, EMITTER = mi.ObjectType.BSDF, mi.ObjectType.Emitter

REACHABLE = {
    "glossy": Phong((0.5, 0.4, 0.3), (0.4,) * 3, 20.0),
    "sharp": Phong((0.05, 0.1, 0.2), (2.0,) * 3, 100.0),
    "dull": Phong((0.3,) * 3, (0.1,) * 3, 5.0),
    "tinted": Phong((0.2, 0.3, 0.4), (0.5, 0.25, 0.125), 30.0),
}
# The brightest material of the figures: no dielectric reflects 0.28 and lets 0.5 back out.
UNREACHABLE = Phong((0.5,) * 3, (0.7,) * 3, 3.0)


def scene(bsdf, *lights, integrator=None):
    description = {
        "type": "scene",
        "integrator": integrator or {"type": "path"},
        "sensor": {
            "type": "perspective",
            "to_world": look_at((-3, 0, 1)),
            "film": {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}},
        },
        "shape": {"type": "sphere", "bsdf": bsdf},
    }
    return description | {f"light {number}": light for number, light in enumerate(lights)}


def pair_of(*arguments, convention=MATCHED, **keywords):
    return halves.pair(Source("a test", scene(*arguments, **keywords)), convention)


def only(graph, kind):
    (index,) = graph.nodes(kind)
    return graph.props(index)


# --- Albedos ---------------------------------------------------------------------------------


def monte_carlo_albedo(plastic, size=700, batches=8):
    """Albedo of Mitsuba's roughplastic under light from the normal, with its standard error.

    Cosine-weighted directions, one in each of ``size``² cells, ``batches`` times: it shares nothing
    with the Gauss-Legendre rule of `pairing.albedo`. Returns mean and error of both parts.
    """
    bsdf = mi.load_dict(
        {
            "type": "roughplastic",
            "diffuse_reflectance": {"type": "rgb", "value": plastic.diffuse_reflectance},
            "specular_reflectance": {"type": "rgb", "value": plastic.specular_reflectance},
            "alpha": plastic.alpha,
            "int_ior": plastic.int_ior,
            "ext_ior": plastic.ext_ior,
            "distribution": plastic.distribution,
            "nonlinear": plastic.nonlinear,
        }
    )
    rng = np.random.default_rng(3)
    cells = np.arange(size)
    x, y = (axis.ravel() for axis in np.meshgrid(cells, cells))
    found = []
    for _ in range(batches):
        u, phi = (x + rng.random(size**2)) / size, 2 * pi * (y + rng.random(size**2)) / size
        sine, cosine = np.sqrt(u), np.sqrt(1 - u)
        wo = mi.Vector3f(
            mi.Float(sine * np.cos(phi)), mi.Float(sine * np.sin(phi)), mi.Float(cosine)
        )
        si = dr.zeros(mi.SurfaceInteraction3f, size**2)
        si.wi = mi.Vector3f(0, 0, 1)
        parts = []
        for component in ("DiffuseReflection", "GlossyReflection"):
            context = mi.BSDFContext()
            context.type_mask = +getattr(mi.BSDFFlags, component)
            value = np.array(bsdf.eval(context, si, wo), float)
            parts.append((value * pi / cosine).mean(axis=1))
        found.append(parts)
    found = np.array(found)
    return found.mean(axis=0), found.std(axis=0, ddof=1) / sqrt(batches)


@pytest.mark.guarantee(
    "pairing",
    "A matched `roughplastic` has the albedos of its Phong material.",
)
@pytest.mark.parametrize("phong", REACHABLE.values(), ids=REACHABLE.keys())
def test_a_matched_roughplastic_has_the_albedos_that_it_was_matched_to(rgb, phong):
    """``k_d`` and ``2 k_s / (n + 2)``, within 5 standard errors of an independent quadrature."""
    plastic, misses = factors.to_roughplastic(phong, MATCHED)
    assert misses == []
    mean, error = monte_carlo_albedo(plastic)
    wanted = np.array([phong.k_d, 2 * np.array(phong.k_s) / (phong.n + 2)])
    assert np.all(error < 1e-3 * wanted)
    np.testing.assert_array_less(np.abs(mean - wanted), 5 * error + 2e-5 * wanted)


@pytest.mark.parametrize("distribution", ["beckmann", "ggx"])
@pytest.mark.parametrize("nonlinear", [False, True])
@pytest.mark.parametrize("alpha", [0.1, 0.5])
def test_the_albedo_of_a_roughplastic(rgb, distribution, nonlinear, alpha):
    plastic = albedo.RoughPlastic(
        (0.2, 0.5, 0.8), alpha, 1.49, 1.0, (1.0, 0.5, 0.25), distribution, nonlinear
    )
    mean, error = monte_carlo_albedo(plastic)
    found = albedo.of_roughplastic(plastic)
    np.testing.assert_array_less(np.abs(found.diffuse - mean[0]), 5 * error[0] + 1e-4)
    np.testing.assert_array_less(np.abs(found.specular - mean[1]), 5 * error[1] + 1e-4)


@pytest.mark.parametrize("n", [0, 1, 3, 9, 100])
@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_the_albedo_of_the_lobe(form, n):
    """``2 pi`` times the integral of ``(k_s / pi) cos^n``, leaving through the cosine.

    The power is of the angle to the mirror direction, or, for Blinn's form, of half of it.
    """
    part = 2 if form == "blinn" else 1
    integral, _ = quad(lambda t: np.cos(t / part) ** n * np.cos(t) * np.sin(t), 0, pi / 2)
    expected = 2 * pi * (0.7 / pi) * integral
    plain = Phong((0.5,) * 3, (0.7,) * 3, n, form=form)
    np.testing.assert_allclose(factors.specular_albedo(plain), expected, rtol=1e-9)
    normalised = Phong((0.5,) * 3, (0.7,) * 3, n, form=form, normalised=True)
    np.testing.assert_allclose(factors.specular_albedo(normalised), 0.7, rtol=1e-9)


@pytest.mark.parametrize("phong", REACHABLE.values(), ids=REACHABLE.keys())
def test_there_and_back_gives_the_same_phong(rgb, phong):
    plastic, _ = factors.to_roughplastic(phong, MATCHED)
    back, misses = factors.to_phong(plastic, MATCHED)
    assert misses == []
    np.testing.assert_allclose(back.k_d, phong.k_d, rtol=2e-5)
    np.testing.assert_allclose(back.k_s, phong.k_s, rtol=2e-5)
    assert back.n == pytest.approx(phong.n, rel=1e-9)


@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_roughness_and_exponent_are_inverse_to_each_other(form):
    for n in (0.0, 1.0, 9.0, 1000.0):
        assert factors.exponent_of(factors.alpha_of(n, form), form) == pytest.approx(n, abs=1e-9)
    assert factors.alpha_of(0, form) == 1
    assert factors.exponent_of(2.0, form) == 0


@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_a_matched_highlight_is_as_wide(rgb, form):
    """Where the heuristic lobe has fallen to a half, so has the rough plastic's, to a fiftieth.

    Under light from the normal, and sharp, so that Fresnel's and Smith's factors hardly change
    across the lobe.
    """
    n = 400.0
    plastic, _ = factors.to_roughplastic(Phong((0.1,) * 3, (2.0,) * 3, n, form=form), MATCHED)
    half = np.arccos(0.5 ** (1 / n)) * (2 if form == "blinn" else 1)
    bsdf = mi.load_dict(
        {"type": "roughplastic", "alpha": plastic.alpha, "int_ior": plastic.int_ior}
    )
    context = mi.BSDFContext()
    context.type_mask = +mi.BSDFFlags.GlossyReflection
    si = dr.zeros(mi.SurfaceInteraction3f, 2)
    si.wi = mi.Vector3f(0, 0, 1)
    angles = np.array([0, half])
    wo = mi.Vector3f(mi.Float(np.sin(angles)), 0, mi.Float(np.cos(angles)))
    top, flank = np.array(bsdf.eval(context, si, wo), float)[0] / np.cos(angles)
    assert flank / top == pytest.approx(0.5, abs=0.01)


def half_width(plastic):
    """Return the angle at which a roughplastic's lobe has fallen to a half, in degrees."""
    bsdf = mi.load_dict(
        {"type": "roughplastic", "alpha": plastic.alpha, "int_ior": plastic.int_ior}
    )
    context = mi.BSDFContext()
    context.type_mask = +mi.BSDFFlags.GlossyReflection
    angles = np.linspace(0, np.pi / 2 - 1e-3, 20_001)
    si = dr.zeros(mi.SurfaceInteraction3f, len(angles))
    si.wi = mi.Vector3f(0, 0, 1)
    wo = mi.Vector3f(mi.Float(np.sin(angles)), 0, mi.Float(np.cos(angles)))
    radiance = np.array(bsdf.eval(context, si, wo), float)[0] / np.cos(angles)
    below = np.flatnonzero(radiance < radiance[0] / 2)
    return np.degrees(angles[below[0]]) if len(below) else np.inf


@pytest.mark.parametrize(
    ("n", "wider"), [(3, 35), (5, 18), (9, 9), (15, 5), (30, 2.6), (100, 0.8), (400, 0.3)]
)
def test_a_matched_highlight_is_wider_by_what_the_page_says(rgb, n, wider):
    """In percent at half the height; docs/pairing.md has this table."""
    plastic, _ = factors.to_roughplastic(Phong((0.1,) * 3, (0.2,) * 3, n), MATCHED)
    own = np.degrees(np.arccos(0.5 ** (1 / n)))
    assert 100 * (half_width(plastic) / own - 1) == pytest.approx(wider, abs=0.6, rel=0.02)
    table = (ROOT / "docs/pairing.md").read_text(encoding="utf-8")
    assert f" {wider} % |" in table


@pytest.mark.parametrize("name", ["fig-8-7a", "fig-8-7b", "fig-8-7c", "fig-8-8a", "fig-8-9"])
def test_an_index_that_no_real_plastic_has_is_named(rgb, name):
    (record,) = halves.pair(SCENES[name].source(), resolution=(8, 8)).bsdfs
    assert record.parameters["int_ior"] > 1.8
    assert f"{record.parameters['int_ior']:.3g}" in record.note
    page = (ROOT / "docs/pairing.md").read_text(encoding="utf-8")
    assert f"{record.parameters['int_ior']:.1f}" in page


def test_a_real_plastic_has_no_note(rgb):
    (record,) = pair_of({"type": "phong", "k_d": 0.3, "k_s": 1.0, "n": 48}).bsdfs
    assert 1.3 < record.parameters["int_ior"] < 1.8
    assert not record.note


@pytest.mark.parametrize("k_s", [1e-6, 1e-8, 1e-12])
def test_a_faint_lobe_is_paired_with_an_ior_near_1(rgb, k_s):
    """A smooth surface reflects ``((ior - 1) / (ior + 1))^2``, here ``2 k_s / (n + 2)``."""
    plastic, misses = factors.to_roughplastic(Phong((0.5,) * 3, (k_s,) * 3, 100), MATCHED)
    reflected = ((plastic.int_ior - 1) / (plastic.int_ior + 1)) ** 2
    faintest = 2.5e-9
    assert reflected == pytest.approx(max(2 * k_s / 102, faintest), rel=0.05)
    assert not misses


def test_what_no_plastic_reaches_is_missed_and_said_so(rgb):
    """And what it reaches instead is what the record says, by the independent quadrature."""
    plastic, misses = factors.to_roughplastic(UNREACHABLE, MATCHED)
    assert misses
    mean, error = monte_carlo_albedo(plastic)
    wanted = {"diffuse": 0.5, "specular": 0.28}
    for miss in misses:
        part = miss.what.split()[0]
        assert miss.wanted == pytest.approx(wanted[part])
        row = ["diffuse", "specular"].index(part)
        assert abs(miss.reached - mean[row, 0]) < 5 * error[row, 0] + 1e-4
        assert miss.reached < miss.wanted - 0.01


def test_the_nearest_plastic_is_taken_where_none_reaches(rgb):
    """No index of refraction and reflectance come nearer, in the sum of squares of both parts."""
    plastic, _ = factors.to_roughplastic(UNREACHABLE, MATCHED)
    wanted = np.array([0.5, 0.28])

    def distance(int_ior, rho):
        found = albedo.of_roughplastic(albedo.RoughPlastic((rho,) * 3, plastic.alpha, int_ior))
        return np.sum((np.array([found.diffuse[0], found.specular[0]]) - wanted) ** 2)

    reached = distance(plastic.int_ior, plastic.diffuse_reflectance[0])
    others = [distance(ior, rho) for ior in np.linspace(1.1, 6, 25) for rho in (0.9, 1.0)]
    assert reached <= min(others) + 1e-5


def test_the_literal_convention_goes_by_name(rgb):
    plastic, misses = factors.to_roughplastic(UNREACHABLE, LITERAL)
    assert misses == []
    assert plastic.diffuse_reflectance == (0.5,) * 3
    assert plastic.int_ior == 1.5
    assert plastic.alpha == pytest.approx(sqrt(2 / 5))
    assert plastic.specular_reflectance == (1.0,) * 3
    back, _ = factors.to_phong(
        albedo.RoughPlastic((0.1, 0.2, 0.3), 0.2, 1.9, specular_reflectance=(0.5, 0.6, 0.7)),
        LITERAL,
    )
    assert back == Phong((0.1, 0.2, 0.3), (0.5, 0.6, 0.7), pytest.approx(48))


def test_a_literal_reflectance_above_1_is_limited_and_said_so(rgb):
    plastic, misses = factors.to_roughplastic(Phong((1.5, 0.5, 0.5), (0.1,) * 3, 9.0), LITERAL)
    assert plastic.diffuse_reflectance == (1.0, 0.5, 0.5)
    assert [(miss.wanted, miss.reached) for miss in misses] == [(1.5, 1.0)]


def test_the_record_of_a_pair_holds_its_misses(rgb):
    bsdf = {"type": "phong", "k_d": 0.5, "k_s": 0.7, "n": 3}
    assert pair_of(bsdf).misses
    assert not pair_of(bsdf, convention=LITERAL).misses


def test_a_material_that_reflects_more_than_it_receives_is_warned_of(rgb):
    (warning,) = pair_of({"type": "phong", "id": "bright", "k_d": 0.9, "k_s": 0.7, "n": 3}).warnings
    assert "bright" in warning
    assert "1.18" in warning  # 0.9 + 2 · 0.7 / 5
    assert not pair_of({"type": "phong", "k_d": 0.5, "k_s": 0.7, "n": 3}).warnings


# --- Lights ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("given", "derived"),
    [
        ({"type": "point", "position": (1, 2, 3), "intensity": 5.0}, "heuristic_point"),
        ({"type": "directional", "direction": (0, 0, -1), "irradiance": 5.0}, None),
    ],
    ids=["point", "directional"],
)
def test_the_factor_from_physical_to_heuristic_lights_is_1_over_pi(rgb, given, derived):
    pair = pair_of({"type": "diffuse", "reflectance": 0.5}, given)
    props = only(pair.heuristic, EMITTER)
    assert props.plugin_name() == (derived or "heuristic_directional")
    assert props["scale"] == pytest.approx(1 / pi)
    (record,) = pair.emitters
    assert record.factor == pytest.approx(1 / pi)
    assert record.exact
    if derived:
        assert [props[name] for name in ("k0", "k1", "k2")] == [0, 0, 1]
    assert only(pair.physical, EMITTER).plugin_name() == given["type"]


def test_the_factor_from_heuristic_to_physical_lights_is_pi(rgb):
    bsdf = {"type": "phong", "k_d": 0.5}
    inverse_square = {"type": "heuristic_point", "position": (1, 2, 3), "k0": 0.0, "k2": 1.0}
    (record,) = pair_of(bsdf, inverse_square | {"intensity": 2.0}).emitters
    assert record.exact
    assert record.factor == pytest.approx(pi)
    pair = pair_of(bsdf, {"type": "heuristic_directional", "intensity": 2.0, "scale": 0.5})
    assert tuple(only(pair.physical, EMITTER)["irradiance"]) == pytest.approx((pi,) * 3)


def test_light_without_attenuation_gets_the_same_mean_irradiance_over_what_is_seen(rgb):
    """On a diffuse sphere that is the mean of the picture; only the fall-off's shape differs."""
    pair = halves.pair(SCENES["fig-8-6b"].source(), resolution=(192, 192))
    heuristic = np.array(mi.render(pair.heuristic.instantiate(), spp=4, seed=0), float)
    direct = mi.load_dict({"type": "direct"})
    physical = np.array(
        mi.render(pair.physical.instantiate(), integrator=direct, spp=4, seed=0), float
    )
    assert physical.mean() == pytest.approx(heuristic.mean(), rel=2e-3)
    assert np.abs(physical - heuristic).max() > 0.02
    (record,) = pair.emitters
    assert not record.exact


def test_a_constant_environment_is_ambient_light_of_its_radiance(rgb):
    pair = pair_of({"type": "diffuse", "reflectance": 0.5}, {"type": "constant", "radiance": 0.3})
    (index,) = pair.heuristic.nodes(mi.ObjectType.Integrator)
    assert np.allclose(np.array(pair.heuristic.props(index)["ambient"]), 0.3)
    (record,) = pair.emitters
    assert (record.factor, record.exact) == (1.0, True)


def test_emission_of_a_phong_becomes_an_area_light_of_that_radiance(rgb):
    pair = pair_of({"type": "phong", "k_i": 0.4, "k_d": 0.5})
    props = only(pair.physical, EMITTER)
    assert props.plugin_name() == "area"
    assert props["radiance"] == pytest.approx(0.4)


# --- Materials -------------------------------------------------------------------------------


@pytest.mark.guarantee("pairing", "Diffuse surfaces pair exactly.")
def test_diffuse_pairs_exactly(rgb):
    reflectance = {"type": "rgb", "value": (0.1, 0.2, 0.3)}
    props = only(pair_of({"type": "diffuse", "reflectance": reflectance}).heuristic, BSDF)
    assert props.plugin_name() == "phong"
    assert tuple(props["k_d"]) == tuple(props["k_a"]) == pytest.approx((0.1, 0.2, 0.3))
    assert "k_s" not in props
    back = only(pair_of({"type": "phong", "k_d": reflectance}).physical, BSDF)
    assert back.plugin_name() == "diffuse"
    assert tuple(back["reflectance"]) == pytest.approx((0.1, 0.2, 0.3))


def test_a_shape_without_a_bsdf_gets_the_default_in_both_halves(rgb):
    description = scene({"type": "diffuse"})
    del description["shape"]["bsdf"]
    pair = halves.pair(Source("a test", description))
    assert only(pair.heuristic, BSDF)["k_d"] == pytest.approx(0.5)
    assert only(pair.physical, BSDF)["reflectance"] == pytest.approx(0.5)


def test_two_sided_surfaces_become_two_sided_phongs(rgb):
    pair = pair_of({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 0.5}})
    props = only(pair.heuristic, BSDF)
    assert props.plugin_name() == "phong"
    assert props["twosided"]
    pair.heuristic.instantiate()
    pair.physical.instantiate()


@pytest.mark.parametrize("k_s", [0.0, 0.3])
def test_two_sided_phongs_become_two_sided_surfaces(rgb, k_s):
    pair = pair_of({"type": "phong", "k_d": 0.5, "k_s": k_s, "n": 9, "twosided": True})
    plugins = sorted(pair.physical.plugin(index) for index in pair.physical.nodes(BSDF))
    assert plugins == sorted(["twosided", "roughplastic" if k_s else "diffuse"])
    pair.physical.instantiate()


# --- Refusals --------------------------------------------------------------------------------


def test_what_has_no_pair_is_named_with_what_is_lost(rgb):
    beam = {"type": "projector", "id": "beam", "irradiance": 1.0}
    pair = pair_of({"type": "conductor", "id": "mirror"}, beam)
    (mirror,) = pair.bsdfs
    assert (mirror.name, mirror.given, mirror.derived) == ("mirror", "conductor", "phong")
    assert "mirror image" in dict(mirror.lost)
    (light,) = (record for record in pair.emitters if record.name == "beam")
    assert light.given == "projector"
    assert light.lost


@pytest.mark.parametrize("name", ["k_a", "k_d", "k_s"])
@pytest.mark.parametrize("value", [-0.5, float("nan")])
def test_a_coefficient_that_is_no_reflectance_is_named(rgb, name, value):
    """Wherever it is noticed: when the pair is derived, or when its halves are made."""

    def make():
        pair = pair_of({"type": "phong", "id": "paint", name: value})
        pair.heuristic.instantiate()
        pair.physical.instantiate()

    with pytest.raises(InputError, match=rf"{name} = .*finite values of 0 or more"):
        make()


def test_a_scene_without_a_camera_is_refused(rgb):
    description = scene({"type": "diffuse"})
    del description["sensor"]
    with pytest.raises(InputError, match="no sensor"):
        halves.pair(Source("a test", description))


@pytest.mark.parametrize("occlusion", [False, True])
def test_the_heuristic_keeps_the_shadows_that_its_scene_asks_for(rgb, occlusion):
    phong = {"type": "phong", "k_d": 0.5}
    pair = pair_of(phong, integrator={"type": "heuristic", "occlusion": occlusion})
    assert pair.heuristic.instantiate().integrator().occlusion is occlusion
