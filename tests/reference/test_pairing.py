"""The pairing of heuristic and physical values: factors, conventions, misses, refusals."""

from math import pi, sqrt

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy.integrate import quad

from fotismos.heuristic.errors import InputError
from fotismos.reference import Convention, Source
from fotismos.reference.pairing import albedo, factors, halves
from fotismos.reference.pairing.albedo import RoughPlastic
from fotismos.reference.pairing.factors import Phong
from tests.shared.parts import camera, rgb_of

MATCHED, LITERAL = Convention.MATCHED, Convention.LITERAL
BSDF, EMITTER = mi.ObjectType.BSDF, mi.ObjectType.Emitter

REACHABLE = (
    Phong((0.5, 0.4, 0.3), (0.4,) * 3, 20.0),
    Phong((0.05, 0.1, 0.2), (2.0,) * 3, 100.0),
    Phong((0.3,) * 3, (0.1,) * 3, 5.0),
    Phong((0.2, 0.3, 0.4), (0.5, 0.25, 0.125), 30.0),
)
# The brightest material of the figures: no dielectric reflects 0.28 and lets 0.5 back out.
UNREACHABLE = Phong((0.5,) * 3, (0.7,) * 3, 3.0)


def scene(bsdf, *lights, integrator=None):
    description = {
        "type": "scene",
        "integrator": integrator or {"type": "path"},
        "sensor": camera((-3, 0, 1), size=8),
        "shape": {"type": "sphere", "bsdf": bsdf},
    }
    return description | {f"light {number}": light for number, light in enumerate(lights)}


def pair_of(*arguments, convention=MATCHED, **keywords):
    return halves.pair(
        Source("a test", scene(*arguments, **keywords)), halves.PairOptions(convention)
    )


def only(graph, kind):
    (index,) = graph.nodes(kind)
    return graph.props(index)


THETA = (np.arange(20_000) + 0.5) / 20_000
THETA, STEP = pi / 2 * THETA**3, pi / 2 * 3 * THETA**2 / 20_000  # finer towards the normal


def leaving(plastic, component):
    """Return ``f cos`` (C, angles) at THETA of a part of roughplastic, lit from the normal."""
    values = dict(vars(plastic))
    for name in ("diffuse_reflectance", "specular_reflectance"):
        grey, *others = values[name]
        values[name] = rgb_of(grey, *others) if set(others) - {grey} else grey
    bsdf = mi.load_dict({"type": "roughplastic", **values})
    si = dr.zeros(mi.SurfaceInteraction3f, len(THETA))
    si.wi = mi.Vector3f(0, 0, 1)
    si.wavelengths = mi.Color0f() if mi.is_rgb else 550.0  # any will do: spectra are uniform
    context = mi.BSDFContext()
    context.type_mask = +getattr(mi.BSDFFlags, component)
    wo = mi.Vector3f(mi.Float(np.sin(THETA)), 0, mi.Float(np.cos(THETA)))
    return np.array(bsdf.eval(context, si, wo), float)


def albedos(plastic):
    """Return both albedos (2, C) of the plugin, by midpoints: no nodes are the package's."""
    parts = (leaving(plastic, name) for name in ("DiffuseReflection", "GlossyReflection"))
    return np.array([2 * pi * part @ (np.sin(THETA) * STEP) for part in parts])


def drawn(seed, number):
    """Draw plastics: common ones, smooth and rough ones, faint and strong ones, and bubbles."""
    rng = np.random.default_rng(seed)
    for _ in range(number):
        alpha, ratio = [
            (10 ** rng.uniform(-2, 0.2), rng.uniform(1.02, 3)),
            (10 ** rng.uniform(-4, 3), rng.uniform(1.02, 3)),
            (10 ** rng.uniform(-2, 0.2), 1 + 10 ** rng.uniform(-4, -1)),
            (10 ** rng.uniform(-2, 0.2), rng.uniform(3, 40)),
            (10 ** rng.uniform(-0.5, 0.2), rng.uniform(0.4, 0.98)),
        ][rng.integers(5)]
        ext_ior = rng.uniform(1, 1.5)
        yield RoughPlastic(
            (float(rng.uniform(0, 1)),) * 3,
            float(alpha),
            float(ratio * ext_ior),
            float(ext_ior),
            (float(rng.uniform(0, 1)),) * 3,
            str(rng.choice(["beckmann", "ggx"])),
            bool(rng.integers(2)),
        )


@pytest.mark.parametrize(
    ("variant", "number"),
    [
        ("llvm_ad_rgb", 12),
        pytest.param("llvm_ad_rgb", 32, marks=pytest.mark.thorough),
        pytest.param("llvm_ad_spectral", 4, marks=pytest.mark.thorough),
    ],
    indirect=["variant"],
)
def test_the_albedos_of_a_roughplastic_are_what_its_plugin_reflects(variant, number):
    """The plugin's own sums, in single precision, are off by up to 1e-5.

    Total reflection gives bubbles a kink, which the package's nodes meet to a percent.
    """
    for plastic in drawn(number, number):
        found, by_plugin = albedo.of_roughplastic(plastic), albedos(plastic)
        rtol = 2e-5 if plastic.int_ior > plastic.ext_ior else 1e-2
        np.testing.assert_allclose(found.diffuse[0], by_plugin[0], rtol=rtol, atol=1e-5)
        np.testing.assert_allclose(found.specular[0], by_plugin[1], rtol=rtol, atol=2e-7)


@pytest.mark.guarantee("pairing", "A matched `roughplastic` has the albedos of its Phong material.")
def test_a_matched_roughplastic_has_the_albedos_that_it_was_matched_to(rgb):
    """``k_d`` and ``2 k_s / (n + 2)``, by an independent quadrature of the plugin."""
    for phong in REACHABLE:
        plastic, misses = albedo.to_roughplastic(phong, MATCHED)
        assert not misses
        expected = phong.k_d, 2 * np.array(phong.k_s) / (phong.n + 2)
        np.testing.assert_allclose(albedos(plastic), expected, rtol=2e-5, atol=1e-5)


def test_the_albedo_of_the_lobe():
    """``2 pi`` times the integral of ``(k_s / pi) cos^n``, leaving through the cosine.

    The power is of the angle to the mirror direction, or, for Blinn's form, of half of it.
    """

    def lobe(angle, n, part):
        return np.cos(angle / part) ** n * np.cos(angle) * np.sin(angle)

    for form, part in (("phong", 1), ("blinn", 2)):
        for n in (0, 1, 3, 9, 100):
            integral, _ = quad(lobe, 0, pi / 2, args=(n, part))
            expected = 2 * pi * (0.7 / pi) * integral
            plain = Phong((0.5,) * 3, (0.7,) * 3, n, form=form)
            np.testing.assert_allclose(factors.specular_albedo(plain), expected, rtol=1e-9)
            normalised = Phong((0.5,) * 3, (0.7,) * 3, n, form=form, normalised=True)
            np.testing.assert_allclose(factors.specular_albedo(normalised), 0.7, rtol=1e-9)


def half_width(plastic):
    """Return the angle at which a roughplastic's lobe has fallen to a half, in degrees."""
    radiance = leaving(plastic, "GlossyReflection")[0] / np.cos(THETA)
    below = np.flatnonzero(radiance < radiance[0] / 2)
    return np.degrees(THETA[below[0]]) if len(below) else np.inf


def test_a_matched_highlight_is_wider_by_what_the_documents_say(rgb):
    """In percent at half the height; Blinn's is as wide."""
    wider = {3: 35, 5: 18, 9: 9, 15: 5, 30: 2.6, 100: 0.8, 400: 0.3}
    for n, percent in wider.items():
        plastic, _ = albedo.to_roughplastic(Phong((0.1,) * 3, (0.2,) * 3, n), MATCHED)
        own = np.degrees(np.arccos(0.5 ** (1 / n)))
        assert 100 * (half_width(plastic) / own - 1) == pytest.approx(percent, abs=0.6, rel=0.02)
    phong = Phong((0.1,) * 3, (2.0,) * 3, 400, form="blinn")
    own = 2 * np.degrees(np.arccos(0.5 ** (1 / 400)))
    assert half_width(albedo.to_roughplastic(phong, MATCHED)[0]) == pytest.approx(own, rel=0.02)


def test_what_no_plastic_reaches_is_missed_and_said_so(rgb):
    """And what it reaches instead is what the record says, by the independent quadrature."""
    plastic, misses = albedo.to_roughplastic(UNREACHABLE, MATCHED)
    assert misses
    wanted = {"diffuse": 0.5, "specular": 0.28}
    reached = dict(zip(wanted, albedos(plastic)[:, 0], strict=True))
    for miss in misses:
        part = miss.what.split()[0]
        assert (miss.wanted, miss.reached) == pytest.approx((wanted[part], reached[part]), abs=1e-4)
        assert miss.reached < miss.wanted - 0.01


def test_the_nearest_plastic_is_taken_where_none_reaches(rgb):
    """No index of refraction and reflectance come nearer, in the sum of squares of both parts."""
    plastic, _ = albedo.to_roughplastic(UNREACHABLE, MATCHED)
    wanted = np.array([0.5, 0.28])

    def distance(int_ior, rho):
        found = albedo.of_roughplastic(RoughPlastic((rho,) * 3, plastic.alpha, int_ior))
        return np.sum((np.array([found.diffuse[0], found.specular[0]]) - wanted) ** 2)

    reached = distance(plastic.int_ior, plastic.diffuse_reflectance[0])
    others = [distance(ior, rho) for ior in np.linspace(1.1, 6, 25) for rho in (0.9, 1.0)]
    assert reached <= min(others) + 1e-5


def test_the_literal_convention_goes_by_name(rgb):
    """And limits a reflectance to 1, which it says."""
    plastic, misses = albedo.to_roughplastic(UNREACHABLE, LITERAL)
    assert not misses
    assert plastic == RoughPlastic((0.5,) * 3, pytest.approx(sqrt(2 / 5)), 1.5)
    back = albedo.to_phong(
        RoughPlastic((0.1, 0.2, 0.3), 0.2, 1.9, specular_reflectance=(0.5, 0.6, 0.7)), LITERAL
    )
    assert back == Phong((0.1, 0.2, 0.3), (0.5, 0.6, 0.7), pytest.approx(48))
    plastic, misses = albedo.to_roughplastic(Phong((1.5, 0.5, 0.5), (0.1,) * 3, 9.0), LITERAL)
    assert plastic.diffuse_reflectance == (1.0, 0.5, 0.5)
    assert [(miss.wanted, miss.reached) for miss in misses] == [(1.5, 1.0)]


def test_a_pair_holds_its_misses_and_warns_of_what_reflects_more_than_it_receives(rgb):
    bsdf = {"type": "phong", "id": "bright", "k_d": 0.5, "k_s": 0.7, "n": 3}
    pair = pair_of(bsdf)
    assert pair.pairing.misses
    assert not pair.warnings
    assert not pair_of(bsdf, convention=LITERAL).pairing.misses
    (warning,) = pair_of(bsdf | {"k_d": 0.9}).warnings
    assert "bright" in warning
    assert "1.18" in warning  # 0.9 + 2 · 0.7 / 5


def test_the_factor_from_heuristic_to_physical_lights_is_pi(rgb):
    bsdf = {"type": "phong", "k_d": 0.5}
    inverse_square = {"type": "heuristic_point", "position": (1, 2, 3), "k0": 0.0, "k2": 1.0}
    (record,) = pair_of(bsdf, inverse_square | {"intensity": 2.0}).pairing.emitters
    assert record.exact
    assert record.factor == pytest.approx(pi)
    pair = pair_of(bsdf, {"type": "heuristic_directional", "intensity": 2.0, "scale": 0.5})
    assert tuple(only(pair.physical, EMITTER)["irradiance"]) == pytest.approx((pi,) * 3)


def test_a_clamped_inverse_square_is_not_exact_below_its_clamp(rgb):
    """Mitsuba's point light has no limit: near the lamp its fall-off is another."""
    near = {"type": "heuristic_point", "position": (0, 0, 1.4), "k0": 0.0, "k2": 1.0}
    (record,) = pair_of({"type": "phong", "k_d": 0.5}, near | {"clamped": True}).pairing.emitters
    assert not record.exact
    assert "fall-off" in record.note
    assert record.factor < 0.9 * pi
    (record,) = pair_of({"type": "phong", "k_d": 0.5}, near | {"clamped": False}).pairing.emitters
    assert record.exact


TWO_INTENSITIES = """<scene version="3.0.0"><sensor type="perspective"/>
<shape type="sphere"><bsdf type="phong"><float name="k_d" value="0.5"/>
<float name="k_s" value="0.4"/></bsdf></shape>
<emitter type="heuristic_{}" id="lamp"><float name="k2" value="1"/><float name="k0" value="0"/>
<rgb name="diffuse_intensity" value="0.9, 0.6, 0.3"/><float name="scale" value="2"/>
<rgb name="specular_intensity" value="{}"/></emitter></scene>"""


def test_a_light_of_two_intensities_is_paired_by_the_diffuse_one(rgb, tmp_path):
    path = tmp_path / "two.xml"
    for kind, parameter in (
        ("point", "intensity"), ("spot", "intensity"), ("directional", "irradiance"),
    ):  # fmt: skip
        for specular, is_lost in (("0.9, 0.6, 0.4", True), ("0.9, 0.6, 0.3", False)):
            text = TWO_INTENSITIES.format(kind, specular)
            if kind == "directional":
                text = text.replace('<float name="k2" value="1"/><float name="k0" value="0"/>', "")
            path.write_text(text)
            pair = halves.pair(Source("two", path))
            (record,) = pair.pairing.emitters
            given = np.array(only(pair.physical, EMITTER)[parameter])
            np.testing.assert_allclose(given, 2 * record.factor * np.array((0.9, 0.6, 0.3)), 1e-6)
            lost = [(loss.name, loss.plugin, loss.lost) for loss in pair.unrepresentable]
            expected = ("lamp", f"heuristic_{kind}", "specular intensity L_s")
            assert lost == [expected] * is_lost
    path.write_text(text.replace("0.9, 0.6, 0.3", "0.9, -0.6, 0.3"))
    with pytest.raises(InputError, match=r"lamp: diffuse_intensity = .* is not allowed"):
        halves.pair(Source("two", path))


def test_what_glows_is_seen_in_both_halves_although_ambient_light_fills_the_room(rgb):
    """Mitsuba hides both emitters or none, so the background is seen, too."""
    ball = {"type": "sphere", "bsdf": {"type": "phong", "k_i": 0.8, "k_a": 0.1, "k_d": 0.5}}
    described = {
        "type": "scene",
        "integrator": {"type": "heuristic", "ambient": 1.0},
        "sensor": camera((0, -4, 0), size=9),
        "ball": ball,
    }
    for k_i in (0.8, 0.0, None):
        is_glowing = k_i == 0.8
        ball["bsdf"]["k_i"] = k_i
        if k_i is None:
            del ball["bsdf"]["k_i"]
        found = halves.pair(Source("a test", described))
        assert found.hide_emitters is not is_glowing
        expected = 0.1 + 0.8 * is_glowing
        shown = np.array(mi.render(found.heuristic.instantiate(), spp=1))[4, 4]
        assert shown == pytest.approx(expected, abs=1e-5)
        path = {"type": "path", "hide_emitters": found.hide_emitters}
        physical = found.physical.instantiate()
        seen = np.array(mi.render(physical, integrator=mi.load_dict(path), spp=4096))[4, 4]
        assert seen == pytest.approx(expected, rel=0.02)


def test_environments_are_ambient_light_and_emission_shines_at_their_radiance(rgb):
    pair = pair_of({"type": "diffuse", "reflectance": 0.5}, {"type": "constant", "radiance": 0.3})
    (index,) = pair.heuristic.nodes(mi.ObjectType.Integrator)
    assert np.allclose(np.array(pair.heuristic.props(index)["ambient"]), 0.3)
    (record,) = pair.pairing.emitters
    assert (record.factor, record.exact) == (1.0, True)
    props = only(pair_of({"type": "phong", "k_i": 0.4, "k_d": 0.5}).physical, EMITTER)
    assert props.plugin_name() == "area"
    assert props["radiance"] == pytest.approx(0.4)


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


def test_two_sided_surfaces_stay_so_both_ways(rgb):
    pair = pair_of({"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": 0.5}})
    assert only(pair.heuristic, BSDF)["twosided"]
    for half in (pair.heuristic, pair.physical):
        half.instantiate()
    for k_s, plugin in ((0.0, "diffuse"), (0.3, "roughplastic")):
        pair = pair_of({"type": "phong", "k_d": 0.5, "k_s": k_s, "n": 9, "twosided": True})
        plugins = {pair.physical.plugin(index) for index in pair.physical.nodes(BSDF)}
        assert plugins == {"twosided", plugin}
        pair.physical.instantiate()


def test_what_has_no_pair_is_named_with_what_is_lost(rgb):
    beam = {"type": "projector", "id": "beam", "irradiance": 1.0}
    pair = pair_of({"type": "conductor", "id": "mirror"}, beam)
    (mirror,) = pair.pairing.bsdfs
    assert (mirror.name, mirror.given, mirror.derived) == ("mirror", "conductor", "phong")
    (light,) = (record for record in pair.pairing.emitters if record.name == "beam")
    assert light.given == "projector"
    lost = {(loss.name, loss.lost) for loss in pair.unrepresentable}
    assert {("mirror", "mirror image"), ("beam", "this kind of light")} <= lost


SHADOWS = "shadows that bumps cast on themselves"


def bitmap():
    pixels = np.full((2, 2, 3), (0.6, 0.5, 0.9), np.float32)
    return {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(pixels)}


def mapped(name, plugin="normalmap", inner="diffuse", shadows=True):
    """A map of bumps around a BSDF, which may be given as the name of its plugin."""
    inner = {"type": inner} if isinstance(inner, str) else inner
    own = {"type": plugin, "id": name, "use_shadowing_function": shadows}
    return own | {"normalmap" if plugin == "normalmap" else "heights": bitmap(), "inner": inner}


def of_two(plugin, first, second="diffuse", **more):
    parts = [{"type": part} if isinstance(part, str) else part for part in (first, second)]
    return {"type": plugin, "id": "two", "first": parts[0], "second": parts[1], **more}


ROUGH = {"type": "roughplastic", "alpha": 0.3}
LOST = {
    "normal map": (mapped("map"), {("map", SHADOWS)}),
    "bump map": (mapped("map", "bumpmap"), {("map", SHADOWS)}),
    "without shadows": (mapped("map", shadows=False), set()),
    "twosided": ({"type": "twosided", "inner": mapped("map")}, {("map", SHADOWS)}),
    "mask": ({"type": "mask", "inner": mapped("map", inner=ROUGH)}, {("map", SHADOWS)}),
    "maps in maps": (
        mapped("outer", inner=mapped("inner", "bumpmap"), shadows=False),
        {("outer", "nested normal maps"), ("inner", SHADOWS)},
    ),
    "two lobes": (of_two("blendbsdf", ROUGH, ROUGH, weight=0.5), {("two", "two lobes")}),
    "two normals": (
        of_two("blendbsdf", "diffuse", mapped("map", shadows=False), weight=0.5),
        {("two", "two normals at a point")},
    ),
    "front and back": (
        of_two("twosided", mapped("map", "bumpmap")),
        {("two", "the normals of the back"), ("map", SHADOWS)},
    ),
}


@pytest.mark.parametrize("name", LOST)
def test_what_each_wrapper_loses_is_recorded_under_its_own_label(name, rgb):
    bsdf, expected = LOST[name]
    found = [(loss.name, loss.lost) for loss in pair_of(bsdf).unrepresentable]
    assert len(found) == len(set(found))
    assert set(found) == expected


def test_a_coefficient_that_is_no_reflectance_and_a_missing_camera_are_named(rgb):
    """Wherever it is noticed: when the pair is derived, or when its halves are made."""
    for name in ("k_a", "k_d", "k_s"):
        for value in (-0.5, float("nan")):
            with pytest.raises(InputError, match=rf"{name} = .*finite values of 0 or more"):
                pair_of({"type": "phong", "id": "paint", name: value}).heuristic.instantiate()
    description = scene({"type": "diffuse"})
    del description["sensor"]
    with pytest.raises(InputError, match="no sensor"):
        halves.pair(Source("a test", description))
