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

import pytest

from fotismos.heuristic import llvm
from fotismos.heuristic.errors import InstallationError
from tests.shared.programs import ROOT, python

REQUIREMENTS = ["requirements.txt", "requirements-test.txt"]

PROBE = """
from fotismos.heuristic import llvm
info = llvm.check()
print(info.source, info.version, info.path)
"""


def probe(library=None):
    """Run PROBE in a process with DRJIT_LIBLLVM_PATH set to a library, or not at all."""
    environment = {k: v for k, v in os.environ.items() if k != llvm.VARIABLE}
    environment["PYTHONPATH"] = str(ROOT)
    if library is not None:
        environment[llvm.VARIABLE] = str(library)
    words = [sys.executable, "-c", PROBE]
    done = subprocess.run(words, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_versions_that_abort_are_refused_and_others_accepted(monkeypatch):
    for version in ((15, 0, 7), (16, 0, 6), (17, 0, 6), (19, 1, 7), (22, 1, 8), (23, 1, 4)):
        monkeypatch.setattr("drjit.detail.llvm_version", lambda version=version: version)
        if version[0] > 16:
            assert llvm.check().version == version
        else:
            with pytest.raises(InstallationError, match=f"LLVM {version[0]}"):
                llvm.check()


def test_no_llvm_at_all(monkeypatch):
    monkeypatch.delenv(llvm.VARIABLE, raising=False)
    monkeypatch.setattr("drjit.detail.llvm_version", lambda: (-1, -1, -1))
    with pytest.raises(InstallationError) as caught:
        llvm.check()
    parts = "Found: none", "karellen-llvm-core", "libllvm19", "brew install llvm", llvm.VARIABLE
    for part in parts:
        assert part in str(caught.value)
    assert caught.value.exit_code == 2


def command(words, prelude):
    run = (
        f"sys.argv = 'fotismos {words}'.split(); from fotismos.reports.__main__ import main; main()"
    )
    done = python("-c", f"import os, sys; {prelude}; {run}")
    assert "Traceback" not in done.stderr
    return done


@pytest.mark.thorough
def test_every_command_names_a_path_that_is_no_library(tmp_path):
    missing, text = tmp_path / "libLLVM.so", tmp_path / "text.so"
    text.write_text("not a library")
    for words, library, what in (
        ("compare fig-8-9", missing, "which is not a file"),
        ("plan fig-8-9", missing, "which is not a file"),
        ("doctor", text, "which is not an LLVM library"),
    ):
        done = command(words, f"os.environ['{llvm.VARIABLE}'] = {str(library)!r}")
        assert done.returncode == 2
        assert f"{llvm.VARIABLE}={library}, {what}" in done.stderr
        assert f"unset {llvm.VARIABLE}" in done.stderr
    assert command("scenes", f"os.environ['{llvm.VARIABLE}'] = {str(missing)!r}").returncode == 0


@pytest.mark.thorough
def test_a_missing_system_library_is_named_by_every_command():
    for words in ("doctor", "compare fig-8-9"):
        done = command(words, "from fotismos.heuristic import llvm; llvm.ATOMIC = 'libabsent.so.1'")
        assert done.returncode == 2
        assert done.stderr.startswith("fotismos: error: Dr.Jit cannot be imported: libabsent.so.1")
        assert "apt-get install libatomic1" in done.stderr


def test_the_users_choice_comes_before_the_wheel():
    library = llvm.check().path
    # The same file by another path, since not every machine has two that work.
    chosen = f"{library.parent}/../{library.parent.name}/{library.name}"
    source, *_, path = probe(chosen).split()
    assert (source, path) == (llvm.VARIABLE, chosen)
    said = probe()
    try:
        importlib.metadata.version(llvm.WHEEL)
    except importlib.metadata.PackageNotFoundError:
        assert said.startswith("system")
    else:
        assert said.startswith("wheel")
        assert said.strip().endswith(str(llvm.find_wheel()))


def fake_wheel(prefix, listed, present):
    """Lay the files down as pip does: libraries in lib/, their list in the dist-info folder."""
    packages = prefix / "lib" / "python3" / "site-packages"
    information = packages / "karellen_llvm_core-22.1.8.dist-info"
    information.mkdir(parents=True)
    (information / "METADATA").write_text("Name: karellen-llvm-core\nVersion: 22.1.8\n")
    (information / "RECORD").write_text("".join(f"../../{name},,\n" for name in listed))
    for name in present:
        (prefix / "lib" / name).touch()
    return packages


def test_drjit_imported_first_is_named(monkeypatch, tmp_path):
    monkeypatch.syspath_prepend(fake_wheel(tmp_path, ["libLLVM.so"], ["libLLVM.so"]))
    monkeypatch.delenv(llvm.VARIABLE, raising=False)
    monkeypatch.setattr("drjit.detail.llvm_version", lambda: (15, 0, 7))
    with pytest.warns(RuntimeWarning, match="imported before fotismos"):
        llvm.configure()
    assert llvm.VARIABLE not in os.environ


def test_the_library_in_a_wheel(tmp_path):
    for number, (listed, present, expected) in enumerate(
        (
            (["libLLVM.so", "libLLVM.so.22.1"], ["libLLVM.so", "libLLVM.so.22.1"], "libLLVM.so"),
            (["libLLVM.so.22.1", "libLTO.so"], ["libLLVM.so.22.1", "libLTO.so"], "libLLVM.so.22.1"),
            (["libLLVM.so", "libLLVM.so.22.1"], ["libLLVM.so.22.1"], "libLLVM.so.22.1"),
            (["libLLVM.so"], [], None),
        )
    ):
        prefix = tmp_path / str(number)
        with pytest.MonkeyPatch.context() as patched:
            patched.syspath_prepend(fake_wheel(prefix, listed, present))
            expected = expected and prefix.resolve() / "lib" / expected
            assert llvm.find_wheel() == expected


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
