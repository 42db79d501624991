"""Physics against closed forms: what an exact pair must give, on both sides."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.reference import Source
from fotismos.reference.pairing import halves
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


def mean_radiance(half, spp, integrator=None):
    """Return the mean of what the pixels of a half see."""
    made = half.instantiate()
    integrator = mi.load_dict(integrator) if integrator else made.integrator()
    return np.mean(mi.render(made, integrator=integrator, spp=spp, seed=0))


EXACT = {
    "point": lambda: SCENES["lambert-sphere"].make(),
    "directional": lambda: scene(
        sphere(), {"type": "directional", "direction": (2, 1, -1), "irradiance": 2.5}
    ),
    "constant": lambda: scene(sphere(), {"type": "constant", "radiance": 0.8}),
}


@pytest.mark.guarantee("pairing", "The halves of an exact pair differ by noise alone.")
@pytest.mark.parametrize(
    ("name", "everything"), [*((name, False) for name in EXACT), ("constant", True)]
)
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
        heuristic = mean_radiance(pair.heuristic, 16)
        physical = mean_radiance(pair.physical, 2048, {"type": "direct_all"})
        errors.append(abs(heuristic / physical - 1))
    errors = np.array(errors)
    assert errors[0] > 0.01, "near by, the two should differ visibly"
    np.testing.assert_allclose(errors[:-1] / errors[1:], 4, rtol=0.25)
