"""What a command takes from a scene file: values for its placeholders, and one of its sensors."""

import json
import re

import pytest

from reference import Source
from reference.pairing import halves
from tests.small_scene import PLAIN

BALL = '<bsdf type="diffuse"><rgb name="reflectance" value="$grey"/></bsdf>'
GREY = PLAIN.replace('<bsdf type="diffuse"/>', BALL, 1)
SECOND = PLAIN[PLAIN.index("<sensor") : PLAIN.index("</sensor>") + len("</sensor>")]
SMALL = ("--resolution", "16x16", "--spp", 4)


@pytest.fixture
def scene(tmp_path):
    """A file with a placeholder, and a second sensor whose film is 40 by 20 pixels."""
    assert "$grey" in GREY
    second = SECOND.replace('value="24"', 'value="40"').replace('value="16"', 'value="20"')
    path = tmp_path / "grey.xml"
    path.write_text(GREY.replace("</scene>", f"{second}</scene>"), encoding="utf-8")
    return path


def test_a_placeholder_without_a_value_is_refused_by_name(run, scene, tmp_path):
    code, _, messages = run("compare", scene, "-o", tmp_path / "out", *SMALL)
    assert code == 2
    assert "grey" in messages.replace("grey.xml", "")


@pytest.mark.parametrize("command", ["plan", "compare"])
def test_a_value_without_a_placeholder_names_the_nearest_one(command, run, scene):
    code, _, messages = run(command, scene, "-D", "grey=0.5", "-D", "gray=0.2", *SMALL)
    assert code == 2
    assert "it has no placeholder $gray (did you mean grey?)" in messages


def test_a_defined_value_is_used_and_recorded(run, scene, tmp_path):
    albedos = {}
    for value in ("0.2", "0.6"):
        words = ("-D", f"grey={value}", "-o", tmp_path / value, *SMALL)
        assert run("compare", scene, *words)[0] == 0
        text = (tmp_path / value / "grey/comparison.json").read_text(encoding="utf-8")
        record = json.loads(text)
        assert f"-D grey={value}" in record["command"]
        albedos[value] = record["metrics"]["dE2000"]["mean"]
    assert albedos["0.2"] != albedos["0.6"]


def test_a_second_sensor_brings_its_own_film(run, scene, tmp_path):
    words = ("-D", "grey=0.5", "--sensor", 1, "--spp", 4, "-o", tmp_path)
    assert run("compare", scene, *words)[0] == 0
    record = json.loads((tmp_path / "grey/comparison.json").read_text(encoding="utf-8"))
    assert record["resolution"] == [40, 20]


@pytest.mark.parametrize("command", ["plan", "cost", "fit"])
def test_other_commands_take_them_as_well(command, run, scene, tmp_path):
    words = {"plan": (), "cost": ("--rounds", 2, "-o", tmp_path), "fit": ("-o", tmp_path)}[command]
    code, printed, messages = run(
        command, scene, "-D", "grey=0.5", "--sensor", 1, "--json", *words, *SMALL
    )
    assert (code, messages) == (0, "")
    record = json.loads(printed)
    record = record[0] if isinstance(record, list) else record
    if command != "plan":
        assert "-D grey=0.5" in record["command"]
        assert "--sensor 1" in record["command"]


def test_a_baseline_keeps_them(run, scene, tmp_path):
    baseline = tmp_path / "grey.json"
    words = ("--update", "--scene", scene, "-D", "grey=0.5", "--sensor", 1, "--spp", 64)
    assert run("check", baseline, *words)[0] == 0
    options = json.loads(baseline.read_text(encoding="utf-8"))["options"]
    assert (options["define"], options["sensor"]) == ({"grey": "0.5"}, 1)
    assert options["resolution"] == [40, 20]
    assert run("check", baseline, "-q", "-o", tmp_path) == (0, "", "")
    before = baseline.read_bytes()
    assert run("check", baseline, *words)[0] == 0
    assert baseline.read_bytes() == before
    changed = baseline.read_text(encoding="utf-8").replace('"0.5"', '"0.6"')
    baseline.write_text(changed, encoding="utf-8")
    code, printed, _ = run("check", baseline, "-q", "-o", tmp_path)
    assert code == 1
    assert "1 of 1" in printed


def test_a_sensor_that_is_not_there_is_refused_with_the_numbers_of_those_that_are(
    run, scene, tmp_path
):
    words = ("-D", "grey=0.5", "--sensor", 2, "-o", tmp_path / "out", *SMALL)
    code, _, messages = run("compare", scene, *words)
    assert code == 2
    assert "there is no sensor 2: choose one from 0 to 1" in messages


SPECTRAL_FILM = """<film type="specfilm">
  <integer name="width" value="24"/><integer name="height" value="16"/>
  <integer name="crop_offset_x" value="3"/><integer name="crop_width" value="8"/>
  <rfilter type="tent"><float name="radius" value="1.5"/></rfilter>{bands}
</film>"""
BANDS = '<spectrum name="band" value="400:0, 500:1, 600:0"/>'


def test_another_film_keeps_its_size_its_crop_and_its_filter(rgb, tmp_path):
    """A film of bands becomes one of colours, and the record says so."""
    made = {}
    for kind, text in {
        "specfilm": SPECTRAL_FILM.format(bands=BANDS),
        "hdrfilm": SPECTRAL_FILM.format(bands="").replace("specfilm", "hdrfilm"),
    }.items():
        path = tmp_path / f"{kind}.xml"
        path.write_text(re.sub("<film.*?</film>", text, PLAIN, flags=re.DOTALL), encoding="utf-8")
        made[kind] = halves.pair(Source("a test", path))
    films = [each.physical.instantiate().sensors()[0].film() for each in made.values()]
    assert [str(film) for film in films] == 2 * [str(films[1])]
    assert (*films[0].crop_size(), *films[0].crop_offset()) == (8, 16, 3, 0)
    assert films[0].rfilter().radius() == 1.5
    told = {kind: [each.what for each in one.overridden] for kind, one in made.items()}
    assert told == {"specfilm": ["film"], "hdrfilm": []}
