"""Pixels where the reference is at fault: masks and counts, in arrays and in scenes."""

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest

from comparisons.reference_limits import SMALLEST_ALPHA, Surfaces, find, fireflies, of_scene

SIDE = 32
UP = np.broadcast_to([0.0, 0.0, 1.0], (SIDE, SIDE, 3))
GREY = np.full((SIDE, SIDE, 3), 0.5)


@pytest.fixture
def plain():
    """A surface without any limit, seen and lit from above."""
    return Surfaces(
        hit=np.ones((SIDE, SIDE), bool),
        alpha=np.full((SIDE, SIDE), np.inf),
        albedo=np.ones((SIDE, SIDE)),
        shading=UP,
        geometric=UP,
        view=UP,
        lights=(UP,),
    )


def noise(seed=0, size=0.01):
    return np.abs(np.random.default_rng(seed).normal(size=GREY.shape)) * size


def test_a_surface_without_limits_has_none(plain):
    limits = find(plain, GREY, noise())
    assert limits.data() == {
        "clamped": 0, "terminator": 0, "energy_loss": 0, "fireflies": 0, "any": 0
    }  # fmt: skip


def test_alpha_at_mitsubas_smallest_is_clamped_and_above_it_not(plain):
    alpha = plain.alpha.copy()
    alpha[0, :3] = SMALLEST_ALPHA, 1e-6, 1.01 * SMALLEST_ALPHA
    limits = find(replace(plain, alpha=alpha), GREY, noise())
    assert limits.data()["clamped"] == 2
    assert limits.clamped[0, :3].tolist() == [True, True, False]


@pytest.mark.parametrize("which", ["view", "light"])
def test_normals_that_disagree_about_light_or_viewer_are_a_terminator(plain, which):
    tilted = UP.copy()
    tilted[4, 5] = 0.8, 0.0, 0.6
    grazing = UP.copy()
    grazing[4, 5] = -0.96, 0.0, 0.28  # above the surface, and below for the tilted normal
    changed = {"view": grazing} if which == "view" else {"lights": (grazing,)}
    limits = find(replace(plain, shading=tilted, **changed), GREY, noise())
    assert limits.data()["terminator"] == 1
    assert limits.terminator[4, 5]
    assert not find(replace(plain, shading=tilted), GREY, noise()).terminator.any()


def test_a_surface_that_loses_light_is_marked(plain):
    albedo = plain.albedo.copy()
    albedo[:2] = 0.74
    albedo[2] = 0.985
    assert find(replace(plain, albedo=albedo), GREY, noise()).data()["energy_loss"] == 2 * SIDE


def test_a_pixel_whose_light_came_in_one_pass_is_a_firefly():
    """Of 16 passes, in steady noise and in noise of its own size."""
    rng = np.random.default_rng(1)
    passes = 0.5 + 0.05 * rng.normal(size=(16, SIDE, SIDE, 3))
    passes[7, 10, 20] = 100.0
    mean, error = passes.mean(axis=0), passes.std(axis=0, ddof=1) / 4
    assert np.argwhere(fireflies(mean, error)).tolist() == [[10, 20]]
    noisy = rng.exponential(size=(16, SIDE, SIDE, 3)) ** 2  # everywhere
    assert not fireflies(noisy.mean(axis=0), noisy.std(axis=0, ddof=1) / 4).any()


def test_pixels_that_do_not_count_are_not_marked(plain):
    nothing = np.zeros((SIDE, SIDE), bool)
    bad = replace(plain, alpha=np.zeros((SIDE, SIDE)), albedo=np.zeros((SIDE, SIDE)))
    assert find(bad, GREY, noise(), nothing).data()["any"] == 0
    assert find(bad, GREY, noise()).data()["any"] == SIDE**2


def scene(bsdf, shape=None):
    return mi.load_dict(
        {
            "type": "scene",
            "sensor": {
                "type": "perspective", "fov": 40.0,
                "to_world": mi.ScalarTransform4f().look_at((-3, 0, 1), (0, 0, 0), (0, 0, 1)),
            },
            "shape": {"type": "sphere", **(shape or {}), "bsdf": bsdf},
            "light": {"type": "point", "position": (-4, 0, 0), "intensity": 10.0},
            "spot": {
                "type": "spot",
                "to_world": mi.ScalarTransform4f().look_at((0, 0, 3), (0, 0, 0), (0, 1, 0)),
            },
        },
        optimize=False,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("alpha", "expected"),
    [
        (1e-5, {"clamped": True, "energy_loss": False}),
        (0.05, {"clamped": False, "energy_loss": False}),
        (0.5, {"clamped": False, "energy_loss": True}),
    ],
)
@pytest.mark.parametrize("twosided", [False, True])
def test_a_scenes_roughplastic_is_read(rgb, alpha, expected, twosided):
    bsdf = {"type": "roughplastic", "alpha": alpha, "diffuse_reflectance": 0.2}
    bsdf = {"type": "twosided", "bsdf": bsdf} if twosided else bsdf
    surfaces = of_scene(scene(bsdf), SIDE, SIDE)
    limits = find(surfaces, GREY, noise())
    assert 0.2 < surfaces.hit.mean() < 0.9
    for name, everywhere in expected.items():
        np.testing.assert_array_equal(getattr(limits, name), surfaces.hit & everywhere)
    assert len(surfaces.lights) == 2
    assert not limits.terminator.any(), "a sphere's two normals are one"


def test_other_materials_have_no_limit(rgb):
    surfaces = of_scene(scene({"type": "diffuse", "reflectance": 1.0}), SIDE, SIDE)
    assert find(surfaces, GREY, noise()).data()["any"] == 0


def test_a_coarse_mesh_with_smooth_normals_has_a_terminator(rgb):
    """Where the interpolated normal still sees the light and the face does not, or not yet."""
    from heuristic import meshes

    smooth = mi.load_dict({"type": "sphere", "bsdf": {"type": "diffuse"}})
    mesh = meshes.to_mesh(smooth, 3)
    description = {
        "type": "scene",
        "sensor": {
            "type": "perspective", "fov": 40.0,
            "to_world": mi.ScalarTransform4f().look_at((0, -4, 0), (0, 0, 0), (0, 0, 1)),
        },
        "shape": mesh,
        "light": {"type": "point", "position": (5, 0, 0), "intensity": 10.0},
    }  # fmt: skip
    surfaces = of_scene(mi.load_dict(description, optimize=False), 64, 64)
    big = np.full((64, 64, 3), 0.5)
    marked = find(surfaces, big, 0 * big).terminator
    assert 0.005 < marked[surfaces.hit].mean() < 0.5
