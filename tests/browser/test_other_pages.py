"""Pages of audits, fits and studies in a browser: accessible, offline, and whole on a phone."""

import numpy as np
import pytest

from fotismos.comparisons.audit.checks import audit
from fotismos.comparisons.fit.fit import fit
from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.options import Options
from fotismos.comparisons.study import design, running
from fotismos.reports.run import audit_files, fit_files
from fotismos.reports.work import study as work
from tests.browser.conftest import Visitor, violations

STUDY = """title = "Gloss"
[[part]]
scene = "sphere"
spp = 16
resolution = [12, 12]
[part.parameters]
alpha = [0.1, 0.4]
light_angle = [0, 60]
"""

PICTURES = "() => [...document.images].map((e) => e.complete && e.naturalWidth)"
BEYOND = "all => all.map((e) => e.getBoundingClientRect().right - innerWidth)"


def audited(folder):
    file = folder / "index.html"
    sphere = {"rough metal": np.full((8, 8, 3), 0.5)}
    file.write_text(audit_files.render(audit("bsdf", "roughconductor", {}), spheres=sphere))
    return file


def fitted(folder):
    file = folder / "index.html"
    options = Options(resolution=(16, 16), spp=4)
    found = fit(builtin("fig-8-9").source(), options, forms=["phong"])
    file.write_text(fit_files.page(found))
    return file


def studied(folder):
    study = design.parse(STUDY, "gloss")
    (folder / work.FIGURES).mkdir()
    table, _ = running.run(study, folder)
    *_, page = work.write(study, table, running.all_points(study), folder)
    return page


@pytest.mark.parametrize(
    ("make", "whole", "count"),
    [
        (audited, "figure svg", 1),
        (fitted, ".scroll table", 2),
        (studied, ".scroll, .chart svg, .sheet", 5),
    ],
)
def test_axe_finds_no_violation_and_nothing_is_cut_off(rgb, chromium, tmp_path, make, whole, count):
    file = make(tmp_path)
    for width, scheme in ((390, "dark"), (1280, "light")):
        screen = {"viewport": {"width": width, "height": 844}, "color_scheme": scheme}
        context = chromium.new_context(**screen)
        visitor = Visitor(context.new_page(), None)
        page = visitor.page
        page.goto(file.as_uri())
        assert not violations(page)
        assert page.evaluate("document.documentElement.scrollWidth - window.innerWidth") <= 0
        beyond = page.locator(whole).evaluate_all(BEYOND)
        assert len(beyond) >= count
        assert max(beyond) <= 0
        assert all(page.evaluate(PICTURES))
        context.close()
        assert visitor.complaints == []
