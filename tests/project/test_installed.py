"""The wheel in an environment of its own, with all dependencies from the package registry."""

import os
import shutil
import subprocess
import sys

import pytest

from tests.shared.programs import ROOT
from tests.shared.small_scene import SCENE

pytestmark = pytest.mark.thorough


STUDY = """
title = "Roughness"
[[part]]
name = "lobe"
scene = "lobe"
[part.parameters]
alpha = [0.1, 0.2]
"""


@pytest.fixture(scope="module")
def installed(tmp_path_factory):
    """The folder of programs of an environment in which a wheel of this project is installed."""
    folder = tmp_path_factory.mktemp("installed")
    pip = (sys.executable, "-m", "pip", "-q", "--disable-pip-version-check")
    # Made of a copy: what a wheel leaves behind would be found as another plugin of pytest.
    source = folder / "source"
    shutil.copytree(
        ROOT, source, symlinks=True, ignore=shutil.ignore_patterns(".*", "node_modules", "out")
    )
    # Nor has a clone on Windows the links to the rooms.
    for room in ("heuristic", "reference", "comparisons", "reports"):
        (source / room).unlink()
    do(*pip, "wheel", "--no-deps", "-w", folder, source)
    (wheel,) = folder.glob("fotismos-*.whl")
    do(sys.executable, "-m", "venv", "--without-pip", folder / "env")
    programs = folder / "env/bin"
    # What nobody imports need not be compiled.
    do(*pip, "--python", programs / "python", "install", "--no-compile", wheel, "pytest")
    return programs


def do(*words, folder=None, code=0):
    """Run a program away from the checkout, and return all that it printed."""
    environment = {k: v for k, v in os.environ.items() if not k.startswith(("PYTHON", "FOTISMOS"))}
    done = subprocess.run(
        list(map(str, words)),
        cwd=folder or "/",
        env=environment,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        timeout=900,
        check=False,
    )
    assert done.returncode == code, done.stdout
    return done.stdout


def test_the_installed_commands_work(installed, tmp_path):
    fotismos = installed / "fotismos"
    assert "llvm_ad_spectral renders" in " ".join(do(fotismos, "doctor").split())
    (tmp_path / "ball.xml").write_text(SCENE)
    words = ("--resolution", "16x16", "--spp", 8)
    do(fotismos, "compare", "ball.xml", "fig-8-9", *words, folder=tmp_path)
    assert (tmp_path / "out/ball/comparison.exr").is_file()
    assert "viewer" in (tmp_path / "out/index.html").read_text()
    do(fotismos, "check", "base", "--update", "--scene", "ball.xml", *words, folder=tmp_path)
    assert "1 of 1 unmoved" in do(fotismos, "check", "base", folder=tmp_path)
    assert "did you mean fig-8-9?" in do(fotismos, "compare", "fig-8-99", code=2)
    # The wheel alone is without the extra.
    (tmp_path / "study.toml").write_text(STUDY)
    assert "pyarrow is not installed" in do(
        fotismos, "study", "study.toml", folder=tmp_path, code=2
    )
    program = "import fotismos; print(fotismos.plan('fig-8-9').integrator, fotismos.shade)"
    assert do(installed / "python", "-c", program).startswith("direct_all <function shade")
    assert "fotismos_variant" in do(installed / "python", "-m", "pytest", "--markers")


def test_a_project_may_have_names_of_its_own(installed, tmp_path):
    """Its folders and files are called like ours, and like colour-science's package."""
    files = {
        "reports/__init__.py": "OURS = True",
        "heuristic.py": "raise ImportError('a file of the project')",
        "tests/__init__.py": "",
        "tests/test_reports.py": "import fotismos, reports\ndef test_it(): assert reports.OURS",
        "colour.py": "RED = 1",
        "ball.xml": SCENE,
    }
    for name, text in files.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text)
    small = ("--resolution", "8x8", "--spp", 4)
    do(installed / "fotismos", "compare", "ball.xml", *small, folder=tmp_path)
    assert (tmp_path / "out/ball/comparison.exr").is_file()
    assert "1 passed" in do(installed / "python", "-m", "pytest", "-q", "tests", folder=tmp_path)
    program = "import fotismos, reports; fotismos.compare('fig-8-9', resolution=(8, 8), spp=4)"
    message = do(installed / "python", "-c", program, folder=tmp_path, code=1).splitlines()[-1]
    assert "colour.py hides colour-science" in message
