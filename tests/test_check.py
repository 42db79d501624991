"""Checks of rendered scenes: unchanged ones pass, and small changes are caught."""

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from comparisons.case import open_case
from comparisons.check import baseline, check
from comparisons.check.measurement import measure
from comparisons.check.moved import differences, moved
from comparisons.compare import prepare
from comparisons.departure.spaces import DEFAULT_VIEWING
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from heuristic.errors import InputError
from reference.scene.source import Source

SMALL = Options(resolution=(64, 64))


def spheres(**changes):
    """The plastic spheres, with what their plastic has changed, or the distance of their lamp."""
    scene = SCENES["plastic-spheres"].make()
    for name in ("sphere-1", "sphere-2", "sphere-3"):
        bsdf = scene[name]["bsdf"] = dict(scene[name]["bsdf"])
        bsdf["alpha"] *= changes.get("alpha", 1)
        colour = bsdf["diffuse_reflectance"]["value"]
        value = tuple(changes.get("k_d", 1) * c for c in colour)
        bsdf["diffuse_reflectance"] = {"type": "rgb", "value": value}
    place = [changes.get("distance", 1) * x for x in (-3, -4, 7)]
    look = mi.ScalarTransform4f().look_at(place, (0, 0, 0), (0, 0, 1))
    scene["lamp"]["to_world"] = look.scale(0.5)
    return scene


def box(bounces=0):
    """The Cornell box, with more or fewer bounces."""
    scene = SCENES["cornell-box"].make()
    scene["integrator"]["max_depth"] += bounces
    return scene


def measured(make, seed=0, options=SMALL):
    return check.measure_scene(Source("scene", make), replace(options, seed=seed)).measurement


# --- Power -----------------------------------------------------------------------------------

CHANGES = {
    "1 % in k_d": (spheres, lambda: spheres(k_d=1.01)),
    "2 % in alpha": (spheres, lambda: spheres(alpha=1.02)),
    "the lamp at 1 % more distance": (spheres, lambda: spheres(distance=1.01)),
    "one bounce less": (box, lambda: box(bounces=-1)),
}


@pytest.mark.guarantee("checks", "A small change is caught, whatever the seed.")
@pytest.mark.parametrize("name", CHANGES)
def test_a_small_change_is_caught_with_another_seed(rgb, name):
    """In the reference, whose noise could hide it; the heuristic half has next to none."""
    before, after = CHANGES[name]
    moves = moved(differences(measured(before), measured(after, 1000)))
    assert any(move.half == "reference" for move in moves)


def test_what_moved_is_where_the_change_is(rgb):
    """Of one sphere alone: blocks without it, or its light on the floor, stay."""

    def third(factor):
        scene = spheres()
        value = tuple(factor * c for c in (0.1, 0.27, 0.36))
        scene["sphere-3"]["bsdf"]["diffuse_reflectance"] = {"type": "rgb", "value": value}
        return scene

    options = replace(SMALL, spp=64)
    result = check.check(
        Source("spheres", lambda: third(1.05)), options, measured(lambda: third(1), 0, options)
    )
    assert not result.passed
    blocks = {move.block for move in result.moved if move.block}
    assert {(2, 4), (3, 4)} <= blocks
    assert not blocks & {(1, 1), (2, 1), (1, 4), (4, 1)}
    p = result.p_values("reference")
    assert p[1, 3] < 0.01 < p[1, 0]
    assert result.change("reference")[1, 3].min() > 0


# --- False alarms ----------------------------------------------------------------------------


def pairs_of_measurements(make, resolution, count, spp=64, passes=16):
    """Differences of two independent measurements of a scene, made once, many times over."""
    ready = prepare(Source("scene", make), Options(resolution=resolution, spp=spp))
    for half in (ready.heuristic, ready.reference):
        half.spp = spp // passes
    for number in range(count):
        sides = [
            measure(ready, 2 * number * passes + shift, passes, DEFAULT_VIEWING)[0]
            for shift in (0, passes)
        ]
        yield differences(*sides)


def check_alarms(make, resolution, count, levels):
    """Alarms are no more than stated, and single p-values of noisy quantities are as they say."""
    alarms, small, noisy = dict.fromkeys(levels, 0), 0, 0
    for moves in pairs_of_measurements(make, resolution, count):
        for level in levels:
            alarms[level] += bool(moved(moves, level))
        p = np.array([move.p for move in moves if move.p < 1])
        small, noisy = small + np.sum(p < 0.05), noisy + len(p)
    for level in levels:
        assert alarms[level] <= stats.binom.ppf(0.999, count, level)
    assert noisy > 40 * count
    # Quantities of one check go together, so that the share is known less well than a binomial's.
    assert 0.02 < small / noisy < 0.08


def test_an_unchanged_scene_alarms_no_more_than_stated(rgb):
    check_alarms(SCENES["plastic-spheres"].make, (16, 16), 10, (0.05,))


@pytest.mark.guarantee(
    "checks",
    "Checks of an unchanged scene raise alarms no more often than stated.",
)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["plastic-spheres", "cornell-box"])
def test_200_checks_of_an_unchanged_scene_alarm_no_more_than_stated(rgb, name):
    check_alarms(SCENES[name].make, (32, 32), 200, (0.01, 0.05, 0.2))


def test_the_same_seed_gives_the_same_numbers(rgb):
    options = replace(SMALL, spp=32, resolution=(16, 16))
    result = check.check(Source("box", box), options, measured(box, 0, options))
    assert result.passed
    assert all(move.p == 1 for move in result.moves)


# --- The file --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def text():
    mi.set_variant("llvm_ad_rgb")
    found = measured(SCENES["fig-8-9"].make, 0, Options(resolution=(9, 3), spp=32))
    options = {"variant": "llvm_ad_rgb", "seed": 0, "resolution": [9, 3]}
    return baseline.of("fig-8-9", options, found).text()


def test_a_baseline_reads_as_it_was_written(text):
    again = baseline.parse(text, "x.json")
    assert again.text() == text
    assert again.measured().colours["reference"].blocks.shape == (3, 4, 3)
    assert len(text.splitlines()) < 90
    assert max(map(len, text.splitlines())) < 110


@pytest.mark.parametrize(
    ("old", "new", "expected"),
    [
        ('{\n  "record', "", "not JSON"),
        ('"record_version": 2', '"record_version": 3', "version 3"),
        ('"record_version": 2', '"format": "fotismos baseline 0"', "of fotismos 0.1"),
        ('"passes": 16', '"passes": 1', r"`int` >= 2 - at `\$.passes`"),
        ('"rmse"', '"rms"', "'rms' is not a metric"),
        ('"rmse": {', '"rmse": 1, "x": {', r"`object`, got `int` - at `\$.metrics"),
        ('"dE2000"', '"dE_ITP"', "'dE2000' is missing"),
        ('"mean": [', '"mean": ["x", ', "length 3, got 4"),
        ('"error": [', '"error": [-', ">= 0.0"),
        ('"value": ', '"value": NaN, "x": ', "unknown field `x`"),
        ('"value": ', '"value": 1e999, "noise_floor": ', "not finite"),
        ('"scene": "fig-8-9"', '"scene": 5', "got `int` - at"),
        ('"blocks": [', '"blocks": [[],', "x.json"),
    ],
)
def test_a_file_that_is_no_baseline_is_refused(text, old, new, expected):
    assert old in text
    with pytest.raises(InputError, match=expected) as refused:
        baseline.parse(text.replace(old, new, 1), "x.json")
    assert str(refused.value).startswith("x.json: ")
    assert "--update" in str(refused.value)


def test_a_baseline_of_the_version_before_is_read(text):
    old = text.replace('"record_version": 2', '"format": "fotismos baseline 1"')
    assert old != text
    assert baseline.parse(old, "x.json").text() == text


def test_a_metric_that_was_declared_later_is_not_tested(rgb):
    options = replace(SMALL, spp=32, resolution=(16, 16))
    before = measured(box, 0, options)
    names = [name for name in before.metrics if name != "dE_ITP"]
    result, whole = (
        check.check(Source("box", box), options, known) for known in (before.of(names), before)
    )
    assert result.passed
    assert len(result.moves) == len(whole.moves) - 1
    assert "dE_ITP" in result.after.metrics


def test_a_list_is_no_baseline():
    with pytest.raises(InputError, match="array"):
        baseline.parse("[]", "x.json")


def test_other_blocks_are_refused(rgb):
    options = Options(resolution=(3, 3), spp=32)
    before = measured(SCENES["fig-8-9"].make, 0, options)
    with pytest.raises(InputError, match="3 by 3 blocks, but the scene 4 by 4"):
        check.check(SCENES["fig-8-9"].source(), replace(options, resolution=(8, 8)), before)


def test_a_small_film_keeps_its_size_and_a_large_one_its_proportions(rgb):
    assert check.made_small(open_case("narrow-band-lamp")).options.resolution == (64, 20)
    film = {"type": "hdrfilm", "width": 30, "height": 50}
    scene = {"type": "scene", "sensor": {"type": "perspective", "film": film}}
    assert check.made_small(open_case(scene, name="small")).options.resolution == (30, 50)
