"""Pages of audits, fits and studies in a browser: accessible, offline, and whole on a phone."""

import numpy as np
import pytest

from fotismos.comparisons.audit.checks import audit
from fotismos.comparisons.fit.fit import fit
from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.options import Options
from fotismos.comparisons.study import design, running
from fotismos.reports.page import page
from fotismos.reports.page.page import Failure
from fotismos.reports.run import audit_files, fit_files
from fotismos.reports.run import study as work
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
    file.write_text(audit_files.render(audit("bsdf", "roughconductor", {}), pictures=sphere))
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


@pytest.mark.parametrize(("age_s", "reloads"), [(1, True), (30, False), (3600, False)])
def test_a_page_that_grows_reloads_ever_less_often_and_then_no_more(
    chromium, tmp_path, monkeypatch, age_s, reloads
):
    """As when its command was killed: the page is not written again."""
    now = page.time()
    monkeypatch.setattr(page, "time", lambda: now - age_s)
    file = tmp_path / "index.html"
    failures = [Failure(scene="lost", error="there is no such file")]
    file.write_text(page.render([], failures=failures, state="In progress.", reloads=True))
    seen = chromium.new_page()
    seen.goto(file.as_uri())
    seen.evaluate("() => { window.isFirst = true; }")
    seen.wait_for_timeout(2500)
    assert seen.evaluate("() => !window.isFirst") == reloads
    is_over = "no longer written" in seen.text_content("#state")
    seen.close()
    assert is_over == (age_s > 600)
