"""What accuracy costs, in the page: the map of effects."""

import numpy as np
import pytest

from fotismos.comparisons.hybrids.attribution import dominating
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


@pytest.mark.parametrize("pixel", [(5, 12), (40, 12), (23, 16), (24, 16), (30, 31), (30, 1)])
def test_map_and_inspector_name_the_effect_that_dominates(visitor, pixel):
    visitor.open(f"{SCENE}&map=effects&pixel={pixel[0]},{pixel[1]}")
    found = causes()
    known = dominating(found.maps, found.counted)[place(*pixel)]
    names = [*found.maps, "unknown", "none"]
    colours = [*map(scene_view.EFFECT_COLOURS.get, found.maps), "#82888f", scene_view.NO_EFFECT]
    assert visitor.inspected()["cause"] == names[known]
    x, y = pixel[0] + (2 if pixel[0] != 23 else -2), pixel[1]  # beside the mark
    np.testing.assert_allclose(visitor.colour_of(x, y), bytes_of(colours[known]), atol=1)


def test_a_scene_without_causes_has_no_map_of_effects(visitor):
    page = visitor.open(f"#scene={EXACT}&mode=error&map=effects")
    assert page.get_by_label("Map of the error").input_value() == "dE2000"
    assert page.locator("option[value=effects]").is_disabled()
    page.keyboard.press("m")
    assert visitor.state()["map"] != "effects"
