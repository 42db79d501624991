"""Images inside the page: read back, they are the EXR's values to three digits."""

import numpy as np
import pytest

from fotismos.comparisons.departure.metrics import drawn
from fotismos.reports.files import images
from fotismos.reports.page import embedding
from tests.shared.pages import codes

ROUNDING, ERROR_ROUNDING = 0.0025, 2**-4
"""Largest relative errors, of values and of standard errors."""


def read(embedded):
    """All planes: half floats, but for the flags."""
    return {
        name: plane if name == "flags" else plane.view(np.float16).astype(float)
        for name, plane in codes(embedded).items()
    }


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
    return images.channels(layers)


def test_the_page_holds_what_the_exr_holds():
    stored = channels(7, 5)
    counted = np.arange(35).reshape(5, 7) % 4 > 0
    embedded = embedding.embed(stored, counted)
    values = read(embedded)
    assert (embedded.width, embedded.height, embedded.block) == (7, 5, 1)
    for name in (f"{half}.{c}" for half in ("heuristic", "reference") for c in "RGB"):
        np.testing.assert_allclose(values[name], stored[name], ROUNDING)
    error = stored["dE2000.Y"].astype(float)
    expected = np.where((error > 0) & (error < embedding.LEAST), embedding.LEAST / 2, error)
    np.testing.assert_allclose(values["dE2000"], expected, ROUNDING)
    largest = np.max([stored[f"reference_stderr.{c}"] for c in "RGB"], axis=0)
    np.testing.assert_allclose(values["standard_error"], largest, ERROR_ROUNDING)
    flags = values["flags"]
    np.testing.assert_array_equal(flags & 1, stored["significant.Y"] == 1)
    np.testing.assert_array_equal((flags & 4) > 0, stored["significant.Y"] == 0.5)
    np.testing.assert_array_equal((flags & 2) > 0, counted)


def test_what_is_too_small_or_too_large_has_the_nearest_value():
    codes = embedding.encode([1e-30, -1e-30, 1e25, -1e25, 0.0, -0.0])
    largest, largest_below = (pytest.approx(s * images.HALF_MAX, rel=ROUNDING) for s in (1, -1))
    assert codes.view(np.float16).tolist() == [0.0, 0.0, largest, largest_below, 0.0, 0.0]
    assert not np.isnan(embedding.encode([1e25, 65504.0], 128).view(np.float16)).any()


def test_a_large_image_is_averaged_over_blocks(monkeypatch):
    monkeypatch.setattr(embedding, "LONGEST", 4)
    stored = channels(7, 5)
    embedded = embedding.embed(stored, np.ones((5, 7), bool))
    assert (embedded.width, embedded.height, embedded.block) == (4, 3, 2)
    image, found = stored["reference.R"].astype(float), read(embedded)["reference.R"]
    for y, x in ((0, 0), (1, 2), (2, 3)):  # the last is a single pixel, at the corner
        mean = image[2 * y : 2 * y + 2, 2 * x : 2 * x + 2].mean()
        np.testing.assert_allclose(found[y, x], mean, ROUNDING)
