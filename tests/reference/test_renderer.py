"""Rendering in passes: sums, common camera rays, and light."""

from contextlib import nullcontext
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.pairing import halves
from fotismos.reference.rendering import renderer, sums
from fotismos.reference.rendering.gbuffer import size_of_width
from fotismos.reference.rendering.passes import Stream, pass_seed, passes
from tests.shared.parts import camera, look_at, moved

GLOSSY = {"type": "roughplastic", "alpha": 0.3, "diffuse_reflectance": 0.4}
DIFFUSE = {"type": "diffuse", "reflectance": 0.6}


def scene(size=24, **lights):
    """A diffuse sphere on a floor."""
    return {
        "type": "scene",
        "sensor": camera((0, -6, 3), size=size, sampler={"type": "multijitter"}),
        "sphere": {"type": "sphere", "bsdf": GLOSSY},
        "floor": {"type": "rectangle", "to_world": moved((0, 0, -1), 4), "bsdf": DIFFUSE},
        **lights,
    }


POINT = {"type": "point", "position": (2, -2, 3), "intensity": 8.0}
SECOND = {"type": "point", "position": (-3, -1, 2), "intensity": 5.0}
CONSTANT = {"type": "constant", "radiance": 0.3}


def lamp():
    return {
        "type": "rectangle",
        "to_world": look_at((-2, 1, 3)).scale(0.8),
        "emitter": {"type": "area", "radiance": 6.0},
    }


def estimate(made, integrator, spp, count, first_seed=0):
    half = renderer.Renderer(made, integrator, spp, "a test")
    total = sums.Accumulator()
    for seed in range(count):
        total.add(half.render(first_seed + seed))
    return total.estimate()


@pytest.mark.parametrize(
    ("name", "integrator"), [("fig-8-9", "direct_all"), ("plastic-spheres", "path")]
)
def test_camera_rays_coincide_in_both_halves(rgb, name, integrator):
    """Same sampler and seed: what the pixels see differs by exactly nothing."""
    pair = halves.pair(SCENES[name].source(), halves.PairOptions(resolution=(48, 48)))

    def positions(half, nested):
        made = half.instantiate()
        aov = mi.load_dict(
            {"type": "aov", "aovs": "P:position", "image": nested or made.integrator()}
        )
        return np.array(mi.render(made, integrator=aov, spp=4, seed=9))[..., -3:]

    heuristic = positions(pair.heuristic, None)
    physical = positions(pair.physical, mi.load_dict({"type": integrator}))
    assert heuristic.any()
    np.testing.assert_array_equal(heuristic, physical)


def test_no_two_runs_have_a_pass_in_common():
    """Seeds of runs next to each other, of 64 passes each and of every stream."""
    streams = list(Stream)
    seeds = [
        pass_seed(seed, number, stream)
        for seed in range(50)
        for number in range(64)
        for stream in streams
    ]
    assert all(0 <= seed < 2**32 for seed in seeds)
    # Of 9,600 numbers of 32 bits, 0.01 pairs are expected to be equal by chance.
    assert len(set(seeds)) == len(seeds) == 50 * 64 * len(streams)


def check_same_means(made, ours, theirs, passes):
    """Compare two integrators: in no pixel do the means differ by more than the noise.

    Two-sided t-test on every pixel and channel, with Šidák's correction, so that a right
    implementation fails once in a thousand seeds.
    """
    ours, theirs = (
        estimate(made, mi.load_dict(description), 256, passes, first_seed)
        for description, first_seed in ((ours, 0), (theirs, 1000))
    )
    difference = ours.mean - theirs.mean
    error = np.hypot(ours.standard_error, theirs.standard_error)
    noisy = error > 1e-6
    assert noisy.mean() > 0.5
    t = difference[noisy] / error[noisy]
    each = 1 - (1 - 0.001) ** (1 / t.size)
    assert np.abs(t).max() < stats.t.isf(each / 2, passes - 1)
    assert abs(t.mean()) < 0.15  # and none of them leans to one side
    np.testing.assert_allclose(ours.mean[~noisy], theirs.mean[~noisy], atol=1e-5)
    return ours, theirs


@pytest.mark.parametrize("hide_emitters", [False, True])
def test_direct_light_is_that_of_mitsubas_direct(rgb, hide_emitters):
    """Point, area and constant light, each at every sample, which is less noise for the same."""
    made = mi.load_dict(scene(12, one=POINT, two=SECOND, lamp=lamp(), sky=CONSTANT))
    integrators = (
        {"type": kind, "hide_emitters": hide_emitters} for kind in ("direct_all", "direct")
    )
    ours, theirs = check_same_means(made, *integrators, passes=32)
    assert ours.standard_error.mean() < theirs.standard_error.mean()


def test_indirect_light_is_that_of_mitsubas_path(rgb):
    """Between a sphere and a floor, of points, a lamp and the sky."""
    made = mi.load_dict(scene(12, one=POINT, two=SECOND, lamp=lamp(), sky=CONSTANT))
    integrators = ({"type": kind, "max_depth": -1} for kind in ("direct_all", "path"))
    check_same_means(made, *integrators, passes=32)


def test_a_size_is_of_its_passes_alone(rgb):
    """Renderers that share a scene give at each size what a scene of that size gives."""

    direct = mi.load_dict({"type": "direct"})

    def alone(size):
        half = renderer.Renderer(mi.load_dict(scene(size, point=POINT)), direct, 4, "a test")
        return [np.array(image) for image in half.passes(2, seed=5)]

    made = mi.load_dict(scene(24, point=POINT))
    pair = [renderer.Renderer(made, direct, 4, "a test", size=size) for size in (None, (16, 16))]
    for size in (None, (12, 12), None, (8, 8), (12, 12)):
        found = [tuple(map(np.array, images)) for images in passes(pair, 5, 2, size=size)]
        for images, own in zip(zip(*found, strict=True), (24, 16), strict=True):
            np.testing.assert_array_equal(images, alone(size[0] if size else own))


def test_sources_take_turns_and_those_of_a_variant_follow_each_other():
    """With 0 or 1 changes of the variant a pass, and the same seeds for all."""
    said = []

    class Source(SimpleNamespace):
        def active(self):
            said.append(self.variant)
            return nullcontext()

        def passes(self, count, size, stream, seed):
            for number in range(count):
                said.append(self.name)
                yield pass_seed(seed, number, stream)

    sources = [Source(name=name, variant=name[0]) for name in ("a1", "b1", "a2")]
    found = list(passes(sources, 7, 3, stream=Stream.PRICE))
    assert found == [(pass_seed(7, number, Stream.PRICE),) * 3 for number in range(3)]
    forth = ["a", "a1", "a2", "b", "b1"]
    assert said == [*forth, "a", "a2", "a1", "b", "b1", *forth]


def test_surfaces_are_those_of_the_halves_whatever_was_rendered_last(rgb):
    """A pass of another size may have another shape, by the rounding of its rows."""
    ready = prepare(SCENES["fig-8-9"].source(), Options(resolution=(24, 16)))
    before = ready.traced().position
    size = size_of_width(ready.scene, ready.size, 128)
    assert [image.shape[:2] for image in ready.reference.passes(1, size)] == [(85, 128)]
    np.testing.assert_array_equal(ready.traced().position, before)
