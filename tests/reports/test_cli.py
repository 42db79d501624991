"""The command line: results, messages, exit codes; most of it inside this process, for speed."""

import itertools
import json
import os
import re
import shlex
import shutil
import signal
import subprocess
import sys
import time
from io import StringIO
from itertools import accumulate
from random import Random

import jsonschema
import pytest
from rich.console import Console

from fotismos.comparisons.case import open_case
from fotismos.comparisons.fit import fit as fitting
from fotismos.comparisons.ladder import climb
from fotismos.comparisons.options import Options
from fotismos.comparisons.processes.pool import Pool, Task
from fotismos.heuristic.errors import InputError
from fotismos.reports import cli
from fotismos.reports.terminal import progress
from tests.shared.programs import ROOT, python
from tests.shared.schemas import schema
from tests.shared.small_scene import SCENE


def read(path):
    return json.loads(path.read_text())


def test_compare_writes_what_the_contract_names(two_scenes):
    out, published = two_scenes.out, schema("comparison")
    assert str(out / "index.html") in two_scenes.printed
    for name in ("lambert-sphere", "fig-8-9"):
        record = read(out / name / "comparison.json")
        jsonschema.validate(record, published)
        assert (record["scene"], record["resolution"]) == (name, [24, 16])
        pictures = {path.name for path in (out / name).iterdir()}
        assert {"comparison.exr", "heuristic.png", "reference.png"} <= pictures
    record = read(out / "run.json")
    jsonschema.validate(record, schema("run"))
    assert {"rendering", "metrics", "files", "page", "start-up"} <= record["stages"].keys()
    tables = {path.name for path in (out / "tables").glob("[!.]*")}
    assert tables == {"carriers.csv", "metrics.csv"}
    names = {path.name for path in out.glob("[!.]*")}
    pages = {"index.html", "details.html"}
    assert names == pages | {"run.json", "tables", "lambert-sphere", "fig-8-9"}


def test_the_recorded_command_repeats_the_result(run, scene_file, tmp_path):
    options = ("--spp", 8, "--seed", 3, "--resolution", "20x12", "--pairing", "literal")
    run("compare", scene_file, "-o", tmp_path / "a", *options)
    first = read(tmp_path / "a/my-scene/comparison.json")
    words = shlex.split(first["command"])
    assert words[0] == "fotismos"
    run(*words[1:], "-o", tmp_path / "b")
    second = read(tmp_path / "b/my-scene/comparison.json")
    # Mitsuba adds up a wide reconstruction filter in no fixed order.
    for metric in ("dE2000", "dE_ITP", "dE_CAM16UCS"):
        wanted, found = (record["metrics"][metric]["mean"] for record in (first, second))
        assert found == pytest.approx(wanted, rel=1e-4)
    assert second["command"] == first["command"]


def _changed(old, new):
    assert old in SCENE
    return SCENE.replace(old, new)


def test_bad_words_are_refused(run, tmp_path):
    for words, expected in {
        ("nix.xml",): r"nix\.xml: there is no such file",
        ("fig-9-9",): "'fig-9-9' is neither .*fig-8-9",
        ("fig-8-9", "--resolution", "0x5"): "at least 1",
        ("fig-8-9", "--resolution", "big"): "write it like 512x512",
        ("fig-8-9", "--variant", "cuda_rgb"): "llvm_ad_rgb",
        ("fig-8-9", "--spp", "1"): "range",
        ("fig-8-9", "--noise", "nan"): "range",
        ("fig-8-9", "--pairing", "fit"): "literal",
        ("fig-8-9", "-D", "grey"): "'grey' is not a definition; write it like name=value",
        (): "Missing argument",
        ("",): "'' is neither a file nor",  # an empty variable of a shell is not this folder
        ("x" * 1000,): "File name too long",
        ("fig-8-9", "--timeout", "nan"): "'nan' is not in the range",
    }.items():
        code, _, messages = run("compare", *words, "-o", tmp_path / "out")
        assert (code, bool(re.search(expected, messages))) == (2, True), (words, messages)


def test_causes_that_cannot_be_found_leave_the_comparison_and_a_warning(
    run, scene_file, tmp_path, monkeypatch
):
    def fails(*_args, **_kwargs):
        raise InputError("the effects are unknown")

    monkeypatch.setattr("fotismos.comparisons.attribution.find", fails)
    words = ("--spp", 4, "--resolution", "12x8", "-o", tmp_path)
    assert run("compare", scene_file, "--why", *words)[0] == 0
    record = read(tmp_path / "my-scene/comparison.json")
    assert record["metrics"]["dE2000"]["mean"] > 0
    assert record["warnings"][-1] == "The causes are unknown: the effects are unknown"
    page = (tmp_path / "index.html").read_text()
    assert "The causes are unknown: the effects are unknown" in page


def test_plan_prints_a_table_and_json(run):
    code, printed, _ = run("plan", "cornell-box")
    assert code == 0
    for words in ("occlusion", "premise that may fail", "integrator    path", "k_a, k_d"):
        assert words in printed
    rules = {
        each["name"]: each for each in json.loads(run("plan", "cornell-box", "--json")[1])["rules"]
    }
    assert rules["light by light"]["applies"]
    shadows = rules["no shadow rays"]
    assert not shadows["applies"]
    assert "box around a light" in shadows["premise"]
    assert "may stand between" in shadows["evidence"]
    data = json.loads(run("plan", "fig-8-9", "--json", "--everything")[1])
    assert (data["integrator"], len(data["effects"])) == ("path", 16)
    assert all(effect["called_for"] for effect in data["effects"])


def test_a_file_with_tabulated_spectra_is_compared_spectrally(tmp_path):
    spectrum = '<spectrum name="radiance" value="400:0.1, 700:0.3"/>'
    path = tmp_path / "scene.xml"
    path.write_text(_changed('<rgb name="radiance" value="0.2"/>', spectrum))
    assert open_case(path, Options()).variant == "llvm_ad_spectral"
    assert open_case(path, Options(variant="llvm_ad_rgb")).variant == "llvm_ad_rgb"


def test_python_without_docstrings_is_refused_before_any_work(tmp_path):
    words = ("audit", "--heuristic", "phong", "-o", tmp_path / "out")
    done = python("-m", "fotismos.reports", *words, PYTHONOPTIMIZE="2")
    assert (done.returncode, done.stderr.count("\n")) == (2, 1)
    assert "Unset PYTHONOPTIMIZE" in done.stderr
    assert not (tmp_path / "out").exists()


STARTED = """
import sys
from fotismos.reports.__main__ import main
sys.argv = ["fotismos", *sys.argv[1:]]
main()
print(*sys.modules)
"""
SURROUNDINGS = {
    "MPLBACKEND": "module://not_installed.backend",
    "SOURCE_DATE_EPOCH": "9" * 30,
    "PYTHONOPTIMIZE": "1",
}
"""As in a cell of Jupyter, whose kernel passes its backend on, and as packagers set them."""


@pytest.mark.thorough
def test_a_comparison_ignores_its_surroundings_and_imports_what_it_needs(tmp_path):
    options = ("--no-why", "--resolution", "16x16", "--spp", 4, "--workers", 0, "--figures", "-q")
    words = ("compare", "fig-8-9", *options, "-o", tmp_path)
    done = python("-c", STARTED, *words, **SURROUNDINGS)
    assert (done.returncode, done.stderr) == (0, "")
    modules = done.stdout.split()
    assert "fotismos.comparisons.compare" in modules
    assert "altair" not in modules, "the charts of a study of cost alone need it"
    elsewhere = ("alignment", "check", "cost", "departure.tone", "fit", "hard", "picture", "study")
    unneeded = tuple(f"fotismos.comparisons.{name}" for name in elsewhere)
    assert [name for name in modules if name.startswith(unneeded)] == []


@pytest.mark.guarantee("runs", "`--help` installs, writes and renders nothing.")
@pytest.mark.parametrize("command", ["", "docs", "test", "bench", "lint", "compare"])
def test_help_only_helps(command, tmp_path):
    """In a copy without an installation, and without a network to install from."""
    script = tmp_path / "run"
    shutil.copy(ROOT / "run", script)
    words = ["bash", script, *command.split(), "--help"]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=20)
    assert done.returncode == 0
    assert "./run docs" in done.stdout
    assert [path.name for path in tmp_path.iterdir()] == ["run"]


# --- Manners ---------------------------------------------------------------------------------


@pytest.mark.parametrize("name", sorted(cli.cli.list_commands(None)))
def test_help_shows_examples_that_are_commands_and_options_that_there_are(name, run):
    code, printed, _ = run(name, "--help-all")
    assert code == 0
    before, _, examples = printed.partition("Examples")
    command = cli.cli.get_command(None, name)
    found = 0
    for line in examples.partition("\nOptions")[0].splitlines():
        if line.strip().startswith("fotismos"):
            words = shlex.split(line.partition("|")[0])
            command.make_context(name, words[2:])  # fails on an option that is not there
            assert words[1] == name
            found += 1
    assert found or "fotismos " + name in examples
    text = re.sub(r"`[^`]*`", "", f"{before} {examples.partition('Options:')[2]}")
    has = {option for one in command.params for option in (*one.opts, *one.secondary_opts)}
    assert set(re.findall(r"(?<![\w-])--[a-z][a-z-]*", text)) <= has | {"--help", "--help-all"}


def test_help_is_in_groups_with_whole_summaries_and_the_words_of_the_user(run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("FOTISMOS_PROGRAM", "./run")
    _, printed, _ = run("--help")
    assert "\nOne scene:\n" in printed
    assert "  ./run compare fig-8-9" in printed
    assert not re.search(r"…|\.\.\.\n", printed.partition("Options")[2])
    _, printed, _ = run("compare", "--help-all")
    groups = [line for line in printed.splitlines() if re.fullmatch(r"\w.*:", line)]
    assert groups[0] == "Options:"
    assert {"What is rendered:", "Results:", "Bounds and CI:"} < set(groups)
    assert "--workers" in printed.partition("FOTISMOS_WORKERS")[2]


@pytest.mark.parametrize("name", sorted(cli.cli.list_commands(None)))
def test_the_short_help_fits_a_screen(name, run, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    code, printed, _ = run(name, "--help")
    assert code == 0
    command = printed.partition("\nOptions:")[2]
    options = re.findall(r"(?m)^  (?:-\w, )?(--[a-z-]+|-D)", command)
    assert options[-2:] == ["--help", "--help-all"]
    assert len(options) - 2 <= 14
    assert len(printed.splitlines()) <= 52


SMALL = ("--resolution", "16x16", "--spp", 4)


def test_a_quiet_run_prints_the_page_alone_and_a_verbose_one_says_more(run, tmp_path, two_scenes):
    quiet = run("compare", "fig-8-9", "-q", "-o", tmp_path, *SMALL)
    assert quiet == (0, f"{tmp_path / 'index.html'}\n", "")
    assert "differs visibly" in two_scenes.printed
    words = ("-v", "--figures", "-o", tmp_path, *SMALL)
    code, printed, messages = run("compare", "fig-8-8a", *words)
    assert (code, "differs visibly" in printed) == (0, True)
    assert (tmp_path / "figures/fig-8-8a.pdf").stat().st_size > 1000
    for word in ("4 samples per pixel", "heuristic_point as point", "missed: specular", "metrics"):
        assert word in messages


class Terminal(StringIO):
    def isatty(self):
        return True


def test_a_terminal_shows_stages_a_bar_and_the_time_left_in_colours_unless_no_color_is_set(
    monkeypatch,
):
    for name in ("NO_COLOR", "FORCE_COLOR", "COLORTERM"):
        monkeypatch.delenv(name, raising=False)
    for name, value in {"TERM": "xterm-256color", "COLUMNS": "100"}.items():
        monkeypatch.setenv(name, value)
    tasks = [Task(f"scene-{number}", rendering, (number,), tells=True) for number in range(3)]
    for is_coloured in (True, False):
        monkeypatch.setattr(sys, "stderr", Terminal())
        with Pool(0) as pool, progress.shown(pool, "scenes") as shown:
            shown.clock = itertools.count().__next__
            for task, _ in shown.each(tasks):
                shown.rows = ["scene", task.name]
        said = sys.stderr.getvalue()
        for words in ("rendering 5 of 10", "scenes", r"2 of 3, 1 failed, \d:\d\d left"):
            assert re.search(words, said)
        assert ("\x1b[38;5;" in said or "\x1b[3" in said) is is_coloured
        monkeypatch.setenv("NO_COLOR", "1")


def rendering(number, report):
    for done in (0, 5):
        report("rendering", done, 10)
        time.sleep(0.3)
    if number == 1:
        raise InputError("no")


@pytest.mark.parametrize("height", [4, 10, 24, 45])
def test_the_bar_of_all_is_the_last_line_at_any_height(height):
    """With more tasks than lines that run, and more rows than lines."""
    found = progress.Progress(Pool(0), "scenes", total=99, done=30, begin=-60.0)
    found.clock = lambda: 0.0
    found.rows = ["heading", *(f"row {number}" for number in range(30))]
    for running in (2, 40):
        names = [f"scene-{number}" for number in range(running)]
        found.running = {name: progress.Running(-1.0, "causes", 1, 9) for name in names}
        console = Console(width=80, file=StringIO())
        console.print(found.lines(80, height))
        lines = console.file.getvalue().splitlines()
        assert len(lines) <= height - 1
        assert lines[-1].startswith("scenes ")
        assert "30 of 99, 2:" in lines[-1]
        if len(lines) > running + 2:
            assert lines[0] == "heading"
            assert lines[-running - 2] == "row 29"


def test_the_time_left_never_triples_even_where_long_tasks_come_late():
    """For tasks in any order, or the shortest first, whose times differ as those of scenes do."""
    for seed in range(40):
        seconds = Random(seed).choices([3, 5, 8, 13, 21], k=30)
        if seed % 2:
            seconds.sort()
        found = progress.Progress(Pool(0), "scenes", total=len(seconds))
        ends = [seconds.pop(0) for _ in range(2)]
        found.running = {str(n): progress.Running(0.0) for n in range(2)}
        told = []
        for now in range(1, 1000):
            found.clock = lambda now=now: now
            for number, end in enumerate(ends):
                if end == now and str(number) in found.running:
                    del found.running[str(number)]
                    found.done += 1
                    if seconds:
                        found.running[str(number)] = progress.Running(float(now))
                        ends[number] = now + seconds.pop(0)
            if (left := found.seconds_left()) is not None:
                told.append(left)
            if not found.running:
                break
        assert told[-1] == 0
        grown = [
            later / least
            for least, later in zip(accumulate(told, min), told, strict=True)
            if least > 10
        ]
        assert max(grown) < 3


def test_a_pipe_gets_a_line_with_the_count_every_ten_seconds_at_most(capsys):
    """Here each task takes four seconds; hard cases are no scene."""
    now = [0.0]

    def work(number):
        now[0] += 4
        if number == 1:
            raise InputError("no")

    for count, lines in (
        (1, []),
        (6, ["3 of 6, 1 failed, 0:12 left", "5 of 6, 1 failed, 0:05 left"]),
    ):
        now[0] = 0
        tasks = [Task(f"scene-{number}", work, (number,)) for number in range(count)]
        tasks.insert(3, Task("hard cases", work, (9,), is_counted=False))
        with Pool(0) as pool, progress.shown(pool, "scenes") as shown:
            shown.clock = lambda: now[0]
            assert len([*shown.each(tasks)]) == count + 1
        said = capsys.readouterr().err.splitlines()
        assert said == [f"scenes: {line}" for line in lines]


def test_tasks_that_follow_others_are_counted_from_the_start():
    found = progress.Progress(Pool(0), "scenes")
    for name in ("price", "method"):
        found.do(Task(name, str, ()))
        assert (found.done, found.total) == (1, 1)


def test_help_of_costs_and_fits_states_their_own_defaults(run):
    texts = {name: " ".join(run(name, "--help")[1].split()) for name in ("cost", "fit", "export")}
    assert f"reduced to a width of {climb.WIDTH}]" in texts["cost"]
    assert f"[default: {climb.LARGEST_SPP}, then more until a method looks right]" in texts["cost"]
    assert "[default: {}x{}]".format(*fitting.RESOLUTION) in texts["fit"]
    assert f"[default: {fitting.SPP}]" in texts["fit"]
    for option in ("--spp", "--seed", "--pixels-per-degree"):
        assert option not in texts["export"]


def test_a_closed_pipe_ends_as_a_shell_expects():
    reader, writer = os.pipe()
    os.close(reader)
    command = [sys.executable, "-P", "-m", "fotismos.reports", "--version"]
    done = subprocess.run(command, stdout=writer, stderr=subprocess.PIPE, cwd=ROOT, check=False)
    os.close(writer)
    assert (done.returncode, done.stderr) == (128 + signal.SIGPIPE, b"")
