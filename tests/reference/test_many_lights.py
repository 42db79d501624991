"""Many lights: each is evaluated in one loop."""

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.reference.rendering import direct
from tests.shared.parts import camera, look_at, moved, rgb_of

ALBEDO = 0.5
SIDE = 20
RAYS = SIDE**2


def floor(**parts):
    """A diffuse floor in z = 0, seen by a camera above it."""
    diffuse = {"type": "diffuse", "reflectance": ALBEDO}
    return {
        "type": "scene",
        "floor": {"type": "rectangle", "to_world": moved(0, 3), "bsdf": diffuse},
        "camera": camera((0, -3, 8), size=SIDE, fov=30.0),
        **parts,
    }


def numbers(rng, low, high, size):
    return [float(value) for value in rng.uniform(low, high, size)]


def places(rng):
    return [*numbers(rng, -3, 3, 2), *numbers(rng, 0.5, 4, 1)]


def colour(rng):
    return rgb_of(*numbers(rng, 0, 1, 3))


def point(rng):
    return {"type": "point", "position": places(rng), "intensity": colour(rng)}


def directional(rng):
    toward = [*numbers(rng, -1, 1, 2), -1.0]
    return {"type": "directional", "direction": toward, "irradiance": colour(rng)}


def spot(rng):
    target = [*numbers(rng, -2, 2, 2), 0.0]
    return {
        "type": "spot",
        "to_world": look_at(places(rng), target, [0, 1, 0]),
        "intensity": colour(rng),
        "cutoff_angle": 40.0,
        "beam_width": 30.0,
    }


def lamp(rng):
    emitter = {"type": "area", "radiance": colour(rng)}
    return {"type": "sphere", "center": places(rng), "radius": 0.05, "emitter": emitter}


def lights(kind, count):
    rng = np.random.default_rng(count)
    return {f"{kind.__name__}_{number}": kind(rng) for number in range(count)}


def rays(made, repeats=1):
    """Camera rays through even places of the film."""
    film = np.indices((SIDE, SIDE)).reshape(2, RAYS) / SIDE + 0.5 / SIDE
    film = mi.Point2f(*np.tile(film, repeats).astype(np.float32))
    return made.sensors()[0].sample_ray_differential(0.0, 0.5, film, mi.Point2f(0.5))[0]


def radiance(made, repeats=1, **parameters):
    """What the rays see, (3, repeats, RAYS)."""
    direct.register()
    integrator = mi.load_dict({"type": "direct_all"} | parameters)
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(dr.opaque(mi.UInt32, 7), RAYS * repeats)
    colour, _, _ = integrator.sample(made, sampler, rays(made, repeats))
    return np.array(mi.Color3f(colour), float).reshape(3, repeats, RAYS)


def expected(parts, met):
    """The closed form in double precision: ``rho / pi sum_k E_k cos theta_k``, (3, points)."""
    total = np.zeros_like(met)
    for part in parts.values():
        if part["type"] == "directional":
            toward = -np.array(part["direction"])[:, None] + 0 * met
            strength = 1.0
        else:
            matrix = np.array(part["to_world"].matrix) if "to_world" in part else None
            origin = part["position"] if matrix is None else matrix[:3, 3]
            toward = np.asarray(origin, float)[:, None] - met
            strength = 1 / np.sum(toward**2, axis=0)
        toward = toward / np.linalg.norm(toward, axis=0)
        if part["type"] == "spot":
            angle = np.degrees(np.arccos(-matrix[:3, 2] @ toward))
            width, edge = part["beam_width"], part["cutoff_angle"]
            strength = strength * np.clip((edge - angle) / (edge - width), 0, 1)
        colour = part["irradiance" if part["type"] == "directional" else "intensity"]["value"]
        total += np.outer(colour, strength * np.maximum(toward[2], 0))
    return ALBEDO / np.pi * total


def test_the_sum_is_that_of_the_closed_form(rgb):
    parts = lights(point, 100) | lights(directional, 100) | lights(spot, 100)
    made = mi.load_dict(floor(**parts))
    found, met = radiance(made)[:, 0], np.array(made.ray_intersect(rays(made)).p, float)
    want = expected(parts, met)
    np.testing.assert_allclose(found, want, rtol=2e-4, atol=1e-5 * want.max())
    assert np.abs(found / want - 1).mean() < 2e-6


def test_lamps_in_a_loop_have_the_mean_of_mitsubas_direct(rgb):
    made, repeats = mi.load_dict(floor(**lights(lamp, 20))), 256
    ours = radiance(made, repeats)
    theirs = radiance(made, 4 * repeats, type="direct")
    means, errors = zip(
        *((x.mean(), x.mean(axis=(0, 2)).std(ddof=1) / x.shape[1] ** 0.5) for x in (ours, theirs)),
        strict=True,
    )
    assert abs(means[0] - means[1]) < 4 * np.hypot(*errors)
    assert errors[0] < 0.003 * means[0]
