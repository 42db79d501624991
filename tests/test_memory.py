"""What memory does not hold is refused before anything is rendered."""

import re

import pytest

from comparisons.compare import compare
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from heuristic.errors import InputError
from reference.rendering import renderer


def test_what_does_not_fit_is_refused_with_the_largest_image_that_does(monkeypatch):
    monkeypatch.setattr(renderer, "available_memory", lambda: 2 * 10**9)
    renderer.require_memory("small", 512, 512)
    with pytest.raises(InputError, match=r"large: an image of 4096x2048 .* 2 GB are") as refused:
        renderer.require_memory("large", 4096, 2048)
    wide, high = map(int, re.search(r"At most (\d+)x(\d+) pixels", str(refused.value)).groups())
    assert wide == pytest.approx(2 * high, abs=2)
    renderer.require_memory("fits", wide, high)
    with pytest.raises(InputError):
        renderer.require_memory("next", wide + 2, high + 1)
    monkeypatch.setattr(renderer, "available_memory", lambda: None)
    renderer.require_memory("unknown", 10**5, 10**5)


def test_nothing_is_rendered_of_what_is_refused(rgb, monkeypatch):
    monkeypatch.setattr(renderer, "available_memory", lambda: 10**6)
    monkeypatch.setattr(renderer.Renderer, "render", lambda *_: pytest.fail("it was rendered"))
    with pytest.raises(InputError, match="Not even a small one fits"):
        compare(SCENES["cornell-box"].source(), Options(resolution=(64, 64)))


def test_the_machine_says_how_much_is_free():
    assert 0 < renderer.available_memory() < 2**50
