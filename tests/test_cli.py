"""The command line: results, messages, exit codes; most of it inside this process, for speed."""

import json
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest

from heuristic.errors import InputError
from reports import cli
from tests.programs import python
from tests.schemas import schema
from tests.small_scene import SCENE


def test_compare_writes_what_the_contract_names(run, scene_file, tmp_path):
    out = tmp_path / "out"
    other = tmp_path / "other.xml"
    other.write_text(SCENE.replace('value="24"', 'value="32"'), encoding="utf-8")
    code, printed, messages = run("compare", scene_file, other, "-o", out, "--spp", 4)
    assert (code, messages) == (0, "")
    assert str(out / "index.html") in printed
    published = schema("comparison")
    for name, scene, size in (("my-scene", "my scene", [24, 16]), ("other",) * 2 + ([32, 16],)):
        record = json.loads((out / name / "comparison.json").read_text(encoding="utf-8"))
        jsonschema.validate(record, published)
        assert record["scene"] == scene
        assert record["resolution"] == size
        assert (out / name / "comparison.exr").stat().st_size > 0
        assert {path.stem for path in (out / name).glob("*.png")} >= {"heuristic", "reference"}
    hidden = [".fotismos", ".fotismos-lock"]
    expected = [*hidden, "index.html", "my-scene", "other", "run.json", "tables"]
    assert sorted(path.name for path in out.iterdir()) == expected


def test_the_recorded_command_repeats_the_result(run, scene_file, tmp_path):
    options = ("--spp", 8, "--seed", 3, "--resolution", "20x12", "--pairing", "literal")
    run("compare", scene_file, "-o", tmp_path / "a", *options)
    first = json.loads((tmp_path / "a/my-scene/comparison.json").read_text(encoding="utf-8"))
    words = shlex.split(first["command"])
    assert words[0] == "fotismos"
    run(*words[1:], "-o", tmp_path / "b")
    second = json.loads((tmp_path / "b/my-scene/comparison.json").read_text(encoding="utf-8"))
    # Mitsuba adds up a wide reconstruction filter in no fixed order.
    for metric in ("dE2000", "dE_ITP", "dE_CAM16UCS"):
        wanted, found = (record["metrics"][metric]["mean"] for record in (first, second))
        assert found == pytest.approx(wanted, rel=1e-4)
    assert second["command"] == first["command"]


def _changed(old, new):
    assert old in SCENE
    return SCENE.replace(old, new)


BAD_FILES = {
    "malformed": (SCENE[:300], r"line \d+|byte offset \d+"),
    "no scene": ("<bsdf version='3.0.0' type='diffuse'/>", "must be <scene>"),
    "unknown BSDF": (_changed("roughplastic", "roughplastik"), r'"roughplastik" not found'),
    "environment without a file": (
        _changed('type="constant"', 'type="envmap"'),
        r'envmap.*"filename" cannot be found',
    ),
    "negative reflectance": (_changed("0.2, 0.3, 0.5", "-0.2, 0.3, 0.5"), r"-0\.2.*0 or more"),
    "NaN": (_changed('name="alpha" value="0.2"', 'name="alpha" value="nan"'), r"alpha = nan"),
    "no sensor": (re.sub("<sensor.*</sensor>", "", SCENE, flags=re.DOTALL), "no sensor"),
    "unknown parameter": (_changed('name="alpha"', 'name="alhpa"'), "alhpa"),
    "broken reference": (_changed('<bsdf type="diffuse"/>', '<ref id="nix"/>'), "nix"),
}


@pytest.mark.parametrize("name", BAD_FILES)
def test_a_scene_that_cannot_be_used_is_refused_in_one_message(name, run, tmp_path):
    content, expected = BAD_FILES[name]
    path = tmp_path / "scene.xml"
    path.write_text(content, encoding="utf-8")
    code, printed, messages = run("compare", path, "-o", tmp_path / "out", "--spp", 2)
    assert code == 2
    assert printed == ""
    assert messages.startswith("fotismos: error: scene: ")
    assert re.search(expected, messages)
    assert "Traceback" not in messages
    assert list((tmp_path / "out").iterdir()) == []


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("nix.xml",), r"nix\.xml: there is no such file"),
        (("fig-9-9",), r"'fig-9-9' is neither .*fig-8-9"),
        (("fig-8-9", "--resolution", "0x5"), "at least 1"),
        (("fig-8-9", "--resolution", "big"), "write it like 512x512"),
        (("fig-8-9", "--variant", "cuda_rgb"), "llvm_ad_rgb"),
        (("fig-8-9", "--spp", "1"), "range"),
        (("fig-8-9", "--pairing", "fit"), "literal"),
        (("fig-8-9", "-D", "grey"), "'grey' is not a definition; write it like name=value"),
        (("fig-8-9", "-D", "=0.5"), "'=0.5' is not a definition"),
        ((), "Missing argument"),
        (("",), "'' is neither a file nor"),  # an empty variable of a shell is not this folder
        (("x" * 1000,), "File name too long"),
        (("fig-8-9", "--timeout", "nan"), "'nan' is not in the range"),
    ],
)
def test_bad_words_are_refused(words, expected, run, tmp_path):
    code, _, messages = run("compare", *words, "-o", tmp_path / "out")
    assert code == 2
    assert re.search(expected, messages)


def test_a_folder_that_cannot_be_written_is_refused_before_rendering(run, tmp_path):
    (tmp_path / "file").write_text("")
    code, _, messages = run("compare", "fig-8-9", "-o", tmp_path / "file" / "out")
    assert code == 2
    assert f"{tmp_path / 'file' / 'out'}: Not a directory" in messages


def test_causes_that_cannot_be_found_leave_the_comparison_and_a_warning(
    run, scene_file, tmp_path, monkeypatch
):
    def fails(*_args, **_kwargs):
        raise InputError("the effects have no price")

    monkeypatch.setattr("comparisons.cost.cost.quick", fails)
    words = ("--spp", 4, "--resolution", "12x8", "-o", tmp_path)
    assert run("compare", scene_file, "--why", *words)[0] == 0
    record = json.loads((tmp_path / "my-scene/comparison.json").read_text(encoding="utf-8"))
    assert record["metrics"]["dE2000"]["mean"] > 0
    assert record["warnings"][-1] == "The causes are unknown: the effects have no price"
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    assert "The causes are unknown: the effects have no price" in page


def test_an_error_leaves_the_earlier_result(run, scene_file, tmp_path, monkeypatch):
    out = tmp_path / "out"
    run("compare", scene_file, "-o", out, "--spp", 4)
    before = (out / "my-scene/comparison.json").read_bytes()

    def fail(*_args, **_kwargs):
        raise RuntimeError("the disk is full")

    monkeypatch.setattr("reports.files.exr.write", fail)
    with pytest.raises(RuntimeError, match="disk"):
        run("compare", scene_file, "-o", out, "--spp", 4, "--seed", 1)
    assert (out / "my-scene/comparison.json").read_bytes() == before
    names = sorted(path.name for path in out.iterdir())
    assert names == [".fotismos", ".fotismos-lock", "index.html", "my-scene", "run.json", "tables"]


def test_a_scene_that_fails_is_named_and_the_others_are_compared(run, scene_file, tmp_path):
    broken = tmp_path / "broken.xml"
    broken.write_text(_changed('type="diffuse"', 'type="nonesuch"'), encoding="utf-8")
    out = tmp_path / "out"
    code, printed, messages = run("compare", broken, scene_file, "-o", out, "--spp", 4)
    assert code == 2
    assert "1 of 2 scenes failed" in messages
    assert "my scene" in printed
    page = (out / "index.html").read_text(encoding="utf-8")
    assert "<b>Failed:</b>" in page
    assert (out / "my-scene/comparison.json").is_file()
    assert not (out / "broken").exists()


def test_plan_prints_a_table_and_json(run):
    code, printed, _ = run("plan", "fig-8-9")
    assert code == 0
    for word in (
        "occlusion",
        "direct light alone",
        "direct_all, no shadow rays",
        "k_a, k_d, k_s",
    ):
        assert word in printed
    code, printed, _ = run("plan", "fig-8-9", "--json", "--everything")
    data = json.loads(printed)
    assert data["integrator"] == "path"
    assert len(data["effects"]) == 14
    assert all(effect["called_for"] for effect in data["effects"])


def test_what_mitsuba_says_is_for_those_who_ask(apart, monkeypatch, capfd):
    """As the process prints it: Mitsuba writes past Python."""
    words = ["fotismos", "plan", "narrow-band-lamp", "--json", "--resolution", "16x16"]
    for more, is_told in (([], False), (["-v"], True)):
        monkeypatch.setattr(sys, "argv", [*words, *more])
        cli.main()
        printed, messages = capfd.readouterr()
        assert json.loads(printed)["effects"]
        assert ("out-of-gamut" in messages) == is_told


def test_what_mitsuba_says_stands_in_the_record_once(run, tmp_path):
    out = tmp_path / "out"
    words = ("compare", "narrow-band-lamp", "--resolution", "16x16", "--spp", 8, "-o", out)
    assert run(*words)[2] == ""
    record = json.loads((out / "narrow-band-lamp/comparison.json").read_text(encoding="utf-8"))
    told = [warning for warning in record["warnings"] if warning.startswith("Mitsuba: ")]
    assert len(told) == len(set(told)) > 0
    assert all("\x1b" not in warning for warning in told)


def test_plan_names_the_premise_that_fails(run):
    code, printed, _ = run("plan", "cornell-box", "--json")
    assert code == 0
    rules = {rule["name"]: rule for rule in json.loads(printed)["rules"]}
    assert rules["every light at every sample"]["applies"]
    shadows = rules["no shadow rays"]
    assert not shadows["applies"]
    assert "box around a light" in shadows["premise"]
    assert "may stand between" in shadows["evidence"]
    code, printed, _ = run("plan", "cornell-box")
    assert "premise not known to hold" in printed


def test_plan_verifies(run):
    words = ("plan", "--verify", "fig-8-6a", "--resolution", "32x32")
    code, printed, _ = run(*words, "--json")
    assert code == 0
    assert json.loads(printed)["significant"] == 0
    code, printed, _ = run(*words)
    assert "faster" in printed


def test_a_file_with_tabulated_spectra_is_compared_spectrally(run, tmp_path):
    spectrum = '<spectrum name="radiance" value="400:0.1, 700:0.3"/>'
    path = tmp_path / "scene.xml"
    path.write_text(_changed('<rgb name="radiance" value="0.2"/>', spectrum), encoding="utf-8")
    asked = ("--variant", "llvm_ad_rgb")
    for options, variant in (((), "llvm_ad_spectral"), (asked, "llvm_ad_rgb")):
        run("compare", path, "-o", tmp_path / "out", "--spp", 4, *options)
        record = json.loads((tmp_path / "out/scene/comparison.json").read_text(encoding="utf-8"))
        assert record["variant"] == variant


def test_scenes_lists_every_figure(run):
    code, printed, _ = run("scenes")
    assert code == 0
    for figure in ("8-5a", "8-6b", "8-7c", "8-8a", "8-9", "8-11-n9", "8-11-n3"):
        assert f"fig-{figure} " in printed


def test_a_whole_process_renders_and_is_silent_in_a_pipe(scene_file, tmp_path):
    words = ("compare", scene_file, "-o", "out", "--spp", 2, "--no-why")
    done = python("-m", "reports", *words, cwd=tmp_path)
    assert (done.returncode, done.stderr) == (0, "")
    assert (tmp_path / "out/index.html").is_file()


@pytest.mark.parametrize(
    ("shell", "code", "said"),
    [('exec "$@" >/dev/full', 2, "output: No space left on device"), ('exec "$@" >&-', 0, "")],
)
def test_an_output_that_is_full_or_closed_is_no_traceback(shell, code, said):
    words = ["sh", "-c", shell, "sh", sys.executable, "-P", "-m", "reports", "scenes"]
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(words, env=environment, capture_output=True, text=True)
    assert done.returncode == code
    assert said in done.stderr
    assert "Traceback" not in done.stderr
