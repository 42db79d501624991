"""The stand-ins of plotting libraries beside the libraries' own pictures, and in closed form."""

import math

import colour
import mitsuba as mi
import numpy as np
import pytest
from PIL import Image

from docs.engines import plotting as drawn
from fotismos.heuristic import plotting
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering.renderer import Renderer
from tests.shared.programs import ROOT

PICTURES = ROOT / "tests/heuristic/pictures"


def light_of(code):
    return colour.models.eotf_sRGB(np.asarray(code, float))


def rgb_value(values):
    return {"type": "rgb", "value": [float(value) for value in values]}


def surface(code):
    base = rgb_value(light_of(code))
    coefficients = {"k_a": base, "k_d": base, "k_s": drawn.HIGHLIGHT, "n": float(drawn.EXPONENT)}
    return {"type": "phong", **coefficients}


def scene(sensor, half_edge, lights):
    turned = mi.ScalarTransform4f().rotate([1, 0, 0], -90).scale(half_edge)
    film = {"type": "hdrfilm", "width": drawn.WIDTH, "height": drawn.HEIGHT}
    return {
        "type": "scene",
        "sensor": sensor | {"film": film | {"rfilter": {"type": "box"}}},
        "ball": {"type": "sphere", "center": [0, 1, 0], "bsdf": surface(drawn.BALL)},
        "floor": {"type": "rectangle", "to_world": turned, "bsdf": surface(drawn.FLOOR)},
        **lights,
    }


def image(content, model, ambient=0.0):
    integrator = {"type": "heuristic", "model": model, "ambient": ambient}
    return np.array(Renderer(mi.load_dict(content), mi.load_dict(integrator), 16, model).render(1))


def in_perspective(model, ambient):
    """The image of a stand-in, from where VTK, MuJoCo and pygfx look."""
    view = mi.ScalarTransform4f().look_at([*drawn.EYE], [*drawn.TARGET], [0, 1, 0])
    sensor = {"type": "perspective", "fov": drawn.FOV, "fov_axis": "y", "to_world": view}
    lights = {
        f"lamp{number}": {"type": "heuristic_point"}
        | {"position": [*map(float, position)], "intensity": rgb_value(intensity)}
        for number, (position, intensity) in enumerate(drawn.LIGHTS.items())
    }
    return image(scene(sensor, 4, lights), model, ambient)


def without_perspective():
    """The images of matplotlib's stand-in, side by side."""
    elevation = math.radians(drawn.ELEVATION)
    eye = [0, 20 * math.sin(elevation), 20 * math.cos(elevation)]
    view = mi.ScalarTransform4f().look_at(eye, [0, 0, 0], [0, 1, 0])
    sensor = {"type": "orthographic", "to_world": view.scale(drawn.WIDTH / 2 / drawn.SCALE)}
    lamps = [
        {"type": "heuristic_directional", "direction": [-float(part) for part in position]}
        for position in drawn.LIGHTS
    ]
    return np.hstack([image(scene(sensor, 3, {"lamp": lamp}), "matplotlib") for lamp in lamps])


def difference(linear, name):
    """The mean ΔE2000 between an image and a library's picture, over all pixels and over a hit."""
    shown = np.asarray(Image.open(PICTURES / f"{name}.png").convert("RGB")) / 255
    pair = light_of(shown), np.clip(linear, 0, 1)
    one, other = (
        colour.XYZ_to_Lab(colour.sRGB_to_XYZ(each, apply_cctf_decoding=False)) for each in pair
    )
    error = colour.delta_E(one, other, method="CIE 2000")
    return error.mean(), error[shown.any(axis=-1)].mean()


@pytest.mark.parametrize("name", ["vtk", "mujoco", "pygfx"])
def test_a_stand_in_shows_what_the_library_draws(name, rgb):
    linear = in_perspective(name, drawn.AMBIENT if name == "vtk" else 0.0)
    everywhere, on_surfaces = difference(linear, name)
    assert everywhere < 0.5
    assert on_surfaces < 0.8
    # The test can fail: other stand-ins are farther off.
    others = {"vtk", "mujoco", "pygfx"} - {name}
    assert all(difference(linear, other)[0] > 2 for other in others)


def test_the_stand_in_of_matplotlib_shows_what_it_draws_under_each_light(rgb):
    """Most of what is left is the floor's edge, which matplotlib cuts by two pixels."""
    assert max(difference(without_perspective(), "matplotlib")) < 0.8


def test_codes_are_those_of_srgb(rgb):
    light = np.array([0, 0.001, 0.0031308, 0.02, 0.5, 1], np.float32)
    codes = np.array(plotting.code(mi.Float(light)))
    np.testing.assert_allclose(codes, colour.models.eotf_inverse_sRGB(light), atol=2e-6)
    np.testing.assert_allclose(plotting.light_of(mi.Float(codes)), light, atol=2e-6)
    np.testing.assert_allclose(plotting.light_of(mi.Float([-1, 2])), [0, 1], atol=1e-6)


def test_a_stand_in_refuses_wavelengths(spectral):
    with pytest.raises(InputError, match="has wavelengths in place of RGB"):
        in_perspective("vtk", 0.0)
