"""Many lights: each asked in one loop, or some picked in proportion to what they give."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from comparisons.compare import prepare
from comparisons.options import Options
from reference.planning import light_by_light
from reference.rendering import direct, light_choice, light_sums
from reference.rendering.light_choice import LightChoice
from reference.scene.source import Source
from reports.terminal import plan_lines

ALBEDO = 0.5
SIDE = 20
RAYS = SIDE**2
REPEATS = 256
T = mi.ScalarTransform4f


def floor(**parts):
    """A diffuse floor in z = 0, seen by a camera above it."""
    return {
        "type": "scene",
        "floor": {
            "type": "rectangle",
            "to_world": T().scale(3),
            "bsdf": {"type": "diffuse", "reflectance": ALBEDO},
        },
        "camera": {
            "type": "perspective",
            "fov": 30,
            "to_world": T().look_at([0, -3, 8], [0, 0, 0], [0, 0, 1]),
            "film": {"type": "hdrfilm", "width": 20, "height": 20},
        },
        **parts,
    }


def numbers(rng, low, high, size):
    return [float(value) for value in rng.uniform(low, high, size)]


def places(rng):
    return [*numbers(rng, -3, 3, 2), *numbers(rng, 0.5, 4, 1)]


def point(rng):
    return {"type": "point", "position": places(rng), "intensity": rgb_of(rng)}


def rgb_of(rng):
    return {"type": "rgb", "value": numbers(rng, 0, 1, 3)}


def directional(rng):
    toward = [*numbers(rng, -1, 1, 2), -1.0]
    return {"type": "directional", "direction": toward, "irradiance": rgb_of(rng)}


def spot(rng):
    target = [*numbers(rng, -2, 2, 2), 0.0]
    return {
        "type": "spot",
        "to_world": T().look_at(places(rng), target, [0, 1, 0]),
        "intensity": rgb_of(rng),
        "cutoff_angle": 40.0,
        "beam_width": 30.0,
    }


def lamp(rng):
    emitter = {"type": "area", "radiance": rgb_of(rng)}
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
    integrator = mi.load_dict({"type": "direct_all", **parameters})
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


@pytest.mark.parametrize("kinds", [(point,), (directional,), (spot,), (point, directional, spot)])
def test_the_sum_is_that_of_the_closed_form(rgb, kinds):
    parts = {}
    for kind in kinds:
        parts |= lights(kind, 100)
    made = mi.load_dict(floor(**parts))
    found, met = radiance(made)[:, 0], np.array(made.ray_intersect(rays(made)).p, float)
    want = expected(parts, met)
    np.testing.assert_allclose(found, want, rtol=2e-4, atol=1e-5 * want.max())
    assert np.abs(found / want - 1).mean() < 2e-6


def test_a_few_lights_are_unrolled_as_ever(rgb):
    """To the last bit the sum in order of what Mitsuba's emitters give."""
    made = mi.load_dict(floor(**lights(point, 8), **lights(spot, 8)))
    assert len(made.emitters()) == light_sums.UNROLLED
    ray = rays(made)
    si = made.ray_intersect(ray)
    bsdf, total = si.bsdf(ray), mi.Spectrum(0)
    for emitter in made.emitters():
        ds, weight = emitter.sample_direction(si, mi.Point2f(0.5))
        seen = (ds.pdf > 0) & ~made.ray_test(si.spawn_ray_to(ds.p))
        value = bsdf.eval(mi.BSDFContext(), si, si.to_local(ds.d), seen) * weight
        total += dr.select(seen, value, 0)
    np.testing.assert_array_equal(radiance(made)[:, 0], np.array(total, float))


def test_the_kernel_does_not_grow_with_the_lights(rgb):
    def operations(count):
        made = mi.load_dict(floor(**lights(point, count // 2), **lights(spot, count // 2)))
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            radiance(made)
            return [k["operation_count"] for k in dr.kernel_history([dr.KernelType.JIT])]

    few, many = operations(64), operations(256)
    assert len(few) == len(many)
    assert max(few) == max(many)


def check_mean(samples, truth, other=0.0):
    """Hold means against the truth, at a level of one in ten thousand for all rays together.

    ``other`` is the standard error of the truth.
    """
    samples, truth = samples.mean(axis=0), truth.mean(axis=0)
    error = np.hypot(samples.std(axis=0, ddof=1) / np.sqrt(len(samples)), other)
    difference, noisy = samples.mean(axis=0) - truth.mean(axis=0), error > 1e-6
    assert noisy.sum() > RAYS / 2
    np.testing.assert_allclose(difference[~noisy], 0, atol=1e-5)
    t = difference[noisy] / error[noisy]
    assert np.abs(t).max() < stats.norm.isf(1e-4 / 2 / RAYS)
    assert abs(t.mean()) < 4 / np.sqrt(RAYS)  # and they do not lean to one side
    return error


@pytest.mark.guarantee(
    "reference",
    "Lights that are picked in proportion to their contribution have the mean of all lights.",
)
def test_picked_lights_have_the_mean_of_all(rgb):
    made = mi.load_dict(floor(**lights(point, 150), **lights(spot, 100), **lights(directional, 50)))
    check_mean(radiance(made, REPEATS, light_samples=8), radiance(made))


@pytest.mark.parametrize(
    ("lamps", "bsdf_samples", "light_samples"),
    [(20, 0, 0), (20, 1, 0), (20, 0, 8), (20, 1, 8), (10, 1, 8)],
)
def test_sampled_lights_have_the_mean_of_unrolled_ones(
    rgb, monkeypatch, lamps, bsdf_samples, light_samples
):
    """Small spheres and the sky beside points; some of the spheres stand before others."""
    sky = {"type": "constant", "radiance": 0.3}
    made = mi.load_dict(floor(**lights(point, 20), **lights(lamp, lamps), sky=sky))
    options = {"bsdf_samples": bsdf_samples}
    found = radiance(made, REPEATS, light_samples=light_samples, **options)
    monkeypatch.setattr(light_sums, "UNROLLED", 100)
    truth = radiance(made, REPEATS, **options)
    spread = truth.mean(axis=0).std(axis=0, ddof=1) / np.sqrt(REPEATS)
    check_mean(found, truth, spread)


@pytest.mark.parametrize("bsdf_samples", [0, 1])
def test_picking_on_the_way_has_the_mean_of_picking_evenly(rgb, bsdf_samples):
    """Light that is reflected twice, between the floor and a wall."""
    upright = T().translate([0, 3.2, 0]).rotate([1, 0, 0], 90).scale(3)
    wall = {"type": "rectangle", "to_world": upright}
    sky = {"type": "constant", "radiance": 0.3}
    made = mi.load_dict(floor(**lights(point, 20), **lights(lamp, 20), sky=sky, wall=wall))
    options = {"bsdf_samples": bsdf_samples, "max_depth": 3}
    found = radiance(made, REPEATS, light_samples=8, **options)
    truth = radiance(made, 2 * REPEATS, **options)
    spread = truth.mean(axis=0).std(axis=0, ddof=1) / np.sqrt(2 * REPEATS)
    check_mean(found, truth, spread)


def test_picking_in_proportion_beats_picking_evenly(rgb, monkeypatch):
    rng = np.random.default_rng(0)
    parts = lights(point, 300)
    for part in parts.values():
        part["intensity"] = {"type": "rgb", "value": [float(rng.lognormal(0, 2))] * 3}
    made = mi.load_dict(floor(**parts))

    def variance():
        return radiance(made, REPEATS, light_samples=8).var(axis=1).mean()

    proportional = variance()
    monkeypatch.setattr(light_choice, "UNIFORM_SHARE", 1.0)
    assert variance() > 10 * proportional


def test_chances_are_never_zero(rgb):
    """Of lights that the camera's surface does not face, too, and where it sees none."""
    dark = {"type": "point", "position": [0, 0, 1], "intensity": 0.0}
    parts = lights(point, 20) | {"dark": dark}
    for made in (mi.load_dict(floor(**parts)), mi.load_dict({**floor(**parts), "floor": dark})):
        emitters = made.emitters()
        choice = LightChoice(made, emitters, 8)
        assert choice.chances.sum() == pytest.approx(1)
        assert choice.chances.min() >= light_choice.UNIFORM_SHARE / len(emitters)
        pointers = dr.gather(mi.EmitterPtr, made.emitters_dr(), dr.arange(mi.UInt32, len(emitters)))
        np.testing.assert_allclose(
            np.array(choice.expected(pointers, True)), 8 * choice.chances, rtol=1e-6
        )


@pytest.fixture
def few_asked(monkeypatch):
    """Count more than ten lights as thousands."""
    monkeypatch.setattr(light_by_light, "MOST_ASKED", 10)


def test_a_plan_picks_of_thousands_and_says_so(rgb, few_asked):
    def planned(count):
        ready = prepare(Source("many", floor(**lights(point, count))), Options(spp=8))
        report = plan_lines.report("many", ready, mi.variant())
        return ready, [rule.evidence for rule in report.rules], list(plan_lines.lines(report))

    ready, evidence, said = planned(10)
    assert ready.plan.exact
    assert ready.plan.light_samples == 0
    assert not any("in proportion" in line for line in (*evidence, *said))
    ready, evidence, said = planned(20)
    assert ready.plan.integrator == "direct_all"
    assert not ready.plan.exact
    assert "20 lights: 16 per sample are picked, in proportion to their light" in evidence
    assert any(line.startswith("integrator") and "16 lights per sample" in line for line in said)
    assert ready.reference.integrator.light_samples == light_choice.PICKS
