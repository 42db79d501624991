"""Light by way of mirrors, glass and masks: `direct_all` against Mitsuba's `path`.

No sample of a light takes the one direction that such a surface demands, so that a light found
there counts in full. Samples are independent: Mitsuba's multijitter is biased where paths are long.
"""

import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from fotismos.reference.rendering.passes import Stream, pass_seed
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reference.rendering.sums import Accumulator
from tests.shared.misplanned import scene as described
from tests.shared.parts import moved

SIDE, SPP, PASSES = 24, 256, 8

BALLS = {
    "mirror": {"type": "conductor", "material": "none"},
    "glass": {"type": "dielectric", "int_ior": 1.5},
    "thin glass": {"type": "thindielectric", "int_ior": 1.5},
    "smooth plastic": {"type": "plastic", "diffuse_reflectance": 0.5},
    "null": {"type": "null"},
    "mask": {"type": "mask", "opacity": 0.4, "bsdf": {"type": "diffuse", "reflectance": 0.5}},
}


IN_EVERY_RUN = {
    ("mirror", "area"), ("glass", "constant"), ("mask", "point"), ("smooth plastic", "area"),
}  # fmt: skip
LIGHTS = {"mirror": ("area", "constant"), "glass": ("area", "constant"), "mask": ("area", "point")}
"""Of the others a lamp alone: no ray finds a point, and rays find the sky as they find a lamp."""
CASES = [
    pytest.param(ball, light, marks=() if (ball, light) in IN_EVERY_RUN else pytest.mark.thorough)
    for ball in BALLS
    for light in LIGHTS.get(ball, ("area",))
]


def _scene(ball, light):
    """A ball in a room: closed about a lamp or a point, and a floor alone under the sky."""
    down = moved((0, 0, 1.9)).rotate((1, 0, 0), 180).scale(0.5)
    lights = {
        "area": {
            "type": "rectangle", "to_world": down, "emitter": {"type": "area", "radiance": 8.0},
        },
        "constant": {"type": "constant", "radiance": 1.0},
        "point": {"type": "point", "position": (0.3, -0.4, 1.5), "intensity": 6.0},
    }  # fmt: skip
    room = {"type": "cube", "flip_normals": True, "to_world": moved(0, 2)}
    floor = {"type": "rectangle", "to_world": moved((0, 0, -2), 2)}
    return described(
        (1.5, -1.7, 0.6),
        lens={"fov": 70.0, "sampler": {"type": "independent"}},
        size=SIDE,
        ball={"type": "sphere", "radius": 0.8, "bsdf": BALLS[ball]},
        light=lights[light],
        room=(floor if light == "constant" else room)
        | {"bsdf": {"type": "diffuse", "reflectance": 0.6}},
    )


def _estimate(made, integrator, stream):
    renderer = Renderer(made, mi.load_dict(integrator), SPP, "a test")
    total = Accumulator()
    for number in range(PASSES):
        image = np.array(renderer.render(pass_seed(3, number, stream)))
        total.add(mi.TensorXf(image.mean(axis=(0, 1), keepdims=True)))
    return total.estimate()


@pytest.mark.guarantee(
    "reference", "Light through a mirror or glass counts as in Mitsuba's `path`."
)
@pytest.mark.parametrize(("ball", "light"), CASES)
def test_a_light_found_by_way_of_a_ball_counts_as_in_mitsubas_path(rgb, ball, light):
    """Means of the whole image; the test rejects once in a thousand times."""
    made = mi.load_dict(_scene(ball, light))
    ours, theirs = (
        _estimate(made, {"type": kind, "max_depth": 8}, stream)
        for kind, stream in (("direct_all", Stream.COMPARED), ("path", Stream.OTHER_SIDE))
    )
    difference = (ours.mean - theirs.mean).mean()
    error = np.hypot(ours.standard_error, theirs.standard_error).mean()
    assert error < 0.01 * theirs.mean.mean(), "the noise hides a departure of a few per cent"
    t = abs(difference) / error
    assert t < stats.t.isf(0.0005, PASSES - 1), (
        f"{difference / theirs.mean.mean():+.2%}, t = {t:.1f}"
    )


def test_without_shadows_a_mirror_still_shows_the_lamp(rgb):
    """Only its own ray finds the lamp there, whatever is said about the rays of other surfaces."""
    made = mi.load_dict(_scene("mirror", "area"))
    brightest = {}
    for samples in (0, 1):
        integrator = {"type": "direct_all", "shadows": False, "bsdf_samples": samples}
        image = np.array(mi.render(made, integrator=mi.load_dict(integrator), spp=256, seed=1))
        brightest[samples] = image.max()
    assert brightest[0] == pytest.approx(brightest[1], rel=0.1)
    assert brightest[0] > 2
