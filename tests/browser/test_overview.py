"""The overview: its order, its filters, and the way to a scene and back."""

from tests.browser.conftest import EXACT, FAILED, NOISY, NOISY_ID


def names(page):
    return [name.strip() for name in page.locator(".card:visible .name").all_text_contents()]


def test_cards_show_the_records_figures(visitor, report):
    page = visitor.open()
    assert names(page) == [NOISY, EXACT, FAILED]
    metrics = report.records[NOISY]["metrics"]
    values = page.locator(f".card[data-scene='{NOISY_ID}'] data").all()
    assert [float(value.get_attribute("value")) for value in values] == [
        metrics["dE2000"]["mean"],
        metrics["dE2000"]["after_exposure"]["mean"],
        metrics["dE2000"]["noise_floor"],
        report.records[NOISY]["significant"]["fraction"],
    ]
    pictures = page.locator(".card:visible img")
    assert pictures.count() == 6
    assert all(picture.evaluate("image => image.naturalWidth > 0") for picture in pictures.all())


def test_a_card_opens_its_scene_and_the_way_back_leads_back(visitor):
    page = visitor.open()
    page.get_by_role("link", name=EXACT).first.click()
    visitor.wait_for_viewer(EXACT)
    assert page.get_by_role("heading", level=2).all_text_contents()[0] == EXACT
    assert page.locator(".scene:visible").count() == 1
    assert not page.locator("#overview-section").is_visible()
    page.go_back()
    page.wait_for_function("() => document.documentElement.dataset.view === 'overview'")
    assert names(page) == [NOISY, EXACT, FAILED]
