"""Commands: options, help, table, completion and signatures come from one declaration."""

import inspect
from typing import Annotated, Literal

import click
import pytest
from click.testing import CliRunner
from msgspec import Meta

import fotismos
from fotismos.comparisons.options import Options, option
from fotismos.heuristic.errors import InputError
from fotismos.reports import notebook
from fotismos.reports.cli import cli
from fotismos.reports.command import OnScene, click_command
from fotismos.reports.commands.check import Baseline
from fotismos.reports.commands.compare import Compare
from fotismos.reports.commands.cost import Cost
from fotismos.reports.commands.fit import Fit
from fotismos.reports.jobs import Terminal

asked = []


class Trial(OnScene, frozen=True):
    """Try a declaration.

    Examples
    --------
      fotismos trial fig-8-9 --gain 2
    """

    argument = "SCENE"
    options_shown = ("gain", "way", "spp", "output", "timeout")
    below = "trial"
    table = {"gain": "gain", "report": "output"}  # noqa: RUF012 as commands declare it

    gain: Annotated[float, Meta(gt=0, lt=10), option("How much.", metavar="G")] = 1.5
    way: Annotated[Literal["up", "down"] | None, option("Which way.", default="neither")] = None

    def run(self, terminal):
        asked.append((self, terminal))
        return 3


@pytest.fixture
def trial(tmp_path, monkeypatch):
    """A function that runs the trial on the command line, which may have a table."""
    monkeypatch.chdir(tmp_path)
    command = click_command(Trial, "trial")

    def run(*words, table=""):
        (tmp_path / "pyproject.toml").write_text(f"[tool.fotismos]\n{table}\n")
        return CliRunner().invoke(command, words)

    return run


def test_a_declaration_makes_options_with_their_help_and_bounds(trial):
    shown = trial("--help-all").output
    for words in (
        "--gain G", "How much.  [default: 1.5; 0<x<10]", "--way [down|up]",
        "Which way. [default: neither]", "OUTPUT/trial", "Examples:\n", "--spp N",
    ):  # fmt: skip
        assert words in shown
    refused = trial("fig-8-9", "--gain", "10")
    assert (refused.exit_code, "not in the range" in refused.output) == (2, True)
    done = trial("fig-8-9", "--gain", "2", "--spp", "8", "-o", "there")
    command, terminal = asked.pop()
    assert done.exit_code == 3
    assert command == Trial(scene="fig-8-9", gain=2.0, spp=8)
    assert command.options == Options(spp=8)
    assert (str(terminal.output), terminal.timeout) == ("there", 1800)
    assert terminal.stated == {"scene", "gain", "spp", "output"}


def test_a_declaration_makes_the_keys_of_the_table(trial):
    assert trial("fig-8-9", table="gain = 4\nreport = 'kept'").exit_code == 3
    command, terminal = asked.pop()
    assert (command.gain, terminal.output.name) == (4.0, "kept")
    error = trial("fig-8-9", table="gian = 4").exception
    assert isinstance(error, InputError)
    assert "key 'gian' is not known (did you mean gain?)" in str(error)


def test_a_declaration_makes_the_signature_of_its_function():
    """It refuses what the options refuse, before anything is read."""
    function = notebook._asked_as(Trial)(lambda asked: asked)
    assert inspect.signature(function).parameters == inspect.signature(Trial).parameters
    assert function("fig-8-9", "name", 2, spp=4).gain == 2.0
    with pytest.raises(InputError, match=r"gain = 10 is not allowed: give .* and below 10"):
        function(gain=10)
    with pytest.raises(InputError, match="option 'gian' is not known"):
        function(gian=1)
    with pytest.raises(TypeError, match="too many positional"):
        function(1, 2, 3, None, 5)


@pytest.mark.parametrize(
    ("function", "declaration"),
    [
        (fotismos.compare, Compare),
        (fotismos.plan, OnScene),
        (fotismos.cost, Cost),
        (fotismos.fit, Fit),
        (fotismos.check, Baseline),
    ],
)
def test_functions_and_commands_have_the_fields_of_one_declaration(function, declaration):
    parameters = inspect.signature(function).parameters
    assert list(parameters) == list(inspect.signature(declaration).parameters)
    if declaration is not Baseline:
        assert set(Options.__struct_fields__) < set(parameters)


@pytest.mark.parametrize("name", sorted(cli.list_commands(None)))
def test_each_option_of_a_command_is_a_field(name):
    command = cli.get_command(None, name)
    known = {*command.declared.__struct_fields__, *Terminal.__struct_fields__}
    known |= {*Options.__struct_fields__, "quiet", "verbose"}
    assert {parameter.name for parameter in command.params} <= known
    assert set(command.declared.table.values()) <= known
    assert all(p.help for p in command.params if isinstance(p, click.Option))
