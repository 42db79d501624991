"""The command line's manners: help, completion, colours, and how much it says."""

import os
import shlex
import subprocess
import sys
from io import StringIO

import pytest

from reports import cli
from reports.terminal import progress
from tests.programs import ROOT

COMMANDS = sorted(cli.cli.commands)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_shows_examples_that_are_commands(name, run):
    code, printed, _ = run(name, "--help")
    assert code == 0
    _, _, examples = printed.partition("Examples")
    command = cli.cli.commands[name]
    found = 0
    for line in examples.partition("\nOptions")[0].splitlines():
        if line.strip().startswith("fotismos"):
            words = shlex.split(line.partition("|")[0])
            command.make_context(name, words[2:])  # fails on an option that is not there
            assert words[1] == name
            found += 1
    assert found or "fotismos " + name in examples


SMALL = ("--resolution", "16x16", "--spp", 4)


def test_a_quiet_run_prints_the_page_alone_and_a_verbose_one_says_more(run, tmp_path):
    quiet = run("compare", "fig-8-9", "-q", "-o", tmp_path, *SMALL)
    assert quiet == (0, f"{tmp_path / 'index.html'}\n", "")
    code, usual, messages = run("compare", "fig-8-9", "-o", tmp_path, *SMALL)
    assert (code, messages) == (0, "")
    assert "mean ΔE2000" in usual
    code, printed, messages = run("compare", "fig-8-8a", "-v", "-o", tmp_path, *SMALL)
    assert "mean ΔE2000" in printed
    for word in ("4 samples per pixel", "heuristic_point as point", "missed: specular", "metrics"):
        assert word in messages


def test_figures_come_when_asked_for_and_tables_always(run, tmp_path):
    run("compare", "fig-8-9", "-o", tmp_path / "plain", *SMALL)
    assert not (tmp_path / "plain/figures").exists()
    run("compare", "fig-8-9", "-o", tmp_path, "--figures", *SMALL)
    for name in ("fig-8-9.pdf", "fig-8-9-histogram-dE2000.svg", "departures.pdf"):
        assert (tmp_path / "figures" / name).stat().st_size > 1000
    assert "\nfig-8-9,dE2000," in (tmp_path / "tables/metrics.csv").read_text(encoding="utf-8")
    assert "| fig-8-9 |" in (tmp_path / "tables/metrics.md").read_text(encoding="utf-8")


class Terminal(StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(("no_color", "coloured"), [(None, True), ("1", False)])
def test_progress_has_time_left_and_colours_unless_no_color_is_set(no_color, coloured, monkeypatch):
    for name in ("NO_COLOR", "FORCE_COLOR", "COLORTERM"):
        monkeypatch.delenv(name, raising=False)
    if no_color:
        monkeypatch.setenv("NO_COLOR", no_color)
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setenv("COLUMNS", "100")
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress.shown() as bar:
        update = bar.of("cornell-box")
        update("rendering", 0, 10)
        update("rendering", 5, 10)
    shown = sys.stderr.getvalue()
    assert "cornell-box" in shown
    assert ":" in shown  # time left
    assert ("\x1b[38;5;" in shown or "\x1b[3" in shown) is coloured


def test_the_line_of_the_run_and_every_bar_reach_their_end(monkeypatch):
    monkeypatch.setenv("TERM", "xterm-256color")
    monkeypatch.setattr(sys, "stderr", Terminal())
    with progress.shown(total=5) as bar:
        whole = bar._progress.tasks[0]
        bar.begin("first pictures", 2, weight=1)
        for scene in "ab":
            update = bar.of(scene)
            update("rendering", 1, 2)
            bar.over(update)
        assert whole.percentage == 40
        assert whole.description == "first pictures, 2 of 2"
        bar.begin("scenes", 1, weight=1, skipped=1)
        assert whole.percentage == 50
        bar.begin("the rest", 2, weight=1)
        bar.over(None)
        bar.over(None)
        assert whole.finished
        assert bar._progress.tasks == [whole]


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion_prints_what_the_shell_sources(shell, run):
    code, printed, messages = run("completion", shell)
    assert (code, messages) == (0, "")
    assert f"_FOTISMOS_COMPLETE={shell}_complete" in printed


def test_completion_of_another_shell_is_refused(run):
    code, _, messages = run("completion", "tcsh")
    assert code == 2
    assert "bash" in messages


@pytest.mark.parametrize(
    ("words", "expected"),
    [("pl", {"plan"}), ("compare fig-8-8", {"fig-8-8a", "fig-8-8b", "fig-8-8c"})],
)
def test_bash_completes_commands_and_scenes(words, expected, tmp_path):
    # Under the name of the run script, which the shell calls to complete itself.
    program = tmp_path / "run"
    program.write_text(f'#!/bin/sh\nexec {sys.executable} -m reports "$@"\n')
    program.chmod(0o755)
    script = (
        "compopt() { :; }\n"  # a bash that is not interactive refuses it
        f"source <({program} completion bash)\n"
        f"COMP_WORDS=(run {words}) COMP_CWORD={len(words.split())}\n"
        f"_fotismos_completion {program}\n"
        "printf '%s\\n' \"${COMPREPLY[@]}\"\n"
    )
    environment = os.environ | {"PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        ["bash", "-c", script], env=environment, capture_output=True, text=True, cwd=tmp_path
    )
    assert done.stderr == ""
    assert set(done.stdout.split()) == expected
