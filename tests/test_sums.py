"""Sums of passes as comparisons keep them: in parts, compact, a difference by its halves."""

import mitsuba as mi
import numpy as np
import pytest

from comparisons.store import Entry, Lazy
from reference.rendering import sums
from reference.rendering.moments import DifferenceSums, SumsOfHalves
from reference.rendering.sums import Accumulator, Deviations, Mean, add_difference

SIZE = (24, 17)
COUNTED = np.ones(SIZE, bool)


def halves(scale, passes=16, seed=1):
    """Skewed passes of two halves, (2, N, H, W, 3)."""
    rng = np.random.default_rng(seed)
    return (scale * rng.exponential(size=(2, passes, *SIZE, 3)) ** 2).astype(np.float32)


def of_halves():
    both = [Mean(), Deviations(compact=True)]
    return [*both, SumsOfHalves(COUNTED, tuple(both), compact=True)]


def add_all(total, images):
    for pair in zip(*images, strict=True):
        add_difference(total, [mi.TensorXf(image) for image in pair])


@pytest.mark.parametrize("scale", [1e-15, 1.0, 1e10])
def test_compact_sums_of_halves_are_those_of_the_difference(rgb, scale):
    """However dim or bright: they are kept as roots, whose range is the images'."""
    images, whole = halves(scale), DifferenceSums(COUNTED)
    for first, second in zip(*images.astype(float), strict=True):
        whole.add(mi.TensorXd(first - second))
    total = of_halves()
    add_all(total, images)
    found, wanted = total[2].estimate(), whole.estimate()
    size = scale * np.ones(())
    np.testing.assert_allclose(found.mean, wanted.mean, rtol=1e-9, atol=1e-12 * size)
    np.testing.assert_allclose(found.standard_error, wanted.standard_error, rtol=2e-6)
    np.testing.assert_allclose(found.noise, wanted.noise, rtol=1e-6, atol=1e-6 * size)
    np.testing.assert_allclose(found.third, wanted.third, rtol=1e-5, atol=1e-6 * size**3)
    np.testing.assert_array_equal(found.grouped.means, wanted.grouped.means)


@pytest.mark.parametrize("part", [1, 7, 1000])
def test_parts_do_not_show(rgb, monkeypatch, part):
    images = halves(1.0, passes=4)[:, :, :3, :5]
    found = []
    for size in (2**20, part):
        monkeypatch.setattr(sums, "PART", size)
        total = Accumulator()
        for image in images[0]:
            total.add(mi.TensorXf(image))
        found.append(total.estimate())
    for name in ("mean", "standard_error", "noise"):
        np.testing.assert_array_equal(*(getattr(one, name) for one in found))


def test_a_difference_without_noise_has_none(rgb):
    images = np.repeat(halves(1.0, passes=1), 6, axis=1)
    total = of_halves()
    add_all(total, images)
    found = total[2].estimate(np.float32, last=True)
    assert not found.noise.any()
    assert found.standard_error.max() <= 1e-7 * images.max()
    np.testing.assert_allclose(found.mean, images[0, 0] - images[1, 0], rtol=1e-6)


def test_kept_sums_go_on_bit_for_bit(rgb, tmp_path):
    images, entry = halves(0.3, passes=6), Entry(tmp_path / "r.npz", "key")
    through, before, after = of_halves(), of_halves(), of_halves()
    add_all(through, images)
    add_all(before, images[:, :3])
    makers = {f"{n}_{name}": m for n, one in enumerate(before) for name, m in one.state().items()}
    entry.save(Lazy(makers))
    kept = entry.load()
    for number, one in enumerate(after):
        one.restore({name[2:]: kept[name] for name in kept if name[0] == str(number)})
    add_all(after, images[:, 3:])
    for one, other in zip(through, after, strict=True):
        for (name, made), again in zip(one.state().items(), other.state().values(), strict=True):
            np.testing.assert_array_equal(made(), again(), err_msg=name)


def test_arrays_are_written_one_at_a_time(tmp_path):
    asked = []

    def make(name):
        asked.append(name)
        return np.full(3, len(asked))

    content = Lazy({name: lambda name=name: make(name) for name in "abc"})
    entry = Entry(tmp_path / "r.npz", "key")
    entry.save(content)
    assert asked == ["a", "b", "c"]
    assert {name: array[0] for name, array in entry.load().items()} == {"a": 1, "b": 2, "c": 3}


def test_memory_is_given_back_with_the_last_array(rgb):
    total = Accumulator()
    total.add(mi.TensorXf(halves(1.0)[0, 0]))
    total.estimate(last=True)
    assert total._parts == [{}]
