"""One door: whatever names a scene is read once, in the same way by all who open it."""

import json

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.case import open_case
from fotismos.comparisons.options import LARGEST_SPP, Options
from fotismos.comparisons.records.departure import MOST_PIXELS
from fotismos.heuristic.errors import InputError, unknown
from fotismos.heuristic.tessellation import FINEST
from fotismos.reference.scene import source

SMALL = ("--spp", 4, "--resolution", "12x12")

SCRIPT = """
from pathlib import Path

with Path(__file__).with_suffix(".runs").open("a") as file:
    file.write("x")

def scene():
    return {
        "type": "scene",
        "view": {"type": "perspective"},
        "ball": {"type": "sphere", "center": (0, 0, 4), "bsdf": {"type": "diffuse"}},
        "lamp": {"type": "point", "position": (0, 2, 0)},
    }
"""

LAMP = {"type": "spectrum", "value": [(580.0, 0.0), (590.0, 50.0), (600.0, 0.0)]}


def spectral_scene():
    """A sphere under a lamp that three numbers cannot stand for."""
    return {
        "type": "scene",
        "sensor": {"type": "perspective", "film": {"type": "hdrfilm", "width": 8, "height": 8}},
        "ball": {"type": "sphere", "center": (0, 0, 4), "bsdf": {"type": "diffuse"}},
        "lamp": {"type": "point", "position": (0, 2, 0), "intensity": LAMP},
    }


@pytest.mark.thorough
def test_a_script_runs_once_in_a_command(run, tmp_path):
    script, runs = tmp_path / "s.py", tmp_path / "s.runs"
    script.write_text(SCRIPT)
    assert run("compare", script, "-o", tmp_path / "out", *SMALL)[0] == 0
    assert runs.read_text() == "x"


def test_the_lamps_of_a_scene_choose_its_variant(rgb):
    spectral = open_case(spectral_scene)
    assert spectral.variant == "llvm_ad_spectral"
    assert "--variant llvm_ad_spectral" in spectral.command()
    assert open_case(mi.cornell_box(), name="box").variant == "llvm_ad_rgb"


def test_a_command_repeats_what_was_given(rgb, tmp_path):
    case = open_case("fig-6-10", Options(resolution=(12, 10)))
    assert case.command() == (
        "fotismos compare fig-6-10 --variant llvm_ad_rgb --resolution 12x10"
        " --interpolation flat --tessellation 4"
    )
    words = {"define": {"a": 1}, "image": ("a.png", "b.png"), "everything": True, "seed": 3}
    assert Options(**words).command("cost", "s.xml", rounds=2) == (
        "fotismos cost s.xml --seed 3 --everything -D a=1 --image a.png --image b.png --rounds 2"
    )


def test_values_for_placeholders_are_refused_where_there_are_none(rgb, tmp_path):
    script = tmp_path / "s.py"
    script.write_text(SCRIPT)
    for scene in ("fig-8-9", spectral_scene):
        with pytest.raises(InputError, match=r"-D foo: only files take values"):
            open_case(scene, Options(define={"foo": 1}))
    with pytest.raises(InputError, match=r"-D foo: `scene` of .*s\.py does not take it.*none"):
        open_case(script, Options(define={"foo": 1}))


def test_a_script_takes_values(rgb, tmp_path):
    script = tmp_path / "s.py"
    script.write_text(
        "def scene(radiance, *, size='2'):\n"
        "    ball = {'type': 'sphere', 'radius': float(size)}\n"
        "    light = {'type': 'constant', 'radiance': float(radiance)}\n"
        "    view = {'type': 'perspective'}\n"
        "    return {'type': 'scene', 'ball': ball, 'light': light, 'view': view}\n"
    )
    assert source.placeholders(script) == {"radiance", "size"}
    digests = set()
    for values in ({"radiance": "0.5"}, {"radiance": "0.25"}, {"radiance": "0.5", "size": "3"}):
        made = open_case(script, Options(define=values)).source
        graph = made.parse()
        (light,) = graph.nodes(mi.ObjectType.Emitter)
        assert graph.props(light)["radiance"] == float(values["radiance"])
        digests.add(source.digest(made))
    assert len(digests) == 3
    for values, message in (
        ({}, r"`scene` of .*s\.py needs radiance\. Give -D NAME=VALUE"),
        ({"size": "1"}, r"needs radiance\."),
        ({"radiance": "1", "colour": "2"}, r"-D colour: .* does not take it; .* radiance, size"),
        ({"radiance": "bright"}, r"s\.py: ValueError: could not convert"),
    ):
        with pytest.raises(InputError, match=message):
            open_case(script, Options(define=values))
    script.write_text(
        "def scene(radius=2.0, count=1, name='a', **more):\n"
        "    assert (type(radius), type(count), type(name)) == (float, int, str)\n"
        "    return {'type': 'scene', 'v': {'type': 'perspective'}}"
    )
    open_case(script, Options(define={"radius": "3", "count": "2", "name": "1", "other": "1"}))
    with pytest.raises(InputError, match=r"-D count=two: .* takes a number, such as 1\."):
        open_case(script, Options(define={"count": "two"}))


REFUSED = [
    ({"spp": 99999999999999}, f"spp = .* to {LARGEST_SPP}"),
    ({"spp": True}, "spp = True .*whole number"),
    ({"tessellation": 10**8}, f"tessellation = .* to {FINEST}"),
    ({"seed": -1}, "seed = -1"),
    ({"noise": float("nan")}, "noise = nan"),
    ({"noise": 0}, "noise = 0"),
    ({"resolution": (0, 5)}, "resolution"),
    ({"pixels_per_degree": 0.5}, f"from 1 to {MOST_PIXELS:g}"),
    ({"allow_empty": 3}, "True or False"),
    ({"transfer": 3}, "linear, srgb"),
    ({"image": 3}, "image = 3"),
]


def test_options_beyond_their_bounds_are_refused():
    for words, message in REFUSED:
        with pytest.raises(InputError, match=message):
            Options(**words)


def test_stated_options_are_read_back():
    words = {"heuristic": "blinn", "resolution": [np.int64(3), 4], "noise": 0.5, "image": None}
    options = Options.of(words)
    assert options.stated() == {
        "heuristic": "blinn", "resolution": [3, 4], "noise": 0.5, "seed": 0, "pairing": "matched"
    }  # fmt: skip
    assert Options.of(json.loads(json.dumps(options.stated()))) == options


def test_a_word_that_is_not_known_is_told_with_what_is_allowed():
    message = str(unknown("form =", "blin", ["phong", "blinn"]))
    assert message.startswith("form = 'blin' is not known (did you mean blinn?): choose one of")
    assert "did you mean" not in str(unknown("n =", None, ["phong"]))
