"""The page of a study in a browser: accessible, and whole on a phone, its pictures, too."""

from fotismos.comparisons.study import design, running
from fotismos.reports.work import study as work
from tests.browser.conftest import violations

TEXT = """title = "Gloss"
[[part]]
scene = "sphere"
spp = 16
resolution = [12, 12]
[part.parameters]
alpha = [0.1, 0.4]
light_angle = [0, 60]
"""


def test_axe_finds_no_violation_and_pictures_and_charts_are_whole_on_a_phone(
    rgb, chromium, tmp_path
):
    study = design.parse(TEXT, "gloss")
    (tmp_path / work.FIGURES).mkdir()
    table, _ = running.run(study, tmp_path)
    *_, page = work.write(study, table, running.all_points(study), tmp_path)
    for scheme in ("light", "dark"):
        tab = chromium.new_page(viewport={"width": 390, "height": 844}, color_scheme=scheme)
        tab.goto(page.as_uri())
        assert not violations(tab)
        (sheet,) = tab.get_by_alt_text("Contact sheet").all()
        assert sheet.evaluate("e => e.complete && e.naturalWidth > 200")
        shown = tab.locator(".scroll, .chart svg, .sheet").evaluate_all(
            "all => all.map((e) => e.getBoundingClientRect().right - innerWidth)"
        )
        assert (len(shown), max(shown) <= 0) == (5, True), shown
        tab.close()
