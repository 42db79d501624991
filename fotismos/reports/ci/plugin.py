"""The pytest plugin: departures and baselines of scenes in your tests.

::

    def test_textbook_shading_is_close(fotismos):
        assert fotismos.departure("scenes/lamp.xml") <= 5.0

    def test_nothing_moved(fotismos):
        assert fotismos.unchanged("scenes/lamp.xml")

    def test_my_renderer(fotismos):
        image = render()  # linear RGB, (H, W, 3)
        assert fotismos.picture("hall", image)
        assert fotismos.same(image, "references/hall.exr", within=2)

A mark renders a test in other variants, one test for each::

    @pytest.mark.fotismos_variant("llvm_ad_rgb", "llvm_ad_spectral")

Baselines are in ``baselines/`` next to the test's file; ``pytest --fotismos-update`` writes them.
A failure names what it leaves in the test's ``tmp_path``. The ini file of pytest may choose other
folders, relative to its root, and the chance of a failure though nothing changed::

    [pytest]
    fotismos_baselines = references
    fotismos_report = out/tests
    fotismos_significance = 0.001

Without a usable LLVM the tests are skipped, with the reason. Mitsuba is not imported before a test
requests the fixture.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from fotismos.heuristic import llvm
from fotismos.heuristic.errors import InstallationError

if TYPE_CHECKING:
    from fotismos.reports.ci.testing import Fotismos  # loaded late: see below

MARK = "fotismos_variant"

INI = {
    "fotismos_baselines": ("", "folder of the baselines, if not baselines beside a test's file"),
    "fotismos_report": ("", "folder of what failures leave, if not the test's tmp_path"),
    "fotismos_significance": ("0.01", "chance of a failure though nothing changed"),
}
"""Options of the ini file: defaults, and what they are."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes baselines, and those of the ini file."""
    parser.getgroup("fotismos").addoption(
        "--fotismos-update",
        action="store_true",
        help="write the baselines of `unchanged` and `picture` that are missing or moved",
    )
    for name, (default, description) in INI.items():
        parser.addini(name, description, default=default)


def pytest_configure(config: pytest.Config) -> None:
    """Make the mark known, and refuse a significance that is not allowed."""
    _significance(config)
    config.addinivalue_line(
        "markers", f"{MARK}(*names): render in these Mitsuba variants, one test for each"
    )


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Make one test for each variant of the mark."""
    mark = metafunc.definition.get_closest_marker(MARK)
    if mark is not None and "fotismos" in metafunc.fixturenames:
        metafunc.parametrize("fotismos", mark.args, indirect=True)


@pytest.fixture
def fotismos(request: pytest.FixtureRequest) -> Iterator[Fotismos]:
    """Departures and baselines of scenes: see :class:`fotismos.reports.ci.testing.Fotismos`."""
    try:
        llvm.check()
    except InstallationError as error:
        pytest.skip(f"fotismos cannot render here. {error}")
    # Loaded late: it needs LLVM, and most suites use nothing of it.
    from fotismos.reports.ci import testing

    variant = getattr(request, "param", None)
    with testing.rendering_in(variant):
        yield testing.Fotismos(
            folder=_folder(request, "fotismos_baselines") or request.path.parent / "baselines",
            beside=request.path.parent,
            pictures=lambda: _report(request),
            significance=_significance(request.config),
            variant=variant,
            update=request.config.getoption("--fotismos-update"),
        )


def _folder(request: pytest.FixtureRequest, name: str) -> Path | None:
    """Return a folder that the ini file names, relative to the root of the tests."""
    word = request.config.getini(name)
    return request.config.rootpath / word if word else None


def _report(request: pytest.FixtureRequest) -> Path:
    """Return the folder for what a failure of this test leaves."""
    report = _folder(request, "fotismos_report")
    if report is None:
        own: Path = request.getfixturevalue("tmp_path")
        return own
    return report / re.sub(r"[^\w.-]+", "-", request.node.nodeid)


def _significance(config: pytest.Config) -> float:
    """Return the significance of the ini file."""
    word = config.getini("fotismos_significance")
    try:
        value = float(word)
    except ValueError:
        value = 0.0
    if not 0 < value < 1:
        raise pytest.UsageError(
            f"fotismos_significance = {word} is not allowed: give a number between 0 and 1, such"
            " as 0.01."
        )
    return value


def pytest_assertrepr_compare(op: str, left: object, right: object) -> list[str] | None:
    """Explain a departure for which an assertion failed."""
    for side in (left, right):
        # On the type, since a mock has an attribute of any name.
        explain = getattr(type(side), "fotismos_explanation", None)
        if explain is not None:
            return [f"{left} {op} {right}", *explain(side)]
    return None
