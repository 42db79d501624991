"""What the package states of itself, and what works with another Mitsuba."""

import re
import tomllib
from importlib import metadata

import pytest

from fotismos.comparisons.records.check import Change, CheckRecord
from fotismos.heuristic import llvm
from fotismos.heuristic.errors import InstallationError
from fotismos.heuristic.program import __version__
from fotismos.reports.ci import summary
from fotismos.reports.run import doctor
from tests.shared.programs import ROOT, command_line

PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


@pytest.fixture
def installed(monkeypatch):
    """A function that makes Mitsuba be of another version, as far as its metadata say."""
    real = metadata.version

    def of(version):
        known = {"mitsuba": version}
        monkeypatch.setattr(metadata, "version", lambda name: known.get(name) or real(name))

    return of


def test_the_citation_has_the_version_and_its_date():
    text = (ROOT / "CITATION.cff").read_text()
    stated = dict(re.findall(r"(?m)^(version|date-released): (.*)$", text))
    dates = re.findall(r"(?m)^## (\S+) - (\S+)$", (ROOT / "CHANGELOG.md").read_text())
    assert stated["version"] == __version__
    assert stated["date-released"] == dict(dates)[__version__]


def test_the_package_requires_the_range_that_is_checked():
    assert llvm.MITSUBA_REQUIREMENT in PROJECT["dependencies"]
    pin = f"mitsuba=={llvm.MITSUBA_VERSION} "
    for name in ("requirements.txt", "requirements-test.txt"):
        assert pin in (ROOT / name).read_text()


@pytest.mark.parametrize("version", ["3.9.1", "3.9.2", "3.9.10", "3.9.1.post1"])
def test_a_later_patch_of_mitsuba_is_allowed(version, installed):
    installed(version)
    llvm.require_mitsuba()
    assert bool(llvm.other_version()) == (version != "3.9.1")
    (line,) = (line for line in doctor.version_lines() if line.startswith("mitsuba"))
    assert line.split() == ["mitsuba", version]
    said = " ".join(doctor.version_lines())
    assert ("may find that old baselines moved" in said) == (version != "3.9.1")


@pytest.mark.parametrize("version", ["3.9.0", "3.8.7", "3.10.0", "4.0.0", "unknown"])
def test_another_mitsuba_is_refused_with_what_to_install(version, installed):
    installed(version)
    message = rf"Mitsuba {version} is installed.*needs 3\.9\.1 or a later 3\.9.*mitsuba~=3\.9\.1"
    with pytest.raises(InstallationError, match=message):
        llvm.require_mitsuba()
    code, _, said = command_line("doctor")
    assert (code, "Traceback" in said) == (2, False)
    assert re.search(message, said)


def test_a_check_says_once_that_mitsuba_is_another():
    change = Change(before="3.9.1", after="3.9.2")
    made = [
        CheckRecord(baseline=name, scene=name, status="passed", seconds=1, versions=versions)
        for name, versions in (("a", {"mitsuba": change}), ("b", {"mitsuba": change}), ("c", None))
    ]
    said = "\n".join(summary.lines(made, 0.01))
    assert said.count("Mitsuba 3.9.2 renders here, and 3.9.1 made the baselines") == 1
    assert "renders here" not in "\n".join(summary.lines(made[2:], 0.01))
