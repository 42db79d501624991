"""Checks, gates and what CI reads of them: exit codes, JUnit, Markdown, and what they replace."""

import json
import re
import shutil
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import jsonschema
import numpy as np
import OpenEXR
import pytest
from msgspec import structs

from fotismos.comparisons.departure.metrics import METRICS
from fotismos.comparisons.records.check import HALVES
from fotismos.comparisons.records.departure import VisibleShare
from fotismos.heuristic.errors import InputError
from fotismos.reports.ci import baselines, checks, summary
from fotismos.reports.commands.compare import Compare
from fotismos.reports.files import images
from fotismos.reports.jobs import Terminal
from tests.shared import records
from tests.shared.outputs import write
from tests.shared.programs import command_line
from tests.shared.schemas import schema
from tests.shared.small_baselines import FAST, change
from tests.shared.small_scene import SCENE

SMALL = ("--spp", 4, "--resolution", "12x8")
HEADLINE = "`sphere`: red -"

# --- Gates -----------------------------------------------------------------------------------


@pytest.mark.guarantee("checks", "A gate neither passes nor fails because of noise.")
def test_a_gate_is_undecided_where_noise_may_be_the_reason():
    share = VisibleShare(threshold=2.0, value=0.4, low=0.3, high=0.5)
    lead = structs.replace(records.summary(3.0), visible=(share,))
    record = structs.replace(records.record(), metrics={"dE2000": lead})
    states = {0.2: "fail", 0.3: "undecided", 0.4: "undecided", 0.5: "pass"}
    assert {bound: summary.gates([record], bound)[0].state for bound in states} == states
    assert summary.gates([record], None) == []
    outcome = summary.gate_outcome([summary.gates([record], bound)[0] for bound in states])
    assert outcome.startswith("gates: 1 failed, 2 undecided, 1 passed. More samples")


def test_a_run_beyond_its_bounds_ends_with_1_and_says_so_everywhere(two_scenes):
    assert two_scenes.code == 1
    assert "gates: 1 failed, 1 passed" in two_scenes.printed
    suite = ElementTree.parse(two_scenes.folder / "j.xml").getroot().find("testsuite")
    assert (suite.get("tests"), suite.get("failures")) == ("2", "1")
    assert "at most 10.0 % may: it fails." in suite.find("testcase/failure").get("message")
    text = (two_scenes.folder / "s.md").read_text()
    assert "| fail |" in text
    assert f"`{two_scenes.out / 'index.html'}`" in text


@pytest.mark.parametrize("others", [(), ("lambert-sphere",)])
def test_a_scene_that_fails_is_an_error_in_what_ci_reads(run, tmp_path, others):
    (tmp_path / "bad.xml").write_text("<scene")
    files = ("--junit", tmp_path / "j.xml", "--summary", tmp_path / "s.md")
    words = (tmp_path / "bad.xml", *others, *SMALL, "-o", tmp_path / "out", "--max-visible", "99%")
    code, printed, messages = run("compare", *words, *files)
    assert code == 2
    suite = ElementTree.parse(tmp_path / "j.xml").getroot().find("testsuite")
    assert (suite.get("tests"), suite.get("errors")) == (str(1 + len(others)), "1")
    case = suite.find("testcase/error/..")
    assert (case.get("name"), case.find("error").get("type")) == ("bad", "InputError")
    assert "bad.xml" in case.find("error").get("message")
    assert "bad.xml" in (tmp_path / "s.md").read_text()
    assert (tmp_path / "out").exists() == bool(others)
    for name in others:
        assert "1 of 2 scenes failed" in messages
        assert name in printed
        assert "<b>Failed:</b>" in (tmp_path / "out/index.html").read_text()
        assert [path.name for path in (tmp_path / "out").glob("*/comparison.json")]


def test_junit_and_a_summary_are_two_files(run, tmp_path):
    files = ("--junit", tmp_path / "a.md", "--summary", tmp_path / "b/../a.md")
    code, _, messages = run("compare", "lambert-sphere", *SMALL, "-o", tmp_path / "out", *files)
    assert code == 2
    assert "they are one file. Name two." in messages
    assert not list(tmp_path.iterdir())


def test_a_picture_among_the_results_is_not_replaced(run, tmp_path):
    words = ("compare", "lambert-sphere", *SMALL, "-o", tmp_path / "out")
    assert run(*words)[0] == 0
    picture = tmp_path / "out/lambert-sphere/comparison.exr"
    content = picture.read_bytes()
    code, _, messages = run(*words, "--image", f"{picture}:reference")
    assert code == 2
    assert "this picture is in the folder of the results" in messages
    assert picture.read_bytes() == content


# --- Checks ----------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def failure(made_baselines, tmp_path_factory):
    """A check of two baselines, one of which moved, and then one of which none did."""
    folder = tmp_path_factory.mktemp("failed")
    baselines = shutil.copytree(made_baselines, folder / "baselines")
    change(baselines / "fig-8-6b.exr")
    (baselines / "broken.exr").write_text("{")
    words = ("check", baselines, "-o", folder / "out")
    files = ("--junit", folder / "j.xml", "--summary", folder / "s.md")
    code, printed, messages = command_line(*words, *files)
    shutil.copytree(folder / "out", folder / "kept")
    (baselines / "broken.exr").unlink()
    shutil.copy(made_baselines / "fig-8-6b.exr", baselines)
    again = command_line(*words, "--seed", 7)
    return SimpleNamespace(
        folder=folder, baselines=baselines, code=code, printed=printed, messages=messages,
        out=folder / "kept/check", again=again,
    )  # fmt: skip


def test_what_moved_fails_with_a_table_and_the_others_are_checked(failure):
    assert failure.code == 2, "one baseline could not be read"
    assert "1 of 3 moved" in failure.printed
    assert f"fig-8-6b: failed. {HEADLINE}" in failure.printed
    assert "1 could not be checked" in failure.printed
    assert re.search(r"sphere: physical red +-\d\S+ % +\S+ +\S+ +-\S+ +\S+", failure.printed)
    accepting = f"fotismos check {failure.baselines / 'fig-8-6b.exr'} --update"
    assert accepting in failure.printed
    assert re.search(r"error: .*broken\.exr: not a readable EXR file: ", failure.messages)


@pytest.mark.guarantee("checks", "A failure writes one page: before, now, where, and why.")
def test_the_page_of_a_failure_shows_before_and_now_under_what_moved(failure):
    html = (failure.out / "index.html").read_text()
    shown = "<code>sphere</code>: red −"
    assert shown in re.search(r"<h1>(.*?)</h1>", html)[1]
    assert "<title>`sphere`: red -" in html
    for part in (
        "1 of 3 moved",
        "textbook, before",
        "physical, now",
        "what moved: ΔE2000",
        "--update",
    ):
        assert part in html, part
    names = {path.name for path in (failure.out / "fig-8-6b").iterdir()}
    panels = {f"{half}-{name}.png" for half in HALVES for name in ("before", "now", "dE2000")}
    assert names >= {"check.json", *panels}
    record = json.loads((failure.out / "fig-8-6b/check.json").read_text())
    assert record["headline"].startswith(HEADLINE)
    assert record["causes"][0].startswith("Only the physical half moved")
    assert {move["half"] for move in record["moved"]} == {"reference"}
    assert {move["channel"] for move in record["moved"]} == {"R"}
    # Of each half and channel: the picture, one block of 16 by 16 pixels, and a sphere.
    assert record["tested"] == 2 * 3 * 3
    assert record["metrics"].keys() == {*METRICS, "log2_luminance"}


def test_once_it_passes_nothing_speaks_of_the_failure(failure):
    code, printed, messages = failure.again
    assert (code, "error" in messages) == (0, False)
    assert "2 of 2 unmoved" in printed
    assert list((failure.folder / "out").iterdir()) == []


def test_ci_reads_what_moved_and_what_was_not_checked(failure):
    suite = ElementTree.parse(failure.folder / "j.xml").getroot().find("testsuite")
    assert [suite.get(key) for key in ("tests", "failures", "errors")] == ["3", "1", "1"]
    (message,) = suite.findall("testcase/failure")
    assert message.get("message").startswith(HEADLINE)
    assert "standard errors" in message.text
    text = (failure.folder / "s.md").read_text()
    assert "| fig-8-6b | failed | \\`sphere\\`: red -" in text
    assert f"`{failure.folder / 'out/check/index.html'}`" in text


def test_json_and_a_baselines_header_follow_their_schemas(run, baselines_folder, tmp_path):
    path = baselines_folder / "fig-8-6a.exr"
    with OpenEXR.File(str(path), header_only=True) as file:
        jsonschema.validate(json.loads(file.header()["fotismos"]), schema("baseline"))
    code, printed, _ = run("check", path, "--json", "-o", tmp_path / "out")
    jsonschema.validate(json.loads(printed), schema("check"))
    assert code == 0


def test_names_that_xml_and_utf_8_forbid_are_shown():
    made = checks.failed(Path("a\x00\udcff<b>.json"), InputError("x"))
    case = ElementTree.fromstring(summary.junit_of_checks([made])).find("testsuite/testcase")
    assert case.get("name") == "a��<b>"
    assert "x00" in summary.of_checks([made], 0.01, "").encode().decode()


def test_bad_words_are_refused(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("empty", "a", "b"):
        (tmp_path / name).mkdir()
    for name in ("a/x.xml", "b/x.xml"):
        (tmp_path / name).write_text(SCENE)
    for words, expected in {
        ("check", "nix.exr"): "no such baseline",
        ("check", "empty"): "no baseline",
        ("check", "nix.json", "--update"): "--scene",
        ("check", "nix.json", "--update", "--scene", "fig-0"): "'fig-0' is neither",
        ("check", "n.json", "--update", "--scene", "fig-8-6a", "--scene", "a/x.xml"): "one --scene",
        ("check", "new", "--update", "--scene", "a/x.xml", "--scene", "b/x.xml"): "one name",
        ("check", "nix.json", "--spp", "4"): "--spp.*--update",
        ("check", "nix.json", "--scene", "fig-8-6b"): "--scene.*--update",
        ("check", "nix.json", "--significance", "nan"): "range",
        ("compare", "fig-8-9", "--within", "2.1"): "2.1 is not a threshold",
        ("compare", "fig-8-9", "--max-visible", "5 of 100"): "such as 5%",
        ("compare", "fig-8-9", "--max-visible", "101%"): "from 0% to 100%",
    }.items():
        code, _, messages = run(*words)
        assert (code, bool(re.search(expected, messages))) == (2, True), (words, messages)
        assert "Traceback" not in messages


# --- Updates ---------------------------------------------------------------------------------


def test_an_update_rewrites_what_moved_and_nothing_else(run, baselines_folder):
    def content():
        return {path.name: path.read_bytes() for path in baselines_folder.iterdir()}

    whole = content()
    change(baselines_folder / "fig-8-6b.exr")
    code, printed, _ = run("check", baselines_folder, "--update")
    assert code == 0
    for words in (f"fig-8-6b: updated. {HEADLINE}", "1 of 2 baselines written"):
        assert words in printed
    assert content() == whole


def test_other_options_write_a_baseline_anew(run, baselines_folder):
    path = baselines_folder / "fig-8-6b.exr"
    assert run("check", path, "--update", "--pairing", "literal", "--seed", 4)[0] == 0
    options = baselines.read(path).baseline.options
    assert (options["pairing"], options["seed"]) == ("literal", 4)
    assert (options["spp"], options["resolution"]) == (32, [16, 12])


def test_an_update_replaces_no_other_baseline_and_no_other_file(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "x.xml").write_text(SCENE)

    def update(baseline, scene):
        return run("check", baseline, "--update", "--scene", scene, *FAST)

    assert update("base", "a/x.xml")[0] == 0
    path = tmp_path / "base/x.exr"
    before = path.read_bytes()
    assert baselines.read(path).baseline.scene == "../a/x.xml", "found from anywhere"
    code, _, messages = update("base", "b/x.xml")
    assert (code, path.read_bytes()) == (2, before)
    assert "the baseline of ../a/x.xml, not of b/x.xml" in messages
    other = tmp_path / "package.json"
    for text in ('{"name": "mine"}', "[]", "mine", OLD[:40]):
        other.write_text(text)
        code, _, messages = update(other, "a/x.xml")
        assert (code, "Move it away. Make a baseline with" in messages) == (2, True)
        assert other.read_text() == text


OLD = """{"record_version": 4, "scene": "fig-8-6a", "options": {"resolution": [16, 12], "spp": 32},
"passes": 16, "versions": {}, "metrics": {}, "heuristic": {}, "reference": {}}"""


@pytest.mark.guarantee("checks", "A baseline of 0.4 never passes, and an update makes it again.")
def test_a_baseline_of_0_4_is_refused_until_it_is_made_again(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    old = Path("b/fig.json")
    old.parent.mkdir()
    old.write_text(OLD)
    kept = {"baseline.reference": np.zeros((2, 2, 3))}  # the pictures beside it
    images.write_exr(Path("b/fig.exr"), kept, {"scene": "fig-8-6a"})
    for words in (("b",), ("b/fig.json",), ("b/fig.exr",)):
        code, printed, messages = run("check", *words)
        assert (code, "of fotismos 0.4, which kept numbers" in messages) == (2, True)
        assert "check b/fig.json --update` makes fig.exr" in messages
        assert old.exists()
    code, printed, _ = run("check", "b", "--update")
    assert (code, old.exists()) == (0, False)
    assert "fig.json of fotismos 0.4 could not be compared: fig.exr, in its place" in printed
    made = baselines.read(Path("b/fig.exr")).baseline
    assert (made.scene, made.options["resolution"], made.options["spp"]) == (
        "fig-8-6a", [16, 12], 32,
    )  # fmt: skip
    assert run("check", "b/fig.json")[0] == 0, "by its old name, too"
    shots = ("--picture", "hall=?.exr")
    Path("c").mkdir()
    Path("c/hall.json").write_text('{"record_version": 4, "repeats": 2, "transfer": "linear"}')
    write(Path("0.exr"), np.full((8, 8, 3), 0.5))
    write(Path("1.exr"), np.full((8, 8, 3), 0.51))
    code, _, messages = run("check", "c", *shots)
    assert (code, "--update --picture hall=PATTERN` makes hall.exr" in messages) == (2, True)
    assert run("check", "c", "--update", *shots)[0] == 0
    assert baselines.read(Path("c/hall.exr")).baseline.options == {"transfer": "linear"}
    assert run("check", "c", *shots)[0] == 0


# --- Files of others -------------------------------------------------------------------------


@pytest.mark.guarantee("runs", "`--junit`, `--summary` and baselines do not replace your files.")
def test_a_file_of_others_is_not_replaced_by_compare(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    files = {"a.xml": SCENE, "mine.txt": "mine", "b.md": SCENE}
    for each, text in files.items():
        (tmp_path / each).write_text(text)
    (tmp_path / "b.xml").symlink_to("b.md")
    for option, name, scene in (
        ("--junit", "a.xml", "a.xml"), ("--summary", "a.xml", "a.xml"),
        ("--junit", "mine.txt", "a.xml"), ("--summary", "b.md", "b.xml"),
    ):  # fmt: skip
        code, _, messages = run("compare", scene, *SMALL, option, name)
        assert (code, f"{option} {name}: " in messages) == (2, True)
        assert {each: (tmp_path / each).read_text() for each in files} == files
        assert not (tmp_path / "out").exists(), "refused before anything is rendered"


def test_a_picture_of_others_is_not_replaced_by_a_baselines(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "b.exr").write_bytes(b"mine")
    words = ("check", "b.exr", "--update", "--scene", "fig-8-6b", *SMALL)
    code, _, messages = run(*words)
    assert code == 2
    assert "b.exr" in messages
    assert (tmp_path / "b.exr").read_bytes() == b"mine"
    (tmp_path / "b.exr").unlink()
    for seed in range(2):  # its own are
        assert run(*words, "--seed", seed)[0] == 0
        with OpenEXR.File("b.exr", separate_channels=True) as file:
            assert "pass.reference.0.R" in file.channels()


def test_a_report_replaces_an_earlier_one_and_a_summary_is_appended(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "a.xml").write_text(SCENE)
    (tmp_path / "s.md").write_text("before\n")
    files = ("--max-visible", "100%", "--junit", "j.xml", "--summary", "s.md")
    for count in (1, 2):
        assert run("compare", "a.xml", *SMALL, *files)[0] == 0
        assert (tmp_path / "j.xml").read_text().count("<testcase") == 1
        text = (tmp_path / "s.md").read_text()
        assert text.startswith("before\n")
        assert text.count("### fotismos compare") == count


@pytest.mark.guarantee(
    "runs", "Names from a scene reach terminals, CI logs and tables as mere text."
)
def test_hostile_names_are_printed_as_text(run, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", str(tmp_path / "summary"))
    monkeypatch.setenv("GITHUB_ACTIONS", "true")
    hidden = "z&#10;::stop-commands::x&#x9b;31m"
    text = SCENE.replace('<bsdf type="roughplastic"', f'<bsdf type="roughplastic" id="{hidden}"')
    text = text.replace('<shape type="sphere"', '<shape type="sphere" id="=1+1"', 1)
    assert text.count(hidden) == 1
    for name, content in (("*a*|b.xml", text), ("bad.xml", text.replace('"path"', f'"{hidden}"'))):
        (tmp_path / name).write_text(content)
        _, printed, messages = run("compare", name, *SMALL, "-v", "-o", "out", "--summary", "s.md")
        for line in (printed + messages).split("\n"):
            assert not line.lstrip().startswith("::")
            assert "\x9b" not in line
    assert "stop-commands" in messages
    assert "\\*a\\*\\|b" in (tmp_path / "s.md").read_text()
    csv = (tmp_path / "out/tables/carriers.csv").read_text()
    assert "=1+1" in csv
    assert ",=1+1" not in csv


def test_a_junit_path_that_cannot_be_written_is_named_by_its_option(tmp_path):
    with pytest.raises(InputError, match=r"--junit .*: Is a directory\. Name a file"):
        summary.write_junit(tmp_path, lambda: b"<testsuites/>")


@pytest.mark.parametrize("layer", ["", ":view"])
def test_files_for_ci_never_replace_a_picture_whatever_its_name_and_layer(tmp_path, layer):
    picture = tmp_path / "a:b.exr"
    picture.touch()
    command = Compare(image=f"{picture}{layer}", reference="theirs.exr")
    with pytest.raises(InputError, match="is an input of the same command"):
        command.run(Terminal(output=tmp_path, junit=picture))
