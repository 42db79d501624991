"""Lights in scenes with occluders, by the thousands, and against closed forms."""

import drjit as dr
import numpy as np
import pytest

import fotismos
from fotismos.heuristic import kernel
from tests.shared import checks, oracle
from tests.shared.parts import camera, moved, rgb_of

COLOUR = rgb_of(1.0, 0.8, 0.6)
PLACE = {"position": (-4.24, -1, 3), "intensity": COLOUR}
AXIS = {"direction": (4.24, 1, -3)}
LIGHTS = {
    "point": {"type": "heuristic_point", **PLACE},
    "attenuated point": {"type": "heuristic_point", **PLACE, "k0": 0.5, "k1": 0.1, "k2": 0.05},
    "clamped point": {
        "type": "heuristic_point", **PLACE, "k0": 0.1, "k2": 0.02, "clamped": True
    },
    "directional": {"type": "heuristic_directional", **AXIS, "intensity": COLOUR},
    "spot": {"type": "heuristic_spot", **PLACE, **AXIS, "cutoff": 20.0},
    "fading spot": {
        "type": "heuristic_spot", **PLACE, **AXIS, "cutoff": 20.0, "exponent": 5.0, "k2": 0.05
    },
}  # fmt: skip


def with_occluders(light, occlusion=True, **sphere):
    """A sphere and a small ball over a floor, each of another material."""
    bsdf, dark, even = (
        {"type": "phong", "k_d": k_d, "k_s": k_s, "n": n}
        for k_d, k_s, n in ((rgb_of(0.5, 0.3, 0.2), 0.4, 9), (0.2, 0.5, 3), (0.5, 0.2, 20))
    )
    ball = {"center": (-1.5, -0.8, 0.6), "radius": 0.4}
    return {
        "type": "scene",
        "integrator": {"type": "heuristic", "occlusion": occlusion},
        "sensor": camera((-3, 0, 1), fov=45.0),
        "sphere": {"type": "sphere", "bsdf": {**bsdf, **sphere}},
        "ball": {"type": "sphere", "bsdf": dark, **ball},
        "floor": {"type": "rectangle", "to_world": moved((0, 0, -1), 5), "bsdf": even},
        "light": light,
    }


@pytest.mark.parametrize(
    "variant",
    ["llvm_ad_rgb", pytest.param("llvm_ad_spectral", marks=pytest.mark.thorough)],
    indirect=True,
)
def test_kernel_and_plugins_agree_on_every_pixel_with_occluders(variant):
    lobes = [{"form": "blinn"}, {"form": "blinn", "normalised": True}, {"normalised": True}]
    cases = [(light, {}) for light in LIGHTS] + [("point", lobe) for lobe in lobes]
    for light, lobe in cases:
        scene = checks.with_film(with_occluders(LIGHTS[light], **lobe), 48, 4)
        shaded = checks.render(scene, 4, 3)
        path = {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0}
        direct = checks.render(scene, 4, 3, path)
        assert (direct[24:, 12:36] == 0).any(), "there should be a shadow to disagree on"
        oracle.require_close(shaded, direct, relative=1e-5, absolute=2.0**-23)


def test_a_surface_without_a_density_is_black(rgb):
    """Mitsuba's `roughplastic` has the density NaN where it reflects nothing, as from behind."""
    black = {"type": "roughplastic", "diffuse_reflectance": 0.0, "specular_reflectance": 0.0}
    lamp = {"type": "rectangle", "to_world": moved((0, 0, 2)).rotate((1, 0, 0), 180)}
    for bsdf, below in ((black, 1), (black | {"diffuse_reflectance": 0.5}, -1)):
        scene = {
            "type": "scene",
            "sensor": camera((0, -3, 2 * below), size=16),
            "floor": {"type": "rectangle", "bsdf": bsdf},
            "lamp": lamp | {"emitter": {"type": "area", "radiance": 3.0}},
        }
        for name in ("direct_all", "path"):
            image = checks.render(scene, 4, 1, {"type": name, "hide_emitters": True})
            assert not image.any(), name


def test_what_lies_behind_masks_adds_its_light_if_it_is_asked_for(rgb):
    """``L1 + T1 L2 + T1 T2 L3``, each of a surface alone, with a lamp that is sampled."""
    layers = {}
    for name, height, opacity, reflectance in (
        ("first", 1.0, 0.4, 0.8), ("second", 0.5, 0.7, 0.5), ("wall", 0.0, 1.0, 0.3)
    ):  # fmt: skip
        diffuse = {"type": "diffuse", "reflectance": reflectance}
        mask = {"type": "mask", "opacity": opacity, "nested": diffuse}
        layers[name] = {"type": "rectangle", "to_world": moved((0, 0, height), 4), "bsdf": mask}
    lamp = {
        "type": "rectangle",
        "to_world": moved((3, 0, 4)).rotate((0, 1, 0), 180),
        "emitter": {"type": "area", "radiance": 20.0},
    }
    view = {"type": "scene", "sensor": camera((0, 0, 6), up=(0, 1, 0), size=8), "lamp": lamp}
    direct_all = {"type": "direct_all", "shadows": False, "bsdf_samples": 0}

    def light(integrator, *names):
        scene = view | {name: layers[name] for name in names}
        return checks.render(scene, 1024, 3, integrator).mean()

    first, second, wall = (light(direct_all, name) for name in layers)
    assert min(first, second, wall) > 0.1
    expected = first + 0.6 * second + 0.6 * 0.3 * wall
    assert light(direct_all | {"looks_through": True}, *layers) == pytest.approx(expected, rel=0.01)
    assert light(direct_all, *layers) == pytest.approx(first, rel=0.01)


def many(count, seed=1):
    """Point, spot and directional lights in no order, of intensities that differ a thousandfold."""
    rng = np.random.default_rng(seed)
    made = []
    for number in range(count):
        position, direction = rng.normal(size=(2, 3))
        intensity = tuple(10.0 ** rng.uniform(-3, 0, 3))
        attenuation = [(1, 0, 0), (0.5, 0.1, 0.2)][number % 2]
        kind = number % 3
        own = {"specular_intensity": intensity[::-1]} if number % 5 == 1 else {}
        if kind == 0:
            light = oracle.Light(
                "point", intensity, tuple(4 * position), attenuation=attenuation, **own
            )
        elif kind == 1:
            light = oracle.Light("directional", intensity, direction=tuple(direction), **own)
        else:
            light = oracle.Light(
                "spot", intensity, tuple(4 * position), tuple(direction), 60.0, float(number % 4),
                attenuation, **own,
            )  # fmt: skip
        made.append(light)
    return made


@pytest.mark.parametrize("count", [kernel.BLOCK, kernel.BLOCK + 1, 150])
def test_any_number_of_lights_adds_up(count):
    points, lights = checks.random_points(4000), many(count)
    arrays = (points.position, points.normal, points.view)
    material = {"k_a": 0.1, "k_d": (0.5, 0.4, 0.1), "k_s": 0.7, "n": 9}
    expected = oracle.shade(*arrays, oracle.Material(**material), lights, 0.5)
    away = ~oracle.near_an_edge(points.position, points.normal, lights, 1e-6)
    for vector_type, tolerance in ((dr.llvm.Array3f64, 1e-12), (dr.llvm.Array3f, 4e-6)):
        found = fotismos.shade(
            *(vector_type(array.T) for array in arrays),
            fotismos.Material(**material),
            [checks.kernel_light(light) for light in lights],
            0.5,
        )
        largest = np.abs(expected).max()
        oracle.require_close(
            checks.as_rows(found), expected, absolute=tolerance * largest, where=away
        )


def test_many_lights_pass_gradients():
    position = dr.llvm.ad.Array3f([0, 0.5], [0, 0.1], [0, 0.2])
    k_d = dr.llvm.ad.Float(0.5)
    dr.enable_grad(k_d)
    lights = [fotismos.PointLight((x, 1.0, 3.0), 0.1) for x in np.linspace(-1, 1, 20)]
    up = dr.llvm.ad.Array3f(0, 0, 1)
    value = fotismos.shade(position, up, up, fotismos.Material(k_d=k_d), lights)
    dr.backward(dr.sum(value))
    assert dr.grad(k_d)[0] == pytest.approx(dr.sum(value)[0] / 0.5, rel=1e-5)


# -- Lights of two intensities (6.6, 6.8) ----------------------------------------------------------
