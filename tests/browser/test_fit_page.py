"""The page of a fit in a browser: accessible, and narrow enough for a phone."""

from fotismos.comparisons.fit.fit import fit
from fotismos.comparisons.gallery.builtin import builtin
from fotismos.comparisons.options import Options
from fotismos.reports.run import fit_files
from tests.browser.conftest import violations


def test_axe_finds_no_violation_and_tables_are_whole_on_a_phone(rgb, chromium, tmp_path):
    found = fit(builtin("fig-8-9").source(), Options(resolution=(16, 16), spp=4), forms=["phong"])
    file = tmp_path / "index.html"
    file.write_text(fit_files.page(found))
    tab = chromium.new_page(viewport={"width": 390, "height": 844})
    tab.goto(file.as_uri())
    assert not violations(tab)
    beyond = tab.locator(".scroll").evaluate_all(
        "all => all.map((e) => e.scrollWidth - e.clientWidth)"
    )
    assert (len(beyond), max(beyond)) == (2, 0)
    tab.close()
