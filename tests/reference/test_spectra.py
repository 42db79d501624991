"""Wavelengths: what three numbers a colour cannot say, and what the spectral variant does."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options


def test_rgb_cannot_tell_metamers_apart_and_spectra_can(rgb):
    def colours(variant):
        mi.set_variant(variant)
        result = compare(SCENES["metameric-pair"].source(), Options(spp=16, resolution=(32, 18)))
        image, counted = result.images.heuristic, result.images.counted
        halves = np.arange(32) < 16
        return [image[counted & side].mean(axis=0) for side in (halves, ~halves)]

    plain, other = colours("llvm_ad_rgb")
    assert other / other.sum() == pytest.approx(plain / plain.sum(), rel=1e-3)
    plain, other = colours("llvm_ad_spectral")
    assert np.abs(other / other.sum() - plain / plain.sum()).max() > 0.01


@pytest.mark.thorough
def test_under_one_wavelength_all_surfaces_have_one_colour_and_in_rgb_they_keep_theirs(spectral):
    options = Options(spp=256, resolution=(80, 25), heuristic_variant="llvm_ad_rgb")
    images = compare(SCENES["narrow-band-lamp"].source(), options).images

    def spread(image):
        """Largest difference of r / (r + g) between the four spheres."""
        shares = []
        for number in range(4):
            red, green, _ = image[images.counted & (np.arange(80) // 20 == number)].mean(axis=0)
            shares.append(red / (red + green))
        return np.ptp(shares)

    assert spread(images.reference) < 0.03
    assert spread(images.heuristic) > 0.3
