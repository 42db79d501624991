"""The shaders of docs/shaders for environments and lamps: closed forms, and many samples."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from fotismos.heuristic import background
from tests.shared import oracle
from tests.shared.parts import rgb_of
from tests.shared.wrong_shaders import SHADERS

pytestmark = pytest.mark.thorough

UP = np.array([0.0, 0.0, 1.0])
DENSE = 200 * 512
"""200 times the samples of split_sum.py and ltc.py."""


def shaded(name, emitters, material, normal, view):
    """Return the colours (N, 3) of a shader at the origin, for normals and views (N, 3)."""
    phong = {"type": "phong", "k_d": 0.5, "base_color": 1.0, "alpha": 0.5, "ior": 1.5} | material
    loaded = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "heuristic", "model": name},
            "ball": {"type": "sphere", "bsdf": phong},
            **emitters,
        },
        optimize=False,
    )
    count = max(len(normal), len(view))
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    integrator = loaded.integrator().known(loaded)
    ((found, _),) = integrator.materials.at(si, True)
    vectors = [mi.Vector3f(*np.broadcast_to(v, (count, 3)).T.astype("f")) for v in (normal, view)]
    lights = integrator.lights(loaded, si, True)
    value = integrator.model_at(loaded, si)(
        si.p, *vectors, found, lights, integrator.ambient_at(si, True), None
    )
    return np.broadcast_to(np.array(value).T, (count, 3))


def around(function, rows=512):
    """Return an environment (N, 3) -> (N, 3) of the world's directions, as a map."""
    toward = background.directions(rows, 2 * rows)
    texels = function(toward.reshape(-1, 3)).reshape(toward.shape)
    return {"sky": {"type": "envmap", "bitmap": mi.Bitmap(texels.astype(np.float32))}}


def smooth(toward):
    """A coloured environment that no shader's samples miss."""
    x, y, z = toward.T
    return np.stack([1 + 0.5 * x + 0.4 * y * z, 1 + 0.5 * z, 1 - 0.4 * y + 0.3 * x * x], axis=1)


def above(toward):
    return np.repeat(toward[:, 2:] > 0, 3, axis=1).astype(float)


def fan(count=9, widest=80):
    """Return views (N, 3) at angles to UP, and their cosines."""
    angle = np.radians(np.linspace(1, widest, count))
    return np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1), np.cos(angle)


def schlick(f0, cosine):
    return (f0 + (1 - f0) * (1 - cosine) ** 5)[:, None]


def sphere(count=DENSE):
    """Return directions (N, 3) that are even on the sphere, by the golden angle."""
    z = 1 - 2 * (np.arange(count) + 0.5) / count
    side, turn = np.sqrt(1 - z * z), 2.399963229728653 * np.arange(count)
    return np.stack([side * np.cos(turn), side * np.sin(turn), z], axis=1)


def facets(alpha, toward, view):
    """Return GGX's D N.H / (4 V.H), and D G / (4 N.V), of lights (N, 3) and a view; N is UP."""
    half = oracle.unit(toward + view)
    top, turned = half[:, 2], np.maximum(half @ view, 1e-9)
    density = alpha**2 / (np.pi * (top**2 * (alpha**2 - 1) + 1) ** 2)
    masked = [1 / (1 + np.sqrt(1 + alpha**2 * (1 / c**2 - 1))) for c in (toward[:, 2], view[2])]
    is_lit = (toward[:, 2] > 0) & (top > 0)
    seen = np.where(is_lit, density * top / (4 * turned), 0)
    return seen, np.where(is_lit, density * 4 * masked[0] * masked[1] / (4 * view[2]), 0)


def axes(normal):
    """Return three unit vectors (3, 3), of which the last is a normal."""
    side = oracle.unit(np.cross(normal, np.roll(normal, 1))[None])[0]
    return np.stack([side, np.cross(normal, side), normal])


# --- Split sum ----------------------------------------------------------------------------------


def white_furnace(name):
    """A white base returns whatever the lobe leaves: all of the light, and nothing more."""
    view, _ = fan()
    for alpha in (1e-4, 0.1, 0.5, 1.0):
        light = {"sky": {"type": "constant", "radiance": rgb_of(0.5, 1, 2)}}
        value = shaded(name, light, {"alpha": alpha}, UP[None], view)
        np.testing.assert_allclose(value, np.tile([0.5, 1, 2], (9, 1)), rtol=2e-3)
        metal = shaded(name, light, {"alpha": alpha, "metallic": 1.0}, UP[None], view)
        assert (metal < value * 1.002).all()


def constant_environment(name):
    """A grey metal's reflection is its albedo, by 200 times the samples."""
    toward = sphere()
    view, _ = fan(4, 75)
    for alpha in (0.2, 0.5, 0.9):
        light = {"sky": {"type": "constant", "radiance": 2.0}}
        for base in (1.0, 0.3):
            value = shaded(name, light, {"alpha": alpha, "base_color": base, "metallic": 1.0},
                           UP[None], view)  # fmt: skip
            for one, v in zip(value, view, strict=True):
                half = oracle.unit(toward + v)
                fresnel = schlick(base, np.clip(half @ v, 0, 1))[:, 0]
                expected = 2 * 4 * np.pi * np.mean(facets(alpha, toward, v)[1] * fresnel)
                np.testing.assert_allclose(one, expected, rtol=0.02)


def blurred_map(name):
    """Seen from above, what is reflected is the mean of the environment over GGX's lobe."""
    toward = sphere()
    for alpha in (0.04, 0.64):  # levels of the map
        normal = oracle.unit(np.array([[0.2, -0.5, 0.8], [-0.3, 0.1, -0.9], [1, 0.2, 0]]))
        material = {"alpha": alpha, "metallic": 1.0}
        value = shaded(name, around(smooth), material, normal, normal)
        white = {"sky": {"type": "constant", "radiance": 1.0}}
        albedo = shaded(name, white, material, UP[None], UP[None])[0, 0]
        weight = facets(alpha, toward, UP)[0] * toward[:, 2]
        for one, n in zip(value, normal, strict=True):
            light = smooth(toward @ axes(n))
            expected = (weight @ light) / weight.sum()
            np.testing.assert_allclose(one / albedo, expected, rtol=0.01)


def mirror(name):
    """A smooth metal reflects the environment along the mirrored ray, times Fresnel's term."""
    view, cosine = fan()
    turned = view * (-1, -1, 1)
    value = shaded(name, around(smooth), {"alpha": 1e-4, "base_color": 0.4, "metallic": 1.0},
                   UP[None], view)  # fmt: skip
    expected = smooth(turned) * schlick(0.4, cosine)
    np.testing.assert_allclose(value, expected, rtol=0.01)


def no_sun_twice(name):
    """The sun is a light of the scene: the environment of a preparation has none."""
    sky = {"type": "sunsky", "sun_direction": [0.0, 0.3, 0.9]}
    about = oracle.unit(np.array([0.0, 0.3, 0.9]) + 0.005 * sphere(64))
    values = [
        shaded(name, {"sky": sky | more}, {"alpha": 1e-4}, about, about)
        for more in ({}, {"sun_scale": 0.0})
    ]
    np.testing.assert_allclose(*values, rtol=1e-4)


# --- Harmonics ----------------------------------------------------------------------------------

WINDOW = 8.0
KEPT = [0.5 + 0.5 * np.cos(np.pi * order / WINDOW) for order in (0, 1, 2)]


def quadratic(name):
    """Light c + b.w + w.Q w gives c + tr Q / 3 + 2/3 b.n + (n.Q n - tr Q / 3) / 4, windowed."""
    random = np.random.default_rng(2)
    normal = sphere(64)
    for _ in range(3):
        q, b = random.normal(size=(3, 3)), random.uniform(-0.5, 0.5, 3)
        q = 0.3 * (q + q.T)
        third = np.trace(q) / 3

        def light(toward, q=q, b=b):
            form = np.einsum("ni,ij,nj->n", toward, q, toward)
            return np.repeat((3 + toward @ b + form)[:, None], 3, axis=1)

        form = np.einsum("ni,ij,nj->n", normal, q, normal)
        expected = 3 + third + 2 / 3 * KEPT[1] * normal @ b + KEPT[2] / 4 * (form - third)
        base = {"base_color": rgb_of(0.2, 0.5, 0.8)}
        value = shaded(name, around(light, 256), base, normal, normal)
        np.testing.assert_allclose(value, expected[:, None] * (0.2, 0.5, 0.8), rtol=1e-3)
        view = oracle.unit(normal + 0.5 * np.roll(normal, 1, axis=1))
        facing = np.sum(normal * view, axis=1)
        turned = 2 * facing[:, None] * normal - view
        form = np.einsum("ni,ij,nj->n", turned, q, turned)
        expected = 3 + third + 2 / 3 * KEPT[1] * turned @ b + KEPT[2] / 4 * (form - third)
        metal = {"base_color": 0.4, "metallic": 1.0}
        value = shaded(name, around(light, 256), metal, normal, view)
        expected = expected[:, None] * schlick(0.4, np.clip(facing, 0, 1))
        np.testing.assert_allclose(value, np.tile(expected, 3), rtol=1e-3)


def a_small_lamp(name):
    """Beyond a small bright lamp's horizon the sum is not negative, but black."""
    light = around(lambda toward: 100.0 * np.repeat(toward[:, 2:] > 0.99, 3, axis=1))
    value = shaded(name, light, {}, sphere(256), sphere(256))
    assert value.min() >= 0
    assert (value == 0).any()
    assert value.max() == pytest.approx(100 * (1 - 0.99) / 2 * (
        1 + 2 * KEPT[1] * 0.995 + 5 / 4 * KEPT[2] * 0.985), rel=0.01)  # fmt: skip


# --- Linearly transformed cosines ---------------------------------------------------------------


def lamp(place, u, v, radiance=2.0):
    """Return a rectangular lamp as pairing makes it: I = L A / pi along its normal."""
    facing = oracle.unit(np.cross(u, v)[None])[0]
    facing = facing if facing @ place < 0 else -facing
    area = 4 * np.linalg.norm(np.cross(u, v))
    return {
        "lamp": {
            "type": "heuristic_spot", "k0": 0.0, "k1": 0.0, "k2": 1.0,
            "position": list(place), "direction": facing.tolist(), "cutoff": 90.0, "exponent": 1.0,
            "intensity": radiance * area / np.pi, "half_u": list(u), "half_v": list(v),
        }
    }  # fmt: skip


LAMPS = (
    ((0, 0, 2.0), (1, 0, 0), (0, 0.5, 0)),
    ((-2, 1, 2.0), (0.5, 1, 0), (-0.3, 0.15, 1)),
    ((-2, 0, 0.3), (0, 1.5, 0), (0.2, 0, 1)),  # it crosses the horizon
    ((-1.5, -1, 0.2), (1, 0.2, 0.4), (-0.2, 1, 0.6)),
)


def sampled(place, u, v, side=320):
    """Return even directions (N, 3) to a lamp, and the solid angle that each stands for."""
    steps = (np.arange(side) + 0.5) / side * 2 - 1
    a, b = (one.reshape(-1, 1) for one in np.meshgrid(steps, steps))
    offset = np.array(place) + a * np.array(u, float) + b * np.array(v, float)
    distance = np.linalg.norm(offset, axis=1)
    area = 4 * np.cross(u, v) / side**2
    return offset / distance[:, None], abs(offset @ area) / distance**3


def lambert(name):
    """A base under a lamp, against 100,000 points of the lamp; and the plain formula."""
    view, _ = fan(5, 70)
    directions = sphere()
    lobe = np.array([
        4 * np.pi * np.mean(facets(0.3, directions, one)[1] * schlick(
            0.04, np.clip(oracle.unit(directions + one) @ one, 0, 1))[:, 0])
        for one in view
    ])  # fmt: skip
    for place, u, v in LAMPS:
        toward, solid = sampled(place, u, v)
        received = 2 * np.sum(np.maximum(toward[:, 2], 0) * solid) / np.pi
        half = [shaded(name, lamp(place, u, v), {"base_color": base, "alpha": 0.3}, UP[None], view)
                for base in (1.0, 0.0)]  # fmt: skip
        base = (half[0] - half[1])[:, 0]
        np.testing.assert_allclose(base, (1 - lobe) * received, rtol=5e-3)


def glossy_lamp(name):
    """The lobe of a metal, against 100,000 points of lamps of radiance 2."""
    errors = []
    view, _ = fan(4, 65)
    for place, u, v in LAMPS:
        toward, solid = sampled(place, u, v)
        for alpha in (0.1, 0.25, 0.5, 1.0):
            value = shaded(name, lamp(place, u, v), {"alpha": alpha, "metallic": 1.0}, UP[None],
                           view)[:, 0]  # fmt: skip
            expected = [2 * np.sum(facets(alpha, toward, one)[1] * solid) for one in view]
            errors.append(abs(value - expected))
    assert np.mean(errors) < 0.006
    assert np.max(errors) < 0.04


def mirrored_lamp(name):
    """A smooth metal shows the lamp where the mirrored ray meets it, and black beside it."""
    view, cosine = fan(40, 80)
    turned = view * (-1, -1, 1)
    place = np.array([-2.0, 0, 1.5])
    value = shaded(name, lamp(place, (0, 1, 0), (0.4, 0, 0.5)),
                   {"alpha": 1e-4, "base_color": 0.4, "metallic": 1.0}, UP[None], view)  # fmt: skip
    normal = np.cross((0, 1, 0), (0.4, 0, 0.5))
    hit = turned * ((place @ normal) / (turned @ normal))[:, None] - place
    along = hit @ (0.4, 0, 0.5) / (0.4**2 + 0.5**2)
    is_seen = (abs(along) < 1) & (turned @ normal * (place @ normal) > 0)
    clear = abs(abs(along) - 1) > 0.02
    expected = 2 * is_seen[:, None] * schlick(0.4, cosine)
    assert 3 < is_seen.sum() < 35
    np.testing.assert_allclose(value[clear], np.tile(expected[clear], 3), atol=0.02)


CHECKS = {
    "split_sum": (white_furnace, constant_environment, blurred_map, mirror, no_sun_twice),
    "harmonics": (quadratic, a_small_lamp, no_sun_twice),
    "ltc": (lambert, glossy_lamp, mirrored_lamp),
}


@pytest.mark.guarantee(
    "kernel", "Split sum, harmonics and transformed cosines agree with closed forms."
)
@pytest.mark.parametrize("name", CHECKS)
def test_a_shader_of_the_documentation_has_its_closed_forms(rgb, name):
    for check in CHECKS[name]:
        check(str(SHADERS / f"{name}.py"))
