"""Stand-ins in hard cases: on a lone ball, whatever is hard about it, each is plain shading.

Nothing hides light from a convex body, and none of it comes back: what a stand-in adds is nothing.
"""

import mitsuba as mi
import numpy as np
import pytest

from reference.rendering.renderer import Renderer
from tests.fuzzed_stand_ins import MODELS


def ball(scale=1.0, lamp=(2.0, -3.0, 3.0), intensity=10.0, **material):
    """A ball under a lamp, with lengths in units of ``scale``."""
    to_world = mi.ScalarTransform4f().look_at(
        [0, -4 * scale, 0], [0, 0, 0], [0, 0, 1]
    )  # fmt: skip
    film = {"type": "hdrfilm", "width": 16, "height": 16, "rfilter": {"type": "box"}}
    lens = {"near_clip": 0.01 * scale, "far_clip": 100 * scale}
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": {"type": "perspective", "fov": 35, "to_world": to_world, "film": film, **lens},
        "ball": {
            "type": "sphere",
            "radius": scale,
            "bsdf": {"type": "phong", "k_d": 0.5, "k_s": 0.4, "n": 9.0} | material,
        },
        "sky": {"type": "constant", "radiance": 1e-12},  # some stand-ins ask for one
        "lamp": {
            "type": "heuristic_point",
            "position": [scale * place for place in lamp],
            "intensity": intensity,
            "k0": 0.0,
            "k2": 1 / scale**2,
        },
    }


HARD = {
    "an exponent of 1e7": {"n": 1e7, "k_s": 0.9},
    "a lamp 1e5 away": {"lamp": (4e4, -6e4, 6e4), "intensity": 1e10},
    "a lamp next to the surface": {"lamp": (0.0, -1.001, 0.0), "intensity": 1e-4},
    "lengths of 1e-4": {"scale": 1e-4},
    "lengths of 1e5": {"scale": 1e5},
    "a white surface": {"k_d": 1.0, "k_s": 0.0},
    "a black surface": {"k_d": 0.0, "k_s": 0.0},
    "no light": {"intensity": 0.0},
}


@pytest.mark.parametrize(
    "variant",
    [
        "llvm_ad_rgb",
        pytest.param("llvm_ad_mono", marks=pytest.mark.slow),
        pytest.param("llvm_ad_spectral", marks=pytest.mark.slow),
    ],
    indirect=True,
)
@pytest.mark.parametrize("case", HARD)
def test_a_stand_in_adds_nothing_to_a_lone_ball(variant, case):
    scene = mi.load_dict(ball(**HARD[case]))

    def shown(model):
        integrator = mi.load_dict({"type": "heuristic", "model": model, "hide_emitters": True})
        return np.array(Renderer(scene, integrator, 4, model).render(1), float)

    plain = shown("phong")
    assert (plain.max() > 0) == (case not in ("a black surface", "no light"))
    for model in MODELS:
        found = shown(model)
        assert np.isfinite(found).all(), model
        assert found.min() >= 0, model
        # Maps have texels: at the terminator, where next to no light arrives, they may err.
        np.testing.assert_allclose(found, plain, atol=2e-3 * max(plain.max(), 1e-6), err_msg=model)
