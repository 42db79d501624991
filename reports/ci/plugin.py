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
Without a usable LLVM the tests are skipped, with the reason. Mitsuba is not imported before a test
requests the fixture.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import pytest

from fotismos.heuristic import llvm
from fotismos.heuristic.errors import InstallationError

if TYPE_CHECKING:
    from fotismos.reports.ci.testing import Fotismos  # loaded late: see below

MARK = "fotismos_variant"


def pytest_addoption(parser: pytest.Parser) -> None:
    """Add the option that writes baselines."""
    parser.getgroup("fotismos").addoption(
        "--fotismos-update",
        action="store_true",
        help="write the baselines of `unchanged` and `picture` that are missing or moved",
    )


def pytest_configure(config: pytest.Config) -> None:
    """Make the mark known."""
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
            folder=request.path.parent / "baselines",
            pictures=lambda: request.getfixturevalue("tmp_path"),
            variant=variant,
            update=request.config.getoption("--fotismos-update"),
        )


def pytest_assertrepr_compare(op: str, left: object, right: object) -> list[str] | None:
    """Explain a departure for which an assertion failed."""
    for side in (left, right):
        # On the type, since a mock has an attribute of any name.
        explain = getattr(type(side), "fotismos_explanation", None)
        if explain is not None:
            return [f"{left} {op} {right}", *explain(side)]
    return None
