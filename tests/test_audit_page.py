"""The page of an audit: closed forms in the data of its charts, its words, and its tables."""

import json
from dataclasses import replace as replaced

import numpy as np
import pytest
from msgspec import structs

from comparisons.audit import angles, extremes, profiles
from comparisons.audit.audit import audit
from comparisons.audit.shaded import opened
from comparisons.audit.subject import Setting
from reports.charts import audit_charts
from reports.run import audit_files
from reports.terminal import audit_words
from tests.test_audit import lambert, one_way, shaded

GREY = 0.5


@pytest.fixture(scope="module")
def grey():
    """The audit of a grey diffuse BSDF."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_rgb")
    return audit("bsdf", "diffuse", {"reflectance": GREY})


def rows(spec):
    """The rows of a chart's data, of all its layers."""
    return [row for data in spec["datasets"].values() for row in data] if "datasets" in spec else [
        row for layer in spec["layer"] for row in layer["data"]["values"]
    ]  # fmt: skip


@pytest.mark.parametrize("field", audit_charts.ALBEDOS)
def test_lamberts_albedo_is_k_d_at_each_angle_of_the_chart(grey, field):
    ((name, spec),) = audit_charts.albedo_charts(grey, field)
    found = {row["x"]: row["y"] for row in rows(spec) if "x" in row}
    assert name == "diffuse"
    assert list(found) == list(angles.ANGLES)
    np.testing.assert_allclose(list(found.values()), GREY, rtol=1e-3)


def test_lamberts_lobe_is_a_half_circle_of_k_d(grey):
    ((_, spec),) = audit_charts.lobe_charts(grey)
    lobe = [np.hypot(row["x"], row["y"]) for row in rows(spec) if "of" in row]
    assert len(lobe) == len(profiles.LIGHTS) * len(profiles.VIEWS)
    np.testing.assert_allclose(lobe, GREY, rtol=1e-5)


@pytest.mark.parametrize(("k_s", "n"), [(1.0, 9.0), (0.4, 25.0)])
def test_phongs_lobe_returns_2_k_s_over_n_plus_2_at_normal_incidence(rgb, k_s, n):
    subject = opened("phong", {})
    subject.white["lobe"] = {"k_s": k_s, "n": n}
    subject.materials["lobe"] = None
    assert angles.curve(subject, "lobe").returned[0] == pytest.approx(2 * k_s / (n + 2), rel=1e-3)


def test_a_setting_light_shows_phongs_jump(rgb):
    """Of a metal, ``k_s sin(theta_v)^n`` with the viewer opposite; the cosine fades for matte."""
    subject = opened("phong", {})
    found = {each.material.partition(",")[0]: each for each in profiles.sunsets(subject)}
    elevation = np.deg2rad(profiles.ELEVATIONS)
    np.testing.assert_allclose(found["matte"].values, np.maximum(np.sin(elevation), 0), atol=1e-6)
    metal = found["metal"]
    white = subject.white[metal.material]
    after = metal.values[profiles.ELEVATIONS.index(1e-4)]
    assert metal.viewer.startswith("viewer at 80°")
    assert after == pytest.approx(white["k_s"] * np.sin(np.deg2rad(80)) ** white["n"], rel=1e-3)
    assert metal.values[profiles.ELEVATIONS.index(-1e-4)] == 0


def test_the_map_of_reciprocity_has_its_closed_form(rgb):
    """For ``f ∝ 1/3 + cos(theta_v)``: the difference of the two, over their mean."""
    found = profiles.asymmetry(shaded(one_way))
    cosine = np.cos(np.deg2rad(profiles.POLAR)) + 1 / 3
    light, view = np.meshgrid(cosine, cosine, indexing="ij")
    expected = np.abs(light - view) / ((light + view) / 2)
    np.testing.assert_allclose(found.differences, expected, atol=1e-4)
    assert np.max(profiles.asymmetry(shaded(lambert)).differences) < 1e-5
    phong = profiles.asymmetry(opened("phong", {}))  # f ∝ 1 / cos(theta_l), about the mirror
    grazing = np.cos(np.deg2rad(profiles.POLAR[-1]))
    expected = (1 - grazing) / ((1 + grazing) / 2)
    assert np.max(phong.differences) == pytest.approx(expected, rel=1e-3)


def test_a_hard_case_counts_what_is_wrong(rgb):
    subject = shaded(lambert)
    values = np.array([[0.5, np.nan, -0.25, 2.0]] * 3)
    setting = Setting("a case", lambda: values)
    dark = replaced(setting, values=lambda: np.zeros((3, 4)))
    subject.settings = lambda: iter([setting, dark])
    bad, good = extremes.extremes(subject)
    assert (bad.lowest, bad.highest, bad.wrong) == (-0.25, 2.0, 6)
    assert "nan" in bad.worst
    assert (good.lowest, good.highest, good.wrong, good.worst) == (0, 0, 0, "")
    assert extremes.values(subject).value == 1  # one fault noted per case


def test_the_headline_names_every_failure_and_none_where_all_holds(grey):
    loses = audit_words.headline(grey)
    assert loses == "diffuse, reflectance 0.5 loses up to 50.0 % of the light"
    holding = [structs.replace(check, verdict="holds") for check in grey.checks]
    white = structs.replace(grey, checks=tuple(holding), parameters={})
    assert audit_words.headline(white).startswith("diffuse conserves energy")
    failing = [structs.replace(check, verdict="does not hold", value=2.0) for check in grey.checks]
    said = audit_words.headline(structs.replace(grey, checks=tuple(failing)))
    parts = ("returns up to 2.00 times", "as bright as", "reciprocal", "jumps", "behind", "density")
    assert all(part in said for part in parts)


def test_the_page_says_all_checks_and_cases_and_loads_nothing(grey):
    wrong = extremes.Extreme(case="<b>", lowest=None, highest=2.0, wrong=3, worst="nan (<i>)")
    html = audit_files.render(structs.replace(grey, extremes=(wrong, *grey.extremes)))
    for check in grey.checks:
        assert f'id="{check.name.replace(" ", "-")}"' in html
        assert audit_words.MEANINGS[check.name].split("’")[0] in html
    for each in grey.extremes:
        assert each.case in html
    assert "3 wrong" in html
    assert "Such as nan (&lt;i&gt;)" in html
    assert "<b>" not in html
    assert "<script" not in html
    assert "default-src 'none'" in html


def test_the_command_writes_the_page(run, tmp_path):
    code, said, _ = run("audit", "--bsdf", "diffuse", "-o", tmp_path)
    page = tmp_path / "audit/diffuse/index.html"
    assert (code, str(page) in said) == (0, True)
    record = json.loads(page.with_name("audit.json").read_text(encoding="utf-8"))
    html = page.read_text(encoding="utf-8")
    assert all(case["case"] in html for case in record["extremes"])
