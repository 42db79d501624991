"""``fotismos fit``: files, tables, messages."""

import json
import shlex
from io import BytesIO
from pathlib import Path

import jsonschema
import numpy as np
import pytest
from PIL import Image

from tests.schemas import schema

SCHEMA = schema("fit")
CORPUS = Path(__file__).parent / "corpus"
SMALL = ("--resolution", "16x12", "--spp", 4)


def test_fit_writes_a_record_that_its_schema_accepts_and_a_picture(run, tmp_path):
    words = ("fig-8-6a", "-o", tmp_path, "--intensities", "--seed", 5, *SMALL)
    code, printed, messages = run("fit", *words)
    assert (code, messages) == (0, "")
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    data = json.loads((tmp_path / "fit/fig-8-6a/fit.json").read_text(encoding="utf-8"))
    jsonschema.validate(data, SCHEMA)
    assert [(fit["form"], fit["normalised"]) for fit in data["fits"]] == [
        (form, normalised) for form in ("phong", "blinn") for normalised in (False, True)
    ]
    losses = [fit["loss"] for fit in data["fits"]]
    assert losses[data["best"]] == min(losses)
    assert data["fits"][0]["lights"][0]["reason"]
    for word in ("paired", "blinn (normalised)", "noise floor", "parameter error", "model error"):
        assert word in printed
    assert "light 1" in printed
    picture = np.array(Image.open(BytesIO((tmp_path / "fit/fig-8-6a/fit.png").read_bytes())))
    tiles = np.split(picture[-200:-20, 8:], 4, axis=1)
    assert len(np.unique([tile.mean() for tile in tiles])) == 4


def test_the_recorded_command_repeats_the_fit(run, tmp_path):
    run("fit", "fig-8-6a", "-o", tmp_path / "a", "--form", "blinn", "--loss", "linear", *SMALL)
    first = json.loads((tmp_path / "a/fit/fig-8-6a/fit.json").read_text(encoding="utf-8"))
    code, _, _ = run(*shlex.split(first["command"])[1:], "-o", tmp_path / "b")
    assert code == 0
    second = json.loads((tmp_path / "b/fit/fig-8-6a/fit.json").read_text(encoding="utf-8"))
    assert first["fits"] == second["fits"]


def test_json_is_printed_alone_and_the_table_of_several_scenes_written(run, tmp_path):
    table = tmp_path / "table.md"
    words = ("fig-8-5a", "fig-8-6a", "--form", "phong", "--json", "--markdown", table)
    code, printed, _ = run("fit", *words, "-o", tmp_path, *SMALL)
    assert code == 0
    records = json.loads(printed)
    assert [record["scene"] for record in records] == ["fig-8-5a", "fig-8-6a"]
    rows = [line for line in table.read_text(encoding="utf-8").splitlines() if "fig-8-6a" in line]
    departure = records[1]["fits"][0]["departure"]["dE2000"]
    assert f"{departure['before']:.3f} → {departure['after']:.3f}" in rows[1]
    unlit = [
        line for line in table.read_text(encoding="utf-8").splitlines() if "8-5a | phong" in line
    ]
    assert "0 → –" in unlit[-1]


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("fig-6-10",), "--interpolation phong"),
        (("fig-8-6a", "--loss", "L1"), "perceptual"),
        (("no-such-scene",), "built-in"),
        ((), "Missing argument"),
        (("fig-8-6a", "--variant", "llvm_ad_mono"), "--heuristic-variant llvm_ad_rgb"),
    ],
)
def test_bad_words_are_refused(words, expected, run, tmp_path):
    code, _, messages = run("fit", *words, "-o", tmp_path, *SMALL)
    assert code == 2
    assert expected in messages


@pytest.mark.parametrize(
    ("name", "expected"),
    [("bsdf-mask", "needs opaque materials"), ("bsdf-principled", "n varies over the surface")],
)
def test_what_a_fit_has_no_parameters_for_is_refused_by_name(name, expected, run, tmp_path):
    code, _, messages = run("fit", CORPUS / f"{name}.xml", "-o", tmp_path, *SMALL)
    assert code == 2
    assert "material of shape-" in messages
    assert expected in messages


@pytest.mark.parametrize("name", ["film-crop", "sensor-several"])
def test_a_fit_is_of_the_film_as_it_is(name, run, tmp_path):
    words = ("--form", "phong", "--spp", 8, "--resolution", "48x36")
    code, _, messages = run("fit", CORPUS / f"{name}.xml", "-o", tmp_path, *words)
    assert (code, messages) == (0, "")


def test_materials_of_an_instanced_group_have_names(run, tmp_path):
    text = (CORPUS / "shape-instance.xml").read_text(encoding="utf-8")
    mask = '<bsdf type="mask"><float name="opacity" value="0.6"/><bsdf type="diffuse"/></bsdf>'
    assert mask in text
    scene = tmp_path / "group.xml"
    scene.write_text(text.replace(mask, '<bsdf type="diffuse"/>'), encoding="utf-8")
    assert run("fit", scene, "-o", tmp_path, "--form", "phong", *SMALL)[0] == 0
    record = json.loads((tmp_path / "fit/group/fit.json").read_text(encoding="utf-8"))
    names = [material["name"] for material in record["fits"][0]["materials"]]
    assert "material 3" in names
