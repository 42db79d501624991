"""Images inside the page: read back by another way, they are the EXR's values to three digits."""

import base64
import zlib

import numpy as np

from comparisons.departure.metrics import drawn
from reports.files import exr
from reports.page import embedding

ROUNDING = {3: 2**-11, 2: 2**-8, 1: 2**-5}
"""Largest relative errors by the digits printed."""


def read(embedded):
    """All planes, undone one value at a time; those with digits as half floats."""
    raw = zlib.decompress(base64.b64decode(embedded.data))
    size = embedded.width * embedded.height
    assert len(raw) == 2 * size * len(embedded.planes)
    codes, values = {}, {}
    for number, plane in enumerate(embedded.planes):
        low, high = (raw[(2 * number + half) * size :][:size] for half in (0, 1))
        image, total = np.zeros((embedded.height, embedded.width), np.uint16), 0
        for y, x in np.ndindex(image.shape):
            at = y * embedded.width + x
            zigzag = low[at] + 256 * high[at]
            total = (total if x else 0) + (-(zigzag + 1) // 2 if zigzag % 2 else zigzag // 2)
            base = int(codes[plane.base][y, x]) if plane.base else 0
            image[y, x] = (total + base) % 65536
        codes[plane.name] = image
        values[plane.name] = image.view(np.float16).astype(float) if plane.digits else image
    return values


def channels(width, height):
    rng = np.random.default_rng(0)

    def image(*shape):
        return 10.0 ** rng.uniform(-2, 4, (height, width, *shape))

    layers = {
        "heuristic": image(3) * rng.choice([-1, 1], (height, width, 3)),
        "reference": image(3),
        "reference_stderr": image(3),
        **{name: image() for name in drawn()},
        "significant": rng.choice([0.0, 0.5, 1.0], (height, width)),
    }
    return exr.channels(layers)


def test_the_page_holds_what_the_exr_holds():
    stored = channels(7, 5)
    counted = np.arange(35).reshape(5, 7) % 4 > 0
    embedded = embedding.embed(stored, counted)
    values = read(embedded)
    assert (embedded.width, embedded.height, embedded.block) == (7, 5, 1)
    digits = {plane.name: plane.digits for plane in embedded.planes}
    for name in digits.keys() - {"standard_error", "flags"}:
        image = stored[name if "." in name else f"{name}.Y"].astype(float)
        small = (image > 0) & (image < embedding.LEAST) & (name in drawn())
        rtol = ROUNDING[digits[name]]
        np.testing.assert_allclose(values[name][~small], image[~small], rtol)
        np.testing.assert_allclose(values[name][small], embedding.LEAST / 2, rtol)
    largest = np.max([stored[f"reference_stderr.{c}"] for c in "RGB"], axis=0)
    for (y, x), value in np.ndenumerate(values["standard_error"]):
        top, left = y // 2 * 2, x // 2 * 2
        mean = largest[top : top + 2, left : left + 2].mean(dtype=float)
        np.testing.assert_allclose(value, mean, ROUNDING[1])
    flags = values["flags"]
    np.testing.assert_array_equal(flags & 1, stored["significant.Y"] == 1)
    np.testing.assert_array_equal((flags & 4) > 0, stored["significant.Y"] == 0.5)
    np.testing.assert_array_equal((flags & 2) > 0, counted)


def test_what_is_too_small_or_too_large_has_the_nearest_value():
    codes = embedding.encode([1e-30, -1e-30, 1e25, -1e25, 0.0, -0.0])
    expected = [0.0, 0.0, embedding.LARGEST, -embedding.LARGEST, 0.0, 0.0]
    np.testing.assert_array_equal(codes.view(np.float16), expected)
    assert not np.isnan(embedding.encode([1e25, 65504.0], 1).view(np.float16)).any()


def test_a_large_image_is_averaged_over_blocks(monkeypatch):
    monkeypatch.setattr(embedding, "LONGEST", 4)
    stored = channels(7, 5)
    embedded = embedding.embed(stored, np.ones((5, 7), bool))
    assert (embedded.width, embedded.height, embedded.block) == (4, 3, 2)
    values = read(embedded)
    image = stored["reference.R"].astype(float)
    for y, x in ((0, 0), (1, 2), (2, 3)):  # the last is a single pixel, at the corner
        mean = image[2 * y : 2 * y + 2, 2 * x : 2 * x + 2].mean()
        np.testing.assert_allclose(values["reference.R"][y, x], mean, ROUNDING[3])


def test_smooth_images_take_little_room():
    y, x = np.mgrid[:64, :64] / 64
    smooth = {name: np.float32(1 + x + y) for name in channels(1, 1)}
    embedded = embedding.embed(smooth, np.ones((64, 64), bool))
    assert len(embedded.data) < 0.15 * 2 * 64 * 64 * len(embedded.planes)
