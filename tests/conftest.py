"""What all tests share. `fotismos` comes first: it finds LLVM before Dr.Jit is imported."""

import gc
import shutil
from importlib.metadata import entry_points
from pathlib import Path
from types import SimpleNamespace

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr
import mitsuba as mi
import pytest

from fotismos.comparisons.departure import arrays
from fotismos.comparisons.processes.pool import Pool
from fotismos.heuristic import plugins
from fotismos.reference.rendering import direct
from fotismos.reports import jobs
from fotismos.reports.cli import cli
from tests.shared import small_baselines
from tests.shared.programs import command_line
from tests.shared.small_scene import SCENE

# An installed fotismos brings its pytest plugin along; from a checkout it is named here.
if "fotismos" not in entry_points(group="pytest11").names:
    pytest_plugins = ["fotismos.reports.ci.plugin"]


@pytest.fixture
def variant(request):
    """The Mitsuba variant that the test asks for by indirect parameter, RGB where it does not."""
    yield from in_variant(getattr(request, "param", "llvm_ad_rgb"))


@pytest.fixture
def rgb():
    """The variant llvm_ad_rgb, with the project's plugins."""
    yield from in_variant("llvm_ad_rgb")


@pytest.fixture
def spectral():
    """The variant llvm_ad_spectral, with the project's plugins."""
    yield from in_variant("llvm_ad_spectral")


@pytest.fixture(params=["Dr.Jit", "NumPy"])
def computed_by(request, monkeypatch):
    """Compute formulas of colours by Dr.Jit, and by NumPy, as where no scene is loaded."""
    monkeypatch.setattr(arrays, "is_compiled", lambda: request.param == "Dr.Jit")
    return request.param


WHY = next(option for option in cli.get_command(None, "compare").params if option.name == "why")
"""Whether `compare` finds causes, which takes nine tenths of a small run."""

# In tests, commands render in this process, which has loaded all that they need, without causes.
jobs.Pool = lambda count, *others: Pool(0, *others)
BY_DEFAULT, WHY.default = WHY.default, False


@pytest.fixture
def causes(monkeypatch):
    """Let `compare` find causes by default, as it does for its users."""
    monkeypatch.setattr(WHY, "default", BY_DEFAULT)


@pytest.fixture
def apart(monkeypatch):
    """Let commands render in a process apart, as they do for their users."""
    monkeypatch.setattr(jobs, "Pool", Pool)


@pytest.fixture(autouse=True, scope="module")
def frozen():
    """Let collections skip what outlives a file of tests: modules, and half a million objects."""
    gc.collect()
    gc.freeze()


@pytest.fixture
def run():
    """Run the command line, all in this process; returns exit code, output and messages."""
    return command_line


@pytest.fixture(scope="session")
def two_scenes(tmp_path_factory):
    """What a comparison of two small scenes wrote, one of them without noise, and printed."""
    folder = tmp_path_factory.mktemp("two")
    names = ["--resolution", "24x16", "--spp", 16, "--max-visible", "10%"]
    files = ["-o", folder / "out", "--junit", folder / "j.xml", "--summary", folder / "s.md"]
    code, printed, _ = command_line("compare", "lambert-sphere", "fig-8-9", *names, *files)
    return SimpleNamespace(folder=folder, out=folder / "out", code=code, printed=printed)


@pytest.fixture
def scene_file(tmp_path):
    """The small scene, in a file whose name has a space."""
    path = tmp_path / "my scene.xml"
    path.write_text(SCENE, encoding="utf-8")
    return path


@pytest.fixture
def written(tmp_path, monkeypatch):
    """A function that writes a file of a user's, beside which commands are given."""
    monkeypatch.chdir(tmp_path)

    def write(text, name="mine.py"):
        (tmp_path / name).write_text(text, encoding="utf-8")
        return name

    return write


@pytest.fixture(autouse=True)
def no_service(monkeypatch):
    """No CI service: the tests may themselves run in one."""
    monkeypatch.delenv("GITHUB_STEP_SUMMARY", raising=False)


@pytest.fixture(scope="session")
def made_baselines(tmp_path_factory):
    """The two small baselines, in a folder that stays as it is."""
    folder = tmp_path_factory.mktemp("made") / "baselines"
    small_baselines.make(folder)
    return folder


@pytest.fixture
def baselines_folder(made_baselines, tmp_path):
    """A copy of the two small baselines."""
    return Path(shutil.copytree(made_baselines, tmp_path / "baselines"))


@pytest.fixture
def kernel_history():
    """A function that runs another and returns the kernels that it launched, oldest first."""

    def kernels_of(run):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            dr.eval(run())
            dr.sync_thread()
            return dr.kernel_history([dr.KernelType.JIT])

    yield kernels_of
    _clean_up()


def in_variant(name):
    """Yield in a variant with the project's plugins, for fixtures of any scope."""
    mi.set_variant(name)
    plugins.register()
    direct.register()
    yield name
    _clean_up()


def _clean_up():
    dr.sync_thread()
    dr.set_flag(dr.JitFlag.KernelHistory, False)
    dr.kernel_history_clear()
    gc.collect()
    dr.flush_malloc_cache()
