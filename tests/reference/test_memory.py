"""What memory does not hold is refused before anything is rendered."""

import resource

import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.heuristic.errors import InputError
from fotismos.reference.rendering import renderer


def test_what_does_not_fit_is_refused_before_it_is_rendered(rgb, monkeypatch):
    monkeypatch.setattr(renderer, "available_memory", lambda: 2 * 10**9)
    monkeypatch.setattr(renderer.Renderer, "render", lambda *_: pytest.fail("it was rendered"))
    renderer.require_memory("small", 512, 512)
    with pytest.raises(InputError, match=r"an image of 4096x2048 .* 2 GB are free"):
        compare(SCENES["cornell-box"].source(), Options(resolution=(4096, 2048)))
    monkeypatch.setattr(renderer, "available_memory", lambda: None)
    renderer.require_memory("unknown", 10**5, 10**5)


@pytest.mark.parametrize("limit", ["RLIMIT_DATA", "RLIMIT_AS"])
def test_a_limit_of_the_process_counts(rgb, monkeypatch, limit):
    asked, largest = getattr(resource, limit), [2**62]

    def getrlimit(kind):
        return (largest[0] if kind == asked else resource.RLIM_INFINITY, resource.RLIM_INFINITY)

    monkeypatch.setattr(resource, "getrlimit", getrlimit)
    monkeypatch.setattr(renderer.Renderer, "render", lambda *_: pytest.fail("it was rendered"))
    assert 10**6 < renderer.available_memory() < 2**50
    largest[0] = 10**6
    assert renderer.available_memory() == 0
    with pytest.raises(InputError, match=r"0 GB are free\. .* raise the limits .* \(ulimit -d"):
        compare(SCENES["cornell-box"].source(), Options(resolution=(16, 16)))
