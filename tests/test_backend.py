"""LLVM is found and checked before anything compiles, and the set-up files are sound.

Dr.Jit looks for LLVM once a process, so whatever depends on that runs in a process of its own.
"""

import importlib.metadata
import os
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from heuristic import backend
from heuristic.errors import InstallationError
from tests.programs import ROOT, python

REQUIREMENTS = ["requirements.txt", "requirements-test.txt"]

# Prints what `check` says, after a line that may stand in for a machine other than this one.
PROBE = """
import heuristic.backend as backend
from heuristic.errors import InstallationError
{prelude}
try:
    info = backend.check()
except InstallationError as error:
    print("InstallationError", error)
else:
    print(info.source, info.version, info.path)
"""


def run_probe(llvm=None, prelude=""):
    """Run PROBE in a process with DRJIT_LIBLLVM_PATH set to `llvm`, or not at all."""
    environment = {k: v for k, v in os.environ.items() if k != backend.VARIABLE}
    environment["PYTHONPATH"] = str(ROOT)
    if llvm is not None:
        environment[backend.VARIABLE] = str(llvm)
    code = PROBE.format(prelude=prelude)
    done = subprocess.run(
        [sys.executable, "-c", code], env=environment, capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def pretend_version(version):
    return f"import drjit; drjit.detail.llvm_version = lambda: {version}"


def real_llvm_15():
    places = ["/usr/lib/*/libLLVM-15.so*", "/usr/lib/llvm-15/lib/libLLVM*.so*"]
    found = [p for place in places for p in Path("/").glob(place.lstrip("/"))]
    return min(found, default=None)


def any_llvm():
    """A library that Dr.Jit can load here: the one that it uses in this process."""
    return backend.check().path


def test_llvm_15_is_named_and_nothing_aborts():
    library = real_llvm_15()
    if library is None:  # the machine has none: a library that works, which claims to be 15
        library, prelude = any_llvm(), pretend_version((15, 0, 7))
    else:
        prelude = ""
    said = run_probe(llvm=library, prelude=prelude)
    assert said.startswith("InstallationError")
    assert "LLVM 15.0" in said
    assert str(library) in said
    assert "LLVM 17 or newer" in said


@pytest.mark.parametrize("version", [(15, 0, 7), (16, 0, 6)])
def test_versions_that_abort_are_refused(monkeypatch, version):
    monkeypatch.setattr("drjit.detail.llvm_version", lambda: version)
    with pytest.raises(InstallationError, match=f"LLVM {version[0]}"):
        backend.check()


@pytest.mark.parametrize("version", [(17, 0, 6), (19, 1, 7), (22, 1, 8), (23, 1, 4)])
def test_versions_that_work_are_accepted(monkeypatch, version):
    monkeypatch.setattr("drjit.detail.llvm_version", lambda: version)
    assert backend.check().version == version


def test_no_llvm_at_all(monkeypatch):
    monkeypatch.delenv(backend.VARIABLE, raising=False)
    monkeypatch.setattr("drjit.detail.llvm_version", lambda: (-1, -1, -1))
    monkeypatch.setattr(backend, "_USUAL_PLACES", ())
    with pytest.raises(InstallationError) as caught:
        backend.check()
    message = str(caught.value)
    assert "Found: none." in message
    for way in ("karellen-llvm-core", "libllvm19", "brew install llvm", backend.VARIABLE):
        assert way in message
    assert caught.value.exit_code == 2


def test_a_path_that_does_not_exist(tmp_path):
    missing = tmp_path / "libLLVM.so"
    said = run_probe(llvm=missing)
    assert said.startswith("InstallationError")
    assert f"{backend.VARIABLE}={missing}, which is not a file" in said
    assert f"unset {backend.VARIABLE}" in said


def test_a_file_that_is_no_library(tmp_path):
    text = tmp_path / "libLLVM.so"
    text.write_text("not a library")
    said = run_probe(llvm=text)
    assert f"{text}, which is not an LLVM library" in said


def test_a_missing_system_library_is_named_by_every_command():
    without = "import sys; from heuristic import backend; backend.ATOMIC = 'libabsent.so.1'"
    for command in ("doctor", "compare fig-8-9"):
        run = f"sys.argv = 'fotismos {command}'.split(); from reports.__main__ import main; main()"
        done = python("-c", f"{without}; {run}")
        assert done.returncode == 2
        assert done.stderr.startswith("fotismos: error: Dr.Jit cannot be imported: libabsent.so.1")
        assert "apt-get install libatomic1" in done.stderr


def test_the_users_choice_is_left_alone():
    library = any_llvm()
    # The same file by another path, since not every machine has two that work.
    chosen = f"{library.parent}/../{library.parent.name}/{library.name}"
    source, *_, path = run_probe(llvm=chosen).split()
    assert source == "DRJIT_LIBLLVM_PATH"
    assert path == chosen


def test_the_wheel_is_used_where_it_is_installed():
    said = run_probe()
    try:
        importlib.metadata.version(backend.WHEEL)
    except importlib.metadata.PackageNotFoundError:
        assert said.startswith("system")
    else:
        assert said.startswith("wheel")
        assert said.strip().endswith(str(backend.find_wheel()))


@pytest.mark.parametrize("path", sorted((ROOT / "docs/shaders").glob("*.py")), ids=lambda p: p.stem)
def test_a_shader_of_the_documentation_imports_heuristic_before_drjit(path):
    imported = re.findall(r"^(?:import|from) (heuristic|drjit)\b", path.read_text("utf-8"), re.M)
    assert imported[0] == "heuristic"


@pytest.mark.parametrize("version", [(15, 0, 7), (19, 1, 7)])
def test_drjit_imported_first_is_told(monkeypatch, tmp_path, version):
    packages = install_fake_wheel(tmp_path, ["libLLVM.so"])
    (tmp_path / "lib" / "libLLVM.so").touch()
    monkeypatch.syspath_prepend(packages)
    monkeypatch.delenv(backend.VARIABLE, raising=False)
    monkeypatch.setattr("drjit.detail.llvm_version", lambda: version)
    monkeypatch.setattr(backend, "_imported_too_early", False)
    if version[0] < backend.OLDEST_USABLE:
        with pytest.warns(RuntimeWarning, match="imported before fotismos"):
            backend.configure()
        with pytest.raises(InstallationError, match="imported before fotismos"):
            backend.check()
    else:
        backend.configure()
        assert "imported before fotismos" in backend.check().note
    assert backend.VARIABLE not in os.environ


def install_fake_wheel(prefix, names):
    """Lay the files down as pip does: libraries in lib/, their list in the dist-info folder."""
    packages = prefix / "lib" / "python3" / "site-packages"
    information = packages / "karellen_llvm_core-22.1.8.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text("Name: karellen-llvm-core\nVersion: 22.1.8\n")
    (information / "RECORD").write_text("".join(f"../../{name},,\n" for name in names))
    return packages


@pytest.mark.parametrize(
    ("listed", "present", "expected"),
    [
        (["libLLVM.so", "libLLVM.so.22.1"], ["libLLVM.so", "libLLVM.so.22.1"], "libLLVM.so"),
        (["libLLVM.so.22.1", "libLTO.so"], ["libLLVM.so.22.1", "libLTO.so"], "libLLVM.so.22.1"),
        (["libLLVM.so", "libLLVM.so.22.1"], ["libLLVM.so.22.1"], "libLLVM.so.22.1"),
        (["libLLVM.so"], [], None),
    ],
    ids=["with link", "without link", "broken link", "removed"],
)
def test_the_library_in_a_wheel(monkeypatch, tmp_path, listed, present, expected):
    packages = install_fake_wheel(tmp_path, listed)
    for name in present:
        (tmp_path / "lib" / name).touch()
    monkeypatch.syspath_prepend(packages)
    found = backend.find_wheel()
    assert found == (expected and tmp_path.resolve() / "lib" / expected)


IMAGES = """
import os, sys
os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
import heuristic
import mitsuba as mi
from reference.scene.graph import set_variant

set_variant("llvm_ad_rgb")
mi.Bitmap(mi.TensorXf([0.5] * 64 * 64 * 3, (64, 64, 3))).write(sys.argv[1])
print(mi.Bitmap(sys.argv[1]).size())
"""


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="no way to have a single core")
def test_images_are_written_and_read_on_a_machine_of_one_core(tmp_path):
    done = python("-c", IMAGES, tmp_path / "image.exr")
    assert "64, 64" in done.stdout, done.stderr


def pins(name):
    """Name, version and marker of every package of a requirements file."""
    lines = (ROOT / name).read_text().splitlines()
    return {line.rstrip(" \\") for line in lines if re.match(r"[A-Za-z0-9]", line)}


@pytest.mark.parametrize("name", REQUIREMENTS)
def test_requirements_are_pinned_by_hash_and_name_no_place(name):
    text = (ROOT / name).read_text()
    assert "://" not in text
    assert "--index" not in text
    assert "/" not in re.sub(r"^#.*$", "", text, flags=re.MULTILINE)
    for package in re.split(r"\n(?=[A-Za-z0-9])", text)[1:]:
        assert "==" in package.splitlines()[0]
        assert "--hash=sha256:" in package


def test_the_test_set_holds_the_runtime_set():
    """The `run` script counts the runtime set as installed once the test set is."""

    def names_and_versions(name):
        return {pin.split(" ;")[0] for pin in pins(name)}

    assert names_and_versions("requirements.txt") <= names_and_versions("requirements-test.txt")


def test_every_dependency_is_pinned():
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]

    def names(requirements):
        return {re.match(r"[\w-]+", r).group().lower() for r in requirements}

    runtime = {re.split("==", pin)[0] for pin in pins("requirements.txt")}
    test = {re.split("==", pin)[0] for pin in pins("requirements-test.txt")}
    extras = project["optional-dependencies"]
    assert names(project["dependencies"]) <= runtime
    # The test extra takes in the others by the project's own name.
    assert extras["test"][0] == f"fotismos[{','.join(name for name in extras if name != 'test')}]"
    wanted = set().union(*map(names, extras.values())) - {"fotismos"}
    assert wanted <= test


@pytest.mark.parametrize("script", ["run", ".ci/run"])
def test_scripts_are_executable_and_parse(script):
    assert os.access(ROOT / script, os.X_OK)
    subprocess.run(["bash", "-n", ROOT / script], check=True, timeout=60)


def test_run_names_a_python_that_it_cannot_use(tmp_path):
    for name in ("run", *REQUIREMENTS):
        shutil.copy(ROOT / name, tmp_path)
    environment = os.environ | {"PYTHON": "/no/such/python"}
    done = subprocess.run(
        [tmp_path / "run", "doctor"], env=environment, capture_output=True, text=True, timeout=60
    )
    assert done.returncode == 2
    assert "PYTHON=/no/such/python is not a CPython 3.11 or newer" in done.stderr
    assert not (tmp_path / ".venv").exists()
