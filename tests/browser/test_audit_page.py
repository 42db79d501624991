"""The page of an audit in a browser: accessible, narrow enough, and usable by keyboard."""

from pathlib import Path

import mitsuba as mi
import pytest

from comparisons.audit.checks import audit
from heuristic import plugins
from reports.run import audit_files
from tests.browser.conftest import Visitor
from tests.browser.test_page_at_large import violations

SCREENS = [
    {"viewport": {"width": width, "height": 844}, "color_scheme": scheme}
    for width in (390, 1280)
    for scheme in ("light", "dark")
]


@pytest.fixture(scope="module")
def page_file(tmp_path_factory):
    mi.set_variant("llvm_ad_rgb")
    plugins.register()
    path = Path(tmp_path_factory.mktemp("audit")) / "index.html"
    path.write_text(audit_files.render(audit("bsdf", "roughconductor", {})))
    return path


@pytest.fixture
def opened(chromium, page_file, request):
    context = chromium.new_context(**request.param)
    visitor = Visitor(context.new_page(), None)
    visitor.page.goto(page_file.as_uri())
    yield visitor.page
    context.close()
    assert visitor.complaints == []
    assert visitor.requests == [page_file.as_uri()]


@pytest.mark.parametrize("opened", SCREENS, indirect=True)
def test_axe_finds_no_violation_and_nothing_is_cut_off(opened):
    assert not violations(opened)
    assert opened.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0
    for picture in opened.locator("figure svg").all():
        assert picture.bounding_box()["width"] > 200
