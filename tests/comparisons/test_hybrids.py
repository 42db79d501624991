"""Hybrids and attributions on real scenes: sums, closure, previews."""

from itertools import combinations
from types import SimpleNamespace

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons import attribution
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.hybrids import IN_EMISSION, HybridImages, HybridScenes
from fotismos.comparisons.ladder.methods import Ladder
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import guarded, prepare
from fotismos.comparisons.records.cost import Method
from fotismos.comparisons.steps import steps
from fotismos.reference.planning.effects import (
    ATTENUATION,
    BUMPS,
    CONE,
    ENVIRONMENT,
    EXTENDED,
    INTERREFLECTION,
    MICROFACETS,
    OCCLUSION,
    labelled,
)
from fotismos.reference.rendering.passes import Stream, passes
from fotismos.reference.scene.graph import set_variant
from fotismos.reference.scene.source import Source
from tests.shared import noisy_scenes
from tests.shared.misplanned import BLACK, DIFFUSE
from tests.shared.misplanned import scene as described
from tests.shared.noisy import require_equal, whole
from tests.shared.parts import camera, moved, rgb_of, shadowed
from tests.shared.programs import ROOT

MADE_OF = {
    "cornell-box": {"occlusion", "extended lights", "interreflection"},
    "fig-6-10": {
        "distance attenuation", "polygon interpolation", "microfacets and Fresnel", "environment",
    },
    "two-intensities": {"one intensity", "microfacets and Fresnel"},
    "narrow-band-lamp": {"occlusion", "spectral"},
}  # fmt: skip
"""Effects of scenes that between them have all that the built-in ones have."""


def bumpy(shadows=True):
    """A plate whose one normal is tilted away from a light at its side."""
    bumps = {
        "type": "normalmap",
        "normalmap": rgb_of(0.933, 0.5, 0.75),
        "use_shadowing_function": shadows,
        "inner": {"type": "diffuse"},
    }
    return {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "sensor": camera((0, 0, 5), up=(0, 1, 0), size=16),
        "light": {"type": "point", "position": [5, 0, 4], "intensity": 60.0},
        "plate": {"type": "rectangle", "bsdf": {"type": "twosided", "bumps": bumps}},
    }


def test_shadows_of_bumps_are_the_cause_where_only_they_differ(rgb):
    """Stock Mitsuba renders the plate without them as the textbook does."""
    source = Source("bumps", bumpy())
    options = Options(spp=16)
    ready = guarded(source, options)
    found = attribution.find(ready)
    removes = {part.effect: part.removes.value for part in found.record.effects}
    assert max(removes, key=removes.get) == BUMPS.label
    assert removes[BUMPS.label] > 2
    assert sum(removes.values()) == pytest.approx(removes[BUMPS.label], rel=1e-3)
    scenes = HybridScenes(ready.pair, ready.plan, ready.scene)
    pair = scenes.of(set(scenes.differences) - {BUMPS}), mi.load_dict(bumpy(shadows=False))
    path = mi.load_dict({"type": "path", "max_depth": 2})
    without, expected = (np.array(mi.render(scene, integrator=path, spp=64)) for scene in pair)
    np.testing.assert_allclose(without[6:10, 6:10], expected[6:10, 6:10], rtol=5e-3)


# -- Attribution -----------------------------------------------------------------------------------


@pytest.fixture(
    scope="module",
    params=[
        "cornell-box",
        *(
            pytest.param(name, marks=pytest.mark.thorough)
            for name in ("fig-6-10", "two-intensities", "narrow-band-lamp")
        ),
    ],
)
def found(request):
    """The causes of one small scene, and its kernel and reference, rendered anew."""
    case = open_case(request.param, Options(resolution=(24, 24)))
    ready = guarded(case.source, case.options)
    causes = attribution.find(ready)
    images = [whole(half).mean for half in (ready.heuristic, ready.reference)]
    yield SimpleNamespace(name=request.param, causes=causes, images=images)
    set_variant("llvm_ad_rgb")


def test_a_clamped_fall_off_is_a_cause(rgb):
    """A floor 0.4 below the lamp, where 1/d^2 exceeds 1."""
    lamp = {"type": "heuristic_point", "position": (0, 0, 0.4), "intensity": 0.5}
    description = {
        "type": "scene",
        "sensor": camera((0, -3, 3), size=24),
        "floor": {"type": "rectangle", "to_world": moved((0, 0, 0), 2), "bsdf": DIFFUSE},
        "lamp": lamp | {"k0": 0.0, "k2": 1.0, "clamped": True},
    }
    source = Source("clamped", description)
    ready = guarded(source, Options())
    record = attribution.find(ready).record
    assert record.departure > 0.5
    assert [entry.effect for entry in record.effects] == ["distance attenuation"]
    assert abs(record.closure.value) < 0.01 * record.departure


@pytest.mark.thorough
def test_in_fog_the_causes_are_said_to_be_unknown(rgb):
    """No image of some effects holds a medium: its light would be missing from all of them."""
    case = open_case(noisy_scenes.fog, Options(resolution=(8, 8), spp=16))
    record = compare(case.source, case.options, then=steps(why=True)).record
    assert record.why is None
    assert any("participating media (interior)" in warning for warning in record.warnings)


@pytest.mark.thorough
def test_a_pane_is_looked_through(rgb):
    """As docs/reading.md says, with numbers."""
    case = open_case(ROOT / "docs/scenes/pane.xml", Options())
    ready = guarded(case.source, case.options)
    record = attribution.find(ready).record
    removed = {entry.effect: entry.removes.value for entry in record.effects}
    assert set(removed) == {"occlusion", "interreflection", "extended lights", "transmission"}
    assert removed["occlusion"] == pytest.approx(5, abs=1)
    assert max(abs(removed[name]) for name in removed if name != "occlusion") < 2


@pytest.mark.guarantee(
    "attribution", "Attributions and closure add up to the departure in every pixel."
)
def test_attributions_add_up_to_the_departure_in_the_mean_and_in_every_pixel(found):
    causes = found.causes
    record = causes.record
    assert set(causes.maps) == MADE_OF[found.name]
    removed = [one.removes.value for one in record.effects]
    assert sum(removed) + record.closure.value == pytest.approx(record.departure, abs=1e-9)
    total = sum(causes.maps.values()) + causes.left
    np.testing.assert_allclose(total, causes.departure, atol=1e-9)
    assert causes.departure.max() > 1
    assert (causes.departure[~causes.counted] == 0).all()
    # Single precision: a few units in the last place of values around 1.
    assert record.implementation < 1e-3


def test_the_departure_is_that_of_the_kernel_rendered_anew(found):
    """Noise of a few samples on both sides; the mean over all pixels is sharper than one."""
    causes, (kernel, reference) = found.causes, found.images
    error = LEADING(kernel, reference, Options().viewing)[causes.counted].mean()
    departure = causes.departure[causes.counted].mean()
    assert departure == pytest.approx(error, abs=0.05 * error + 0.5)
    first, *_, last = causes.record.hybrids
    assert (first.effects, first.error) == ((), pytest.approx(departure))
    assert set(last.effects) == set(causes.maps)
    assert set(causes.previews) == {each.effects for each in causes.record.hybrids}


def removes(options):
    source = SCENES["cornell-box"].source()
    return attribution.find(guarded(source, options)).record


@pytest.mark.slow
@pytest.mark.guarantee("attribution", "A quick closure is unbiased to 1 % of the departure.")
def test_a_quick_closure_is_not_biased(rgb):
    records = [removes(Options(resolution=(48, 48), seed=seed)) for seed in range(5)]
    mean = np.mean([record.closure.value for record in records])
    assert abs(mean) < 0.01 * records[0].departure


@pytest.mark.guarantee(
    "attribution", "Intervals of attributions contain the converged value in 35 of 40 runs."
)
@pytest.mark.slow
def test_intervals_of_attributions_hold_the_converged_value(rgb, monkeypatch):
    def effects(seed):
        record = removes(Options(resolution=(48, 48), seed=seed))
        return {one.effect: one.removes for one in record.effects}

    runs = [effects(seed) for seed in range(40)]
    monkeypatch.setattr(attribution, "SPP", 64 * attribution.SPP)
    for effect, exact in effects(1_000).items():
        held = sum(one[effect].low <= exact.value <= one[effect].high for one in runs)
        width = np.median([one[effect].high - one[effect].low for one in runs])
        assert held >= 35
        assert width < max(0.25, exact.value / 2)


# -- Hybrids ---------------------------------------------------------------------------------------


class Shown:
    """Renders the hybrid of some effects: transported light, and what shines of itself."""

    def __init__(self, scenes, simulated, spp):
        glow = [scenes.emission(effect, spp) for effect in IN_EMISSION if effect not in simulated]
        transported = scenes.transport([simulated], spp).renderer
        self.renderers = [transported, *(renderer for renderer in glow if renderer is not None)]

    def render(self, seed):
        return sum(mi.TensorXf(renderer.render(seed)) for renderer in self.renderers)


def hybrid_scenes(source, size=24):
    ready = prepare(source, Options(resolution=(size, size)))
    return ready, HybridScenes(ready.pair, ready.plan, ready.scene)


def test_without_effects_the_plugins_give_the_kernels_image(rgb):
    for name in ("fig-8-9", "plastic-spheres", "fig-6-5-m40"):
        ready, scenes = hybrid_scenes(SCENES[name].source())
        found = np.array(Shown(scenes, (), ready.heuristic.pass_spp).render(3))
        expected = np.array(ready.heuristic.render(3))
        assert expected.max() > 0.1
        np.testing.assert_allclose(found, expected, atol=2e-5)


def test_without_effects_clear_surfaces_are_looked_through_as_by_the_kernel(rgb):
    """Without interreflection, too: light from behind passes glass and masks without a bounce."""
    glass = {"type": "sphere", "center": (0, 0, 1), "radius": 0.6, "bsdf": {"type": "dielectric"}}
    mask = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate((0.5, 0.5, 2)),
        "bsdf": {"type": "mask", "opacity": 0.4, "nested": DIFFUSE},
    }
    wall = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate((0, 0, -1)).scale(4),
        "bsdf": {"type": "diffuse", "reflectance": {"type": "rgb", "value": (0.8, 0.3, 0.1)}},
    }
    scene = {
        "type": "scene",
        "sensor": camera((0, 0, 6), up=(0, 1, 0)),
        "sky": {"type": "constant", "radiance": 0.3},
        "lamp": {"type": "point", "position": (1, 2, 4), "intensity": 20.0},
        "glass": glass,
        "mask": mask,
        "wall": wall,
    }
    case = open_case(scene, Options(resolution=(24, 24), spp=16))
    ready = guarded(case.source, case.options)
    record = attribution.find(ready).record
    assert {"interreflection", "transmission"} <= {one.effect for one in record.effects}
    assert record.implementation < 1e-3


def lit_by_all():
    """A ball over a floor that an extended lamp, parallel light, three spots and a sky shine on."""
    spots = {
        f"spot-{number}": {
            "type": "spot",
            "to_world": mi.ScalarTransform4f().look_at((x, 0, 4), (x, 0, 0), (0, 1, 0)),
            "intensity": rgb_of(4.0, 2.0, 1.0),
            "cutoff_angle": 30.0,
        }
        for number, x in enumerate((-1.5, 0.0, 1.5))
    }
    plastic = {"type": "roughplastic", "diffuse_reflectance": rgb_of(0.6, 0.3, 0.2), "alpha": 0.2}
    lamp = {"type": "sphere", "center": (-2, -1, 3), "radius": 0.5}
    return spots | {
        "type": "scene",
        "sensor": camera((0, -5, 3), (0, 0, 0.5), size=24),
        "floor": {"type": "rectangle", "to_world": moved(0, 4), "bsdf": DIFFUSE},
        "ball": {"type": "sphere", "center": (0, 0, 1), "radius": 0.8, "bsdf": plastic},
        "lamp": lamp | {"light": {"type": "area", "radiance": 3.0}},
        "sun": {"type": "directional", "direction": (1, 1, -2), "irradiance": 0.5},
        "bulb": {"type": "heuristic_point", "position": (2, -1, 3), "intensity": 2.0, "k2": 0.1},
        "sky": {
            "type": "sunsky",
            "sun_direction": (0.4, -0.5, 0.6),
            "sun_scale": 0.1,
            "sky_scale": 0.1,
        },
    }


def test_the_textbooks_sun_shines_only_in_place_of_a_sky(rgb):
    _, scenes = hybrid_scenes(open_case(lit_by_all, Options()).source)
    everything = set(scenes.differences)
    for effect in (EXTENDED, MICROFACETS, ENVIRONMENT):
        lights = [light.id() for light in scenes.of(everything - {effect}).emitters()]
        assert ("sun of sky" in lights) is (effect is ENVIRONMENT)
        assert ("sky" in lights) is (effect is not ENVIRONMENT)


@pytest.mark.thorough
@pytest.mark.guarantee("attribution", "Parts of one trace add up to a rendering of each image.")
@pytest.mark.parametrize(("scene", "count"), [("cornell-box", 1), (lit_by_all, 4)])
def test_images_of_one_rendering_are_those_of_a_rendering_each(rgb, scene, count):
    """Alone, only the image with all effects draws the same random numbers: paths come first."""
    case = open_case(scene, Options(resolution=(24, 24)))
    _, scenes = hybrid_scenes(case.source)
    lights = {ATTENUATION, CONE, ENVIRONMENT, EXTENDED} & set(scenes.differences)
    assert len(lights) == count
    surfaces = set(scenes.differences) & {MICROFACETS}
    left_out = [{OCCLUSION}, {INTERREFLECTION}, lights, *({light} for light in lights)]
    chosen = {frozenset(scenes.differences) - some - surfaces for some in (set(), *left_out)}
    sets = sorted(chosen, key=repr)
    assert len({scenes.rendered_alike(each) for each in sets}) == 1
    parts = scenes.transport(sets, 256)
    passes_of_all = [
        np.split(np.array(parts.renderer.render(seed)), parts.count, axis=2) for seed in range(8)
    ]
    together = np.array([parts.added(found) for found in passes_of_all])
    for number, simulated in enumerate(sets):
        alone = scenes.transport([simulated], 256).renderer
        found = np.array([np.array(alone.render(seed)) for seed in range(20, 28)])
        of_passes = [each.mean(axis=(1, 2)) for each in (together[:, number], found)]
        error = np.sqrt(sum(means.var(axis=0, ddof=1) / 8 for means in of_passes))
        gap = abs(of_passes[0].mean(axis=0) - of_passes[1].mean(axis=0))
        assert (gap < 5 * error + 1e-4).all(), simulated
    means = together.mean(axis=0)
    assert min(abs(one - two).mean() for one, two in combinations(means, 2)) > 1e-4


@pytest.mark.guarantee("attribution", "With all effects simulated, no departure remains.")
def test_with_all_effects_they_give_the_reference(rgb):
    for name in ("fig-8-9", "cornell-box"):
        ready, scenes = hybrid_scenes(SCENES[name].source())
        found = whole(Shown(scenes, scenes.differences, 64))
        ready.reference.pass_spp = 64
        require_equal(found, whole(ready.reference, seed=90), name)


@pytest.mark.thorough
def test_light_without_shadows_passes_through_what_is_in_its_way(rgb):
    """A lamp behind a board: black with shadows, and without them what the lamp gives alone."""

    def board(factor, height=0, bsdf=BLACK, **more):
        return {"type": "rectangle", "to_world": moved((0, 0, height), factor), "bsdf": bsdf} | more

    # The camera stands under the board, which it does not see.
    lamp = board((0.5, 0.5, -0.5), 3, emitter={"type": "area", "radiance": 20.0})
    view = described((0, -3, 1.5), size=16, floor=board(2, bsdf=DIFFUSE), lamp=lamp)
    images = {}
    for key, parts in (("open", {}), ("hidden", {"board": board(4, 2)})):
        _, scenes = hybrid_scenes(Source(key, view | parts), 16)
        everything = set(scenes.differences)
        shown = (Shown(scenes, each, 64) for each in (everything, everything - {OCCLUSION}))
        images[key] = [whole(each) for each in shown]
    assert images["open"][0].mean.max() > 0.1
    assert images["hidden"][0].mean.max() < 1e-6
    found = images["hidden"][1]
    np.testing.assert_allclose(
        found.mean, images["open"][0].mean, atol=8 * found.standard_error.max() + 1e-4
    )


@pytest.mark.guarantee(
    "attribution", "A preview of the switchboard equals a rendering with its effects."
)
def test_a_preview_is_the_same_image_in_finer_pixels(rgb):
    """By the kernel's own shadow rays, where the hybrid has Mitsuba's direct light."""
    scene = shadowed(24)
    scene["sensor"]["film"]["rfilter"] = {"type": "box"}
    case = open_case(scene, Options.of({"resolution": (24, 24)}), "shadowed")
    found = Ladder(guarded(case.source, case.options))
    hybrids = HybridImages(found.pairs, found.scenes, 3, 16, 0, (24, 24))
    for effects in ((), ("occlusion",)):
        image = hybrids.simulating({labelled(effect) for effect in effects})
        assert image.shape == (3, 48, 48, 3)
        corner = hybrids.pixels(image)[:, 1, 2]
        np.testing.assert_allclose(corner, image[:, 2:4, 4:6].mean(axis=(1, 2)), rtol=1e-5)
    for half in (found.ready.reference, found.ready.heuristic):
        assert half.render(0).shape[:2] == (24, 24)
    shadows = Method(name="shadows", family="kernel", shadows=True)
    loop = passes([found.renderer(shadows, 4, (48, 48))], 0, 3, stream=Stream.REPLICATES)
    expected = np.mean([np.array(one[0]) for one in loop], axis=0)
    np.testing.assert_allclose(image.mean(axis=0), expected, rtol=1e-3, atol=1e-4)
    assert abs(image - hybrids.simulating(())).max() > 0.05


@pytest.mark.thorough
@pytest.mark.guarantee(
    "attribution", "Previews with light between surfaces have half the noise of their samples."
)
def test_a_clean_reference_takes_noise_out_of_previews(rgb):
    """By two runs that share nothing but the scene; the means stay."""
    case = open_case("cornell-box", Options(resolution=(48, 48)))
    ladder = Ladder(guarded(case.source, case.options))
    ladder.ready.reference.pass_spp = 256
    total = whole(ladder.ready.reference)
    clean = total.mean, total.standard_error
    runs = [HybridImages(ladder.pairs, ladder.scenes, 4, 16, seed, (24, 24)) for seed in (1, 2)]
    for effects in ({INTERREFLECTION}, {INTERREFLECTION, OCCLUSION}, runs[0].effects):
        plain, quiet = (
            [each.previews([frozenset(effects)], given)[0] for each in runs]
            for given in (None, clean)
        )
        before, after = (np.sqrt(np.mean((one - two) ** 2)) for one, two in (plain, quiet))
        assert after < 0.5 * before
        assert np.mean(quiet) == pytest.approx(np.mean(plain), rel=0.02)


@pytest.mark.thorough
def test_a_crop_keeps_its_place_in_finer_pixels(rgb):
    parts = shadowed(64)
    crop = {"crop_width": 24, "crop_height": 32, "crop_offset_x": 21, "crop_offset_y": 17}
    parts["sensor"]["film"] |= crop
    case = open_case(parts, Options(), "cropped")
    record = compare(case.source, case.options, then=steps(why=True)).record
    assert abs(record.why.closure.value) < 0.05 < record.why.departure
    assert record.why.departure == pytest.approx(record.metrics["dE2000"].mean, rel=0.1)
