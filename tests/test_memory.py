"""What memory does not hold is refused before anything is rendered."""

import re
import resource

import pytest

from comparisons import compare
from comparisons.options import Options
from heuristic.errors import InputError
from reference.rendering import memory
from reference.rendering.renderer import Renderer
from tests.programs import python
from tests.small_scene import SCENE


def need(width, height):
    return memory.BASE + memory.BYTES_A_PIXEL * width * height


@pytest.mark.parametrize(("width", "height"), [(4096, 4096), (640, 360), (1, 8000), (8000, 1)])
@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 0.999])
def test_the_largest_image_that_fits_fits_and_the_next_one_does_not(width, height, share):
    free = int(need(0, 0) + share * (need(width, height) - need(0, 0)))
    found = memory.largest(width, height, free)
    if found is None:
        assert share < 0.5 or 1 in (width, height)
        return
    wide, high = found
    assert need(wide, high) <= free
    assert abs(wide * height - high * width) <= max(width, height)
    assert need(wide + 1, -(-(wide + 1) * height // width)) > free


def test_what_does_not_fit_is_refused_with_what_does(monkeypatch):
    monkeypatch.setattr(memory, "available", lambda: 2 * 10**9)
    memory.require("small", 512, 512)
    with pytest.raises(InputError) as refused:
        memory.require("large", 4096, 2048)
    text = str(refused.value)
    assert text.startswith("large: an image of 4096x2048 pixels needs 2.3 GB of memory, and 2 GB")
    wide, high = map(int, re.search(r"At most (\d+)x(\d+) pixels", text).groups())
    memory.require("fits", wide, high)
    assert wide == pytest.approx(2 * high, abs=2)


def test_where_nobody_says_nothing_is_refused(monkeypatch):
    monkeypatch.setattr(memory, "available", lambda: None)
    memory.require("any", 10**5, 10**5)


def test_nothing_is_rendered_of_what_is_refused(rgb, monkeypatch, tmp_path):
    from comparisons.gallery.builtin import SCENES

    monkeypatch.setattr(memory, "available", lambda: memory.BASE + 10**6)
    monkeypatch.setattr(Renderer, "render", lambda *_: pytest.fail("it was rendered"))
    with pytest.raises(InputError, match="At most 63x63 pixels"):
        compare.compare(SCENES["cornell-box"].source(), Options(resolution=(64, 64)))


def test_the_command_says_so(run, monkeypatch, tmp_path):
    (tmp_path / "s.xml").write_text(SCENE)
    monkeypatch.setattr(memory, "available", lambda: 10**6)
    code, _, messages = run("compare", tmp_path / "s.xml", "--resolution", "64x32", "-o", tmp_path)
    assert code == 2
    assert "an image of 64x32 pixels needs" in " ".join(messages.split())
    assert "Not even a small one fits" in " ".join(messages.split())


def test_the_machine_says_how_much_is_free():
    assert 0 < memory.available() < 2**50


def test_a_limit_on_addresses_counts():
    code = (
        "import resource; from reference.rendering import memory;"
        "resource.setrlimit(resource.RLIMIT_AS, (2**35, resource.RLIM_INFINITY));"
        "before = next(memory._of_limit()); print(before)"
    )
    assert 0 < int(python("-c", code).stdout) < 2**35
    assert resource.getrlimit(resource.RLIMIT_AS)[0] != 2**35


def test_groups_leave_what_they_allow_but_for_what_is_used(tmp_path):
    """Version 2 and version 1 of control groups; pages of files can be dropped."""
    (tmp_path / "memory.max").write_text("1000\n")
    (tmp_path / "memory.current").write_text("700\n")
    (tmp_path / "memory.stat").write_text("anon 600\ninactive_file 100\n")
    assert list(memory._left_in(tmp_path)) == [400]
    (tmp_path / "memory.max").write_text("max\n")
    assert list(memory._left_in(tmp_path)) == []
    (tmp_path / "memory.limit_in_bytes").write_text("500\n")
    (tmp_path / "memory.usage_in_bytes").write_text("600\n")
    assert list(memory._left_in(tmp_path)) == [0]
