"""Approximations of light transport: closed forms, Mitsuba's path, and the kernel's shadow rays."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.heuristic import indirect_light, shadow_maps, tessellation
from fotismos.heuristic.errors import InputError
from fotismos.reference.pairing.halves import PairOptions, pair
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reference.scene.source import Source
from tests.shared.parts import camera, moved
from tests.shared.sky import sky_above, two_colours

AMBIENT = "hemisphere-ambient"


def image(scene, model, spp=4, **parameters):
    """Render the heuristic half of a scene with a model."""
    integrator = {"type": "heuristic", "model": model, **parameters}
    return np.array(Renderer(scene, mi.load_dict(integrator), spp, model).render(1), float)


def integrating_sphere(k_d):
    """The inside of a sphere of radius 2 with a lamp in its middle."""
    wall = {"type": "phong", "k_d": k_d}
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": camera((0.5, 0.3, 0.1), (2, 0, 0), fov=80.0),
        "wall": {"type": "sphere", "radius": 2.0, "flip_normals": True, "bsdf": wall},
        "lamp": {"type": "heuristic_point", "k0": 0.0, "k2": 1.0}
        | {"intensity": {"type": "uniform", "value": 3.0}},
    }


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_mono"], indirect=True)
def test_an_integrating_sphere_has_the_light_of_its_closed_form(variant):
    """It is lit alike everywhere, so ``I = rho (I_p + I)`` and ``I = I_p rho / (1 - rho)``."""
    scene = mi.load_dict(integrating_sphere(0.5))
    (_, arriving, k_d), (_, again, _) = (indirect_light.gather(scene) for _ in range(2))
    mean = indirect_light.weighted_mean(arriving, k_d)
    np.testing.assert_allclose(mean, 3 / 4 * 0.5 / (1 - 0.5), rtol=0.01)
    np.testing.assert_allclose(k_d, 0.5, rtol=0.02)
    np.testing.assert_array_equal(arriving, again)


def test_the_mean_is_the_indirect_light_of_the_cornell_box(rgb):
    """Of the physical half by ``path``, whose lamp has an extent: a few percent."""
    found = pair(SCENES["cornell-box"].source(), PairOptions(resolution=(32, 32)))
    physical, half = found.physical.instantiate(), found.heuristic.instantiate()
    full, direct = (
        np.mean([mi.render(physical, integrator=path, spp=128, seed=s) for s in (1, 2)], 0)
        for path in (mi.load_dict({"type": "path", "max_depth": depth}) for depth in (-1, 2))
    )
    plain = image(half, "phong", 16, occlusion=True)
    added = image(half, AMBIENT, 16, occlusion=True) - plain
    np.testing.assert_allclose(
        added.mean(axis=(0, 1)), (full - direct).mean(axis=(0, 1)), rtol=0.07
    )


def test_an_environment_replaces_ambient_light_and_is_gathered_where_nothing_hides_it(rgb):
    """A sphere under an even sky receives it everywhere, whatever ``I_a`` says."""
    scene = mi.load_dict(sky_above(lambda toward: np.full((len(toward), 3), 0.25)))
    mean = indirect_light.weighted_mean(*indirect_light.gather(scene)[1:])
    assert mean == pytest.approx(0.25, rel=0.005)
    shown = image(scene, AMBIENT, ambient=9.0)[16, 16]
    assert shown == pytest.approx(0.25 * 0.8, rel=0.01)


def test_a_sun_counts_once_as_a_light_and_not_as_environment(rgb):
    """A white plane below ``sunsky`` is as bright as by Mitsuba's ``path``."""
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2, "hide_emitters": True},
        "sensor": camera((0, 0, 5), (0, 0, 0), fov=20.0, up=(0, 1, 0)),
        "plane": {"type": "rectangle", "bsdf": {"type": "diffuse", "reflectance": 0.5}},
        "sky": {"type": "sunsky", "sun_direction": (-0.5, -0.6, 0.6)},
    }
    expected = np.mean([mi.render(mi.load_dict(scene), spp=512, seed=s) for s in (1, 2)], 0)
    half = pair(Source("plane", scene), PairOptions()).heuristic.instantiate()
    found = image(half, AMBIENT, hide_emitters=True)
    np.testing.assert_allclose(found.mean((0, 1)), expected.mean((0, 1)), rtol=0.02)


def test_ambient_light_of_its_own_stays_without_an_environment(rgb):
    given = sky_above(two_colours)
    del given["sky"]
    scene = mi.load_dict(given)
    plain = image(scene, "phong", ambient=2.0)
    assert plain.max() == pytest.approx(1.6)
    np.testing.assert_allclose(image(scene, AMBIENT, ambient=2.0), plain, atol=1e-6)


def test_sky_and_ground_are_found_again(rgb):
    prepared = indirect_light.fitted_sky(mi.load_dict(sky_above(two_colours)))
    assert list(prepared[2]) == [0, 0, 1]
    for side, end in zip(prepared, (1, -1), strict=False):
        (expected,) = two_colours(np.array([(0, 0, end)]))
        np.testing.assert_allclose(np.ravel(side), expected, rtol=0.08, atol=0.01)


def test_a_fit_keeps_the_mean_and_is_not_negative():
    random = np.random.default_rng(3)
    for case in range(200):
        count = int(random.integers(1, 40))
        normal = random.normal(size=(count, 3)) if case % 3 else np.ones((count, 3))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        arriving, k_d = random.random((2, count, 3)) ** 4
        k_d *= random.random((count, 3)) < 0.8
        sky, ground = indirect_light.fit(normal, arriving, k_d, np.array((0.0, 0.0, 1.0)))
        assert min(sky.min(), ground.min()) >= 0
        fitted = sky * (1 + normal[:, 2:]) / 2 + ground * (1 - normal[:, 2:]) / 2
        means = [indirect_light.weighted_mean(light, k_d) for light in (fitted, arriving)]
        np.testing.assert_allclose(*means, rtol=1e-6, atol=1e-9)


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
    return mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "heuristic"},
            "sensor": camera((-0.7, -2.2, 2.2), (0, 0.3, 0), size=128, fov=50.0),
            "floor": {"type": "rectangle", "to_world": moved(0, 3), "bsdf": bsdf},
            "cube": {"type": "cube", "to_world": moved((-0.6, 0.4, 0.3), 0.3)} | {"bsdf": bsdf},
            "ball": {"type": "sphere", "center": (0.5, 0, 0.8), "radius": 0.35, "bsdf": bsdf},
        }
        | {name: LAMPS[name] for name in lamps}
    )


def wrong(scene, resolution):
    """The share of pixels whose centre a hard shadow map shades otherwise than rays do."""
    rays = image(scene, "phong", 1, occlusion=True)
    found = image(scene, "shadow-map", 1, resolution=resolution)
    return np.mean(np.any(abs(found - rays) > 1e-4, axis=2))


def test_errors_lie_along_edges_and_fall_with_the_resolution(rgb):
    """An edge is as wide as a texel: eight times the resolution, an eighth of the pixels."""
    for lamps in (("point",), ("spot",), ("directional",), tuple(LAMPS)):
        scene = still_life(*lamps)
        coarse, fine = (wrong(scene, resolution) for resolution in (32, 256))
        assert coarse > 0.01
        assert fine < min(0.35 * coarse, 0.01 * len(lamps)), lamps


def test_a_lamp_on_a_shape_is_not_hidden_by_it(rgb):
    for name in ("cornell-box", "plastic-spheres"):
        scene = pair(
            SCENES[name].source(), PairOptions(resolution=(48, 48))
        ).heuristic.instantiate()
        assert wrong(scene, 512) < 0.015, name


def test_no_plane_hides_itself_with_the_default_bias(rgb):
    """A plane alone, which a lamp meets at many angles; without a bias it would hide itself."""

    def floor_under(kind, angle):
        toward = np.array((np.sin(angle), 0, np.cos(angle)))
        place = {"directional": {"direction": -toward}, "point": {"position": 4 * toward}}[kind]
        lamp = {name: value.tolist() for name, value in place.items()}
        return mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "heuristic"},
                "sensor": camera((0, -3, 3), (0, 0, 0), size=64),
                "floor": {"type": "rectangle", "bsdf": {"type": "phong", "k_d": 0.5}},
                "lamp": {"type": f"heuristic_{kind}"} | lamp,
            }
        )

    for kind in ("point", "directional"):
        for angle in np.deg2rad((0, 60, 87)):
            scene = floor_under(kind, float(angle))
            plain = image(scene, "phong", 1)
            found = image(scene, "shadow-map", 1, resolution=32)
            np.testing.assert_allclose(found, plain, rtol=1e-5)
    scene = floor_under("point", float(np.deg2rad(60)))
    bare = image(scene, "shadow-map", 1, bias=0.0)
    assert np.mean(bare < 0.5 * image(scene, "phong", 1)) > 0.1


def test_a_scene_without_lamps_or_with_too_many_is_refused_with_the_reason(rgb):
    for count, reason in (
        (0, "it has no lamp"),
        (17, "it has 17 lamps, and at most 16 get a depth image"),
    ):
        given = integrating_sphere(0.5)
        lamp = given.pop("lamp")
        scene = mi.load_dict(given | {f"lamp{i}": lamp for i in range(count)})
        with pytest.raises(
            InputError, match=f"heuristic shadow-map cannot shade this scene: {reason}"
        ):
            image(scene, "shadow-map")


def test_vertices_and_faces_are_shaded_too_and_later_passes_replay_the_first(rgb):
    given = sky_above(two_colours, ambient=0.25)
    given["lamp"] = {"type": "heuristic_directional", "direction": (1, 2, -1)}
    scene = mi.load_dict(given)
    given["ball"] = tessellation.to_mesh(mi.load_dict(given["ball"]), 24)
    polygons = mi.load_dict(given)
    for model in (AMBIENT, "shadow-map"):
        integrator = mi.load_dict({"type": "heuristic", "model": model})
        renderer = Renderer(scene, integrator, 2, model)
        for seed in (1, 2, 3):
            smooth = np.array(renderer.render(seed))
            again = mi.render(scene, integrator=renderer.integrator, spp=2, seed=seed)
            np.testing.assert_array_equal(smooth, np.array(again))
        assert renderer._replayed is not None
        for interpolation in ("flat", "gouraud"):
            found = image(polygons, model, interpolation=interpolation)
            assert found.mean() == pytest.approx(smooth.mean(), rel=0.03), (model, interpolation)


def test_a_prepared_parameter_prepares_again_where_it_changes(rgb, monkeypatch):
    resolutions, right = [], shadow_maps.light_map
    monkeypatch.setattr(
        shadow_maps, "light_map", lambda *given: resolutions.append(given[2]) or right(*given)
    )
    scene = integrating_sphere(0.5)
    scene["integrator"] = {"type": "heuristic", "model": "shadow-map", "resolution": 32.0}
    scene = mi.load_dict(scene)
    for resolution in (32.0, 64.0):
        parameters = mi.traverse(scene)
        parameters["integrator.resolution"] = resolution
        parameters.update()
        for _ in range(2):
            mi.render(scene, spp=1)
    assert resolutions == [32, 64]
    assert scene.integrator().preparation > 0
