"""What a picture seems to lack: the rendering between the halves that it is nearest to."""

import re

import mitsuba as mi
import numpy as np
import pytest

from comparisons.case import open_case
from comparisons.comparison import ComparisonRecord
from comparisons.hybrids.hybrids import HybridImages, HybridScenes, Pairs, labels, subsets
from comparisons.hybrids.nearness import nearest
from comparisons.options import Options
from comparisons.pictures import likeness
from comparisons.prepared import guarded
from reference.records import read
from reports import verdict
from tests.test_pictures import write

SIZE = 96, 72
WHOLE = np.ones(SIZE[::-1])
A, B = ("shadow",), ("gloss",)
BOTH = ("shadow", "gloss")


def distances(noise=0.0, **means):
    """Made-up distances: ``none``, ``a``, ``b`` and ``both``, with the spread of replicates."""
    spread = np.array([0, 1, -1, 1, -1]) * noise
    sets = {"none": (), "a": A, "b": B, "both": BOTH}
    return {
        effects: means[name] + spread * (-1) ** place
        for place, (name, effects) in enumerate(sets.items())
    }


def test_the_nearest_says_what_is_there_and_what_is_not():
    found = nearest(distances(none=6, a=0.5, b=8, both=4))
    assert (found.outcome, found.simulates, found.lacks) == ("named", A, B)
    assert (found.undecided, found.dE2000, found.next_dE2000) == ((), 0.5, 4)
    assert found.gap.value == 3.5
    assert verdict.lacking(found) == "gloss"
    assert verdict.nearest_sentence(found) == (
        "is nearest to textbook shading, with shadow, without gloss (mean ΔE2000 0.500; the next"
        " 4.00)"
    )


def test_what_is_not_told_apart_is_undecided():
    """Neither a gap that noise may make, nor one much smaller than what no rendering explains."""
    for noise, both, undecided in ((0.0, 0.52, B), (0.0, 0.7, ()), (0.2, 0.7, B)):
        made = distances(noise, none=9, a=0.5, b=8, both=both) | {BOTH: np.full(5, both)}
        assert nearest(made).undecided == undecided
    plain = nearest(distances(none=0.5, a=0.52, b=8, both=9))
    assert verdict.lacking(plain) == "gloss; perhaps shadow"


def test_a_picture_that_no_rendering_is_near_is_not_explained():
    for a, both, outcome in ((4, 7, "unexplained"), (3, 7, "named"), (0.9, 1.1, "named"),
                             (0.2, 0.9, "alike")):  # fmt: skip
        assert nearest(distances(none=9, a=a, b=8, both=both)).outcome == outcome
    itself = nearest(distances(none=9, a=8, b=8, both=3))
    assert itself.outcome == "unexplained"
    assert "the reference itself, the nearest, is 3.00 away" in verdict.nearest_sentence(itself)
    alike = nearest(distances(none=9, a=0.2, b=8, both=0.9))
    assert verdict.lacking(alike) == "nothing visible"


def test_a_picture_is_averaged_down_as_the_film_would(rgb):
    """A ramp stays a ramp where no edge is near, and proportions are kept."""
    for kind, wide in (("box", 5), ("gaussian", 21)):  # a Gaussian is 4 pixels wide
        weights = likeness.filter_weights(60, 12, mi.load_dict({"type": kind}))
        small = weights @ np.arange(60.0)
        np.testing.assert_allclose(small[2:-2], np.arange(60).reshape(12, 5).mean(axis=1)[2:-2])
        np.testing.assert_allclose(weights.sum(axis=1), 1)
        assert np.count_nonzero(weights[6]) == wide
    for size, small in (((640, 480), (64, 48)), ((480, 640), (48, 64)), ((1920, 1080), (64, 36)),
                        ((30, 7), (30, 7)), ((500, 300), (60, 36)),
                        ((1000, 1), (64, 1))):  # fmt: skip
        assert likeness.small_size(*size) == small


# --- Pictures from known renderings --------------------------------------------------------------


def room():
    """A lamp over a ball on a floor: shadows, an extended light, and light between surfaces."""
    toward = mi.ScalarTransform4f()
    red = {"type": "rgb", "value": (0.8, 0.3, 0.2)}
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "fov": 40.0,
            "to_world": toward.look_at((0, -7, 3), (0, 0, 0.5), (0, 0, 1)),
            "film": {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1],
                     "rfilter": {"type": "box"}},
        },
        "floor": {"type": "rectangle", "to_world": toward.scale(4),
                  "bsdf": {"type": "diffuse", "reflectance": 0.8}},
        "ball": {"type": "sphere", "center": (0.5, 0, 1), "radius": 1.0,
                 "bsdf": {"type": "diffuse", "reflectance": red}},
        "lamp": {"type": "rectangle",
                 "to_world": toward.look_at((-3, -2, 5), (0, 0, 0), (0, 0, 1)).scale(0.8),
                 "emitter": {"type": "area", "radiance": 30.0}},
    }  # fmt: skip


@pytest.fixture(scope="module")
def pictures():
    """``{simulated effects: picture}`` of the room, with other seeds, at its own size."""
    mi.set_variant("llvm_ad_rgb")
    case = open_case(room, Options(seed=7))
    ready = guarded(case.source, case.options)
    pairs = Pairs(case.source, case.options, ready)
    scenes = HybridScenes(pairs.plain(), ready.plan, ready.scene)
    hybrids = HybridImages(pairs, scenes, 3, 16, 7)
    return {
        labels(hybrids.effects, each): hybrids.simulating(each).images.mean(axis=0)
        for each in subsets(hybrids.effects)
    }


@pytest.fixture(scope="module")
def candidates():
    mi.set_variant("llvm_ad_rgb")
    case = open_case(room)
    return likeness.candidates(case.source, case.options, SIZE[::-1])


@pytest.mark.guarantee(
    "attribution",
    "A picture from a known rendering between the halves is said to be nearest to that one.",
)
def test_a_picture_of_a_rendering_is_nearest_to_it(candidates, pictures):
    """Another exposure is doubted, since it looks like a missing effect; the right one is not."""
    assert set(candidates.images) == set(pictures)
    assert len(pictures) >= 8
    random = np.random.default_rng(5)
    for effects, picture in pictures.items():
        plain = candidates.measured([picture])(WHOLE)
        assert set(plain.simulates) <= set(effects) <= {*plain.simulates, *plain.undecided}
        assert len(plain.undecided) <= 1
        assert plain.outcome == ("named" if plain.reference_dE2000 >= 1 else "alike")
        repeats = [picture * random.normal(1, 0.2, picture.shape).clip(0) for _ in range(4)]
        noisy = candidates.measured(repeats)(WHOLE)
        assert set(noisy.simulates) <= set(effects) <= {*noisy.simulates, *noisy.undecided}
        assert noisy.dE2000 < candidates.measured(repeats[:1])(WHOLE).dE2000 / 2
        for factor in (0.7, 0.9, 1.1, 1.4):
            said = candidates.exposure(factor * picture)
            assert float(re.match(r"Times (\S+),", said)[1]) == pytest.approx(1 / factor, rel=0.04)
        for right in (picture, picture * random.normal(1, 0.05, picture.shape)):
            assert candidates.exposure(right) == ""


def test_each_part_has_its_own(candidates, pictures):
    """The left half without light between surfaces, the right half without shadows."""
    everything = max(pictures, key=len)
    lost = ("interreflection", "occlusion")
    left, right = (tuple(effect for effect in everything if effect != each) for each in lost)
    is_left = np.arange(SIZE[0]) < SIZE[0] // 2
    within = candidates.measured([np.where(is_left[:, None], pictures[left], pictures[right])])
    halves = [np.broadcast_to(each, SIZE[::-1]).astype(float) for each in (is_left, ~is_left)]
    assert [within(each).lacks for each in halves] == [(each,) for each in lost]
    assert within(0 * WHOLE) is None  # no small pixel sees it
    reference = pictures[everything]
    for other in (reference[..., ::-1], reference[:, ::-1], 0 * reference + 0.3, 5 * reference):
        assert candidates.measured([other])(WHOLE).outcome == "unexplained"


SCRIPT = """
from tests.test_likeness import room


def scene():
    return room()
"""


def test_the_command_says_it_and_that_it_is_no_attribution(run, written, tmp_path, pictures):
    written(SCRIPT, "room.py")
    dark = tuple(effect for effect in max(pictures, key=len) if effect != "interreflection")
    write(tmp_path / "x.exr", pictures[dark])
    code, said, _ = run("compare", "room.py", "--image", "x.exr", "--spp", 16, "-o", "out", "--why")
    assert code == 0
    text = (tmp_path / "out/room/comparison.json").read_text(encoding="utf-8")
    record = read(ComparisonRecord, text, "x")
    assert record.picture.nearest.lacks == ("interreflection",)
    assert record.picture.renderings.count == len(pictures)
    assert all(each.nearest for each in (*record.regions, *record.objects, *record.materials))
    assert all(each.effect is None for each in record.regions)
    assert record.time.stages["causes"] > 0
    page = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    for shown in (said, page):
        flat = re.sub(r"\s+", " ", shown)
        assert "without interreflection (mean" in flat
        assert f"Nearest of {len(pictures)} renderings" in flat
        assert "not an attribution" in flat
    assert "Textbook shading is" not in said
    assert "--why" not in said
