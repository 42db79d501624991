"""The page of an audit in a browser: accessible, narrow enough, and usable by keyboard."""

import numpy as np

from fotismos.comparisons.audit.checks import audit
from fotismos.reports.run import audit_files
from tests.browser.conftest import Visitor, violations


def test_axe_finds_no_violation_and_nothing_is_cut_off(rgb, chromium, tmp_path):
    file = tmp_path / "index.html"
    sphere = {"rough metal": np.full((8, 8, 3), 0.5)}
    file.write_text(audit_files.render(audit("bsdf", "roughconductor", {}), spheres=sphere))
    for width, scheme in ((390, "dark"), (1280, "light")):
        screen = {"viewport": {"width": width, "height": 844}, "color_scheme": scheme}
        context = chromium.new_context(**screen)
        visitor = Visitor(context.new_page(), None)
        page = visitor.page
        page.goto(file.as_uri())
        assert not violations(page)
        assert page.get_by_alt_text("Sphere: rough metal").bounding_box()["width"] > 100
        assert page.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0
        for picture in page.locator("figure svg").all():
            assert picture.bounding_box()["width"] > 200
        context.close()
        assert (visitor.complaints, visitor.requests) == ([], [file.as_uri()])
