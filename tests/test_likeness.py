"""What a picture seems to lack: the rendering between the halves that it is nearest to."""

import json
import re

import mitsuba as mi
import numpy as np
import pytest

from comparisons.case import Request, open_case
from comparisons.compare import guarded
from comparisons.comparison import ComparisonRecord
from comparisons.cost.methods import Methods
from comparisons.effects.corners import labels
from comparisons.effects.lattice import Lattice
from comparisons.effects.nearness import nearest
from comparisons.effects.shapley import subsets
from comparisons.pictures import likeness
from comparisons.records import read
from reports.terminal import nearest_lines
from tests.test_pictures import write

SIZE = 96, 72
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


# --- Made-up distances ---------------------------------------------------------------------------


def test_the_nearest_says_what_is_there_and_what_is_not():
    found = nearest(distances(none=6, a=0.5, b=8, both=4))
    assert (found.outcome, found.simulates, found.lacks) == ("named", A, B)
    assert (found.undecided, found.dE2000, found.next_dE2000) == ((), 0.5, 4)
    assert found.gap.value == 3.5
    assert nearest_lines.lacking(found) == "gloss"
    assert nearest_lines.told(found) == (
        "is nearest to textbook shading, with shadow, without gloss (mean ΔE2000 0.500; the next"
        " 4.00)"
    )


@pytest.mark.parametrize(
    ("noise", "both", "undecided"), [(0.0, 0.52, B), (0.0, 0.7, ()), (0.2, 0.7, B)]
)
def test_what_is_not_told_apart_is_undecided(noise, both, undecided):
    """Neither a gap that noise may make, nor one much smaller than what no rendering explains."""
    found = nearest(distances(noise, none=9, a=0.5, b=8, both=both) | {BOTH: np.full(5, both)})
    assert found.undecided == undecided
    plain = nearest(distances(none=0.5, a=0.52, b=8, both=9))
    assert nearest_lines.lacking(plain) == "gloss; perhaps shadow"


def test_a_picture_that_no_rendering_is_near_is_not_explained():
    assert nearest(distances(none=9, a=4, b=8, both=7)).outcome == "unexplained"
    assert nearest(distances(none=9, a=3, b=8, both=7)).outcome == "named"
    assert nearest(distances(none=9, a=0.9, b=8, both=1.1)).outcome == "named"
    itself = nearest(distances(none=9, a=8, b=8, both=3))
    assert itself.outcome == "unexplained"
    assert "the reference itself, the nearest, is 3.00 away" in nearest_lines.told(itself)


def test_a_picture_like_the_reference_lacks_nothing():
    found = nearest(distances(none=9, a=0.2, b=8, both=0.9))
    assert found.outcome == "alike"
    assert nearest_lines.lacking(found) == "nothing visible"


# --- Averaging down ------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("size", "small"),
    [((640, 480), (64, 48)), ((480, 640), (48, 64)), ((1920, 1080), (64, 36)), ((30, 7), (30, 7)),
     ((500, 300), (60, 36)), ((1000, 1), (64, 1))],
)  # fmt: skip
def test_small_renderings_keep_the_proportions(size, small):
    assert likeness.small_size(*size) == small


@pytest.mark.parametrize("kind", ["box", "gaussian"])
def test_a_picture_is_averaged_down_as_the_film_would(rgb, kind):
    """A ramp stays a ramp where no edge is near, and with a box each pixel is a mean of blocks."""
    rfilter = mi.load_dict({"type": kind})
    weights = likeness._weights(60, 12, rfilter)
    small = weights @ np.arange(60.0)
    np.testing.assert_allclose(small[2:-2], np.arange(60).reshape(12, 5).mean(axis=1)[2:-2])
    np.testing.assert_allclose(weights.sum(axis=1), 1)
    assert np.count_nonzero(weights[6]) == (5 if kind == "box" else 21)  # 4 pixels wide


# --- Pictures from known renderings --------------------------------------------------------------


def room(filter="box"):
    """A lamp over a ball on a floor: shadows, an extended light, and light between surfaces."""
    toward = mi.ScalarTransform4f()
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "fov": 40.0,
            "to_world": toward.look_at((0, -7, 3), (0, 0, 0.5), (0, 0, 1)),
            "film": {"type": "hdrfilm", "width": SIZE[0], "height": SIZE[1],
                     "rfilter": {"type": filter}},
        },
        "floor": {"type": "rectangle", "to_world": toward.scale(4),
                  "bsdf": {"type": "diffuse", "reflectance": 0.8}},
        "ball": {"type": "sphere", "center": (0.5, 0, 1), "radius": 1.0,
                 "bsdf": {"type": "diffuse",
                          "reflectance": {"type": "rgb", "value": (0.8, 0.3, 0.2)}}},
        "lamp": {"type": "rectangle",
                 "to_world": toward.look_at((-3, -2, 5), (0, 0, 0), (0, 0, 1)).scale(0.8),
                 "emitter": {"type": "area", "radiance": 30.0}},
    }  # fmt: skip


@pytest.fixture(scope="module")
def pictures():
    """``{simulated effects: picture}`` of the room, with other seeds, at its own size."""
    mi.set_variant("llvm_ad_rgb")
    case = open_case(room, Request(seed=7))
    ready = guarded(case.source, case.options)
    lattice = Lattice(case.options, Methods(case.source, case.options, ready), 3, 16, 7)
    return {
        labels(lattice.effects, each): lattice.simulating(each).images.mean(axis=0)
        for each in subsets(lattice.effects)
    }


@pytest.fixture(scope="module")
def found():
    mi.set_variant("llvm_ad_rgb")
    case = open_case(room)
    return likeness.candidates(case.source, case.options, SIZE[::-1])


@pytest.mark.guarantee(
    "prices",
    "A picture from a known rendering between the halves is said to be nearest to that one.",
)
def test_a_picture_of_a_rendering_is_nearest_to_it(found, pictures):
    assert set(found.images) == set(pictures)
    assert len(pictures) >= 8
    random, whole = np.random.default_rng(5), np.ones(SIZE[::-1])
    for effects, picture in pictures.items():
        told = found.measured([picture])(whole)
        assert set(told.simulates) <= set(effects) <= {*told.simulates, *told.undecided}
        assert len(told.undecided) <= 1
        assert told.outcome == ("named" if told.reference_dE2000 >= 1 else "alike")
        repeats = [picture * random.normal(1, 0.2, picture.shape).clip(0) for _ in range(4)]
        noisy = found.measured(repeats)(whole)
        assert set(noisy.simulates) <= set(effects) <= {*noisy.simulates, *noisy.undecided}
        assert noisy.dE2000 < found.measured(repeats[:1])(whole).dE2000 / 2


@pytest.mark.parametrize("factor", [0.7, 0.9, 1.1, 1.4])
def test_another_exposure_is_doubted(found, pictures, factor):
    """It looks like a missing effect; with the right one, nothing is said."""
    random = np.random.default_rng(5)
    for picture in pictures.values():
        words = found.exposure(factor * picture)
        assert float(re.match(r"Times (\S+),", words)[1]) == pytest.approx(1 / factor, rel=0.04)
        noisy = picture * random.normal(1, 0.05, picture.shape)
        assert [found.exposure(shown) for shown in (picture, noisy)] == ["", ""]


def test_each_part_has_its_own(found, pictures):
    """The left half without light between surfaces, the right half without shadows."""
    (everything,) = (each for each in pictures if len(each) == len(max(pictures, key=len)))
    left, right = (
        tuple(effect for effect in everything if effect != lost)
        for lost in ("interreflection", "occlusion")
    )
    is_left = np.arange(SIZE[0]) < SIZE[0] // 2
    picture = np.where(is_left[:, None], pictures[left], pictures[right])
    halves = [np.broadcast_to(each, SIZE[::-1]).astype(float) for each in (is_left, ~is_left)]
    assert [found.measured([picture])(each).lacks for each in halves] == [
        ("interreflection",),
        ("occlusion",),
    ]


def test_a_picture_of_something_else_is_not_explained(found, pictures):
    reference = pictures[max(pictures, key=len)]
    whole = np.ones(SIZE[::-1])
    for other in (reference[..., ::-1], reference[:, ::-1], 0 * reference + 0.3, 5 * reference):
        assert found.measured([other])(whole).outcome == "unexplained"


def test_a_part_that_no_small_pixel_sees_has_none(found, pictures):
    assert found.measured([pictures[()]])(np.zeros(SIZE[::-1])) is None


# --- On the command line -------------------------------------------------------------------------

SCRIPT = """
from tests.test_likeness import room


def scene():
    return room()
"""


def test_the_command_says_it_and_that_it_is_no_attribution(run, written, tmp_path, pictures):
    written(SCRIPT, "room.py")
    everything = max(pictures, key=len)
    dark = tuple(effect for effect in everything if effect != "interreflection")
    write(tmp_path / "x.exr", pictures[dark])
    words = ("compare", "room.py", "--image", "x.exr", "--spp", 16, "-o", "out")
    code, said, _ = run(*words, "--why")
    assert code == 0
    place = tmp_path / "out/room/comparison.json"
    record = read(ComparisonRecord, place.read_text(encoding="utf-8"), "x")
    picture = record.picture
    assert picture.nearest.lacks == ("interreflection",)
    assert picture.renderings.count == len(pictures)
    assert all(each.nearest for each in (*record.regions, *record.objects, *record.materials))
    assert all(each.effect is None for each in record.regions)
    assert record.time.stages["causes"] > 0
    page = (tmp_path / "out/index.html").read_text(encoding="utf-8")
    for text in (said, page):
        flat = re.sub(r"\s+", " ", text)
        assert "without interreflection (mean" in flat
        assert f"Nearest of {len(pictures)} renderings" in flat
        assert "not an attribution" in flat
    assert "Textbook shading is" not in said
    assert "--why" not in said
    code, said, _ = run(*words[:-1], "plain", "--no-why")
    assert (code, "nearest" in said) == (0, False)
    plain = json.loads((tmp_path / "plain/room/comparison.json").read_text(encoding="utf-8"))
    assert plain["picture"]["nearest"] is plain["regions"][0]["nearest"] is None
