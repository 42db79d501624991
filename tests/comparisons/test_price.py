"""The price of a scene: samples that pass, effects needed, and what a plan saves."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons import price
from fotismos.comparisons.case import open_case
from fotismos.comparisons.compare import compare
from fotismos.comparisons.departure.criterion import LIMIT
from fotismos.comparisons.departure.metrics import LEADING, THRESHOLDS
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import guarded
from fotismos.comparisons.records.comparison import MOST_SPP
from fotismos.comparisons.records.departure import DEFAULT_VIEWING, VisibleShare
from fotismos.comparisons.steps import PRICE, steps
from fotismos.reference.rendering.passes import passes
from fotismos.reference.rendering.transport import power_share
from tests.shared import noisy_scenes
from tests.shared.misplanned import DIFFUSE, scene
from tests.shared.parts import camera, moved

AT_TWO = THRESHOLDS.index(2.0)
GREY = 0.3


def priced(make, why=False, **options):
    """Return the price of a scene."""
    case = open_case(make, Options(**options))
    then = steps(why=why)
    return compare(case.source, case.options, then=then).record.price


# --- Samples ---------------------------------------------------------------------------------


def normal(deviation, counts=(4, 64), pixels=4000):
    """Return the noise of pictures of a grey with some samples, from normal noise of one sample."""
    rng = np.random.default_rng(1)
    found = []
    for spp in counts:
        deviations = deviation / spp**0.5 * rng.normal(size=(2, pixels, 1)) * np.ones(3)
        clean = np.full((pixels, 3), GREY)
        found.append(price.Noise(clean, deviations, spp, 2**0.5, DEFAULT_VIEWING))
    return found


def true_share(deviation, spp):
    """Return the share of pixels above ΔE2000 2, by many more pixels."""
    noise = deviation / spp**0.5 * np.random.default_rng(2).normal(size=(200_000, 1)) * np.ones(3)
    grey = np.full((200_000, 3), GREY)
    distances = LEADING.against(grey, ..., DEFAULT_VIEWING)(grey + noise)
    return np.mean(distances > 2.0)


@pytest.mark.guarantee(
    "attribution", "The samples of a price are the fewest with which normal noise passes."
)
@pytest.mark.parametrize("deviation", [0.01, 0.05, 0.3, 1.0, 2.0])
@pytest.mark.parametrize("counts", [(4, 64), (16, 128), (64,)])
def test_samples_are_the_fewest_that_pass(deviation, counts):
    """Whatever numbers of samples were rendered."""
    found = price.samples_that_pass(normal(deviation, counts))[AT_TWO]
    assert found.low <= found.value <= found.high
    assert true_share(deviation, found.high) <= LIMIT
    if found.value > 4:
        assert true_share(deviation, found.value / 4) > LIMIT or found.low < found.value


def test_noise_that_never_passes_needs_more_samples_than_are_named():
    found = price.samples_that_pass(normal(60.0))[AT_TWO]
    assert found.value is None
    assert true_share(60.0, MOST_SPP) > LIMIT


@pytest.mark.guarantee(
    "attribution",
    "With the samples of a price, scenes rendered with other seeds pass, and with a quarter of the"
    " least they fail or are undecided.",
)
@pytest.mark.parametrize(
    "name",
    [
        "metameric-pair",
        *(
            pytest.param(name, marks=pytest.mark.thorough)
            for name in SCENES
            if name != "metameric-pair"
        ),
    ],
)
@pytest.mark.parametrize("spp", [16, pytest.param(None, marks=pytest.mark.thorough)])
def test_a_scene_passes_with_the_samples_of_its_price(name, spp, rgb):
    case = open_case(name, Options(resolution=(48, 48), spp=spp))
    found = compare(case.source, case.options, then=[PRICE]).record.price
    ready = guarded(case.source, case.options)
    counted = ready.counted

    def pictures(spp, seed, count):
        """Return pictures of the halves, (count, 2, N, 3)."""
        halves = [half.sampled(spp) for half in (ready.heuristic, ready.reference)]
        made = [[np.array(each, float) for each in turn] for turn in passes(halves, seed, count)]
        return np.array(made)[:, :, counted]

    truth = pictures(1024, 900, 4)
    clean = truth[:, 1].mean(axis=0)
    middle = (truth[:, 1] - truth[:, 0]).mean(axis=0)
    distances = LEADING.against(clean, ..., case.options.viewing)

    def share(spp, threshold):
        made = pictures(spp, 5000, 2)
        deviations = made[:, 1] - made[:, 0] - middle
        return np.mean([distances(clean + each) > threshold for each in deviations])

    for threshold in (2.0, 4.0):
        samples = found.samples_at(threshold)
        most = samples.high or samples.value
        if most is not None and most <= 4096:
            assert share(most, threshold) <= LIMIT + 0.01
        if samples.low is not None and 4 < samples.low <= 4096:
            assert share(samples.low // 4, threshold) > LIMIT - 0.01


@pytest.mark.thorough
def test_where_bright_paths_are_rare_more_samples_may_be_needed(rgb):
    assert priced(noisy_scenes.metal_caustic).samples_at(2.0).high is None
    assert priced(noisy_scenes.sun_and_sky).samples_at(2.0).high is not None


# --- Effects ---------------------------------------------------------------------------------


def shares(low, high):
    """Return the same share at all thresholds."""
    share = (low + high) / 2
    return tuple(
        VisibleShare(threshold=threshold, value=share, low=low, high=high)
        for threshold in THRESHOLDS
    )


def test_the_fewest_effects_that_surely_pass_are_needed():
    visible = {
        (): shares(0.5, 0.6),
        ("shadows",): shares(0.04, 0.06),
        ("gloss",): shares(0.2, 0.3),
        ("shadows", "gloss"): shares(0.03, 0.045),
        ("gloss", "sky"): shares(0.01, 0.02),
        ("shadows", "gloss", "sky"): shares(0.0, 0.0),
    }
    found = price.effects_that_pass(visible)[AT_TWO]
    assert found.effects == ("gloss", "sky")
    assert found.visible.high == 0.02


@pytest.mark.thorough
@pytest.mark.guarantee(
    "attribution", "An image of the effects that a price needs passes, with other seeds too."
)
def test_the_effects_needed_pass_with_another_seed(rgb):
    found = [priced("fig-8-9", why=True, resolution=(48, 48), seed=seed) for seed in (0, 1)]
    for threshold in (2.0, 4.0):
        needed = [one.needed_at(threshold).effects for one in found]
        assert needed[0] == needed[1]
    assert found[0].needed_at(2.0).effects
    assert found[0].needed_at(10.0).effects == ()


# --- Pruning ---------------------------------------------------------------------------------


def test_what_a_plan_leaves_out_is_named_and_saves(rgb):
    found = priced("fig-8-9", resolution=(24, 24))
    assert found.left_out == (
        "the random choice of one light", "shadow rays", "interreflection",
        "the sampled environment",
    )  # fmt: skip
    assert found.saved.noise > 1.5
    assert priced("fig-8-9", resolution=(24, 24), everything=True).saved is None


@pytest.mark.thorough
def test_a_plan_is_as_quiet_as_everything_simulated_below_a_ball_that_shines(rgb):
    """Samples of the BSDF hit the lamp rarely; their weight must be small."""
    floor = {"type": "rectangle", "to_world": moved((0, 0, 0), 2), "bsdf": DIFFUSE}
    emitter = {"type": "area", "radiance": 10.0}
    lamp = {"type": "sphere", "center": (0, 0, 3), "radius": 0.4, "emitter": emitter}
    described = scene(floor=floor, lamp=lamp, sensor=camera((0, -6, 3), size=16))
    assert priced(lambda: described).saved.noise > 0.8


def test_weights_of_both_ways_to_find_a_light_add_up_to_one(rgb):
    densities = mi.Float([1e-6, 0.1, 1.0, 1e19, 1e30])
    other = mi.Float([1.0, 0.1, 1e-30, 1e-19, 1e30])
    both = power_share(densities, other) + power_share(other, densities)
    np.testing.assert_allclose(np.array(both), 1.0, rtol=1e-6)


# --- Limits ----------------------------------------------------------------------------------


def lit(size=16, **changes):
    """Return a floor under a lamp."""
    floor = {"type": "rectangle", "to_world": moved((0, 0, 0), 2), "bsdf": DIFFUSE}
    light = {"type": "point", "position": (0, 0, 3), "intensity": 20.0}
    return scene(
        **{"floor": floor, "light": light, "sensor": camera((0, -6, 3), size=size)} | changes
    )


BLACK = {"type": "point", "position": (0, 0, 3), "intensity": 0.0}
FAR = {"type": "rectangle", "to_world": moved((0, 0, -90), 0.1), "bsdf": DIFFUSE}


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("make", "options"),
    [
        (lambda: lit(size=(2, 1)), {"spp": 2}),
        (lit, {"noise": 1.0, "variant": "llvm_ad_mono"}),
        (lambda: lit(light=BLACK), {"allow_empty": True}),
    ],
    ids=["two pixels and samples", "a noise target in grey", "black"],
)
def test_every_scene_has_samples(rgb, make, options):
    found = priced(make, why=True, **options)
    assert len(found.samples) == len(THRESHOLDS)
    assert found.samples_at(2.0).value == 4
    assert found.needed_at(2.0).effects == ()


def test_an_empty_picture_has_no_samples(rgb):
    assert priced(lambda: lit(floor=FAR), allow_empty=True).samples == ()


def test_a_picture_in_place_of_the_textbook_half_has_samples_and_no_time(rgb, tmp_path):
    path = tmp_path / "picture.exr"
    image = mi.render(mi.load_dict(lit()), spp=16)
    mi.util.write_bitmap(str(path), image, write_async=False)
    found = priced(lit, image=str(path))
    assert found.ratio is None
    assert found.reason == price.NOT_TIMED
    assert found.samples_at(2.0).value is not None
