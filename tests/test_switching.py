"""Switching between Mitsuba's variants (`reference.switching`)."""

import mitsuba as mi
import numpy as np
import pytest

from reference import switching

NAMES = ("llvm_ad_spectral", "llvm_ad_mono", "llvm_ad_rgb")


def test_switching_back_transforms_nothing_again(rgb, monkeypatch):
    transformed = []
    original = switching._transform
    for name in NAMES:
        mi.set_variant(name)
    monkeypatch.setattr(switching, "_transform", lambda f: transformed.append(f) or original(f))
    for name in NAMES:
        mi.set_variant(name)
    assert transformed == []


@pytest.mark.thorough
@pytest.mark.parametrize("name", NAMES)
def test_integrators_in_python_render_as_their_counterparts_after_switching(rgb, name):
    for other in (*NAMES, *NAMES):
        mi.set_variant(other)
    mi.set_variant(name)
    box = mi.cornell_box()
    box["sensor"]["film"] |= {"width": 32, "height": 32}
    scene = mi.load_dict(box)
    for own, stock in (("prb", "path"), ("prb_basic", "path")):
        images = [
            np.array(
                mi.render(scene, integrator=mi.load_dict({"type": kind, "max_depth": 4}), spp=64)
            )
            for kind in (own, stock)
        ]
        assert images[0].mean() == pytest.approx(images[1].mean(), rel=0.02)
