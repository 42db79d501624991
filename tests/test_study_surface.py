"""Surfaces evaluated without an image, against formulas that share nothing with kernel or Mitsuba.

The facts that a study must reproduce: Fresnel's rise towards grazing, which Phong's model lacks;
the off-specular peak; more light reflected than received for a large k_s.
"""

import numpy as np
import pytest
from scipy.special import erf

from comparisons.study import design, point, surface


def rows(parameters, scene="lobe", more=""):
    text = f"[[part]]\nscene = '{scene}'\n{more}\n[part.parameters]\n{parameters}"
    (part,) = design.parse(text).parts
    found = [row for block in point.blocks(part) for row in point.rows(block)]
    assert all(row["error"] is None for row in found)
    return found


def fresnel(cosine, ior):
    """Unpolarised reflectance of a dielectric, from Snell's law."""
    refracted = np.sqrt(1 - (1 - cosine**2) / ior**2)
    s = (cosine - ior * refracted) / (cosine + ior * refracted)
    p = (refracted - ior * cosine) / (refracted + ior * cosine)
    return (s**2 + p**2) / 2


def torrance_sparrow(light, view, alpha, ior):
    """Specular radiance in the plane of incidence, display-linear: pi f cos(light).

    Beckmann's distribution and Smith's shadowing in its exact form; Mitsuba has Walter's rational
    fit of the latter, within 0.4 %.
    """

    def shadowing(angle):
        a = 1 / (alpha * np.maximum(np.tan(angle), 1e-6))
        return 2 / (1 + erf(a) + np.exp(-(a**2)) / (a * np.sqrt(np.pi)))

    light, view = np.deg2rad(light), np.deg2rad(view)
    half = (light - view) / 2
    slopes = np.exp(-((np.tan(half) / alpha) ** 2)) / (np.pi * alpha**2 * np.cos(half) ** 4)
    reflectance = fresnel(np.cos((light + view) / 2), ior)
    return np.pi * reflectance * slopes * shadowing(light) * shadowing(view) / (4 * np.cos(view))


def phong_albedo(k_d, k_s, n, degrees):
    """Exitance over irradiance of (8.10), by midpoints; light at ``degrees``."""
    theta = (np.arange(900) + 0.5) * np.pi / 1800
    phi = (np.arange(900) + 0.5) * np.pi / 900
    theta, phi = np.meshgrid(theta, phi)
    a = np.deg2rad(degrees)
    cosine = np.sin(a) * np.sin(theta) * np.cos(phi) + np.cos(a) * np.cos(theta)
    radiance = k_d * np.cos(a) + k_s * np.maximum(cosine, 0) ** n
    return (
        2
        * np.sum(radiance * np.cos(theta) * np.sin(theta))
        * (np.pi / 1800)
        * (np.pi / 900)
        / (np.pi * np.cos(a))
    )


@pytest.mark.parametrize("n", [1, 9, 100])
def test_phong_reflects_more_than_it_receives_for_a_large_k_s(n):
    parameters = f"n = {n}\nk_d = 0.3\nk_s = [0.5, 2]\nlight_angle = [0, 75]"
    for row in rows(parameters, more="pairing = 'literal'"):
        expected = phong_albedo(0.3, row["k_s"], n, row["light_angle"])
        if row["light_angle"] == 0:
            assert expected == pytest.approx(0.3 + 2 * row["k_s"] / (n + 2), rel=1e-4)
        assert row["albedo_heuristic"] == pytest.approx(expected, rel=1e-3)
        assert row["albedo_reference"] < 1
    if n == 1:
        assert row["albedo_heuristic"] > 1


def test_fresnel_raises_the_reference_towards_grazing_and_not_phong():
    found = rows("alpha = 0.1\nlight_angle = [0, 40, 80]")
    for row in found:
        angle = row["light_angle"]
        assert row["specular_heuristic"] == pytest.approx(row["k_s"], rel=1e-5)
        expected = torrance_sparrow(angle, angle, 0.1, 1.5)
        assert row["specular_reference"] == pytest.approx(expected, rel=0.01)
    first, _, last = (row["specular_reference"] for row in found)
    # Fresnel's factor goes from 0.04 to 0.39, and the view's cosine gives the rest.
    assert last / first > fresnel(np.cos(np.deg2rad(80)), 1.5) / fresnel(1.0, 1.5) > 9


@pytest.mark.parametrize(("alpha", "angle"), [(0.2, 40), (0.2, 60), (0.4, 50)])
def test_the_reference_peaks_off_the_mirror_direction_and_phong_in_it(alpha, angle):
    (row,) = rows(f"alpha = {alpha}\nlight_angle = {angle}")
    views = np.arange(0, 89.9, 0.02)
    peak = views[np.argmax(torrance_sparrow(angle, views, alpha, 1.5))]
    assert peak > angle + 1
    assert row["peak_reference"] == pytest.approx(peak, abs=0.4)
    assert row["peak_heuristic"] == pytest.approx(angle, abs=0.11)


def test_a_patch_is_the_lobe_in_one_direction():
    profile = rows("alpha = 0.3\nlight_angle = 50\nview_angle = {from=0, to=80, steps=81}", "patch")
    views = np.array([row["view_angle"] for row in profile])
    specular = np.array([row["specular_reference"] for row in profile])
    assert specular == pytest.approx(torrance_sparrow(50, views, 0.3, 1.5), rel=0.02, abs=1e-3)
    k_d, k_s, n = (profile[0][name] for name in ("k_d", "k_s", "n"))
    lobe = np.maximum(np.cos(np.deg2rad(views - 50)), 0) ** n
    wanted = k_d * np.cos(np.deg2rad(50)) + k_s * lobe
    assert [row["heuristic"] for row in profile] == pytest.approx(wanted, rel=1e-4)


def test_azimuth_turns_the_viewer_away_from_the_mirror_image():
    parameters = "n = 20\nlight_angle = 40\nview_angle = 40\nazimuth = [0, 90, 180]"
    found = rows(parameters, "patch", "pairing = 'literal'")
    cosines = [np.sin(np.deg2rad(40)) ** 2 * np.cos(np.deg2rad(a)) for a in (0, 90, 180)]
    wanted = [0.5 * (c + np.cos(np.deg2rad(40)) ** 2) ** 20 for c in cosines]
    assert [row["specular_heuristic"] for row in found] == pytest.approx(wanted, rel=1e-4, abs=1e-7)


def test_a_diffuse_surface_departs_nowhere():
    (row,) = rows("k_s = 0\nk_d = 0.6\nlight_angle = 30")
    assert row["dE2000"] == pytest.approx(0, abs=1e-4)
    assert row["albedo_heuristic"] == pytest.approx(0.6, rel=1e-5)
    assert row["albedo_reference"] == pytest.approx(0.6, rel=1e-5)


def test_views_see_equal_shares_of_the_surface():
    cosine = surface.views()[2]
    # Over projected solid angle, cos^2 is uniform in [0, 1].
    assert np.mean(cosine**2) == pytest.approx(1 / 2, rel=1e-6)
    assert np.mean(cosine) == pytest.approx(2 / 3, rel=1e-3)
    assert surface.hemisphere().weight @ surface.hemisphere().view[2] == pytest.approx(2 / 3)


def test_a_material_out_of_reach_says_by_how_much():
    found = rows("n = 1\nk_d = 0.3\nk_s = [0.05, 2]\nlight_angle = 0")
    assert found[0]["miss"] < 1e-4
    # Phong's lobe alone wants the albedo 4/3; no surface reflects more than 1.
    assert found[1]["miss"] > 0.25
