"""The nearest phong of other materials, nearest lights, and straight-through transparency."""

from math import pi

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic.errors import InputError
from fotismos.reference import Convention, Source
from fotismos.reference.pairing import albedo, probe
from fotismos.reference.pairing.albedo import RoughPlastic
from fotismos.reference.pairing.bsdfs import Context
from fotismos.reference.pairing.nearest import rule_of
from fotismos.reference.pairing.probe import mean_radiance
from tests.shared.parts import camera, moved, rgb_of

BSDF, EMITTER = mi.ObjectType.BSDF, mi.ObjectType.Emitter
CHECKS = {"type": "checkerboard", "color0": rgb_of(0.9, 0.6, 0.3), "color1": rgb_of(0.1, 0.2, 0.4)}
GREY_CHECKS = {"type": "checkerboard", "color0": 0.2, "color1": 1.5}
"""Weights, of which one is clipped to 1."""

SUN = {"type": "directional", "direction": [0.4, 0.2, -1.0], "irradiance": 2.0}


def scene(shapes, light=SUN, integrator="direct"):
    """Shapes seen from above, of which nothing shadows another."""
    return {
        "type": "scene",
        "integrator": {"type": integrator},
        "sensor": camera((0.5, -1, 4), size=(24, 16), fov=30.0),
        "light": light,
    } | shapes


def images(description, spp=4):
    """Render both halves of a pair with the same camera rays."""
    ready = prepare(Source("a test", description), Options(spp=spp))
    return [np.array(half.render(0)) for half in (ready.heuristic, ready.reference)]


def ball(bsdf):
    """Return the graph of a sphere, and the node of its BSDF."""
    graph = Source("a test", {"type": "scene", "shape": {"type": "sphere", "bsdf": bsdf}}).parse()
    ((_, index),) = graph.children(1, BSDF)
    return graph, index


def material(bsdf, convention=Convention.MATCHED):
    graph, index = ball(bsdf)
    return Context(graph, convention, rule_of).nearest(index)


def raw(values):
    return {"type": "bitmap", "raw": True, "bitmap": mi.Bitmap(np.asarray(values, np.float32))}


def waves(size=32):
    x, y = np.meshgrid(*[2 * pi * (np.arange(size) + 0.5) / size] * 2)
    return np.sin(x), np.cos(y)


def normal_map():
    x, y = (0.4 * wave for wave in waves())
    return raw((np.stack([x, y, np.sqrt(1 - x**2 - y**2)], axis=2) + 1) / 2)


DIFFUSE = {"type": "diffuse", "reflectance": CHECKS}
OTHER = {"type": "diffuse", "reflectance": rgb_of(0.2, 0.3, 0.8)}
EXACT = {
    "texture": DIFFUSE,
    "blend": {"type": "blendbsdf", "weight": GREY_CHECKS, "a": OTHER, "b": DIFFUSE},
    "front": {"type": "twosided", "a": DIFFUSE, "b": OTHER},
    "blend with a back": {
        "type": "blendbsdf",
        "weight": 0.25,
        "a": DIFFUSE,
        "b": {"type": "twosided", "nested": OTHER},
    },
    "normal map": {
        "type": "normalmap",
        "normalmap": normal_map,
        "use_shadowing_function": False,
        "nested": DIFFUSE,
    },
    "bump map": {
        "type": "bumpmap",
        "heights": lambda: raw((0.5 + 0.1 * waves()[0] * waves()[1])[..., None]),
        "scale": 2.0,
        "use_shadowing_function": False,
        "nested": DIFFUSE,
    },
}


@pytest.mark.parametrize("name", EXACT)
def test_diffuse_surfaces_inside_other_bsdfs_stay_exact_pairs(name, rgb):
    """Seen from the front and from the back, side by side."""
    bsdf = {key: value() if callable(value) else value for key, value in EXACT[name].items()}
    plates = {
        f"plate {turn}": {
            "type": "rectangle",
            "to_world": moved([x, 0, 0]).rotate([0, 1, 0], turn),
            "b": bsdf,
        }
        for x, turn in ((-1, 0), (1, 180))
    }
    heuristic, reference = images(scene(plates))
    assert reference.max() > 0.1
    np.testing.assert_allclose(heuristic, reference, atol=2e-5)


def test_two_sides_may_differ_in_a_lobe_higher_than_one(rgb):
    """The lobe's coefficient is a colour above 1, which is no reflectance to Mitsuba."""
    gold = {"type": "roughconductor", "material": "Au", "alpha": 0.1}
    sides = {"type": "twosided", "front": DIFFUSE, "back": gold}
    found = images(scene({"plate": {"type": "rectangle", "bsdf": sides}}))
    assert all(np.isfinite(image).all() and image.max() > 0 for image in found)


@pytest.mark.parametrize("name", ["rgb", "spectral"])
def test_layers_of_opacity_let_through_the_product_of_their_transmittances(name, request):
    request.getfixturevalue(name)
    opacities = (0.5, 0.3, 0.8)
    black = {"type": "diffuse", "reflectance": 0.0}
    layers = {
        f"layer {number}": {
            "type": "rectangle",
            "to_world": moved((0, 0, number), 9),
            "b": {"type": "mask", "opacity": opacity, "nested": black},
        }
        for number, opacity in enumerate(opacities)
    }
    sky = {"type": "constant", "radiance": 2.0}
    through, _ = images(scene(layers, sky))
    sky_alone, _ = images(scene({"far": {"type": "sphere", "center": [0, 0, -99]}}, sky))
    expected = sky_alone * np.prod([1 - opacity for opacity in opacities])
    np.testing.assert_allclose(through, expected, rtol=2e-5)


def test_metal_and_glass_reflect_at_normal_incidence_what_fresnel_says(rgb):
    """And glass lets through what it does not reflect."""
    found = material({"type": "conductor", "eta": 1.5, "k": 2.5})
    expected = ((1.5 - 1) ** 2 + 2.5**2) / ((1.5 + 1) ** 2 + 2.5**2)
    assert found.k_s * 2 / (found.n + 2) == pytest.approx(expected, rel=1e-5)
    assert found.k_a == pytest.approx(expected, rel=1e-5)
    assert found.k_d == 0
    found = material({"type": "dielectric", "int_ior": 1.5, "ext_ior": 1.0})
    assert found.k_s * 2 / (found.n + 2) == pytest.approx(0.04, abs=2e-4)
    assert found.transmittance == pytest.approx(0.96, abs=2e-4)


def test_a_tint_has_the_colour_that_rays_see_in_it(spectral):
    """Mitsuba divides tints by the luminance of the four wavelengths of a ray."""
    tinted = {"type": "principled", "base_color": rgb_of(0.1, 0.5, 0.8), "spec_tint": 1.0}
    plate = {"s": {"type": "rectangle", "b": tinted | {"specular": 0.8}}}
    under_a_sky = scene(plate, {"type": "constant", "radiance": 1.0})
    shown, expected = (image.mean((0, 1)) for image in images(under_a_sky, spp=64))
    np.testing.assert_allclose(shown, expected, rtol=0.03)


@pytest.mark.parametrize("nonlinear", [False, True])
def test_a_textured_plastic_is_at_each_point_what_its_colour_alone_is(rgb, nonlinear):
    """White light on two reflectances: each texel shows the value of one plain material."""
    bsdf = {"type": "roughplastic", "alpha": 0.2, "nonlinear": nonlinear}
    levels = (0.9, 0.3)
    checks = {"type": "checkerboard", "color0": levels[0], "color1": levels[1]}
    textured, *plain = (
        images(scene({"s": {"type": "rectangle", "b": bsdf | {"diffuse_reflectance": given}}}))[0]
        for given in (checks, *levels)
    )
    assert (textured <= plain[0] + 2e-5).all()
    assert (textured >= plain[1] - 2e-5).all()
    for image, other in (plain, plain[::-1]):
        assert (np.abs(textured - image).max(axis=2) < 2e-5).sum() > 20
        assert np.abs(image - other).max() > 0.1


PHONG = {"type": "phong", "k_d": 0.2, "k_s": 0.5, "n": 12.0}
TEXTURED_LOBE = {"type": "roughconductor", "alpha": {"type": "checkerboard", "color0": 0.15,
                                                     "color1": 0.4}}  # fmt: skip


def test_a_blend_of_lobes_of_two_scales_is_at_its_ends_each_of_them(rgb):
    """A textured roughness makes a normalised lobe; the other one's is not."""
    for weight, alone in ((0.0, PHONG), (1.0, TEXTURED_LOBE)):
        blend = {"type": "blendbsdf", "weight": weight, "a": PHONG, "b": TEXTURED_LOBE}
        shown, expected = (
            images(scene({"s": {"type": "rectangle", "b": each}}))[0] for each in (blend, alone)
        )
        assert expected.max() > 0.1
        np.testing.assert_allclose(shown, expected, atol=1e-5)


def wrap(name, given, **instead):
    """Register a plugin of a user's own around a BSDF, with methods ``instead`` of its own."""

    class Own(mi.BSDF):
        def __init__(self, props):
            super().__init__(props)
            self.inner = mi.load_dict(given)
            self.m_components = [self.inner.flags(i) for i in range(2)]
            self.m_flags = self.inner.flags()

        def sample(self, ctx, si, sample1, sample2, active=True):
            return instead.get("sample", self.inner.sample)(ctx, si, sample1, sample2, active)

        def eval(self, ctx, si, wo, active=True):
            return instead.get("eval", self.inner.eval)(ctx, si, wo, active)

        def eval_pdf(self, ctx, si, wo, active=True):
            return self.inner.eval_pdf(ctx, si, wo, active)

        def pdf(self, ctx, si, wo, active=True):
            return self.inner.pdf(ctx, si, wo, active)

    mi.register_bsdf(name, Own)


def partner(bsdf):
    graph, index = ball(bsdf)
    return Context(graph, Convention.MATCHED, rule_of, for_users=True).nearest(index).physical


def test_an_unknown_material_is_measured_for_what_it_is(rgb):
    """A plugin of a user's own around ``roughplastic``, for which there is a rule to compare.

    A user's heuristic has its roughness, index, and the albedo of the diffuse part.
    """
    given = {"type": "roughplastic", "alpha": 0.2, "diffuse_reflectance": 0.6}
    given |= {"int_ior": 1.6, "ext_ior": 1.0}
    wrap("own", given)
    known, found, read = material(given), material({"type": "own"}), partner({"type": "own"})
    assert found.k_d == pytest.approx(known.k_d[0], rel=0.1)
    assert found.n == pytest.approx(known.n, rel=0.3)
    whole = [np.max(m.k_s) * 2 / (m.n + 2) + np.max(m.k_d) for m in (known, found)]
    assert whole[1] == pytest.approx(whole[0], rel=0.02)
    assert (read["alpha"], read["ior"]) == (
        pytest.approx(0.2, rel=0.2),
        pytest.approx(1.6, rel=0.1),
    )
    diffuse = albedo.of_roughplastic(RoughPlastic((0.6,) * 3, 0.2, 1.6, 1.0)).diffuse[0]
    assert read["base_color"] == pytest.approx(diffuse, rel=0.1)
    assert read["metallic"] == 0


def fails(ctx, si, *others):
    raise RuntimeError("it has no sampling")


def test_what_cannot_be_sampled_is_grey_and_said_to_be_so_or_refused_by_name(rgb, monkeypatch):
    """The first if it is unknown, the second if there is a rule for it."""
    nowhere = {"eval": lambda ctx, si, *others: mi.Spectrum(dr.nan)}
    for name, instead in (("unsampled", {"sample": fails}), ("uneven", nowhere)):
        wrap(name, {"type": "diffuse"}, **instead)
        found = material({"type": name})
        assert (found.k_a, found.k_d, found.k_s) == (0.5, 0.5, 0)
        ((_, rule),) = found.lost
        assert "it cannot be sampled" in rule
        assert partner({"type": name})["base_color"] == 0.5
    monkeypatch.setattr(probe, "probe", lambda bsdf: None)
    for plugin in ("conductor", "dielectric", "principled"):
        with pytest.raises(InputError, match=r"odd: its albedo is not a number, or .* sample"):
            material({"type": plugin, "id": "odd"})


def test_hair_without_absorption_is_white_and_with_much_of_it_dark(rgb):
    """All light leaves a fibre that absorbs none; it counts as diffuse, whatever its side."""
    clear, dark = (material({"type": "hair", "sigma_a": sigma}) for sigma in (0.0, 50.0))
    assert clear.k_d == pytest.approx(1, abs=0.02)
    assert np.max(dark.k_d) < 0.2
    for found in (clear, dark):
        assert found.k_a == found.k_d
        assert (found.k_s, found.transmittance, found.twosided) == (0, 0, True)


def lone(emitter):
    graph = Source("a test", {"type": "scene", "e": emitter}).parse()
    (index,) = graph.nodes(EMITTER)
    return graph, graph.instantiate(index)


def test_ambient_light_is_the_mean_of_the_map_over_the_sphere(rgb):
    """``L = cos^2`` of the angle to the axis has the mean 1/3."""
    rows = 256
    theta = np.linspace(0, pi, rows)  # Mitsuba's first row is the pole itself
    radiance = np.repeat(np.cos(theta)[:, None, None] ** 2, 2 * rows, axis=1) * [3.0, 6.0, 9.0]
    bitmap = mi.Bitmap(radiance.astype(np.float32))
    graph, emitter = lone({"type": "envmap", "bitmap": bitmap, "scale": 1.0})
    np.testing.assert_allclose(mean_radiance(graph, emitter), [1, 2, 3], rtol=2e-3)


def test_two_sides_share_one_form_of_the_lobe_and_one_normal_map():
    chalk = {"type": "diffuse"}
    phong, blinn = (
        {"type": "phong", "k_s": 0.4, "n": 9, "form": form} for form in ("phong", "blinn")
    )
    rough = {"type": "bumpmap", "nested": chalk, "texture": raw(waves()[0][..., None])}
    for front, back, form, losses in (
        (chalk, blinn, "blinn", 0),
        (blinn, chalk, "blinn", 0),
        (phong, blinn, "phong", 1),
        (chalk, rough, "phong", 1),  # the bumps have losses of their own
        (rough, chalk, "phong", 1),
    ):
        found = material({"type": "twosided", "front": front, "back": back})
        assert (found.form, len(found.lost)) == (form, losses), (front, back)
