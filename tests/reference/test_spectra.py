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
