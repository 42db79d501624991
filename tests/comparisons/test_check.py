"""Checks of rendered scenes: unchanged ones pass, and small changes are caught."""

from functools import cache

import mitsuba as mi
import numpy as np
import pytest
from scipy import stats

from fotismos.comparisons.check.measurement import (
    baseline_of,
    measure_scene,
    measurement,
    read_baseline,
)
from fotismos.comparisons.check.moved import differences, moved
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.records.departure import DEFAULT_VIEWING
from fotismos.heuristic.errors import InputError
from fotismos.reference.scene.source import Source
from tests.shared.parts import look_at


def spheres(alpha=1, distance=1):
    """The plastic spheres; their roughness and the distance of their lamp change by factors."""
    scene = SCENES["plastic-spheres"].make()
    for name in ("sphere-1", "sphere-2", "sphere-3"):
        bsdf = scene[name]["bsdf"]
        scene[name]["bsdf"] = bsdf | {"alpha": alpha * bsdf["alpha"]}
    place = [distance * x for x in (-3, -4, 7)]
    scene["lamp"]["to_world"] = look_at(place).scale(0.5)
    return scene


def box(bounces=0):
    """The Cornell box, with more or fewer bounces."""
    scene = SCENES["cornell-box"].make()
    scene["integrator"]["max_depth"] += bounces
    return scene


@cache
def measured(make, seed=0, resolution=(64, 64), spp=None):
    options = Options(seed=seed, resolution=resolution, spp=spp)
    return measure_scene(Source("scene", make), options).measurement


# --- What is measured ------------------------------------------------------------------------


def test_a_picture_is_not_checked_like_a_model(rgb):
    with pytest.raises(InputError, match=r"renders what half.exr would replace"):
        measure_scene(Source("scene", spheres), Options(image=("half.exr",)))


def test_the_noise_floor_has_no_light_in_it_for_an_odd_number_of_passes():
    images = np.empty((5, 2, 8, 8, 3))
    images[:, 0] = 0.2
    images[:, 1] = 0.6
    numbers = measurement(images, np.ones((8, 8), bool), DEFAULT_VIEWING)
    assert numbers.metrics["dE2000"].value > 10
    assert numbers.metrics["dE2000"].noise_floor == pytest.approx(0, abs=1e-4)


# --- Power -----------------------------------------------------------------------------------


@pytest.mark.guarantee("checks", "A small change is caught, whatever the seed.")
@pytest.mark.parametrize(
    ("before", "after"),
    [
        pytest.param(spheres, lambda: spheres(alpha=1.02), id="2 % in alpha"),
        pytest.param(
            spheres,
            lambda: spheres(distance=1.01),
            id="the lamp at 1 % more distance",
            marks=pytest.mark.thorough,
        ),
        pytest.param(
            box, lambda: box(bounces=-1), id="one bounce less", marks=pytest.mark.thorough
        ),
    ],
)
def test_a_small_change_is_caught_with_another_seed(rgb, before, after):
    """In the reference, whose noise could hide it; the heuristic half has next to none."""
    moves = moved(differences(measured(before), measured(after, 1000)))
    assert any(move.half == "reference" for move in moves)


# --- False alarms ----------------------------------------------------------------------------


@pytest.mark.guarantee("checks", "Unchanged scenes raise alarms no more often than stated.")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["plastic-spheres", "cornell-box"])
def test_200_checks_of_an_unchanged_scene_alarm_no_more_than_stated(rgb, name):
    """Single p-values of noisy quantities are as they say, too."""
    source = SCENES[name].source()
    alarms = {0.01: 0, 0.05: 0, 0.2: 0}
    p_values = []
    for number in range(200):
        sides = [
            measure_scene(source, Options(resolution=(32, 32), spp=64, seed=2 * number + side))
            for side in (0, 1)
        ]
        moves = differences(*(side.measurement for side in sides))
        for level in alarms:
            alarms[level] += bool(moved(moves, level))
        p_values += [move.p for move in moves if move.p < 1]
    for level, count in alarms.items():
        assert count <= stats.binom.ppf(0.999, 200, level)
    assert len(p_values) > 8000
    # Quantities of one check go together, so that the share is known less well than a binomial's.
    assert 0.02 < np.mean(np.array(p_values) < 0.05) < 0.08


# --- The file --------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def text():
    mi.set_variant("llvm_ad_rgb")
    found = measured(SCENES["fig-8-9"].make, 0, (9, 3), 32)
    options = {"variant": "llvm_ad_rgb", "seed": 0, "resolution": [9, 3]}
    return baseline_of("fig-8-9", options, found).text()


def test_a_baseline_reads_as_it_was_written(text):
    again = read_baseline(text, "x.json")
    assert again.text() == text
    assert again.measured().reference.means().shape == (3, 4, 3)
    assert len(text.splitlines()) < 90
    assert max(map(len, text.splitlines())) < 110


REFUSED = (
    ('{\n  "record', "", "not JSON"),
    ('"record_version": 4', '"record_version": 9', "record_version` is 9, not"),
    ('"record_version": 4', '"format": "fotismos baseline 1"', "of fotismos 0.1"),
    ('"passes": 16', '"passes": 1', r"`int` >= 2 - at `\$.passes`"),
    ('"rmse"', '"rms"', "'rms' is not a metric"),
    ('"dE2000"', '"dE_ITP"', "'dE2000' is missing"),
    ('"error": [', '"error": [-', ">= 0.0"),
    ('"value": ', '"value": NaN, "x": ', "unknown field `x`"),
    ('"value": ', '"value": 1e999, "noise_floor": ', "not finite"),
)


def test_a_file_that_is_no_baseline_is_refused(text):
    for old, new, expected in REFUSED:
        assert old in text
        with pytest.raises(InputError, match=expected) as refused:
            read_baseline(text.replace(old, new, 1), "x.json")
        assert str(refused.value).startswith("x.json: ")
        assert "--update" in str(refused.value)
    with pytest.raises(InputError, match="array"):
        read_baseline("[]", "x.json")
