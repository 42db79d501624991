"""`fotismos check`: files, messages, exit codes, JUnit and what CI services read."""

import json
import re
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest
from PIL import Image

from comparisons.check.moved import Move
from comparisons.departure.metrics import METRICS
from heuristic.errors import InputError
from reports.ci import annotations, junit
from tests.schemas import schema
from tests.small_baselines import FAST, SERVICES, change
from tests.small_scene import SCENE

SCHEMA = schema("baseline")


pytestmark = pytest.mark.usefixtures("no_service")


@pytest.fixture
def folder(baselines_folder):
    return baselines_folder


# --- Checking --------------------------------------------------------------------------------


def test_what_did_not_move_passes(run, folder, tmp_path):
    out = tmp_path / "out"
    for words in ((), ("--seed", 7)):
        code, printed, messages = run("check", folder, "-o", out, *words)
        assert (code, messages) == (0, "")
        assert "2 of 2 unmoved" in printed
    assert list(out.iterdir()) == []


def test_what_moved_fails_with_a_table_and_pictures(run, folder, tmp_path):
    change(folder / "fig-8-6b.json")
    out = tmp_path / "out"
    code, printed, messages = run("check", folder, "-o", out)
    assert (code, messages) == (1, "")
    assert "1 of 2 moved" in printed
    assert re.search(r"reference R, block 2,3 +\S+ +\S+ +-33 % +-\S+ +\S+", printed)
    assert f"fotismos check {folder / 'fig-8-6b.json'} --update" in printed
    names = {path.name for path in (out / "check/fig-8-6b").iterdir()}
    kinds = ("", "-before", "-change", "-p", "-error")
    pictures = {f"{half}{kind}.png" for half in ("heuristic", "reference") for kind in kinds}
    assert names == {".fotismos", "check.json", *pictures}
    assert {path.name for path in out.iterdir()} == {".fotismos", ".fotismos-lock", "check"}
    # The block that moved is the one that stands out of its map.
    shown = np.asarray(Image.open(out / "check/fig-8-6b/reference-p.png").convert("RGB"), float)
    height, width = shown.shape[:2]
    blocks = shown.reshape(4, height // 4, 4, width // 4, 3).mean(axis=(1, 3, 4))
    assert np.unravel_index(blocks.argmax(), blocks.shape) == (1, 2)
    # Once it passes again, nothing speaks of the failure.
    change(folder / "fig-8-6b.json", factor=1 / 1.5)
    assert run("check", folder, "-o", out)[0] == 0
    assert list(out.iterdir()) == []


def test_json_says_what_moved(run, folder, tmp_path):
    change(folder / "fig-8-6b.json")
    code, printed, _ = run("check", folder, "--json", "-o", tmp_path / "out")
    data = json.loads(printed)
    jsonschema.validate(data, schema("check"))
    assert code == 1
    assert not data["passed"]
    passed, failed = data["checks"]
    assert (passed["status"], passed["moved"]) == ("passed", [])
    (move,) = failed["moved"]
    assert (move["half"], move["block"]) == ("reference", [2, 3])
    assert move["before"] == pytest.approx(1.5 * move["after"], rel=1e-6)
    assert move["p_corrected"] < failed["significance"] < 0.01
    assert failed["tested"] == len(METRICS) + 1 + 2 * 3 * (
        1 + 4 * 4
    )  # metrics; halves, channels, blocks


def test_one_bad_baseline_does_not_keep_the_others(run, folder, tmp_path):
    (folder / "broken.json").write_text("{", encoding="utf-8")
    code, printed, messages = run("check", folder, "-o", tmp_path / "out")
    assert code == 2
    assert re.search(r"broken +error", printed)
    assert "2 of 3 unmoved" in printed
    assert "1 could not be checked" in printed
    assert re.search(r"error: .*broken\.json: this is not JSON", messages)


@pytest.mark.parametrize(
    ("words", "expected"),
    [
        (("nix.json",), "no such baseline"),
        (("empty",), "no baseline"),
        (("nix.json", "--update"), "--scene"),
        (("nix.json", "--update", "--scene", "fig-0"), "'fig-0' is neither"),
        (("nix.json", "--update", "--scene", "fig-8-6a", "--scene", "fig-8-6b"), "one --scene"),
        (("new", "--update", "--scene", "a/x.xml", "--scene", "b/x.xml"), "one name"),
        (("nix.json", "--spp", "4"), "--spp.*--update"),
        (("nix.json", "--scene", "fig-8-6b"), "--scene.*--update"),
        (("nix.json", "--significance", "0"), "range"),
        (("nix.json", "--significance", "nan"), "range"),
    ],
)
def test_bad_words_are_refused(run, tmp_path, monkeypatch, words, expected):
    monkeypatch.chdir(tmp_path)
    for name in ("empty", "a", "b"):
        (tmp_path / name).mkdir()
    for name in ("a/x.xml", "b/x.xml"):
        (tmp_path / name).write_text(SCENE, encoding="utf-8")
    code, _, messages = run("check", *words)
    assert code == 2
    assert re.search(expected, messages)
    assert "Traceback" not in messages


def test_files_of_others_in_the_output_folder_stay(run, folder, tmp_path):
    own = tmp_path / "out/check/fig-8-6b/mine.txt"
    own.parent.mkdir(parents=True)
    own.write_text("mine")
    change(folder / "fig-8-6b.json")
    assert run("check", folder / "fig-8-6b.json", "-o", tmp_path / "out")[0] == 1
    assert (own.parent / "check.json").is_file()
    change(folder / "fig-8-6b.json", factor=1 / 1.5)
    assert run("check", folder / "fig-8-6b.json", "-o", tmp_path / "out")[0] == 0
    assert [path.name for path in own.parent.iterdir()] == ["mine.txt"]


# --- Updating --------------------------------------------------------------------------------


def test_a_baseline_is_made_by_its_name_alone(run, tmp_path):
    code, printed, messages = run("check", tmp_path / "new/fig-8-5a.json", "--update", *FAST)
    assert (code, messages) == (0, "")
    assert "1 of 1 baselines written" in printed
    assert [path.name for path in (tmp_path / "new").iterdir()] == ["fig-8-5a.json"]


def test_an_update_rewrites_what_moved_and_nothing_else(run, folder):
    whole = {path.name: path.read_bytes() for path in folder.iterdir()}
    change(folder / "fig-8-6b.json")
    code, printed, _ = run("check", folder, "--update", "--json")
    assert code == 0
    statuses = [check["status"] for check in json.loads(printed)["checks"]]
    assert statuses == ["unchanged", "updated"]
    assert {path.name: path.read_bytes() for path in folder.iterdir()} == whole


def test_an_update_prints_what_changed(run, folder):
    change(folder / "fig-8-6b.json")
    _, printed, _ = run("check", folder / "fig-8-6b.json", "--update")
    assert "fig-8-6b: updated" in printed
    assert "reference R, block 2,3" in printed
    assert "1 of 1 baselines written" in printed


def test_other_options_write_a_baseline_anew(run, folder):
    path = folder / "fig-8-6b.json"
    code, _, _ = run("check", path, "--update", "--pairing", "literal", "--seed", 4)
    options = json.loads(path.read_text(encoding="utf-8"))["options"]
    assert code == 0
    assert (options["pairing"], options["seed"]) == ("literal", 4)
    assert (options["spp"], options["resolution"]) == (32, [16, 12])


def test_a_broken_baseline_is_written_anew_once_its_scene_is_named(run, folder):
    path = folder / "fig-8-6a.json"
    path.write_text("{", encoding="utf-8")
    code, _, messages = run("check", path, "--update")
    assert code == 2
    assert "--update --scene" in messages
    assert run("check", path, "--update", "--scene", "fig-8-6a", *FAST)[0] == 0
    assert run("check", path, "-o", folder / "out")[0] == 0


def test_an_update_replaces_no_other_baseline_and_no_other_file(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x.xml").write_text(SCENE, encoding="utf-8")
    assert run("check", "base", "--update", "--scene", "a/x.xml", *FAST)[0] == 0
    before = (tmp_path / "base/x.json").read_bytes()
    code, _, messages = run("check", "base", "--update", "--scene", "b/x.xml", *FAST)
    assert (code, (tmp_path / "base/x.json").read_bytes()) == (2, before)
    assert "the baseline of ../a/x.xml, not of b/x.xml" in messages
    other = tmp_path / "package.json"
    for text in ('{"name": "mine"}', "[]", "mine"):
        other.write_text(text)
        assert run("check", other, "--update", "--scene", "a/x.xml", *FAST)[0] == 2
        assert other.read_text() == text


def test_a_baseline_follows_its_schema(folder):
    for path in folder.glob("*.json"):
        jsonschema.validate(json.loads(path.read_text(encoding="utf-8")), SCHEMA)


def test_a_scene_in_a_file_is_found_from_anywhere(run, scene_file, tmp_path, monkeypatch):
    path = tmp_path / "some/where/baseline.json"
    code, _, messages = run("check", path, "--update", "--scene", scene_file, "--spp", 32)
    assert (code, messages) == (0, "")
    scene = json.loads(path.read_text(encoding="utf-8"))["scene"]
    assert scene == "../../my scene.xml"
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    assert run("check", "../some/where")[0] == 0


# --- CI services -----------------------------------------------------------------------------


def failure(name="a%b,c:d", message=""):
    """A result that failed, or an error with a message, without any rendering."""
    moved = Move("dE2000", None, None, 2.0, 3.0, 0.1, 9.0, 1e-9, 1e-7)
    check = None if message else SimpleNamespace(moved=(moved,), moves=(moved,))
    return SimpleNamespace(
        name=name, path=Path(f"{name}.json"), scene="s", check=check, message=message, exit_code=1,
        status="error" if message else "failed", seconds=1.5,
    )  # fmt: skip


def test_junit_holds_failures_and_errors(run, folder, tmp_path):
    change(folder / "fig-8-6b.json")
    (folder / "broken.json").write_text("{", encoding="utf-8")
    file = tmp_path / "new/junit.xml"
    run("check", folder, "-o", tmp_path / "out", "--junit", file)
    suite = ElementTree.parse(file).getroot().find("testsuite")
    assert {key: suite.get(key) for key in ("tests", "failures", "errors")} == {
        "tests": "3",
        "failures": "1",
        "errors": "1",
    }
    cases = {case.get("name"): case for case in suite}
    assert "reference R, block 2,3" in cases["fig-8-6b"].find("failure").text
    assert "not JSON" in cases["broken"].find("error").get("message")
    assert len(cases["fig-8-6a"]) == 0


def test_junit_survives_names_that_xml_cannot_hold():
    document = junit.document([failure(name="a\x00<b>&\x1b", message="no\x08\ufffe")])
    case = ElementTree.fromstring(document).find("testsuite/testcase")
    assert case.get("name") == "a�<b>&�"


@pytest.mark.parametrize("service", SERVICES)
def test_a_name_that_is_not_utf_8_can_be_told(service, tmp_path):
    environment = {service: "true", "GITHUB_STEP_SUMMARY": str(tmp_path / "summary.md")}
    results = [failure("a\udcff\n[b]"), failure("c\udcff", "d\udcff")]
    told = annotations.annotate(results, tmp_path, 0.01, environment)
    told += [path.read_text(encoding="utf-8") for path in tmp_path.iterdir()]
    assert told
    assert "\udcff" not in "".join(told)
    "".join(told).encode()


def test_a_place_that_cannot_be_written_to_is_a_message(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match=r"Not a directory|File exists"):
        annotations.annotate([failure()], tmp_path / "file", 0.01, {"GITLAB_CI": "true"})
    environment = {"GITHUB_ACTIONS": "true", "GITHUB_STEP_SUMMARY": str(tmp_path / "file/summary")}
    with pytest.raises(InputError, match="Not a directory"):
        annotations.annotate([failure()], tmp_path, 0.01, environment)


def test_github_gets_errors_and_a_summary(tmp_path):
    summary = tmp_path / "summary.md"
    summary.write_text("before\n", encoding="utf-8")
    environment = {
        "GITHUB_ACTIONS": "true",
        "GITHUB_STEP_SUMMARY": str(summary),
        "GITHUB_WORKSPACE": str(Path.cwd().parent),
    }
    results = [failure(), failure("second", "line 1\nline | 2 <b>")]
    first, second = annotations.annotate(results, tmp_path, 0.01, environment)
    place = f"{Path.cwd().name}/a%25b%2Cc%3Ad.json"
    assert first.startswith(f"::error file={place},title=fotismos check%3A a%25b%2Cc%3Ad::dE2000")
    assert second.endswith("title=fotismos check%3A second not checked::line 1%0Aline | 2 <b>")
    text = summary.read_text(encoding="utf-8")
    assert text.startswith("before\n### fotismos check\n")
    assert "| a%b,c:d | failed | dE2000 (1 in all) | 2 | 3 | +9.0 | 1e-07 |" in text
    assert r"| second | error | line 1 line \| 2 &lt;b> |" in text


def test_gitlab_gets_a_code_quality_report(tmp_path):
    assert annotations.annotate([failure()], tmp_path, 0.01, {"GITLAB_CI": "true"}) == []
    (found,) = json.loads((tmp_path / "gl-code-quality-report.json").read_text(encoding="utf-8"))
    assert found["location"] == {"path": "a%b,c:d.json", "lines": {"begin": 1}}
    assert found["severity"] == "major"
    assert "dE2000 moved from 2 to 3" in found["description"]
    assert re.fullmatch("[0-9a-f]{64}", found["fingerprint"])
    annotations.annotate([], tmp_path, 0.01, {"GITLAB_CI": "true"})
    assert (tmp_path / "gl-code-quality-report.json").read_text(encoding="utf-8") == "[]"


def test_azure_gets_issues_and_a_summary(tmp_path):
    issue, summary = annotations.annotate([failure("a;b]")], tmp_path, 0.01, {"TF_BUILD": "True"})
    assert issue.startswith("##vso[task.logissue type=error;sourcepath=a%3Bb%5D.json]fotismos")
    assert summary == f"##vso[task.uploadsummary]{tmp_path / 'summary.md'}"
    assert "fotismos check" in (tmp_path / "summary.md").read_text(encoding="utf-8")


def test_teamcity_gets_problems(tmp_path):
    result = failure("it's [Δ]", "one\ntwo")
    (line,) = annotations.annotate([result], tmp_path, 0.01, {"TEAMCITY_VERSION": "2024.1"})
    assert line == (
        "##teamcity[buildProblem description="
        "'fotismos check: it|'s |[|0x0394|] not checked: one|ntwo']"
    )


def test_without_a_service_nothing_is_written(tmp_path):
    assert annotations.annotate([failure()], tmp_path, 0.01, {"CI": "true"}) == []
    assert list(tmp_path.iterdir()) == []


def test_a_detected_service_is_told(run, folder, tmp_path, monkeypatch):
    change(folder / "fig-8-6b.json")
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)
    _, printed, _ = run("check", folder / "fig-8-6b.json", "-o", tmp_path / "out")
    assert re.search("^::error file=.*fig-8-6b.json,title=", printed, re.MULTILINE)
    _, printed, messages = run("check", folder / "fig-8-6b.json", "-o", tmp_path / "out", "--json")
    json.loads(printed)
    assert messages.startswith("::error ")
