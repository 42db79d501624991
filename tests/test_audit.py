"""Audits, against closed forms, and of ways to shade that are wrong in one respect each."""

import json
from pathlib import Path

import drjit as dr
import jsonschema
import mitsuba as mi
import numpy as np
import pytest

from comparisons.audit import angles, extremes, gradients
from comparisons.audit.audit import examined
from comparisons.audit.scattering import Scattering
from comparisons.audit.shaded import DISTANCES, EXTREMES, Shaded, opened
from comparisons.audit.subject import Subject, random_and_mirrored
from heuristic import Range
from heuristic.errors import InputError
from heuristic.functions import heuristic_of
from heuristic.heuristics import HEURISTICS
from reference.pairing import albedo, factors
from tests.schemas import schema
from tests.test_glsl import opengl

DOCS = Path(__file__).parents[1] / "docs/shaders"
FUNCTIONS = ("filament", "bevy", "gltf", "layered")
SHADERS = [str(path) for path in sorted(DOCS.glob("*.py")) if path.stem != "standard_material"]
SHADERS += [f"{DOCS / 'standard_material.py'}:{name}" for name in FUNCTIONS]


def lambert(point):
    value = mi.Spectrum(0)
    for light in point.lights:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        value += point.material.base_color * light.intensity * cosine
    return value


def shaded(function):
    subject = Shaded(heuristic_of(function, "mine"), {})
    subject.grid = (120, 90)
    return subject


def failing(subject):
    return {check.name for check in examined(subject)["checks"] if check.verdict == "does not hold"}


def curves_of(subject):
    return {name: angles.curve(subject, name) for name in subject.materials}


def test_lamberts_albedo_is_one_at_every_angle(rgb):
    for curve in curves_of(shaded(lambert)).values():
        np.testing.assert_allclose(curve.seen, 1, atol=1e-3)
        np.testing.assert_allclose(curve.returned, 1, atol=1e-3)
    assert failing(shaded(lambert)) == set()


def test_wrapped_light_has_its_closed_form(rgb):
    """``s = max(c + w, 0) / (1 + w)``: seen is its mean over the sphere, which is ``1 + w``."""
    wrap = 0.5

    def wrapped(point):
        value = mi.Spectrum(0)
        for light in point.lights:
            cosine = dr.dot(point.normal, light.toward)
            value += light.intensity * dr.maximum(cosine + wrap, 0) / (1 + wrap)
        return value

    subject = shaded(wrapped)
    curve = curves_of(subject)["matte"]
    np.testing.assert_allclose(curve.seen, 1 + wrap, rtol=2e-3)
    cosine = np.cos(np.deg2rad(angles.ANGLES))
    np.testing.assert_allclose(curve.returned, (cosine + wrap) / ((1 + wrap) * cosine), rtol=2e-3)
    found = angles.below(subject)
    assert found.value == pytest.approx((wrap - np.sin(np.deg2rad(1))) / (1 + wrap), rel=1e-4)
    assert failing(subject) == {"white furnace", "energy", "reciprocity", "light from below"}


def lobe(form, n, degrees):
    """The light returned of a lobe as a textbook prints it, by Gauss and Legendre in float64."""
    nodes, weights = np.polynomial.legendre.leggauss(300)
    z, weights = (nodes + 1) / 2, weights / 2
    azimuth = np.linspace(0, 2 * np.pi, 600, endpoint=False)
    z, azimuth = np.meshgrid(z, azimuth, indexing="ij")
    view = np.stack([np.sqrt(1 - z**2) * np.cos(azimuth), np.sqrt(1 - z**2) * np.sin(azimuth), z])
    theta = np.deg2rad(degrees)
    light = np.array([np.sin(theta), 0, np.cos(theta)])
    if form == "phong":
        cosine = np.einsum("i,ijk", [-light[0], 0, light[2]], view)
    else:
        half = view + light[:, None, None]
        cosine = (half / np.linalg.norm(half, axis=0))[2]
    value = np.maximum(cosine, 0) ** n * z / light[2]
    return (value.mean(axis=1) * weights).sum() * 2 * np.pi / np.pi


@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_the_textbooks_lobes_return_what_a_quadrature_finds(rgb, form):
    subject = opened(form, {})
    subject.grid = (240, 180)
    curve = curves_of(subject)["metal, alpha 0.3"]
    n = factors.exponent_of(curve.alpha, form)
    returned = dict(zip(angles.ANGLES, curve.returned, strict=True))
    head_on = lobe(form, n, 0)
    for degrees in (0.0, 45.0, 80.0):
        assert returned[degrees] == pytest.approx(lobe(form, n, degrees) / head_on, rel=5e-3)
    assert failing(subject) == {"white furnace", "energy", "reciprocity", "horizon"}


def test_a_diffuse_bsdf_is_all_that_it_should_be(rgb):
    assert failing(Scattering("diffuse", {})) == set()


def test_roughplastic_loses_light_and_is_reciprocal(rgb):
    subject = Scattering("roughplastic", {"alpha": 0.5})
    subject.grid = (240, 180)
    curve = angles.curve(subject, "roughplastic")
    known = albedo.of_roughplastic(albedo.RoughPlastic((1.0, 1.0, 1.0), 0.5, 1.49 / 1.000277))
    assert curve.seen[0] == pytest.approx(known.diffuse[0] + known.specular[0], abs=3e-3)
    found = {check.name: check for check in examined(subject)["checks"]}
    assert found["white furnace"].verdict == "does not hold"
    holding = ("energy", "reciprocity", "horizon", "light from below", "sampling", "values")
    assert {found[name].verdict for name in holding} == {"holds"}


def doubled(point):
    return 2 * lambert(point)


def one_way(point):
    return lambert(point) * 0.75 * (1 / 3 + dr.dot(point.normal, point.view))


def stepping(point):
    value = mi.Spectrum(0)
    for light in point.lights:
        value += light.intensity * dr.select(dr.dot(point.normal, light.toward) > 0, 0.5, 0.0)
    return value


def both_sides(point):
    value = mi.Spectrum(0)
    for light in point.lights:
        value += light.intensity * dr.abs(dr.dot(point.normal, light.toward)) / 2
    return value


def undefined_at_grazing(point):
    """The trial has no viewer so low."""
    facing = dr.dot(point.normal, point.view)
    return lambert(point) * dr.select(facing < 1e-5, dr.log(facing - 1), 1)


def negative_when_near(point):
    value = lambert(point)
    for light in point.lights:
        value -= dr.select(light.distance < 1e-5, 1.0, 0.0)
    return value


def detached(point):
    return lambert(point) * dr.detach(point.material.base_color)


def detached_parameter(point, gloss: Range(0, 1) = 0.5):
    value = lambert(point)
    return value * (1 - 0.5 * dr.detach(gloss)) / 0.75


def infinite_derivative(point):
    return lambert(point) * (
        1 + dr.maximum(point.material.alpha - 1.5, 0) ** (point.material.n + 1)
    )


@pytest.mark.parametrize(
    ("function", "expected"),
    [
        (doubled, {"white furnace", "energy"}),
        (one_way, {"white furnace", "reciprocity"}),
        (stepping, {"energy", "reciprocity", "horizon"}),
        (both_sides, {"light from below"}),
        (undefined_at_grazing, {"values"}),
        (negative_when_near, {"values"}),
        (detached, {"gradient"}),
        (detached_parameter, {"gradient"}),
        (infinite_derivative, {"gradient"}),
    ],
)
def test_each_check_can_fail(rgb, function, expected):
    found = failing(shaded(function))
    assert expected <= found
    allowed = {"white furnace", "energy"} if expected & {"horizon", "reciprocity"} else set()
    assert found - expected <= allowed


def test_a_density_that_is_wrong_is_found(rgb):
    class Wrong(mi.BSDF):
        """Diffuse, with samples even over the hemisphere and the density of the cosine."""

        def __init__(self, properties):
            super().__init__(properties)
            flags = mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide
            self.m_components, self.m_flags = [flags], flags

        def sample(self, context, si, sample1, sample2, active=True):
            bs = dr.zeros(mi.BSDFSample3f)
            bs.wo = mi.warp.square_to_uniform_hemisphere(sample2)
            return bs, mi.Spectrum(1)

        def eval(self, context, si, wo, active=True):
            return mi.Spectrum(dr.maximum(wo.z, 0) / dr.pi) & (si.wi.z > 0)

        def pdf(self, context, si, wo, active=True):
            return mi.warp.square_to_cosine_hemisphere_pdf(wo)

        def to_string(self):
            return "Wrong[]"

    mi.register_bsdf("densely_wrong", Wrong)
    subject = Scattering("densely_wrong", {})
    assert subject.sampling().verdict == "does not hold"
    assert Scattering("diffuse", {}).sampling().verdict == "holds"


def test_the_tables_of_roughplastic_have_no_derivative(rgb):
    """By ``alpha`` the diffuse part depends on tables that Dr.Jit does not see."""
    by = {tuned.name: gradients._disagreement(tuned)
          for tuned in Scattering("roughplastic", {"alpha": 0.3}).tuned()}  # fmt: skip
    assert by["alpha"] > gradients.AGREES
    assert by["diffuse_reflectance.value"] < gradients.AGREES


@pytest.mark.guarantee(
    "kernel", "Every built-in heuristic and example shader passes the hard cases of an audit."
)
@pytest.mark.parametrize("name", [*sorted(HEURISTICS), *SHADERS])
def test_every_heuristic_goes_through_the_hard_cases(rgb, name):
    subject: Subject = opened(name, {})
    subject.grid = (24, 18)
    found = extremes.extremes(subject)
    assert len(found) >= len(EXTREMES) + len(DISTANCES)
    assert [each.worst for each in found if each.wrong] == []
    assert "values" not in failing(subject)


@opengl
def test_a_shader_in_glsl_is_audited_without_derivatives(rgb):
    subject = opened(str(DOCS / "phong.glsl"), {})
    subject.grid = (24, 18)
    checks = {check.name: check for check in examined(subject)["checks"]}
    assert checks["gradient"].verdict == "not asked"
    assert checks["values"].verdict == "holds"
    pairs = random_and_mirrored()
    for material in subject.materials:
        built_in = opened("phong", {}).response(material, *pairs)
        found = subject.response(material, *pairs)
        np.testing.assert_allclose(found, built_in, rtol=1e-4, atol=1e-5)


def test_the_command_writes_a_record_and_a_chart(run, tmp_path):
    code, said, _ = run("audit", "--bsdf", "diffuse", "-p", "reflectance=0.5", "-o", tmp_path)
    assert code == 0
    assert "white furnace does not hold" in said
    record = json.loads((tmp_path / "audit/diffuse/audit.json").read_text(encoding="utf-8"))
    jsonschema.validate(record, schema("audit"))
    np.testing.assert_allclose(record["curves"][0]["seen"], 0.5, rtol=1e-4)
    assert (tmp_path / "audit/diffuse/audit.svg").read_text(encoding="utf-8").startswith("<svg")


def test_only_values_that_no_light_has_fail_the_command(run, tmp_path):
    file = tmp_path / "mine.py"
    file.write_text(
        "import drjit as dr\n"
        "def shade(point):\n"
        "    facing = dr.dot(point.normal, point.view)\n"
        "    return dr.select(facing < 1e-5, dr.log(facing - 1), 1) * point.material.k_s\n"
        "def even(point):\n"
        "    return 7 * point.material.k_d\n",
        encoding="utf-8",
    )
    code, said, _ = run("audit", "--heuristic", f"{file}:even", "-o", tmp_path / "out", "--json")
    assert code == 0
    jsonschema.validate(json.loads(said), schema("audit"))
    code, said, _ = run("audit", "--heuristic", file, "-o", tmp_path / "out")
    assert (code, "nan" in said) == (1, True)
    assert {path.name for path in (tmp_path / "out/audit").iterdir()} >= {"mine-even"}


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), "one of --heuristic and --bsdf"),
        (("--heuristic", "phong", "--bsdf", "diffuse"), "one of --heuristic and --bsdf"),
        (("--heuristic", "phong", "-p", "gloss=1"), "gloss"),
        (("--heuristic", "phnog"), "phnog"),
        (("--bsdf", "plastic"), "mirror"),
        (("--bsdf", "roughplastic", "-p", "alpha=0.01"), "too narrow"),
        (("--bsdf", "phong", "-p", "n=1000"), "too narrow"),
        (("--bsdf", "roughplastic", "-p", "alhpa=1"), "alhpa"),
        (("--bsdf", "diffuse", "-p", "reflectance"), "is not a parameter"),
    ],
)
def test_mistakes_are_told(run, tmp_path, words, told):
    code, _, said = run("audit", *words, "-o", tmp_path)
    assert code == 2
    assert told in said


def test_a_parameter_outside_its_bounds_is_refused(rgb):
    with pytest.raises(InputError, match="give a value from 0 to 1"):
        Shaded(heuristic_of(detached_parameter, "mine"), {"gloss": 2.0})
