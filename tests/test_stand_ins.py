"""Stand-ins for indirect light: closed forms, quadrature in double precision, Mitsuba's path."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from comparisons.gallery.builtin import SCENES
from heuristic import meshes
from heuristic.errors import InputError
from heuristic.heuristics import named
from heuristic.stand_ins import depth_image, gathering, harmonics, hemisphere, openness
from reference.pairing.halves import pair
from reference.rendering.renderer import Renderer
from tests import fuzzed_stand_ins
from tests.fuzzed_stand_ins import MODELS
from tests.sky import sky_above, two_colours

STAND_INS = ("mean-ambient", "hemisphere-ambient", "ambient-occlusion", "screen-occlusion")


def looking(origin, target, up=(0, 0, 1), size=32, fov=40.0, **others):
    """A camera with a small film."""
    film = {"type": "hdrfilm", "width": size, "height": size, "rfilter": {"type": "box"}}
    to_world = mi.ScalarTransform4f().look_at(origin, target, up)
    return {"type": "perspective", "fov": fov, "to_world": to_world, "film": film, **others}


def image(scene, model, spp=4, **parameters):
    """Render the heuristic half of a scene with a model."""
    integrator = {"type": "heuristic", "model": model, **parameters}
    return np.array(Renderer(scene, mi.load_dict(integrator), spp, model).render(1), float)


# --- Gathering ------------------------------------------------------------------------------------


def integrating_sphere(k_d):
    """The inside of a sphere of radius 2 with a lamp in its middle."""
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": looking((0.5, 0.3, 0.1), (2, 0, 0), fov=80.0),
        "wall": {
            "type": "sphere",
            "radius": 2.0,
            "flip_normals": True,
            "bsdf": {"type": "phong", "k_d": k_d},
        },
        "lamp": {"type": "heuristic_point", "k0": 0.0, "k2": 1.0}
        | {"intensity": {"type": "uniform", "value": 3.0}},
    }


@pytest.mark.parametrize(
    "variant", ["llvm_ad_rgb", "llvm_ad_mono", "llvm_ad_spectral"], indirect=True
)
def test_an_integrating_sphere_has_the_light_of_its_closed_form(variant):
    """All of it is lit alike, so that ``I = rho (I_p + I)`` and ``I = I_p rho / (1 - rho)``."""
    found = gathering.gather(mi.load_dict(integrating_sphere(0.5)))
    np.testing.assert_allclose(found.mean(), 3 / 4 * 0.5 / (1 - 0.5), rtol=0.01)
    np.testing.assert_allclose(found.k_d, 0.5, rtol=0.02)


def test_each_channel_is_gathered_alone(rgb):
    rho = np.array((0.7, 0.3, 0.0))
    walls = {"type": "rgb", "value": rho.tolist()}
    found = gathering.gather(mi.load_dict(integrating_sphere(walls)))
    lit = rho > 0
    np.testing.assert_allclose(found.mean()[lit], (0.75 * rho / (1 - rho))[lit], rtol=0.015)
    assert found.mean()[2] == 0


def test_the_mean_is_the_indirect_light_of_the_cornell_box(rgb):
    """Of the physical half by ``path``, whose lamp has an extent: a few percent."""
    found = pair(SCENES["cornell-box"].source(), resolution=(32, 32))
    physical, half = found.physical.instantiate(), found.heuristic.instantiate()
    full, direct = (
        np.mean(
            [np.array(mi.render(physical, integrator=path, spp=256, seed=s)) for s in (1, 2)], 0
        )
        for path in (mi.load_dict({"type": "path", "max_depth": depth}) for depth in (-1, 2))
    )
    plain = image(half, "phong", 64, occlusion=True)
    for model in STAND_INS:
        added = image(half, model, 64, occlusion=True) - plain
        np.testing.assert_allclose(
            added.mean(axis=(0, 1)), (full - direct).mean(axis=(0, 1)), rtol=0.06, err_msg=model
        )


def test_an_environment_is_gathered_where_nothing_hides_it(rgb):
    """A sphere under an even sky receives it everywhere, whatever ``I_a`` says."""
    scene = sky_above(lambda toward: np.full((len(toward), 3), 0.25))
    assert gathering.gather(mi.load_dict(scene)).mean() == pytest.approx(0.25, rel=0.005)
    for model in ("mean-ambient", "harmonics-ambient", "hemisphere-ambient", "ambient-occlusion"):
        seen = image(mi.load_dict(scene), model, ambient=9.0)[16, 16]
        assert seen == pytest.approx(0.25 * 0.8, rel=0.01), model


def test_ambient_light_of_its_own_stays_without_an_environment(rgb):
    """A corner of no lamps: even light on all, and as much less as is hidden."""
    given = corner()
    for name in ("floor", "wall"):
        given[name]["bsdf"] = given[name]["bsdf"] | {"k_a": 0.4}
    scene = mi.load_dict(given)
    plain = image(scene, "phong", ambient=2.0)
    assert plain.max() == pytest.approx(0.8)
    for model in ("mean-ambient", "hemisphere-ambient"):
        np.testing.assert_allclose(image(scene, model, ambient=2.0), plain, atol=1e-6)
    at = gathering.seen(scene)
    distance = openness.reach_of(scene, openness.REACH.default)
    share = openness.openness(at.visible(scene), at.si.p, at.normal, mi.Float(distance), 256)
    share = np.array(share)[np.array(at.si.is_valid())]
    for model, within in (("ambient-occlusion", 0.01), ("screen-occlusion", 0.04)):
        found = image(scene, model, 16, ambient=2.0)
        seen = plain.max(axis=2) > 0.4
        assert found[seen].mean() == pytest.approx(0.8 * share.mean(), rel=within), model
    assert share.mean() < 0.97


def test_what_is_reflected_and_what_comes_from_around_add_up(rgb):
    """The mean of a picture by ``path``, of the same surfaces under the same sky and lamp."""
    given = corner()
    given["sky"] = sky_above(two_colours)["sky"]
    given["wall"]["bsdf"] = {"type": "phong", "k_d": 0.9, "twosided": True}
    given["lamp"] = {"type": "heuristic_directional", "direction": (-2, 1, -1)}
    scene = mi.load_dict(given)
    path = mi.load_dict({"type": "path", "hide_emitters": True})
    expected = np.array(mi.render(scene, integrator=path, spp=64)).mean(axis=(0, 1))
    for model in STAND_INS:
        found = image(scene, model, 4, occlusion=True, hide_emitters=True).mean(axis=(0, 1))
        np.testing.assert_allclose(found, expected, rtol=0.02, err_msg=model)


def test_a_sun_is_gathered_without_noise(rgb):
    """One texel of the sky holds all light: paths alone would meet it once in ten thousand."""
    size = gathering.GRID

    def sun(toward):
        nearest = np.argmax(toward @ np.array((0.2, -0.5, 0.9)))
        return 500.0 * (np.arange(len(toward)) == nearest)[:, None] * np.ones(3)

    means = []
    for height in (32, 64):
        scene = sky_above(sun, height=height)
        means.append(gathering.gather(mi.load_dict(scene)).mean() * height**2)
    np.testing.assert_allclose(means[0], means[1], rtol=0.15)
    assert size == 32


def test_gathering_repeats(rgb):
    scene = mi.load_dict(integrating_sphere(0.5))
    first, second = gathering.gather(scene), gathering.gather(scene)
    np.testing.assert_array_equal(first.arriving, second.arriving)


# --- Hemispheres ----------------------------------------------------------------------------------


def sphere_of_directions(rings=400):
    """Directions (N, 3) over the sphere and their solid angles, by a rule of this test's own."""
    z = (np.arange(rings) + 0.5) / rings * 2 - 1
    turn = (np.arange(2 * rings) + 0.5) / rings * np.pi
    z, turn = (part.ravel() for part in np.meshgrid(z, turn, indexing="ij"))
    flat = np.sqrt(1 - z**2)
    toward = np.stack([flat * np.cos(turn), flat * np.sin(turn), z], axis=1)
    return toward, 4 * np.pi / len(toward)


def irradiance(radiance, normal):
    """``E / pi`` (K,) at a normal by quadrature, of a radiance (N, K) of directions (N, 3)."""
    toward, solid_angle = sphere_of_directions()
    cosine = np.maximum(toward @ normal, 0)
    return (cosine[:, None] * radiance(toward)).sum(axis=0) * solid_angle / np.pi


def unit(*vector):
    return np.array(vector) / np.linalg.norm(vector)


NORMALS = [unit(0, 0, 1), unit(0, 0, -1), unit(1, 0, 0), unit(1, -2, 0.5), unit(-1, 1, 3)]


def test_sky_and_ground_are_integrated():
    for normal in NORMALS:
        expected = irradiance(two_colours, normal)
        sky, ground = two_colours(np.array([(0, 0, 1), (0, 0, -1)]))
        found = hemisphere.irradiance(sky, ground, normal[2])
        np.testing.assert_allclose(found, expected, rtol=1e-4)


def test_sky_and_ground_are_found_again(rgb):
    prepared = hemisphere.prepare(mi.load_dict(sky_above(two_colours)))
    sky, ground = two_colours(np.array([(0, 0, 1), (0, 0, -1)]))
    assert list(prepared.up) == [0, 0, 1]
    for table, expected in ((prepared.sky, sky), (prepared.ground, ground)):
        np.testing.assert_allclose(np.ravel(table.at(())), expected, rtol=0.08, atol=0.01)


def test_a_fit_keeps_the_mean_and_is_not_negative():
    rng = np.random.default_rng(3)
    for case in range(200):
        count = int(rng.integers(1, 40))
        normal = rng.normal(size=(count, 3)) if case % 3 else np.ones((count, 3))
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        arriving, k_d = rng.random((2, count, 3)) ** 4
        found = gathering.Gathered(normal, arriving, k_d * (rng.random((count, 3)) < 0.8))
        sky, ground = hemisphere.fit(found, np.array((0.0, 0.0, 1.0)))
        assert (sky >= 0).all()
        assert (ground >= 0).all()
        fitted = hemisphere.irradiance(sky, ground, normal[:, 2:])
        np.testing.assert_allclose(found.mean(fitted), found.mean(), rtol=1e-6, atol=1e-9)


# --- Spherical harmonics --------------------------------------------------------------------------


def by_harmonics(radiance, normal):
    """``E / pi`` (K,) at a normal, by the nine terms."""

    def of(directions):
        return radiance(np.stack([directions.x, directions.y, directions.z], axis=1))

    terms = np.stack(harmonics.basis(harmonics.Directions(*normal)))
    return terms @ harmonics.project(of)


def test_light_of_the_second_order_is_exact():
    """Any quadratic polynomial of the direction is a sum of the nine terms."""
    rng = np.random.default_rng(5)
    for _ in range(3):
        square, slope = rng.normal(size=(3, 3)), rng.normal(size=3)

        def quadratic(toward, square=square, slope=slope):
            value = np.einsum("ni,ij,nj->n", toward, square, toward) + toward @ slope + 0.3
            return value[:, None]

        for normal in NORMALS:
            expected = irradiance(quadratic, normal)
            np.testing.assert_allclose(by_harmonics(quadratic, normal), expected, atol=3e-4)


def test_a_cosine_lobe_keeps_99_percent():
    """Ramamoorthi and Hanrahan: at least 99 % of the irradiance of such light."""
    axis = unit(1, 2, -2)

    def lobe(toward):
        return np.maximum(toward @ axis, 0)[:, None]

    rng = np.random.default_rng(6)
    normals = [axis, *(unit(*rng.normal(size=3)) for _ in range(30))]
    expected, found = (
        np.array([of(lobe, n)[0] for n in normals]) for of in (irradiance, by_harmonics)
    )
    assert abs(found - expected).max() < 0.01 * expected.max()
    assert abs(found - expected).max() > 1e-4 * expected.max(), "what is cut off should be seen"


def test_harmonics_light_a_sphere_as_quadrature_says(rgb):
    """The picture of a white sphere, pixel by pixel, under a smooth sky."""

    def smooth(toward):
        return np.stack([1 + toward[:, i] for i in range(3)], axis=1) / 4

    given = sky_above(smooth, k_d=1.0)
    scene = mi.load_dict(given)
    found = image(scene, "harmonics-ambient", 1)
    at = gathering.seen(scene)
    on = np.array(at.si.is_valid())
    normals = np.array(at.normal, float).T[on]
    ray = image(scene, "harmonics-ambient", 256).reshape(-1, 3)[on]
    expected = 0.25 + normals / 6
    # A pixel is as wide as a degree or two of the sphere, but for its rim.
    middle = np.array(dr.dot(at.normal, at.si.to_world(at.si.wi)))[on] > 0.5
    np.testing.assert_allclose(ray[middle], expected[middle], atol=0.01)
    assert found.max() < 0.5


# --- Ambient occlusion ----------------------------------------------------------------------------

WALL_HEIGHT = 1.0


def corner():
    """A floor and a wall of one unit's height at x = 0, both wide."""
    turned = mi.ScalarTransform4f().translate((0, 0, WALL_HEIGHT / 2)).rotate((0, 1, 0), 90)
    bsdf = {"type": "phong", "k_d": 0.5, "twosided": True}
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": looking((2.5, -1, 2.5), (0.3, 0, 0.2), size=192, fov=90.0),
        "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(300), "bsdf": bsdf},
        "wall": {
            "type": "rectangle",
            "to_world": turned @ mi.ScalarTransform4f().scale((WALL_HEIGHT / 2, 300, 1)),
            "bsdf": bsdf,
        },
    }


def wall_openness(distance):
    """A vertical strip of height h hides ``(1 - d / sqrt(d^2 + h^2)) / 2`` of the floor's sky."""
    return 1 - 0.5 * (1 - distance / np.hypot(distance, WALL_HEIGHT))


RADIUS = 0.6


def ball_on_a_floor():
    bsdf = {"type": "phong", "k_d": 0.5}
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": looking((0, -4, 3), (0, 0, 0.3), size=128),
        "floor": {"type": "rectangle", "to_world": mi.ScalarTransform4f().scale(300), "bsdf": bsdf},
        "ball": {"type": "sphere", "radius": RADIUS, "center": (0, 0, RADIUS), "bsdf": bsdf},
    }


def ball_openness(distance):
    """A ball hides ``(r / D)^2 cos t``: ``D`` to its centre, at ``t`` from the normal."""
    return 1 - RADIUS**3 / np.hypot(distance, RADIUS) ** 3


def floor_points(scene, x, y):
    """What openness is asked for on a floor: positions, normals, and the shadow test."""
    position = mi.Point3f(mi.Float(x), mi.Float(y), 0)
    si = dr.zeros(mi.SurfaceInteraction3f, len(x))
    si.p, si.n = position, mi.Normal3f(0, 0, 1)
    at = gathering.Seen(si, mi.Vector3f(0, 0, 1), None)
    return position, at.normal, at.visible(scene)


@pytest.mark.parametrize(
    ("make", "expected"), [(corner, wall_openness), (ball_on_a_floor, ball_openness)]
)
def test_rays_find_the_openness_of_closed_forms(rgb, make, expected):
    scene = mi.load_dict(make())
    rng = np.random.default_rng(2)
    for distance in (0.25, 0.7, 1.5):
        turn = rng.uniform(0, 2 * np.pi, 4096)
        if make is corner:
            x, y = np.full(4096, distance), rng.uniform(-1, 1, 4096)
        else:
            x, y = distance * np.cos(turn), distance * np.sin(turn)
        position, normal, visible = floor_points(scene, x, y)
        found = np.array(openness.openness(visible, position, normal, mi.Float(250.0), 16))
        # 65,536 rays, stratified by sixteens: well below the half percent of as many at random.
        assert found.mean() == pytest.approx(expected(distance), abs=0.004)
        assert set(np.unique(found * 16 % 1)) == {0.0}


def test_what_lies_beyond_the_reach_hides_nothing(rgb):
    scene = mi.load_dict(corner())
    position, normal, visible = floor_points(scene, np.full(64, 0.5), np.linspace(-1, 1, 64))
    near, far = (
        np.array(openness.openness(visible, position, normal, mi.Float(reach), 16)).mean()
        for reach in (0.45, 0.55)
    )
    assert near == 1
    assert far < 1


def on_the_floor(scene, low, high, reach):
    """Openness by the depth image at the floor's points seen, and their places in the plane."""
    found = depth_image.depth_image(scene)
    places = np.array(found.places, float).reshape(-1, 3)
    flat = np.hypot(places[:, 0], places[:, 1])
    chosen = (abs(places[:, 2]) < 1e-4) & (flat > low) & (flat < high)
    places = places[chosen]
    viewer = np.array(scene.sensors()[0].world_transform().matrix, float)[:3, 3, 0]
    view = viewer - places
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    position, toward = mi.Point3f(places.T), mi.Vector3f(view.T)
    value = depth_image.openness(found, position, mi.Vector3f(0, 0, 1), toward, mi.Float(reach))
    return np.array(value, float), places


def beside_the_wall(reach):
    """Openness by the depth image near the wall, and the places, which see it in the image."""
    found, places = on_the_floor(mi.load_dict(corner()), 0.05, 1.2, reach)
    chosen = (places[:, 0] > 0.1) & (abs(places[:, 1]) < 0.6)
    assert chosen.sum() > 500
    return found[chosen], places[chosen]


def test_horizons_find_the_openness_beside_a_wall(rgb, monkeypatch):
    """What hides light is in the image here, so that many steps and slices find the closed form."""
    monkeypatch.setattr(depth_image, "STEPS", 128)
    monkeypatch.setattr(depth_image, "SLICES", 16)
    found, places = beside_the_wall(12.0)
    expected = wall_openness(places[:, 0])
    assert found.mean() == pytest.approx(expected.mean(), abs=0.015)
    assert abs(found - expected).mean() < 0.02


def test_few_horizons_find_about_what_rays_do(rgb):
    """With as many steps as there are, and a reach as scenes have it."""
    found, places = beside_the_wall(1.5)
    scene = mi.load_dict(corner())
    position, normal, visible = floor_points(scene, *np.repeat(places[:, :2].T, 64, axis=1))
    rays = np.array(openness.openness(visible, position, normal, mi.Float(1.5), 16))
    rays = rays.reshape(-1, 64).mean(axis=1)
    assert found.mean() == pytest.approx(rays.mean(), abs=0.05)
    assert np.corrcoef(found, rays)[0, 1] > 0.9


def test_horizons_find_the_openness_beside_a_ball(rgb):
    """Before it, where its back, which the image does not show, hides nothing more."""
    found, places = on_the_floor(mi.load_dict(ball_on_a_floor()), 0.3, 1.5, reach=3.0)
    chosen = places[:, 1] < -abs(places[:, 0])
    expected = ball_openness(np.hypot(*places[chosen, :2].T))
    assert chosen.sum() > 200
    assert found[chosen].mean() == pytest.approx(expected.mean(), abs=0.06)
    assert np.corrcoef(found[chosen], expected)[0, 1] > 0.9


@pytest.mark.parametrize("camera", ["perspective", "thinlens", "crop", "shifted"])
def test_what_a_pixel_sees_is_found_there_again(rgb, camera):
    """For every camera that has a viewpoint, and whatever part of the film is kept."""
    given = ball_on_a_floor()
    sensor = given["sensor"]
    if camera == "thinlens":
        sensor |= {"type": "thinlens", "aperture_radius": 0.01, "focus_distance": 4.0}
    elif camera == "crop":
        sensor["film"] |= {"crop_width": 40, "crop_height": 25}
        sensor["film"] |= {"crop_offset_x": 30, "crop_offset_y": 61}
    elif camera == "shifted":
        sensor |= {"principal_point_offset_x": 0.2, "principal_point_offset_y": -0.1}
    found = depth_image.depth_image(mi.load_dict(given))
    places = np.array(found.places, float).reshape(-1, 3)
    places = places[np.isfinite(places).all(axis=1)]
    assert len(places) > 500
    again = np.array(found.at(mi.Point3f(places.T)), float).T
    # A pixel's centre lies on no border, so that rounding leads to no other pixel.
    assert np.mean(np.any(abs(again - places) > 1e-3, axis=1)) < 0.01


def test_an_open_floor_has_all_light_from_every_side(rgb):
    given = ball_on_a_floor()
    del given["ball"]
    found, _ = on_the_floor(mi.load_dict(given), 0.0, 5.0, reach=3.0)
    assert len(found) > 1000
    np.testing.assert_allclose(found, 1, atol=1e-5)


def test_a_slice_is_the_integral_that_it_stands_for():
    """``int cos(t - g) |sin t| dt`` from the view to a horizon, by the midpoint rule."""
    for tilt in (-1.2, 0.0, 0.4):
        for horizon in (-1.5, -0.3, 0.2, 1.4):
            edges = np.linspace(0, horizon, 20001)
            t, width = (edges[1:] + edges[:-1]) / 2, abs(np.diff(edges))
            expected = np.sum(np.cos(t - tilt) * abs(np.sin(t)) * width)
            found = depth_image.free(dr.scalar.ArrayXf([horizon]), dr.scalar.ArrayXf([tilt]))[0]
            assert float(found) == pytest.approx(expected, abs=1e-6)


# --- All of them ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("model", "change", "reason"),
    [
        ("harmonics-ambient", {}, "it has no environment"),
        ("shadow-map", {"lamp": None}, "it has no lamp"),
        ("soft-shadow-map", {"lamp": "many"}, "it has 17 lamps, and at most 16 get a depth image"),
        ("screen-occlusion", {"camera": "orthographic"}, "no single viewpoint, so no depth"),
    ],
)
def test_a_scene_that_cannot_be_shaded_so_is_refused_with_the_reason(rgb, model, change, reason):
    given = integrating_sphere(0.5)
    if "lamp" in change:
        lamp = given.pop("lamp")
        given |= {f"lamp{i}": lamp for i in range(17)} if change["lamp"] else {}
    if "camera" in change:
        del given["sensor"]["fov"]
        given["sensor"]["type"] = "orthographic"
    with pytest.raises(InputError, match=f"^heuristic {model} cannot shade this scene: .*{reason}"):
        image(mi.load_dict(given), model)
    assert named(model).refuse(mi.load_dict(given))


def extreme(name):
    """Scenes at the ends of what there is."""
    given = integrating_sphere(0.5)
    if name == "nothing seen":
        given["wall"] |= {"center": (0, 0, 90)}
    elif name == "no shape":
        del given["wall"]
    elif name == "black":
        given["wall"]["bsdf"] = {"type": "phong"}
    elif name == "more than white":
        given["wall"]["bsdf"] = {"type": "phong", "k_d": 1.0, "k_s": 1.0, "n": 3}
    elif name == "bright":
        given["lamp"]["intensity"] = 1e25
    elif name == "tiny":
        given["wall"]["radius"] = 2e-5
        given["sensor"] = looking((5e-6, 3e-6, 1e-6), (2e-5, 0, 0), near_clip=1e-9)
    elif name == "camera on the lamp":
        given["sensor"] = looking((0, 0, 0), (2, 0, 0))
    return mi.load_dict(given)


@pytest.mark.parametrize("model", MODELS)
@pytest.mark.parametrize(
    "name",
    [
        "nothing seen",
        "no shape",
        "black",
        "more than white",
        "bright",
        "tiny",
        "camera on the lamp",
    ],
)
def test_scenes_at_the_ends_of_what_there_is_are_finite(rgb, name, model):
    scene = extreme(name)
    if named(model).refuse is None or not named(model).refuse(scene):
        found = image(scene, model, 1)
        assert np.isfinite(found).all()
        assert found.min() >= 0


@pytest.mark.parametrize(
    ("variant", "seeds"),
    [("llvm_ad_rgb", (3, 5, 8)), ("llvm_ad_mono", (12,)), ("llvm_ad_spectral", (28,))],
    indirect=["variant"],
)
def test_random_scenes_are_finite_and_not_negative(variant, seeds, tmp_path):
    for seed in seeds:
        assert list(fuzzed_stand_ins.wrong(seed, tmp_path)) == []


def test_a_negative_picture_is_found_out(rgb, tmp_path, monkeypatch):
    monkeypatch.setattr(gathering.Gathered, "mean", lambda self, of=None: np.full(3, -1.0))
    found = list(fuzzed_stand_ins.wrong(3, tmp_path))
    assert any("mean-ambient" in line for line in found)


@pytest.mark.parametrize("interpolation", ["flat", "gouraud"])
@pytest.mark.parametrize("model", MODELS)
def test_vertices_and_faces_are_shaded_too(rgb, interpolation, model):
    given = sky_above(two_colours)
    given["lamp"] = {"type": "heuristic_directional", "direction": (1, 2, -1)}
    given["ball"] = meshes.to_mesh(mi.load_dict(given["ball"]), 24)
    scene = mi.load_dict(given)
    found, smooth = image(scene, model, interpolation=interpolation), image(scene, model)
    assert found.mean() == pytest.approx(smooth.mean(), rel=0.03)


@pytest.mark.parametrize("model", MODELS)
def test_later_passes_replay_the_first(rgb, model):
    """Under an environment and a parallel lamp, which no scene of ``test_replays`` has."""
    given = sky_above(two_colours, ambient=0.25)
    given["lamp"] = {"type": "heuristic_directional", "direction": (1, 2, -1)}
    scene = mi.load_dict(given)
    renderer = Renderer(scene, mi.load_dict({"type": "heuristic", "model": model}), 2, model)
    for seed in (1, 2, 3):
        found = np.array(renderer.render(seed))
        again = mi.render(scene, integrator=renderer.integrator, spp=2, seed=seed)
        np.testing.assert_array_equal(found, np.array(again))
    assert renderer.replays


def test_a_prepared_parameter_prepares_again_where_it_changes(rgb, monkeypatch):
    asked = []
    right = openness.reach_of
    monkeypatch.setattr(
        openness, "reach_of", lambda s, reach: asked.append(reach) or right(s, reach)
    )
    scene = integrating_sphere(0.5)
    scene["integrator"] = {"type": "heuristic", "model": "ambient-occlusion", "reach": 0.25}
    scene = mi.load_dict(scene)
    for _ in range(2):
        mi.render(scene, spp=1)
    parameters = mi.traverse(scene)
    parameters["integrator.reach"] = 0.5
    parameters.update()
    for _ in range(2):
        mi.render(scene, spp=1)
    assert asked == [0.25, 0.5]
    assert scene.integrator().preparation > 0
