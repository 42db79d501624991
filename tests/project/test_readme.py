"""README's commands: each runs in a fresh clone, with the files that a user would bring."""

import re
import shlex
import shutil
from glob import glob

import click
import numpy as np
import OpenEXR
import pytest

from fotismos.reports import cli, jobs
from tests.shared.programs import ROOT, command_line
from tests.shared.small_scene import SCENE

README = (ROOT / "README.md").read_text(encoding="utf-8")

SMALL = {"resolution": "32x18", "spp": "4", "rounds": "2", "timeout": "300"}
"""Options that make a command small, where it has them and README does not give them."""

SCRIPT = {"test", "lint", "bench", "docs"}
"""Commands of the script `run` itself."""


def commands():
    """Return the words of README's commands after `./run`, in order, without repetition."""
    blocks = re.findall(r"^\./run (.*?)(?:\s+#.*)?$", README, re.MULTILINE)
    inline = [" ".join(text.split()) for text in re.findall(r"`\./run ([^`]*)`", README)]
    return list(dict.fromkeys([*blocks, *inline]))


@pytest.fixture(scope="module")
def clone(tmp_path_factory):
    """A folder with what a clone holds and README's commands name, and a user's files."""
    folder = tmp_path_factory.mktemp("clone")
    for name in ("docs", "studies"):
        (folder / name).symlink_to(ROOT / name)
    # One of many: tests/test_baselines.py checks all.
    (folder / "tests/baselines").mkdir(parents=True)
    shutil.copy(ROOT / "tests/baselines/fig-8-9-llvm_ad_rgb.exr", folder / "tests/baselines")
    shutil.copy(ROOT / "run", folder)
    sensor = re.search(r"<sensor.*?</sensor>", SCENE, re.DOTALL)[0]
    rough = SCENE.replace('name="alpha" value="0.2"', 'name="alpha" value="$roughness"')
    (folder / "my_scene.xml").write_text(SCENE)
    (folder / "kitchen.xml").write_text(rough.replace(sensor, sensor + sensor))
    (folder / "my_scenes").mkdir()
    (folder / "my_scenes/a.xml").write_text(SCENE)
    (folder / "my_shader.py").write_text("def shade(point): return point.material.k_d * 0.5\n")
    (folder / "FILE.toml").write_text("[[part]]\nscene = 'lobe'\n[part.parameters]\nalpha = 0.1\n")
    channels = {name: np.full((18, 32), 0.3, np.float32) for name in "RGB"}
    with OpenEXR.File({"type": OpenEXR.scanlineimage}, channels) as picture:
        for name in ("theirs", "mine"):
            picture.write(str(folder / f"{name}.exr"))
    return folder


def small(words):
    """Return a command's words, with sizes that make it small."""
    if "--reference" in words:  # two pictures have the size that they have
        return words
    command = cli.cli.get_command(click.Context(cli.cli), words[0])
    is_check = words[0] == "check" and "--update" not in words  # it has its baselines' sizes
    has = {} if is_check else {option.name for option in command.params}
    more = ((f"--{name}", value) for name, value in SMALL.items() if name in has)
    return [*words, *(word for pair in more if pair[0] not in words for word in pair)]


RUN = [command for command in commands() if command.split()[0] not in SCRIPT]


def test_readme_names_many_commands():
    assert len(RUN) > 15


@pytest.mark.thorough
@pytest.mark.guarantee("runs", "Every command of README runs in a fresh clone.")
@pytest.mark.parametrize("command", RUN)  # in order: a check needs the baselines of an update
def test_every_command_of_the_readme_runs(clone, monkeypatch, command):
    monkeypatch.chdir(clone)
    monkeypatch.setattr(jobs, "open_page", lambda page: None)
    words = [name for word in shlex.split(command) for name in (sorted(glob(word)) or [word])]
    code, printed, messages = command_line(*small(words))
    is_gate = "--max-visible" in words or "--within" in words
    assert code == 0 or (is_gate and code == 1), messages
    assert "Traceback" not in printed + messages


def test_the_readme_names_the_commands_that_run_the_report_and_the_tests():
    first = re.search(r"```\n(.*?)```", README, re.DOTALL)[1]
    assert [line.split()[1] for line in first.splitlines()] == ["report", "test"]
    assert "test --all" in commands()
    assert '"./run test --all"' in (ROOT / ".ci/run").read_text()
