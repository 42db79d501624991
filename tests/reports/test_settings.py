"""The table ``[tool.fotismos]`` of pyproject.toml and variables, which set defaults of commands."""

import pytest

from fotismos.comparisons.records.check import Tolerance
from fotismos.heuristic.errors import InputError
from fotismos.reports.cli import cli
from fotismos.reports.commands.check import Check
from fotismos.reports.commands.compare import Compare
from tests.shared.programs import command_line

TABLE = """\
[tool.fotismos]
baselines = "kept"
report = "made"
significance = 0.001
within = 3
max_visible = "7%"
"""
PICTURES = ("--picture", "hall=*.exr")


@pytest.fixture
def asked(tmp_path, monkeypatch):
    """A function that runs ``check`` below a folder with a table; it returns what was asked.

    That is the command, and what its terminal has.
    """
    below = tmp_path / "tests/scenes"
    below.mkdir(parents=True)
    monkeypatch.chdir(below)
    made = []
    monkeypatch.setattr(Check, "run", lambda *asked: made.append(asked) or 0)

    def ask(table, *words):
        (tmp_path / "pyproject.toml").write_text(table)
        code, _, message = command_line("check", *words)
        assert code == 0, message
        return made.pop()

    return ask


def test_the_table_sets_what_the_command_line_leaves_open(asked):
    made, terminal = asked(TABLE, *PICTURES)
    assert made.baseline.as_posix() == "../../kept"
    assert terminal.output.as_posix() == "../../made"
    assert (made.significance, made.tolerance) == (0.001, Tolerance(within=3, bound=0.07))
    words = ("other", "-o", "out", "--significance", 0.1, "--within", 4, "--max-visible", "1%")
    made, terminal = asked(TABLE, *words, *PICTURES)
    assert (made.baseline.name, terminal.output.name) == ("other", "out")
    assert (made.significance, made.tolerance) == (0.1, Tolerance(within=4, bound=0.01))


def test_a_tolerance_of_the_table_is_for_pictures_alone(asked):
    made, _ = asked(TABLE)
    assert made.tolerance is None


@pytest.mark.parametrize("nearer", ["[tool.other]\nbaselines = 'no'", "tool = 3"])
def test_nearer_files_without_the_table_are_passed_over(asked, tmp_path, nearer):
    (tmp_path / "tests/pyproject.toml").write_text(nearer)
    assert asked(TABLE)[0].baseline.name == "kept"


@pytest.mark.parametrize(
    ("table", "message"),
    [
        ("baseline = 'x'", r"key 'baseline' is not known \(did you mean baselines\?\)"),
        ("significance = 2", r"\[tool.fotismos\] significance: 2(.0)? is not in the range"),
        ("max_visible = 'x'", r"max_visible: 'x' is not a percentage"),
        ("baselines = 3", r"baselines = 3 is not a folder"),
        ("within = [2]", r"within = \[2\] is not a number or a text"),
        ("within", r"pyproject.toml cannot be read"),
        ("within = " + 9999 * "[" + 9999 * "]", r"pyproject.toml cannot be read"),
    ],
)
def test_what_is_wrong_in_the_table_is_named_with_its_file(table, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "pyproject.toml").write_text(f"[tool.fotismos]\n{table}\n")
    with pytest.raises(InputError, match=message) as caught:
        cli.get_command(None, "check").make_context("check", ["kept"])
    assert str(tmp_path / "pyproject.toml") in str(caught.value)
    assert command_line("check", "--help")[0] == 0


def test_without_a_table_the_baselines_must_be_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    code, _, message = command_line("check")
    assert (code, "Missing argument 'BASELINE'" in message) == (2, True)


@pytest.fixture
def compared(tmp_path, monkeypatch):
    """A function that runs ``compare`` below a table; it returns the command and its terminal."""
    monkeypatch.chdir(tmp_path)
    asked = []
    monkeypatch.setattr(Compare, "run", lambda *given: asked.append(given) or 0)

    def compare(table, *words):
        (tmp_path / "pyproject.toml").write_text(table)
        code, _, message = command_line("compare", "fig-8-9", *words)
        assert code == 0, message
        return asked.pop()

    return compare


def test_settings_come_from_the_words_then_a_variable_then_the_table(compared, monkeypatch):
    table = "[tool.fotismos]\nworkers = 1\nvertex_weights = 'area'\nbaselines = 'kept'\n"
    command, terminal = compared(table)
    assert (command.vertex_weights, terminal.workers) == ("area", 1)
    monkeypatch.setenv("FOTISMOS_WORKERS", "2")
    monkeypatch.setenv("FOTISMOS_COLOUR_SCIENCE", "1")
    command, terminal = compared(table)
    assert (command.colour_science, terminal.workers) == (True, 2)
    assert compared(table, "--workers", "3")[1].workers == 3


def test_a_variable_that_is_not_allowed_is_named(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("FOTISMOS_WORKERS", "many")
    code, _, message = command_line("compare", "fig-8-9")
    assert (code, "FOTISMOS_WORKERS: 'many' is not" in message) == (2, True)
