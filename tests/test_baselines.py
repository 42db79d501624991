"""The built-in scenes against the baselines beside this file; `--fotismos-update` writes them.

They are small, since a baseline keeps eight passes of both halves.
"""

import pytest

from fotismos.comparisons.gallery.builtin import SCENES

SMALL = {"resolution": (32, 32)}
SPECTRAL = ("narrow-band-lamp", "metameric-pair")


@pytest.mark.fotismos_variant("llvm_ad_rgb")
@pytest.mark.parametrize("name", SCENES)
def test_a_scene_in_rgb_is_as_it_was(fotismos, name):
    assert fotismos.unchanged(name, **SMALL)


@pytest.mark.parametrize("name", SPECTRAL)
def test_shading_in_rgb_against_spectra_is_as_it_was(fotismos, name):
    assert fotismos.unchanged(name, **SMALL)


@pytest.mark.thorough
@pytest.mark.fotismos_variant("llvm_ad_spectral")
def test_a_scene_in_spectra_is_as_it_was(fotismos):
    assert fotismos.unchanged("cornell-box", **SMALL)
