"""``phong`` with a transmittance: a share of the light passes, as through a mask."""

import mitsuba as mi
import numpy as np

from tests.shared.bsdfs import chi2, direction, elsewhere, interaction  # noqa: F401 a fixture
from tests.shared.parts import camera, moved

TRANSMITTANCE = [0.6, 0.4, 0.2]
CLEAR = {
    "k_d": 0.3, "k_s": 0.4, "n": 9, "twosided": True,
    "transmittance": {"type": "rgb", "value": TRANSMITTANCE},
}  # fmt: skip
COUNT = 200_000


def sampled(values, wi):
    """Return the mean weight of the samples that pass, and of the others, each with its error."""
    bsdf = mi.load_dict({"type": "phong", **values})
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(0, COUNT)
    si = interaction(wi, COUNT)
    bs, weight = bsdf.sample(mi.BSDFContext(), si, sampler.next_1d(), sampler.next_2d())
    passes = np.array(mi.has_flag(bs.sampled_type, mi.BSDFFlags.Null))
    assert np.all(np.abs(np.array(bs.wo)[:, passes].T + wi) < 1e-6)
    weight = np.array(weight)
    parts = [np.where(chosen, weight, 0) for chosen in (passes, ~passes)]
    return [(part.mean(axis=1), part.std(axis=1) / np.sqrt(COUNT)) for part in parts]


def test_samples_follow_the_density_and_pass_by_the_transmittance(rgb):
    for degrees in (35, 145):
        assert chi2(CLEAR, direction(degrees)).run(0.01)
        (passed, error), (reflected, noise) = sampled(CLEAR, direction(degrees))
        np.testing.assert_array_less(np.abs(passed - TRANSMITTANCE), 5 * error)
        opaque, other_noise = sampled(CLEAR | {"transmittance": 0.0}, direction(degrees))[1]
        np.testing.assert_array_less(np.abs(reflected - opaque), 5 * np.hypot(noise, other_noise))


def test_one_that_only_passes_is_not_there(rgb):
    (passing,), (nothing,) = (
        images({"type": "phong", "transmittance": 1.0}),
        images({"type": "null"}),
    )
    np.testing.assert_array_equal(passing, nothing)


def images(bsdf, count=1, **film):
    """Render a ball of the material over a floor, between a sky and a lamp."""
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 8},
        "sensor": camera((0, -6, 3), **film),
        "floor": {"type": "rectangle", "to_world": moved((0, 0, -1), 4)},
        "ball": {"type": "sphere", "bsdf": bsdf},
        "sky": {"type": "constant", "radiance": 0.3},
        "lamp": {
            "type": "sphere", "center": [3, -2, 4], "radius": 0.7,
            "emitter": {"type": "area", "radiance": 20.0},
        },
    }  # fmt: skip
    made = mi.load_dict(scene)
    return [np.array(mi.render(made, spp=64, seed=seed)) for seed in range(count)]
