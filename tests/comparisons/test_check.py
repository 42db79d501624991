"""Checks of rendered scenes: unchanged ones pass, and small changes are caught and named."""

from functools import cache

import numpy as np
import pytest
from scipy import stats

from fotismos.comparisons.check.measured import measure_scene
from fotismos.comparisons.check.moved import check
from fotismos.comparisons.departure.drift import level_of_each, sidak
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.heuristic.errors import InputError
from fotismos.reference.scene.source import Source
from tests.shared.parts import look_at, rgb_of


def spheres(alpha=1, distance=1, red=1):
    """The plastic spheres; what their makers call roughness, and their lamp, change by factors.

    ``red`` multiplies the red of the first sphere alone.
    """
    scene = SCENES["plastic-spheres"].make()
    for name in ("sphere-1", "sphere-2", "sphere-3"):
        bsdf = scene[name]["bsdf"]
        scene[name]["bsdf"] = bsdf | {"alpha": alpha * bsdf["alpha"]}
    r, g, b = scene["sphere-1"]["bsdf"]["diffuse_reflectance"]["value"]
    scene["sphere-1"]["bsdf"]["diffuse_reflectance"] = rgb_of(red * r, g, b)
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
    return measure_scene(Source("scene", make), options)


def test_a_picture_is_not_checked_like_a_model(rgb):
    with pytest.raises(InputError, match=r"renders what half.exr would replace"):
        measure_scene(Source("scene", spheres), Options(image=("half.exr",)))


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
    found = check(measured(before).halves, measured(after, 1000))
    assert any(move.half == "reference" for move in found.moves)


@pytest.mark.guarantee("checks", "A change of a material is named: shape, colour, size and half.")
def test_a_change_of_one_material_by_5_percent_is_named(rgb):
    """The red that a sphere scatters, of which its highlights have none, rises by 5 %."""
    small = {"resolution": (48, 36), "spp": 256}
    for seed in (0, 1):
        now = measured(lambda: spheres(red=1.05), seed, **small)
        found = check(measured(spheres, 0, **small).halves, now)
        assert found.headline().startswith("`sphere-1`: red +")
        assert found.headline().endswith("in both halves")
        shares = {
            move.half: move.after / move.before - 1
            for move in found.moves
            if (move.shape, move.channel) == ("sphere-1", "R")
        }
        assert shares.keys() == {"heuristic", "reference"}
        assert all(0.03 < share < 0.05 for share in shares.values())
        assert found.causes()[0].startswith("Both halves moved: look at what")


# --- False alarms ----------------------------------------------------------------------------


@pytest.mark.guarantee("checks", "Unchanged scenes raise alarms no more often than stated.")
@pytest.mark.slow
@pytest.mark.parametrize("name", ["plastic-spheres", "cornell-box"])
def test_200_checks_of_an_unchanged_scene_alarm_no_more_than_stated(rgb, name):
    """Single p-values of noisy means are not too small, either."""
    source = SCENES[name].source()
    smallest = []
    p_values = []
    for number in range(200):
        sides = [
            measure_scene(source, Options(resolution=(32, 32), spp=64, seed=2 * number + side))
            for side in (0, 1)
        ]
        found = check(sides[0].halves, sides[1])
        kinds = [drift for half in found.halves for drift in half.drifts.values()]
        smallest.append(min(float(sidak(kind.p(), kind.tests).min()) for kind in kinds))
        p_values += [p for kind in kinds for p in kind.p().ravel() if p < 1]
    for level in (0.01, 0.05, 0.2):
        alarms = sum(p < level_of_each(level, len(kinds)) for p in smallest)
        assert alarms <= stats.binom.ppf(0.999, 200, level)
    assert len(p_values) > 4000
    # Means of one check go together, so that the share is known less well than a binomial's.
    assert np.mean(np.array(p_values) < 0.05) < 0.08
