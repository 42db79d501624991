"""Shadows from depth images of the lamps, against the integrator's own shadow rays."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from comparisons.gallery.builtin import SCENES
from heuristic.stand_ins import light_maps
from reference.pairing.halves import pair
from tests.test_stand_ins import image, looking

LAMPS = {
    "point": {"type": "heuristic_point", "position": (0.8, -0.7, 2.5)},
    "spot": {
        "type": "heuristic_spot",
        "position": (0.8, -0.7, 2.5),
        "direction": (-0.3, 0.3, -1),
        "cutoff": 40.0,
    },
    "directional": {"type": "heuristic_directional", "direction": (-0.4, 0.3, -1)},
}


def still_life(*lamps):
    """A cube and a ball on a floor under lamps."""
    bsdf = {"type": "phong", "k_d": 0.5, "k_s": 0.3, "n": 10}
    place = mi.ScalarTransform4f()
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "heuristic"},
            "sensor": looking((-0.7, -2.2, 2.2), (0, 0.3, 0), size=128, fov=50.0),
            "floor": {"type": "rectangle", "to_world": place.scale(3), "bsdf": bsdf},
            "cube": {"type": "cube", "to_world": place.translate((-0.6, 0.4, 0.3)).scale(0.3)}
            | {"bsdf": bsdf},
            "ball": {"type": "sphere", "center": (0.5, 0, 0.8), "radius": 0.35, "bsdf": bsdf},
        }
        | {name: LAMPS[name] for name in lamps}
    )


def wrong(scene, resolution):
    """The share of pixels whose centre a hard shadow map shades otherwise than rays do."""
    rays = image(scene, "phong", 1, occlusion=True)
    found = image(scene, "shadow-map", 1, resolution=resolution)
    return np.mean(np.any(abs(found - rays) > 1e-4, axis=2))


@pytest.mark.parametrize("lamps", [("point",), ("spot",), ("directional",), tuple(LAMPS)])
def test_errors_lie_along_edges_and_fall_with_the_resolution(rgb, lamps):
    """An edge is as wide as a texel: eight times the resolution, an eighth of the pixels."""
    scene = still_life(*lamps)
    coarse, fine = (wrong(scene, resolution) for resolution in (32, 256))
    assert coarse > 0.01
    assert fine < 0.35 * coarse
    assert fine < 0.01 * len(lamps)


def test_there_are_shadows_to_be_found(rgb):
    scene = still_life("point")
    lit, hidden = (image(scene, "phong", 1, occlusion=shadows) for shadows in (False, True))
    assert np.mean(np.any(abs(lit - hidden) > 0.01, axis=2)) > 0.02


@pytest.mark.parametrize("name", ["cornell-box", "plastic-spheres"])
def test_a_lamp_on_a_shape_is_not_hidden_by_it(rgb, name):
    scene = pair(SCENES[name].source(), resolution=(48, 48)).heuristic.instantiate()
    assert wrong(scene, 512) < 0.015


def leaning(angle, kind):
    """A plane alone, which a lamp meets at an angle to its normal."""
    toward = np.array((np.sin(angle), 0, np.cos(angle)))
    lamp = {"type": "heuristic_directional", "direction": (-toward).tolist()}
    if kind == "point":
        lamp = {"type": "heuristic_point", "position": (4 * toward).tolist()}
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "heuristic"},
            "sensor": looking((0, -3, 3), (0, 0, 0), size=64),
            "floor": {"type": "rectangle", "bsdf": {"type": "phong", "k_d": 0.5}},
            "lamp": lamp,
        }
    )


@pytest.mark.parametrize("kind", ["point", "directional"])
@pytest.mark.parametrize("model", ["shadow-map", "soft-shadow-map"])
def test_no_plane_hides_itself_with_the_bias_that_is_given(rgb, kind, model):
    for angle in np.deg2rad((0, 30, 60, 80, 87)):
        scene = leaning(float(angle), kind)
        for resolution in (32, 256):
            found = image(scene, model, 1, resolution=resolution)
            np.testing.assert_allclose(found, image(scene, "phong", 1), rtol=1e-5)


def test_without_a_bias_planes_hide_themselves(rgb):
    scene = leaning(np.deg2rad(60), "point")
    found, plain = (image(scene, "shadow-map", 1, bias=0.0), image(scene, "phong", 1))
    assert np.mean(found < 0.5 * plain) > 0.1


def test_a_filter_has_the_mean_of_rays_and_softens_edges(rgb):
    scene = still_life("directional")
    rays, soft = image(scene, "phong", 16, occlusion=True), image(scene, "soft-shadow-map", 16)
    assert soft.mean() == pytest.approx(rays.mean(), rel=0.02)
    between = image(scene, "soft-shadow-map", 1, radius=8.0)
    lit, dark = image(scene, "phong", 1), image(scene, "phong", 1, occlusion=True)
    half = np.all((between < 0.95 * lit) & (between > dark + 0.05 * lit), axis=2)
    assert half.mean() > 0.02
    assert (between <= lit + 1e-5).all()


def test_an_edge_is_a_ramp_as_wide_as_the_filter(rgb):
    """A roof over half of a floor, under light from straight above."""
    bsdf = {"type": "phong", "k_d": 1.0, "twosided": True}
    roof = mi.ScalarTransform4f().translate((-1, 0, 0.5))
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "heuristic"},
            "sensor": looking((0.5, -3, 0.45), (0.2, 0, 0)),
            "floor": {"type": "rectangle", "bsdf": bsdf},
            "roof": {"type": "rectangle", "to_world": roof, "bsdf": bsdf},
            "lamp": {"type": "heuristic_directional", "direction": (0, 0, -1)},
        }
    )
    size, taps, radius = 256, 4, 8.0
    (emitter,) = (e for e in scene.emitters() if hasattr(e, "light"))
    lamp = emitter.light(dr.zeros(mi.SurfaceInteraction3f))
    depths = light_maps.light_map(scene, lamp, size)
    width = float(depths.texel(mi.Float(1.0))[0])
    x = np.linspace(-12, 12, 97) * width
    offset = depths.offset(mi.Point3f(mi.Float(x), 0.1, 0.0))
    places = [radius * (2 * (tap + 0.5) / taps - 1) for tap in range(taps)]
    frame = mi.Frame3f(mi.Vector3f(0, 0, 1))
    lit = sum(
        np.array(depths.distance(offset) * 0.999 <= depths.depth(offset, (frame.s, frame.t), u, v))
        for u in places
        for v in places
    )
    share = lit / taps**2
    # Which of the map's axes is which does not matter: a row of taps is as wide as a column.
    expected = np.clip(0.5 + x / width / (2 * radius), 0, 1)
    assert abs(share - expected).max() <= 1 / taps + 1e-6
    assert share[0] == 0
    assert share[-1] == 1


@pytest.mark.parametrize("variant", ["llvm_ad_mono", "llvm_ad_spectral"], indirect=True)
def test_other_variants_have_the_same_shadows(variant):
    scene = still_life("point", "directional")
    rays, found = image(scene, "phong", 4, occlusion=True), image(scene, "shadow-map", 4)
    assert np.mean(np.any(abs(found - rays) > 1e-3, axis=2)) < 0.05
