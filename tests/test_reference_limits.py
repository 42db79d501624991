"""Pixels where the reference is at fault: masks and counts, in arrays and in scenes."""

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest

from comparisons.departure.limits import (
    SMALLEST_ALPHA,
    WEDGE_LOST,
    Lights,
    Surfaces,
    find,
    fireflies,
    lights_of,
    of_scene,
    terminator,
)
from heuristic import tessellation
from reference.scene.source import Source

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
        position=np.zeros((SIDE, SIDE, 3)),
        shading=UP,
        geometric=UP,
        view=UP,
        lights=Lights(np.empty((0, 3)), UP[0, :1]),
    )


def noise(seed=0, size=0.01):
    return np.abs(np.random.default_rng(seed).normal(size=GREY.shape)) * size


def test_limits_of_plain_arrays_are_where_the_arrays_say(plain):
    assert not any(mask.any() for mask in find(plain, GREY, noise()).values())
    alpha, albedo = plain.alpha.copy(), plain.albedo.copy()
    alpha[0, :3] = SMALLEST_ALPHA, 1e-6, 1.01 * SMALLEST_ALPHA
    albedo[1], albedo[2] = 0.74, 0.985
    changed = replace(plain, alpha=alpha, albedo=albedo)
    limits = find(changed, GREY, noise())
    assert limits["clamped"][0, :3].tolist() == [True, True, False]
    counts = {name: int(mask.sum()) for name, mask in limits.items()}
    assert counts == {
        "clamped": 2, "terminator": 0, "energy_loss": SIDE, "fireflies": 0, "any": SIDE + 2
    }  # fmt: skip
    nothing = np.zeros((SIDE, SIDE), bool)
    assert not find(changed, GREY, noise(), nothing)["any"].any()


GRAZING = np.array([-0.96, 0.0, 0.28])
"""Above the surface, and below for the tilted normal."""
LIT_FROM = {
    "point": Lights(10 * GRAZING[None], np.empty((0, 3))),
    "direction": Lights(np.empty((0, 3)), GRAZING[None]),
    "all sides": Lights(np.empty((0, 3)), np.empty((0, 3)), surrounding=True),
}


@pytest.mark.parametrize("which", ["view", *LIT_FROM])
def test_normals_that_disagree_about_light_or_viewer_are_a_terminator(plain, which):
    tilted, grazing = UP.copy(), UP.copy()
    tilted[4, 5] = 0.8, 0.0, 0.6
    grazing[4, 5] = GRAZING
    changed = {"view": grazing} if which == "view" else {"lights": LIT_FROM[which]}
    both, normals = replace(plain, shading=tilted, **changed), replace(plain, shading=tilted)
    assert np.argwhere(terminator(both)).tolist() == [[4, 5]]
    assert not terminator(normals).any()
    assert not terminator(replace(plain, **changed)).any()


def test_under_light_from_all_sides_the_wedge_that_counts_is_a_hundredth(plain):
    tilted = UP.copy()
    for x, degrees in enumerate((11.0, 12.0)):
        angle = np.deg2rad(degrees)
        tilted[0, x] = np.sin(angle), 0, np.cos(angle)
    shaded = replace(plain, shading=tilted, lights=LIT_FROM["all sides"])
    assert np.argwhere(terminator(shaded)).tolist() == [[0, 1]]


def test_a_pixel_whose_light_came_in_one_pass_is_a_firefly():
    """Of 16 passes, in steady noise and in noise of its own size."""
    rng = np.random.default_rng(1)
    passes = 0.5 + 0.05 * rng.normal(size=(16, SIDE, SIDE, 3))
    passes[7, 10, 20] = 100.0
    mean, error = passes.mean(axis=0), passes.std(axis=0, ddof=1) / 4
    assert np.argwhere(fireflies(mean, error)).tolist() == [[10, 20]]
    noisy = rng.exponential(size=(16, SIDE, SIDE, 3)) ** 2  # everywhere
    assert not fireflies(noisy.mean(axis=0), noisy.std(axis=0, ddof=1) / 4).any()


# --- Materials of a scene ------------------------------------------------------------------------


def plastic(alpha, **more):
    return {"type": "roughplastic", "alpha": alpha, "diffuse_reflectance": 0.2, **more}


def blend(weight):
    """Diffuse, with a share of plastic that is too smooth."""
    parts = {"a": {"type": "diffuse"}, "b": plastic(1e-5)}
    return {"type": "blendbsdf", "weight": weight, **parts}


HALF = {"type": "checkerboard", "color0": 0.0, "color1": 1.0,
        "to_uv": mi.ScalarTransform4f().scale((1, 0.5, 1))}  # fmt: skip
"""1 on the first half of u, 0 on the second."""

MATERIALS = {
    "smooth": (plastic(1e-5), {"clamped"}),
    "sharp": (plastic(0.05), set()),
    "rough": (plastic(0.5), {"energy_loss"}),
    "two-sided": ({"type": "twosided", "bsdf": plastic(0.5)}, {"energy_loss"}),
    "front only": ({"type": "twosided", "a": plastic(0.5), "b": plastic(0.05)}, {"energy_loss"}),
    "diffuse": ({"type": "diffuse", "reflectance": 1.0}, set()),
    "beckmann": (plastic(0.1), set()),
    "ggx": (plastic(0.1, distribution="ggx"), {"energy_loss"}),
    "all diffuse": (blend(0.0), set()),
    "some plastic": (blend(0.3), {"clamped"}),
    "thin": ({"type": "mask", "opacity": 0.1, "bsdf": plastic(0.5)}, set()),
    "dense": ({"type": "mask", "opacity": 0.9, "bsdf": plastic(0.5)}, {"energy_loss"}),
    "bumpy": ({"type": "bumpmap", "t": HALF, "bsdf": plastic(0.5)}, {"energy_loss"}),
    "own": ({"type": "MyRoughPlastic"}, set()),
}
"""Materials, and the limits that they have wherever they are seen."""


class MyRoughPlastic(mi.BSDF):
    """A plugin of a user."""

    def __init__(self, props):
        super().__init__(props)
        self.m_components = [mi.BSDFFlags.DiffuseReflection | mi.BSDFFlags.FrontSide]

    def to_string(self):
        return "MyRoughPlastic[]"


def surfaces_of(bsdf, **sphere):
    """Return what a camera sees of a sphere of a material."""
    graph = Source("a", lambda: {
        "type": "scene",
        "sensor": {
            "type": "perspective", "fov": 40.0,
            "to_world": mi.ScalarTransform4f().look_at((-3, 0, 1), (0, 0, 0), (0, 0, 1)),
        },
        "shape": {"type": "sphere", **sphere, "bsdf": bsdf},
        "light": {"type": "point", "position": (-4, 0, 0), "intensity": 10.0},
        "spot": {
            "type": "spot",
            "to_world": mi.ScalarTransform4f().look_at((0, 0, 3), (0, 0, 0), (0, 1, 0)),
        },
    }).parse()  # fmt: skip
    return of_scene(graph.instantiate(), graph, SIDE, SIDE)


@pytest.mark.guarantee(
    "means",
    "Pixels are marked as beyond the reference's own limits by the materials that they show:"
    " distribution, blends, masks and sides included.",
)
def test_limits_are_of_the_material_that_a_pixel_shows(rgb):
    mi.register_bsdf("MyRoughPlastic", MyRoughPlastic)
    for name, (bsdf, expected) in MATERIALS.items():
        surfaces = surfaces_of(bsdf)
        masks = find(surfaces, GREY, noise())
        assert 0.2 < surfaces.hit.mean() < 0.9
        for limit in ("clamped", "energy_loss"):
            everywhere = surfaces.hit & (limit in expected)
            np.testing.assert_array_equal(masks[limit], everywhere, err_msg=f"{name}: {limit}")
        assert not masks["terminator"].any(), "a sphere's two normals are one"
    assert surfaces.lights.points.tolist() == [[-4, 0, 0], [0, 0, 3]]


def test_a_textured_blend_is_limited_where_its_plastic_is(rgb):
    surfaces = surfaces_of(blend(HALF))
    clamped = find(surfaces, GREY, noise())["clamped"]
    first = surfaces.position[..., 1] > 0  # u grows from the x axis around z
    np.testing.assert_array_equal(clamped[surfaces.hit], first[surfaces.hit])


# --- Terminators of a mesh -------------------------------------------------------------------

LIGHTS = {
    "point": {"type": "point", "position": (5, 0, 0), "intensity": 10.0},
    "directional": {"type": "directional", "direction": (-1, -0.3, 0)},
    "heuristic directional": {"type": "heuristic_directional", "direction": (-1, -0.3, 0)},
}


def coarse_sphere(light):
    """A mesh of few faces with smooth normals, each point of which no other face hides."""
    smooth = mi.load_dict({"type": "sphere", "bsdf": {"type": "diffuse", "reflectance": 1.0}})
    description = {
        "type": "scene",
        "sensor": {
            "type": "perspective", "fov": 35.0,
            "to_world": mi.ScalarTransform4f().look_at((0, -4, 0), (0, 0, 0), (0, 0, 1)),
        },
        "shape": tessellation.to_mesh(smooth, 4),
        "light": light,
    }  # fmt: skip
    return mi.load_dict(description, optimize=False)


def seen(scene, integrator, samples=1):
    """Return the mean radiance along the rays through the centres of pixels, (64, 64)."""
    x, y = (axis.ravel() for axis in np.meshgrid(*[(np.arange(64) + 0.5) / 64] * 2))
    place = mi.Point2f(np.repeat(x, samples), np.repeat(y, samples))
    ray, _ = scene.sensors()[0].sample_ray_differential(0.0, 0.5, place, mi.Point2f(0.5))
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(3, 64 * 64 * samples)
    value, *_ = mi.load_dict(integrator).sample(scene, sampler, ray)
    return np.array(value[0]).reshape(64, 64, samples).mean(axis=2)


def marked(surfaces):
    nothing = np.zeros((64, 64, 3))
    return find(surfaces, nothing, nothing)["terminator"]


def cosines(surfaces, toward):
    """Return ``N.L`` for both normals and ``N.V`` for the shading normal."""
    return (
        np.einsum("...i,...i", a, b)
        for a, b in (
            (surfaces.shading, toward),
            (surfaces.geometric, toward),
            (surfaces.shading, surfaces.view),
        )
    )


@pytest.mark.parametrize("name", LIGHTS)
def test_a_coarse_mesh_with_smooth_normals_is_black_where_it_is_marked(rgb, name):
    """Where the interpolated normal still sees the light and the face does not."""
    scene = coarse_sphere(LIGHTS[name])
    surfaces = of_scene(scene, None, 64, 64)
    at_infinity = name != "point"
    toward = (1, 0.3, 0) if at_infinity else np.array([5, 0, 0]) - surfaces.position
    shading, geometric, view = cosines(surfaces, np.broadcast_to(toward, (64, 64, 3)))
    radiance = seen(scene, {"type": "direct"})
    at_fault = surfaces.hit & (radiance == 0) & (shading > 1e-4)
    assert at_fault.sum() > 20
    mask = marked(surfaces)
    assert mask[at_fault].all()
    # Nothing else is marked but where the normals do disagree.
    assert not (mask & (np.sign(shading) == np.sign(geometric)) & (view > 0)).any()
    assert 0.01 < mask[surfaces.hit].mean() < 0.4


def test_pixels_that_lose_a_part_of_an_area_light_are_marked(rgb):
    """Against the irradiance of the shading normal, by 64 x 64 points of the light."""
    place = mi.ScalarTransform4f().look_at((3, 0, 0), (0, 0, 0), (0, 0, 1))
    light = {"type": "rectangle", "to_world": place, "emitter": {"type": "area", "radiance": 1.0}}
    scene = coarse_sphere(light)
    surfaces = of_scene(scene, None, 64, 64)
    cells = (np.arange(64) + 0.5) / 32 - 1
    y, z = (axis.ravel() for axis in np.meshgrid(cells, cells))
    points = np.stack([np.full_like(y, 3), y, z], axis=1)
    on_sphere = surfaces.hit & (np.abs(np.linalg.norm(surfaces.position, axis=2) - 1) < 0.2)
    whole, kept = np.zeros((64, 64)), np.zeros((64, 64))
    for point in points:
        shading, geometric, _ = cosines(surfaces, point - surfaces.position)
        weight = np.maximum(shading, 0)
        whole += weight
        kept += weight * (geometric > 0)
    at_fault = on_sphere & (whole - kept > 0.005 * whole[on_sphere].max())
    assert at_fault.sum() > 20
    assert marked(surfaces)[at_fault].all()
    # The lost light is lost in Mitsuba too.
    radiance = seen(scene, {"type": "direct"}, samples=64)
    dark = on_sphere & (kept == 0) & (whole > 0)
    assert dark.sum() > 5
    assert not radiance[dark].any()


def test_what_an_environment_loses_by_two_normals_is_the_wedge_between_them(rgb):
    scene = coarse_sphere({"type": "constant", "radiance": 1.0})
    surfaces = of_scene(scene, None, 64, 64)
    assert surfaces.lights.surrounding
    radiance = seen(scene, {"type": "direct"}, samples=256)
    _, _, view = cosines(surfaces, surfaces.view)
    apart = np.einsum("...i,...i", surfaces.shading, surfaces.geometric)
    counted = surfaces.hit & (view > 0)
    lost = (1 - radiance)[counted] - ((1 - apart) / 2)[counted]
    assert abs(lost.mean()) < 2e-3
    assert np.abs(lost).max() < 0.08  # 256 samples
    mask = marked(surfaces)[counted]
    np.testing.assert_array_equal(mask, ((1 - apart) / 2)[counted] > WEDGE_LOST)
    assert 0.05 < mask.mean() < 0.95


def test_a_light_of_a_shape_is_known_by_its_edges(rgb):
    light = {"type": "rectangle", "emitter": {"type": "area"}}
    points = lights_of(coarse_sphere(light)).points
    assert np.ptp(points[:, :2], axis=0) == pytest.approx([2, 2], abs=1e-5)
    assert not points[:, 2].any()


@pytest.mark.parametrize("name", ["directional", "heuristic directional"])
def test_a_directional_light_is_known_by_the_way_towards_it(rgb, name):
    (toward,) = lights_of(coarse_sphere(LIGHTS[name])).directions
    np.testing.assert_allclose(toward / toward[0], [1, 0.3, 0], atol=1e-6)
    assert toward[0] > 0
