"""Audits, against closed forms, and of ways to shade that are wrong in one respect each."""

import json
from functools import cache
from pathlib import Path

import drjit as dr
import jsonschema
import mitsuba as mi
import numpy as np
import pytest
from msgspec import structs

from fotismos.comparisons.audit import checks, samples
from fotismos.comparisons.audit.subjects import (
    DISTANCES,
    EXTREMES,
    ScatteringSubject,
    ShadingSubject,
)
from fotismos.heuristic import Range, heuristics
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import HEURISTICS
from fotismos.heuristic.user_shaders import of_function
from fotismos.reference.pairing import albedo, factors
from fotismos.reports import sentences
from fotismos.reports.run import audit_files
from tests.shared.opengl import opengl
from tests.shared.quadrature import dot, integral
from tests.shared.schemas import schema

DOCS = Path(__file__).parents[2] / "docs/shaders"
FUNCTIONS = ("filament", "bevy", "gltf", "layered")
SHADERS = [str(path) for path in sorted(DOCS.glob("*.py")) if path.stem != "standard_material"]
SHADERS += [f"{DOCS / 'standard_material.py'}:{name}" for name in FUNCTIONS]


def lambert(point):
    value = mi.Spectrum(0)
    for light in point.lights:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        value += point.material.base_color * light.intensity * cosine
    return value


def small(subject, grid=(120, 90)):
    subject.grid = grid
    return subject


def named(name, grid=(120, 90)):
    return small(ShadingSubject(heuristics.named(name), {}), grid)


def shaded(function):
    return small(ShadingSubject(of_function(function, "mine"), {}))


def checked(subject):
    """Make all checks; return them by name, and the curves by material."""
    record = checks.examined(subject)
    found = {each.name: each for each in record.checks}
    return found, {each.material: each for each in record.curves}


def check(name, subject):
    """Make one check, of the subject alone."""
    (declared,) = [each for each in checks.CHECKS if each.name == name]
    return declared.of(subject, None)


def failing(found):
    return {name for name, each in found.items() if each.verdict == "does not hold"}


# --- Closed forms --------------------------------------------------------------------------------


def test_lamberts_albedo_is_one_at_every_angle(rgb):
    found, curves = checked(shaded(lambert))
    for curve in curves.values():
        np.testing.assert_allclose([curve.seen, curve.returned], 1, atol=1e-3)
    assert failing(found) == set()
    found, curves = checked(small(ScatteringSubject("diffuse", {"reflectance": 0.5})))
    np.testing.assert_allclose([curves["diffuse"].seen, curves["diffuse"].returned], 0.5, rtol=1e-3)
    assert failing(found) == {"white furnace"}


def test_wrapped_light_has_its_closed_form(rgb):
    """``s = max(c + w, 0) / (1 + w)``: seen is its mean over the sphere, which is ``1 + w``."""
    wrap = 0.5
    wrapped = of_each_light(
        lambda point, light: dr.maximum(cosine(point, light) + wrap, 0) / (1 + wrap)
    )
    found, curves = checked(shaded(wrapped))
    curve = curves["matte"]
    np.testing.assert_allclose(curve.seen, 1 + wrap, rtol=2e-3)
    of_light = np.cos(np.deg2rad(checks.ANGLES))
    expected = (of_light + wrap) / ((1 + wrap) * of_light)
    np.testing.assert_allclose(curve.returned, expected, rtol=2e-3)
    below = found["light from below"].value
    assert below == pytest.approx((wrap - np.sin(np.deg2rad(1))) / (1 + wrap), rel=1e-4)
    assert failing(found) == {"white furnace", "energy", "reciprocity", "light from below"}


def lobe(form, n, degrees):
    """The light returned of a lobe as a textbook prints it, by the quadrature of engines."""

    def reflected(light, view, half):
        mirrored = np.stack([-light[0], -light[1], light[2]])
        cosine = dot(mirrored, view) if form == "phong" else half[2]
        return np.maximum(cosine, 0) ** n / light[2]

    return integral(reflected, degrees)


def test_the_textbooks_lobes_return_what_a_quadrature_finds(rgb):
    for form in ("phong", "blinn"):
        subject = named(form)
        found, curves = checked(subject)
        curve = curves["metal, alpha 0.3"]
        n = factors.exponent_of(curve.alpha, form)
        for degrees in (0.0, 45.0, 80.0):
            expected = lobe(form, n, degrees) / lobe(form, n, 0)
            returned = curve.returned[checks.ANGLES.index(degrees)]
            assert returned == pytest.approx(expected, rel=5e-3)
        assert failing(found) == {"white furnace", "energy", "reciprocity", "horizon"}


def test_roughplastic_loses_light_is_reciprocal_and_has_a_wrong_derivative(rgb):
    """By ``alpha`` the diffuse part depends on tables that Dr.Jit does not see."""
    subject = small(ScatteringSubject("roughplastic", {"alpha": 0.5}))
    found, curves = checked(subject)
    known = albedo.of_roughplastic(albedo.RoughPlastic((1.0, 1.0, 1.0), 0.5, 1.49 / 1.000277))
    seen = curves["roughplastic"].seen[0]
    assert seen == pytest.approx(known.diffuse[0] + known.specular[0], abs=3e-3)
    assert failing(found) == {"white furnace", "gradient"}
    assert found["gradient"].worst == "by alpha"


legendre = cache(np.polynomial.legendre.leggauss)


def facets(alpha, eta, degrees):
    """The light that GGX of an interface scatters once, over its facets (Walter et al. 2007)."""
    cosine, eta = abs(np.cos(np.deg2rad(degrees))), eta if degrees < 90 else 1 / eta
    nodes, weights = legendre(400)
    x = (nodes + 1) / 2
    share, weight = x**3 * (10 - 15 * x + 6 * x * x), 15 * weights * (x * (1 - x)) ** 2
    tangent = alpha * np.sqrt(share / np.maximum(1 - share, 1e-15))[:, None]
    top = 1 / np.sqrt(1 + tangent**2)
    facing = (np.sqrt(1 - cosine**2) * tangent * np.cos(np.pi * (nodes + 1)) + cosine) * top
    met = np.maximum(facing, 1e-9)
    inside = np.sqrt(np.maximum(1 - (1 - met**2) / eta**2, 0))
    parts = (met - eta * inside) / (met + eta * inside), (eta * met - inside) / (eta * met + inside)
    fresnel = sum(part**2 for part in parts) / 2

    def lit(z):
        slope = alpha**2 * (1 / np.maximum(z, 1e-9) ** 2 - 1)
        return np.where(z > 0, 2 / (1 + np.sqrt(1 + slope)), 0)

    refracted = cosine / eta - (met / eta - inside) * top
    scattered = fresnel * lit(2 * met * top - cosine) + (1 - fresnel) * lit(refracted)
    seen = np.maximum(facing, 0) / top * lit(cosine) / cosine
    return weight @ (scattered * seen) @ weights / 2


@pytest.mark.thorough
@pytest.mark.guarantee(
    "kernel", "An audit's energies are those of an independent quadrature, to 0.1 %."
)
def test_rough_glass_passes_what_a_quadrature_over_its_facets_finds(rgb):
    for alpha, ior in ((0.1, 1.5), (0.3, 1.1), (1.0, 2.0)):
        given = {"alpha": alpha, "int_ior": ior, "ext_ior": 1.0, "distribution": "ggx"}
        subject = ScatteringSubject("roughdielectric", given)
        curve = checks.curve(subject, "roughdielectric")
        angles = subject.both_sides(checks.ANGLES)
        expected = [facets(alpha, subject.eta, degrees) for degrees in angles]
        np.testing.assert_allclose([curve.seen, curve.returned], [expected] * 2, rtol=1e-3)
    found, _ = checked(small(subject, (48, 36)))
    assert failing(found) == {"white furnace"}
    assert found["directions"].verdict == found["weights"].verdict == "holds"
    subject.eta = 1.9  # not its own
    expected = 2 * (4 - 1.9**2) / (4 + 1.9**2)
    assert check("reciprocity", subject).value == pytest.approx(expected, rel=0.02)


# --- Each check can fail -------------------------------------------------------------------------


def of_each_light(reflected):
    """Return a way to shade that adds up a function of point and light."""

    def shade(point):
        value = mi.Spectrum(0)
        for light in point.lights:
            value += light.intensity * reflected(point, light)
        return value

    return shade


def cosine(point, light):
    return dr.dot(point.normal, light.toward)


def facing(point):
    return dr.dot(point.normal, point.view)


def undefined_at_grazing(point):
    """The trial has no viewer so low."""
    return lambert(point) * dr.select(facing(point) < 1e-5, dr.log(facing(point) - 1), 1)


def detached_parameter(point, gloss: Range(0, 1) = 0.5):
    return lambert(point) * (1 - 0.5 * dr.detach(gloss)) / 0.75


def infinite_derivative(point):
    return lambert(point) * (
        1 + dr.maximum(point.material.alpha - 1.5, 0) ** (point.material.n + 1)
    )


FAILING = (
    (lambda point: 2 * lambert(point), {"white furnace", "energy"}),
    (lambda point: lambert(point) * (0.25 + 0.75 * facing(point)),
     {"white furnace", "reciprocity"}),
    (of_each_light(lambda point, light: dr.select(cosine(point, light) > 0, 0.5, 0.0)),
     {"energy", "reciprocity", "horizon"}),
    (of_each_light(lambda point, light: dr.abs(cosine(point, light)) / 2), {"light from below"}),
    (undefined_at_grazing, {"values"}),
    (lambda point: lambert(point) - dr.select(point.lights[0].distance < 1e-5, 1.0, 0.0)
     if point.lights else lambert(point), {"values"}),

    (detached_parameter, {"gradient"}),
    (infinite_derivative, {"gradient"}),
)  # fmt: skip


@pytest.mark.thorough
def test_each_check_can_fail(rgb):
    for number, (function, expected) in enumerate(FAILING):
        found = failing(checked(small(shaded(function), (48, 36)))[0])
        allowed = {"white furnace", "energy"} if expected & {"horizon", "reciprocity"} else set()
        assert expected <= found <= expected | allowed, number


MATTE = """
import drjit as dr
import mitsuba as mi

class Matte(mi.BSDF):
    def __init__(self, properties):
        super().__init__(properties)
        self.m_flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide

    def sample(self, context, si, sample1, sample2, active=True):
        bs = dr.zeros(mi.BSDFSample3f)
        bs.wo = mi.warp.square_to_cosine_hemisphere(sample2)
        bs.pdf = self.pdf(context, si, bs.wo)
        bs.eta = 1
        bs.sampled_type = +mi.BSDFFlags.DiffuseReflection
        weight = mi.Spectrum(1)
        return bs, weight & (si.wi.z > 0)

    def eval(self, context, si, wo, active=True):
        return mi.Spectrum(dr.maximum(wo.z, 0) / dr.pi) & (si.wi.z > 0)

    def pdf(self, context, si, wo, active=True):
        return mi.warp.square_to_cosine_hemisphere_pdf(wo) & (si.wi.z > 0)

    def eval_pdf(self, context, si, wo, active=True):
        return self.eval(context, si, wo), self.pdf(context, si, wo)

mi.register_bsdf("matte", Matte)
"""


def test_a_bsdf_in_a_file_has_its_density_checked(rgb, written):
    for text, wrong in (
        (MATTE, set()),
        (MATTE.replace("to_cosine_hemisphere(", "to_uniform_hemisphere("), {"directions"}),
    ):
        found, _ = checked(small(ScatteringSubject(f"{written(text)}:matte", {}), (24, 18)))
        assert failing(found) == wrong
    written(MATTE.replace("wo.z, 0)", "wo.w, 0)"))
    with pytest.raises(InputError, match=r"^mine.py, line 20: .* 'w' .*BSDF mine.py:matte"):
        checks.audit("bsdf", "mine.py:matte", {})


WRONG_SAMPLES = {
    "half": ("mi.Spectrum(1)", "mi.Spectrum(0.5)", "weight of sample is 0.5 times eval / pdf"),
    "eval": ("mi.Spectrum(1)", "self.eval(context, si, bs.wo)", "weight of sample"),
    "grazing": ("mi.Spectrum(1)", "mi.Spectrum(dr.select(si.wi.z < 0.2, 0.5, 1))", "is 0.5 times"),
    "channels": ("mi.Spectrum(1)", "mi.Color3f(1.2, 1, 1)", "weight of sample is 1.2 times"),
    "azimuth": ("mi.Spectrum(1)", "mi.Spectrum(1 + 0.5 * dr.sign(bs.wo.x))", "weight of sample"),
    "lobe drawn": ("mi.Spectrum(1)", "mi.Spectrum(dr.select(sample1 < 0.5, 1.9, 0.3))", "is 1.1"),
    "behind": (" & (si.wi.z > 0)\n\n    def eval(", "\n\n    def eval(", "is not 0, as is eval"),
    "not a number": ("mi.Spectrum(1)", "mi.Spectrum(dr.select(sample2.x < 1e-4, dr.nan, 1))",
                     "not finite"),
    "density": ("bs.pdf = self.pdf(context, si, bs.wo)", "bs.pdf = 0.5 / dr.pi", "pdf of sample"),
    "no density": ("bs.pdf = self.pdf(context, si, bs.wo)", "", "pdf of sample is 0 times pdf"),
    "mirror": ("+mi.BSDFFlags.Diffuse", "+mi.BSDFFlags.Delta", "sampled_type of sample"),
    "no index": ("bs.eta = 1", "", "eta of a reflected sample is 0 times 1"),
    "both, eval": ("return self.eval(context, si, wo),", "return 1.3 * self.eval(context, si, wo),",
                   "eval of eval_pdf is 1.3 times eval"),
    "both, pdf": (", self.pdf(context, si, wo)\n", ", 2 * self.pdf(context, si, wo)\n",
                  "pdf of eval_pdf is 2 times pdf"),
    "both, behind": ("return self.eval(context, si, wo),", "return mi.Spectrum(dr.abs(wo.z)),",
                     "eval of eval_pdf is not 0"),
}  # fmt: skip


@pytest.mark.guarantee(
    "kernel", "An audit names samples whose weight or density is wrong, and accuses no right ones."
)
@pytest.mark.parametrize("kind", WRONG_SAMPLES)
def test_wrong_samples_are_named(rgb, written, kind):
    before, after, said = WRONG_SAMPLES[kind]
    assert MATTE.count(before) == 1
    found = check(
        "weights", ScatteringSubject(f"{written(MATTE.replace(before, after))}:matte", {})
    )
    assert (found.verdict, said in found.worst) == ("does not hold", True), found.worst


UNASKED = (
    ("directions", "diffuse", {"reflectance": 0.0}, "it scatters nothing"),
    ("weights", "diffuse", {"reflectance": 0.0}, "it scatters nothing"),
    ("light from below", "roughdielectric", {"alpha": 0.3}, "it transmits light"),
    ("weights", None, {}, "textbook shading is not sampled"),
)


@pytest.mark.parametrize(("name", "plugin", "given", "why"), UNASKED)
def test_what_cannot_be_checked_is_not_asked_and_says_why(rgb, name, plugin, given, why):
    subject = ScatteringSubject(plugin, given) if plugin else named("phong")
    found = check(name, subject)
    assert (found.verdict, found.value, found.worst) == ("not asked", None, why)


LOBES = """
        is_uniform = sample1 < 0.5
        bs.wo = dr.select(is_uniform, mi.warp.square_to_uniform_hemisphere(sample2), bs.wo)
        own = dr.select(is_uniform, 0.5 / dr.pi, bs.wo.z / dr.pi)
        bs.pdf = self.pdf(context, si, bs.wo)
        weight = self.eval(context, si, bs.wo) / own
"""


def test_a_lobe_that_is_weighed_by_itself_is_right_in_the_mean(rgb, written):
    """Of half a uniform and half a cosine lobe; the density is that of both."""
    text = MATTE.replace("        weight = mi.Spectrum(1)\n", LOBES[1:]).replace(
        "return mi.warp.square_to_cosine_hemisphere_pdf(wo) &",
        "return dr.select(wo.z > 0, (0.5 * wo.z + 0.25) / dr.pi, 0) &",
    )
    found = check("weights", ScatteringSubject(f"{written(text)}:matte", {}))
    assert found.verdict == "holds", found.worst
    # The density of that lobe alone would weigh lamps too little.
    text = text.replace(LOBES[1:], LOBES[1:].replace("self.pdf(context, si, bs.wo)", "own"))
    found = check("weights", ScatteringSubject(f"{written(text)}:matte", {}))
    assert "pdf of sample" in found.worst


RIGHT = (
    {"type": "diffuse"},
    {"type": "roughplastic", "alpha": 0.1},
    {"type": "roughconductor", "alpha_u": 0.1, "alpha_v": 0.5},
    {"type": "roughconductor", "distribution": "ggx", "sample_visible": False, "alpha": 0.3},
    {"type": "roughdielectric", "alpha": 0.3},
    {"type": "principled", "roughness": 0.5, "spec_trans": 0.5, "clearcoat": 1.0},
    {"type": "principledthin", "roughness": 0.5, "spec_trans": 0.5, "diff_trans": 0.5},
    {"type": "twosided", "a": {"type": "roughplastic"}},
    {"type": "blendbsdf", "weight": 0.3, "a": {"type": "diffuse"}, "b": {"type": "roughconductor"}},
)


@pytest.mark.parametrize("scattering", RIGHT, ids=str)
def test_samples_of_mitsubas_own_bsdfs_are_right(rgb, scattering):
    assert samples.worst(mi.load_dict(scattering))[0] < 1e-3


# --- Hard cases ----------------------------------------------------------------------------------


@pytest.mark.thorough
@pytest.mark.guarantee(
    "kernel", "Every built-in heuristic and example shader passes an audit's hard cases."
)
def test_every_heuristic_goes_through_the_hard_cases(rgb):
    for name in [*sorted(HEURISTICS), *SHADERS]:
        subject = named(name)
        assert len(list(subject.hard_cases())) >= len(EXTREMES) + len(DISTANCES)
        check("reciprocity", subject), check("horizon", subject)
        found = check("values", subject)
        assert (found.verdict, found.worst) == ("holds", "none"), name


@pytest.mark.thorough
@opengl
def test_a_shader_in_glsl_is_audited_without_derivatives(rgb):
    found, _ = checked(named(str(DOCS / "phong.glsl"), (24, 18)))
    assert found["gradient"].verdict == "not asked"
    assert found["values"].verdict == "holds"


# --- The command and its files -------------------------------------------------------------------


@pytest.fixture(scope="module")
def grey():
    """The audit of a grey diffuse BSDF."""
    mi.set_variant("llvm_ad_rgb")
    return checks.audit("bsdf", "diffuse", {"reflectance": 0.5})


def test_the_headline_and_the_page_name_every_failure(grey):
    assert sentences.of_audit(grey) == "diffuse, reflectance 0.5: white furnace does not hold"
    failed = [structs.replace(check, verdict="does not hold", value=2.0) for check in grey.checks]
    wrong = structs.replace(grey, checks=tuple(failed), faults=("nan (<i>)", "nan (there)"))
    html = audit_files.render(wrong)
    for check in grey.checks:
        assert check.name in sentences.of_audit(wrong)
        assert f"{check.name}</span></th>" in html
    assert "nan (&lt;i&gt;)" in html
    assert "<i>" not in html
    assert "<script" not in html
    assert "default-src 'none'" in html


@pytest.mark.thorough
def test_only_values_that_no_light_has_fail_the_command(run, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import drjit as dr\n"
        "def even(point):\n"
        "    facing = dr.dot(point.normal, point.view)\n"
        "    return dr.select(facing < 1e-5, dr.log(facing - 1), 1) * point.material.k_s\n"
    )
    assert run("audit", "--bsdf", "diffuse", "-p", "reflectance=0.5", "-o", tmp_path)[0] == 0
    code, said, _ = run("audit", "--heuristic", f"{file}:even", "-o", tmp_path)
    assert (code, "nan" in said) == (1, True)
    folder = tmp_path / "audit/mine-even"
    assert (folder / "audit.svg").read_text().startswith("<svg")
    record = json.loads((folder / "audit.json").read_text())
    jsonschema.validate(record, schema("audit"))
    html = (folder / "index.html").read_text()
    assert all(check["worst"] in html for check in record["checks"])


def test_mistakes_in_words_are_refused(run, tmp_path, rgb, written):
    scalar = written("import mitsuba as mi\nmi.set_variant('scalar_rgb')\n")
    for words, message in (
        (("--heuristic", "phong", "--bsdf", "diffuse"), "one of --heuristic and --bsdf"),
        (("--bsdf", "diffuse", "-p", "reflectance"), "is not a parameter"),
    ):
        code, _, said = run("audit", *words, "-o", tmp_path)
        assert (code, message in said) == (2, True)
    for kind, name, given, message in (
        ("heuristic", "phong", {"gloss": 1.0}, "gloss"),
        ("heuristic", "phnog", {}, "phnog"),
        ("bsdf", "plastic", {}, "mirror"),
        ("bsdf", "dielectric", {}, "passes it in one direction"),
        ("bsdf", "roughdielectric", {"int_ior": 1.05}, "too narrow"),
        ("bsdf", "none.py:matte", {}, "^none.py: there is no such file"),
        ("bsdf", "sphere", {}, "'sphere' is a plugin of Mitsuba, but not a BSDF"),
        ("bsdf", scalar, {}, "in variant llvm_ad_rgb"),
        ("bsdf", "roughplastic", {"alpha": 0.01}, "too narrow"),
        ("bsdf", "plastic", {"int_ior": 0.0}, "int_ior = 0 is not allowed: give an index of"),
        ("bsdf", "phong", {"n": 1000.0}, "too narrow"),
        ("bsdf", "roughplastic", {"alhpa": 1.0}, "alhpa"),
    ):
        with pytest.raises(InputError, match=message):
            checks.audit(kind, name, given)
    with pytest.raises(InputError, match="give a value from 0 to 1"):
        ShadingSubject(of_function(detached_parameter, "mine"), {"gloss": 2.0})


def test_spheres_show_the_response_to_their_light(rgb):
    """Lambert's is the cosine; Blinn's highlight lies where the half vector is the normal."""
    side = checks.SIDE
    x, y = np.meshgrid(*2 * [(2 * np.arange(side) + 1) / side - 1])
    inside = np.hypot(x, y) < 0.95
    normal = np.stack([x, -y, np.sqrt(np.clip(1 - x**2 - y**2, 0, None))])
    cosine = np.einsum("cij,c->ij", normal, checks.TOWARD_LIGHT)
    found = checks.spheres(named("blinn"), ["matte", "metal, alpha 0.1"])
    is_lit = inside & (cosine > 0.05)
    np.testing.assert_allclose(found["matte"][is_lit, 0], cosine[is_lit], atol=0.01)
    assert not found["matte"][inside & (cosine < -0.05)].any()
    half = np.add(checks.TOWARD_LIGHT, (0, 0, 1))
    peak = np.unravel_index(found["metal, alpha 0.1"][..., 0].argmax(), (side, side))
    np.testing.assert_allclose(normal[:, *peak], half / np.linalg.norm(half), atol=0.03)
