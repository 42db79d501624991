import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from reference.pairing.halves import pair
from reference.pairing.lights import spots
from reference.scene.source import Source


def solid_angle_error(cutoff, exponent, beam_width, edge=None):
    """Mean square difference over the cone, by another quadrature: uniform in the cosine."""
    cosine = np.linspace(np.cos(np.radians(cutoff)), 1, 20_001)
    theta = np.degrees(np.arccos(cosine))
    power = np.where(cosine > 0, cosine, 0) ** exponent
    edge = edge or cutoff
    linear = np.clip((edge - theta) / (edge - beam_width), 0, 1)
    return np.mean((power - linear) ** 2)


@pytest.mark.parametrize(("cutoff", "beam_width"), [(20, 15), (20, 1), (45, 30), (80, 10)])
def test_no_other_exponent_fits_better(cutoff, beam_width):
    m = spots.exponent_for(cutoff, beam_width)
    best = solid_angle_error(cutoff, m, beam_width)
    for other in m * np.array([0.5, 0.9, 1.1, 2.0]):
        assert solid_angle_error(cutoff, other, beam_width) > best


@pytest.mark.parametrize(("cutoff", "exponent"), [(20, 10), (30, 3), (60, 40), (85, 2)])
def test_no_other_cone_fits_better(cutoff, exponent):
    edge, beam_width = spots.cone_for(cutoff, exponent)
    best = solid_angle_error(cutoff, exponent, beam_width, edge)
    for other_edge in np.linspace(0.1, 1, 20) * cutoff:
        for other in np.linspace(0, 0.999, 20) * other_edge:
            error = solid_angle_error(cutoff, exponent, other, other_edge)
            assert error >= best * (1 - 1e-3)


def test_an_even_cone_is_a_beam_as_wide_as_the_cone():
    assert spots.cone_for(30, 0) == pytest.approx((30, 30), rel=1e-3)
    assert spots.exponent_for(30, 29.99) == pytest.approx(0, abs=1e-2)


def test_mitsubas_spot_falls_off_as_the_fit_believes(rgb):
    light = mi.load_dict({"type": "spot", "intensity": 1.0, "cutoff_angle": 40, "beam_width": 10})
    theta = np.linspace(0, 50, 101)
    it = mi.SurfaceInteraction3f()
    angle = mi.Float(np.radians(theta))
    it.p = mi.Point3f(dr.sin(angle), 0, dr.cos(angle))
    _, weight = light.sample_direction(it, mi.Point2f(0.5))
    assert np.array(weight)[0] == pytest.approx(spots.linear_falloff(theta, 40, 10), abs=1e-5)


@pytest.mark.parametrize("name", ["spot", "heuristic_spot"])
def test_spots_pair_both_ways(rgb, name):
    to_world = mi.ScalarTransform4f().look_at((1, 2, 3), (0, 0, 0), (0, 0, 1))
    given = {
        "spot": {"type": "spot", "to_world": to_world, "intensity": 20.0, "cutoff_angle": 25.0},
        "heuristic_spot": {
            "type": "heuristic_spot", "position": (1, 2, 3), "direction": (-1, -2, -3),
            "intensity": 20.0, "cutoff": 25.0, "exponent": 30.0, "k0": 0.0, "k2": 1.0,
        },
    }[name]  # fmt: skip
    scene = {
        "type": "scene",
        "sensor": {"type": "perspective"},
        "wall": {"type": "rectangle", "bsdf": {"type": "diffuse"}},
        "light": given,
    }
    made = pair(Source("spots", scene))
    point = mi.SurfaceInteraction3f()
    point.p = mi.Point3f(0, 0, 0)
    heuristic, physical = (
        half.instantiate().emitters()[0].sample_direction(point, mi.Point2f(0.5))[1][0][0]
        for half in (made.heuristic, made.physical)
    )
    # On the axis both fall-offs are 1, so that the factor pi between the two is all there is.
    assert heuristic == pytest.approx(physical, rel=1e-5)
    assert not made.emitters[0].exact


@pytest.mark.parametrize("distance", [0.0, 1e-38, 1e-20, 1e-3, 1.0, 1e20, 1e37])
@pytest.mark.parametrize("kind", ["heuristic_point", "heuristic_spot"])
def test_a_lights_plugin_answers_at_any_distance(rgb, kind, distance):
    """``pi I / d²`` wherever single precision has it, and nothing on the light itself."""
    intensity = min(max(distance**2, 1e-30), 1e30)
    description = {"type": kind, "position": (0, 0, distance), "intensity": intensity}
    description |= {"k0": 0.0, "k2": 1.0}
    if kind == "heuristic_spot":
        description["direction"] = (0, 0, -1)
    light = mi.load_dict(description)
    ds, weight = light.sample_direction(dr.zeros(mi.Interaction3f), mi.Point2f(0.5))
    assert dr.all(dr.isfinite(weight) & dr.isfinite(ds.dist) & dr.all(dr.isfinite(ds.d)))
    if distance in (0.0, 1e-38):
        assert dr.all(ds.d == 0)
        return
    np.testing.assert_allclose(np.array(ds.d).ravel(), (0, 0, 1), atol=1e-6)
    np.testing.assert_allclose(np.array(ds.dist), distance, rtol=1e-6)
    expected = np.pi * (intensity / distance / distance)
    np.testing.assert_allclose(np.array(weight).ravel(), expected, rtol=1e-5, atol=1e-37)
