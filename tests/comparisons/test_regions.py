"""Regions on maps whose answer is known."""

import numpy as np
import pytest

from fotismos.comparisons.departure import regions

ALL = np.ones((96, 96), bool)


def blank():
    return np.full((96, 96), 0.01)


def test_several_boxes_come_by_their_worth_and_do_not_overlap():
    error = blank()
    error[4:20, 4:20] = 3.0
    error[60:90, 10:50] = 5.0
    error[30:34, 80:96] = 20.0
    found = regions.find(error, ALL)
    corners = [(r.x, r.y, r.width, r.height) for r in found]
    assert corners == [(10, 60, 40, 30), (80, 30, 16, 4), (4, 4, 16, 16)]
    assert [r.mean_dE2000 for r in found] == pytest.approx([5.0, 20.0, 3.0])
    assert sum(region.share for region in found) <= 1.0


def test_boxes_in_random_maps_never_overlap_and_shares_are_what_they_hold():
    rng = np.random.default_rng(0)
    for _ in range(20):
        error = rng.exponential(1.0, (50, 70)) ** 3
        counted = rng.random((50, 70)) > 0.3
        marked = np.zeros((50, 70), int)
        for r in regions.find(error, counted):
            box = slice(r.y, r.y + r.height), slice(r.x, r.x + r.width)
            marked[box] += 1
            held = error[box][counted[box]]
            assert r.share == pytest.approx(held.sum() / error[counted].sum())
            assert r.mean_dE2000 == pytest.approx(held.mean())
        assert marked.max() <= 1


def test_the_first_box_is_the_best_of_all_boxes():
    error = np.random.default_rng(3).random((6, 7))
    worth = error - regions.CONTRAST * error.mean()
    boxes = {
        (c, a, d - c, b - a): worth[a:b, c:d].sum()
        for a in range(6)
        for b in range(a + 1, 7)
        for c in range(7)
        for d in range(c + 1, 8)
    }
    found = regions.find(error, np.ones((6, 7), bool))[0]
    assert (found.x, found.y, found.width, found.height) == max(boxes, key=boxes.__getitem__)


@pytest.mark.parametrize("error", [np.zeros((96, 96)), np.ones((96, 96))], ids=["none", "even"])
def test_error_that_stands_out_nowhere_has_no_region(error):
    assert regions.find(error, ALL) == ()


def test_a_box_is_drawn_in_to_the_counted_pixels():
    error, counted = np.zeros((480, 480)), np.ones((480, 480), bool)
    error[103:148, 207:251] = 5.0
    counted[:, :207] = counted[:103] = False
    (found,) = regions.find(error, counted)
    assert (found.x, found.y) == (207, 103)
