"""Physics against closed forms: what an exact pair must give, on both sides."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.reference import Source
from fotismos.reference.pairing import halves
from fotismos.reference.rendering import renderer
from tests.shared.parts import camera, look_at, moved

ALBEDO = np.array([0.7, 0.45, 0.2])
DIFFUSE = {"type": "diffuse", "reflectance": {"type": "rgb", "value": tuple(ALBEDO)}}


def scene(shape, light, viewer=(-3, 0, 1), fov=40.0, size=48):
    sensor = camera(viewer, size=size, fov=fov)
    path = {"type": "path"}
    return {"type": "scene", "integrator": path, "sensor": sensor, "shape": shape, "light": light}


def plane():
    return {"type": "rectangle", "to_world": moved(0, 3), "bsdf": DIFFUSE}


def sphere():
    return {"type": "sphere", "bsdf": DIFFUSE}


def seen_by(half, spp, seed, integrator=None):
    """Return the colour, position and normal that each pixel of a half saw."""
    made = half.instantiate()
    nested = mi.load_dict(integrator) if integrator else made.integrator()
    integrator = mi.load_dict({"type": "aov", "aovs": "P:position,N:sh_normal", "image": nested})
    image = np.array(mi.render(made, integrator=integrator, spp=spp, seed=seed), float)
    return np.split(image.reshape(-1, 9), 3, axis=1)


def both_halves(description, spp=1, seed=1):
    """Yield colour, position and normal of the heuristic half, and of the direct reference."""
    pair = halves.pair(Source("a closed form", description))
    yield seen_by(pair.heuristic, spp, seed)
    yield seen_by(pair.physical, spp, seed, {"type": "direct_all"})


def test_a_diffuse_plane_under_a_point_light(rgb):
    """``I cos(theta) rho / (pi d^2)`` at every point that is seen."""
    light, intensity = np.array([1.0, -0.5, 2.0]), 40.0
    description = scene(
        plane(),
        {"type": "point", "position": tuple(light), "intensity": intensity},
        viewer=(0, -3, 5),
    )
    for colour, position, normal in both_halves(description):
        hit = np.any(normal != 0, axis=1)
        assert hit.mean() > 0.9
        np.testing.assert_allclose(position[hit, 2], 0, atol=1e-6)
        offset = light - position[hit]
        distance = np.linalg.norm(offset, axis=1)
        cosine = offset[:, 2] / distance
        expected = (intensity * cosine / (np.pi * distance**2))[:, None] * ALBEDO
        np.testing.assert_allclose(colour[hit], expected, rtol=2e-5)


def test_a_diffuse_sphere_under_a_directional_light(rgb):
    """``E cos(theta) rho / pi`` where the light arrives, 0 behind."""
    travel, irradiance = np.array([2.0, 1.0, -1.0]), 2.5
    description = scene(
        sphere(), {"type": "directional", "direction": tuple(travel), "irradiance": irradiance}
    )
    toward = -travel / np.linalg.norm(travel)
    for colour, _, normal in both_halves(description):
        hit = np.any(normal != 0, axis=1)
        cosine = np.maximum(normal[hit] @ toward, 0)
        assert 0 < np.mean(cosine == 0) < 0.5
        expected = irradiance / np.pi * cosine[:, None] * ALBEDO
        np.testing.assert_allclose(colour[hit], expected, atol=2e-6)


def test_a_diffuse_sphere_in_a_constant_environment(rgb):
    """``rho L``: exactly for the heuristic, within its noise for the reference."""
    radiance = 1.5
    description = scene(sphere(), {"type": "constant", "radiance": radiance})
    heuristic, _ = both_halves(description, spp=64)
    normal = heuristic[2]
    inside = np.linalg.norm(normal, axis=1) > 0.999  # of 64 samples none missed the sphere
    np.testing.assert_allclose(
        heuristic[0][inside], np.tile(radiance * ALBEDO, (inside.sum(), 1)), rtol=1e-5
    )
    pair = halves.pair(Source("a closed form", description))
    half = renderer.Renderer(
        pair.physical.instantiate(), mi.load_dict({"type": "direct_all"}), 16, "reference"
    )
    passes = np.array([np.array(half.render(seed)) for seed in range(8)], float)
    mean = passes.reshape(8, -1, 3)[:, inside].mean(axis=1)  # each pass, over the sphere
    error = mean.std(axis=0, ddof=1) / np.sqrt(8)
    np.testing.assert_array_less(np.abs(mean.mean(axis=0) - radiance * ALBEDO), 4.5 * error + 1e-5)
    assert np.all(error < 0.01 * radiance * ALBEDO)


EXACT = {
    "point": lambda: SCENES["lambert-sphere"].make(),
    "directional": lambda: scene(
        sphere(), {"type": "directional", "direction": (2, 1, -1), "irradiance": 2.5}
    ),
    "constant": lambda: scene(sphere(), {"type": "constant", "radiance": 0.8}),
}


@pytest.mark.guarantee("pairing", "The halves of an exact pair differ by noise alone.")
@pytest.mark.parametrize("everything", [False, True], ids=["planned", "everything"])
@pytest.mark.parametrize("name", EXACT)
def test_an_exact_pair_differs_by_the_noise_alone(rgb, name, everything):
    """ΔE2000 at its noise floor, and no pixel significant.

    Under a point or parallel light the comparison has no noise, nor has an environment that is
    tabulated: what is left is rounding, some 1e-4 of the least that can be seen. In a sampled
    environment the mean over pixels may differ from the floor, itself an estimate from the same
    number of pixels, by a tenth.
    """
    options = Options(spp=64, resolution=(64, 64), everything=everything)
    result = compare(Source(name, EXACT[name]()), options)
    metric, significant = result.record.metrics["dE2000"], result.record.significant
    mean, floor = metric.mean, metric.noise_floor
    assert significant.fraction == 0
    assert not (result.images.significant == 1).any()
    if name == "constant" and everything:
        assert floor > 0.05
        assert mean == pytest.approx(floor, rel=0.1)
    else:
        assert floor < 1e-3
        assert mean < 1e-3


def test_the_spot_of_an_area_light_is_right_in_the_far_field(rgb):
    """The relative error falls as (size / distance)²: to a quarter when the distance doubles.

    The lamp faces the plane slightly askew. Where the light is found the irradiance is compared
    with Mitsuba's, averaged over its samples.
    """
    side = 1.0
    errors = []
    for distance in (2.0, 4.0, 8.0):
        lamp = {
            "type": "rectangle",
            "to_world": look_at((0.3 * distance, 0, distance), up=(0, 1, 0)).scale(side / 2),
            "emitter": {"type": "area", "radiance": 10.0},
        }
        description = scene(plane(), lamp, viewer=(0, -0.5, 1), fov=5.0, size=8)
        pair = halves.pair(Source("a lamp", description))
        heuristic = seen_by(pair.heuristic, 16, 0)[0].mean()
        physical = seen_by(pair.physical, 2048, 0, {"type": "direct_all"})[0].mean()
        errors.append(abs(heuristic / physical - 1))
    errors = np.array(errors)
    assert errors[0] > 0.01, "near by, the two should differ visibly"
    np.testing.assert_allclose(errors[:-1] / errors[1:], 4, rtol=0.25)
