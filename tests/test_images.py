"""Pictures: the sRGB curve, the ranges of maps, and files that keep every pixel."""

from io import BytesIO

import numpy as np
import pytest
from PIL import Image

from comparisons.departure.metrics import METRICS, RATIO, drawn
from reports.files import images
from tests import records


def pixels_of(picture):
    return np.asarray(picture.convert("RGB"))


def decode(png):
    with Image.open(BytesIO(png)) as image:
        return pixels_of(image)


def test_tonemap_is_the_srgb_curve():
    linear = np.array([[[-1.0, 0.0, 0.0031308], [0.21586, 0.5, 1.0], [1e6, 0.04, 0.002]]])
    # IEC 61966-2-1: 0.21586 is the linear value of 128/255.
    expected = [[[0, 0, 10], [128, 188, 255], [255, 56, 7]]]
    np.testing.assert_array_equal(pixels_of(images.tonemap(linear)), expected)
    np.testing.assert_array_equal(pixels_of(images.tonemap(linear / 8, exposure=8)), expected)


def test_png_keeps_small_images_and_shrinks_large_ones_on_request():
    pixels = np.random.default_rng(0).integers(0, 256, (6, 9, 3), dtype=np.uint8)
    picture = Image.fromarray(pixels)
    np.testing.assert_array_equal(decode(images.png(picture)), pixels)
    np.testing.assert_array_equal(decode(images.png(picture, longest=9)), pixels)
    assert images.png(picture) == images.png(picture)
    large = images.error_map(np.zeros((40, 100)), 1.0)
    assert decode(images.png(large)).shape == (40, 100, 3)
    assert decode(images.png(large, longest=50)).shape == (20, 50, 3)


def test_error_map_spans_magma_and_stays_in_it():
    row = pixels_of(images.error_map([[0.0, 10.0, 20.0, 500.0, -1.0]], 20.0))[0]
    assert images.css_colour(row[0]) == "#000004"
    assert images.css_colour(row[2]) == "#fcfdbf"
    np.testing.assert_array_equal(row[3], row[2])
    np.testing.assert_array_equal(row[4], row[0])
    assert row[0].sum() < row[1].sum() < row[2].sum()


def test_signed_map_is_blue_below_red_above_and_pale_at_zero():
    below, zero, above = pixels_of(images.signed_map([[-3.0, 0.0, 3.0]], 3.0))[0].astype(int)
    assert below[2] > below[0] + 50
    assert above[0] > above[2] + 50
    assert zero.min() > 240


def test_mask_map_has_four_colours():
    picture = pixels_of(images.mask_map([[1.0, 0.0, 0.5, 0.5]], [[True, True, True, False]]))
    assert [tuple(map(int, p)) for p in picture[0]] == [
        images.MARKED,
        images.UNMARKED,
        images.UNDETERMINED,
        images.UNCOUNTED,
    ]


def test_colour_bar_has_the_ends_of_the_map():
    bar = images.colour_bar("magma")
    assert bar.startswith("linear-gradient(to right, #000004")
    assert bar.endswith("#fcfdbf)")


@pytest.mark.parametrize("name", [*drawn(), RATIO.name])
def test_pictures_draw_a_map_over_its_printed_range(name):
    top = RATIO.limit if name == RATIO.name else METRICS[name].map_range[1]
    made = images.pictures(records.images(1, 2, {name: np.array([[top, 0.99 * top]])}))
    assert set(made) == {"heuristic", "reference", "significant", *drawn(), RATIO.name}
    end, below = decode(made[name])[0]
    table = images._table("RdBu_r" if name == RATIO.name else "magma")
    np.testing.assert_array_equal(end, table[-1])
    assert (below != table[-1]).any()
