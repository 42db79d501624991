"""Which effect dominates where, on maps whose answer is known."""

import numpy as np

from comparisons.departure.regions import Region
from comparisons.effects.dominance import LEAST, NONE, UNCOUNTED, dominating, in_region

ALL = np.ones((4, 6), bool)


def maps(**values):
    return {name: np.full((4, 6), value, float) for name, value in values.items()}


def test_the_largest_dominates_where_it_can_be_seen():
    effects = maps(shadow=2.0, gloss=1.5)
    effects["gloss"][:, 3:] = 3.0
    effects["shadow"][0] = effects["gloss"][0] = LEAST / 2
    counted = ALL.copy()
    counted[3] = False
    found = dominating(effects, counted)
    assert (found[0] == NONE).all()
    assert (found[1:3] == [0, 0, 0, 1, 1, 1]).all()
    assert (found[3] == UNCOUNTED).all()


def test_what_makes_it_worse_does_not_dominate():
    assert (dominating(maps(shadow=-9.0, gloss=1.1), ALL) == 1).all()
    assert (dominating({}, ALL) == NONE).all()


def region(x, y, width, height):
    return Region(x=x, y=y, width=width, height=height, share=0.5, mean_dE2000=1.0)


def test_a_region_of_a_larger_image_is_found_in_the_smaller_map():
    effects = maps(shadow=0.0, gloss=2.0)
    effects["shadow"][2:, 3:] = 8.0
    size = (60, 40)
    assert in_region(region(30, 20, 30, 20), size, effects) == "shadow"
    assert in_region(region(0, 0, 30, 20), size, effects) == "gloss"
    assert in_region(region(59, 39, 1, 1), size, effects) == "shadow"


def test_a_second_effect_is_named_where_it_removes_half_as_much():
    box = region(0, 0, 6, 4)
    assert in_region(box, (6, 4), maps(a=4.0, b=2.0, c=1.0)) == "a, then b"
    assert in_region(box, (6, 4), maps(a=4.0, b=1.9)) == "a"
    assert in_region(box, (6, 4), maps(a=1.2, b=0.9)) == "a", "what cannot be seen is not named"
    assert in_region(box, (6, 4), maps(a=0.9)) is None
    assert in_region(box, (6, 4), {}) is None
