"""Images inside the page: read back by another way, they are the EXR's values to three digits."""

import base64
import math
import zlib

import numpy as np
import pytest

from comparisons.departure.metrics import drawn
from reports.files import exr
from reports.page import embedding


def value_of(code, digits):
    """The value of a code, by the definition in `embedding.encode`'s docstring."""
    sign = -1 if code >= embedding.NEGATIVE else 1
    magnitude = code % embedding.NEGATIVE
    if magnitude == 0:
        return 0.0
    unit = 10 ** (digits - 1)
    steps, place = divmod(magnitude - 1, 9 * unit)
    exponent = embedding.EXPONENTS[0] + steps
    return sign * float(f"{unit + place}e{exponent - digits + 1}")


def read(embedded):
    """All planes, undone one value at a time."""
    raw = zlib.decompress(base64.b64decode(embedded.data))
    size = embedded.width * embedded.height
    assert len(raw) == 2 * size * len(embedded.planes)
    planes = {}
    for number, plane in enumerate(embedded.planes):
        low, high = (raw[(2 * number + half) * size :][:size] for half in (0, 1))
        codes = np.zeros((embedded.height, embedded.width), int)
        for y in range(embedded.height):
            total = 0
            for x in range(embedded.width):
                zigzag = low[y * embedded.width + x] + 256 * high[y * embedded.width + x]
                total += -(zigzag + 1) // 2 if zigzag % 2 else zigzag // 2
                base = planes[plane.base][y, x] if plane.base else 0
                codes[y, x] = (total + base) % 65536
        planes[plane.name] = codes
    return planes


def channels(width, height, seed=0):
    rng = np.random.default_rng(seed)

    def image(*shape):
        return 10.0 ** rng.uniform(-5, 4, (height, width, *shape))

    layers = {
        "heuristic": image(3) * rng.choice([-1, 1], (height, width, 3)),
        "reference": image(3),
        "reference_stderr": image(3),
        **{name: image() for name in drawn()},
        "significant": rng.choice([0.0, 0.5, 1.0], (height, width)),
    }
    return exr.channels(layers)


@pytest.mark.parametrize(("digits", "form"), [(3, ".2e"), (2, ".1e"), (1, ".0e")])
def test_codes_are_values_rounded_as_they_are_printed(digits, form):
    rng = np.random.default_rng(1)
    values = (10.0 ** rng.uniform(-17.5, 15.5, 4000) * rng.choice([-1, 1], 4000)).astype("f4")
    edges = np.float32([0, 9.995, 9.996, 1.125, 1.135, 0.125, -0.375, 99.95, 1e-17, 65504, 1, 10])
    values = np.concatenate([values, edges])
    codes = embedding.encode(values, digits)
    for value, code in zip(values, codes, strict=True):
        assert value_of(int(code), digits) == float(f"{float(value):{form}}")


def test_codes_rise_with_the_magnitude():
    values = np.logspace(-17, 15, 5000)
    assert (np.diff(embedding.encode(values).astype(int)) >= 0).all()
    assert (embedding.encode(-values) == embedding.encode(values) + embedding.NEGATIVE).all()


def test_what_is_too_small_or_too_large_has_the_nearest_code():
    codes = embedding.encode([1e-30, -1e-30, 1e25, -1e25])
    assert [value_of(int(code), 3) for code in codes] == [0.0, 0.0, 9.95e16, -9.95e16]


def test_the_page_holds_what_the_exr_holds():
    stored = channels(7, 5)
    counted = np.arange(35).reshape(5, 7) % 4 > 0
    embedded = embedding.embed(stored, counted)
    planes = read(embedded)
    assert (embedded.width, embedded.height, embedded.block) == (7, 5, 1)
    names = [f"{half}.{c}" for half in ("heuristic", "reference") for c in "RGB"]
    for name in [*names, *drawn()]:
        image = stored[name if "." in name else f"{name}.Y"]
        for (y, x), code in np.ndenumerate(planes[name]):
            value = float(image[y, x])
            is_least = name in drawn() and 0 < value < embedding.LEAST
            digits = 2 if name in drawn() and name != "dE2000" else 3
            rounded = float(f"{value:.{digits - 1}e}")
            assert value_of(code, digits) == (0.005 if is_least else rounded)
    largest = np.max([stored[f"reference_stderr.{c}"] for c in "RGB"], axis=0)
    for (y, x), code in np.ndenumerate(planes["standard_error"]):
        top, left = y // 2 * 2, x // 2 * 2
        mean = float(largest[top : top + 2, left : left + 2].mean(dtype=float))
        assert value_of(code, 1) == float(f"{mean:.0e}")
    np.testing.assert_array_equal(planes["flags"] & 1, stored["significant.Y"] == 1)
    np.testing.assert_array_equal((planes["flags"] & 4) > 0, stored["significant.Y"] == 0.5)
    np.testing.assert_array_equal((planes["flags"] & 2) > 0, counted)


def test_a_large_image_is_averaged_over_blocks(monkeypatch):
    monkeypatch.setattr(embedding, "LONGEST", 4)
    stored = channels(7, 5)
    embedded = embedding.embed(stored, np.ones((5, 7), bool))
    assert (embedded.width, embedded.height, embedded.block) == (4, 3, 2)
    planes = read(embedded)
    image = stored["reference.R"].astype(float)
    for y, x in ((0, 0), (1, 2), (2, 3)):  # the last is a single pixel, at the corner
        mean = image[2 * y : 2 * y + 2, 2 * x : 2 * x + 2].mean()
        assert math.isclose(value_of(planes["reference.R"][y, x], 3), mean, rel_tol=0.006)
    assert planes["flags"][2, 3] & 1 == (stored["significant.Y"][4, 6] == 1)


def test_smooth_images_take_little_room():
    y, x = np.mgrid[:64, :64] / 64
    smooth = {name: np.float32(1 + x + y) for name in channels(1, 1)}
    embedded = embedding.embed(smooth, np.ones((64, 64), bool))
    assert len(embedded.data) < 0.15 * 2 * 64 * 64 * len(embedded.planes)
