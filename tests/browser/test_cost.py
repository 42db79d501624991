"""What accuracy costs, in the page: the map of effects."""

import numpy as np

from fotismos.comparisons.attribution import dominating
from fotismos.reports.page import scene_view
from tests.browser.conftest import EXACT, HEIGHT, NOISY_ID, WIDTH
from tests.shared.cost_records import HEIGHT as ROWS
from tests.shared.cost_records import WIDTH as COLUMNS
from tests.shared.cost_records import causes

SCENE = f"#scene={NOISY_ID}&mode=error"


def bytes_of(css):
    return tuple(bytes.fromhex(css[1:]))


def place(x, y):
    """The pixel of the study that holds the middle of one of the image."""
    return int((y + 0.5) * ROWS / HEIGHT), int((x + 0.5) * COLUMNS / WIDTH)


def test_map_and_inspector_name_the_effect_that_dominates(visitor):
    found = causes()
    known = dominating(found.maps, found.counted)
    names = [*found.maps, "unknown", "none"]
    colours = [*map(scene_view.EFFECT_COLOURS.get, found.maps), "#82888f", scene_view.NO_EFFECT]
    for x, y in ((5, 12), (40, 12), (23, 16), (24, 16), (30, 31), (30, 1)):
        visitor.open(f"{SCENE}&map=effects&pixel={x},{y}")
        visitor.settle()
        effect = known[place(x, y)]
        assert visitor.inspected()["cause"] == names[effect]
        beside = x - 2 if x == 23 else x + 2  # not on the mark
        shown = visitor.colour_of(beside, y)
        np.testing.assert_allclose(shown, bytes_of(colours[effect]), atol=1)


def test_a_scene_without_causes_has_no_map_of_effects(visitor):
    page = visitor.open(f"#scene={EXACT}&mode=error&map=effects")
    assert page.get_by_label("Map of the error").input_value() == "dE2000"
    assert page.locator("option[value=effects]").is_disabled()
    page.keyboard.press("m")
    assert visitor.state()["map"] != "effects"
