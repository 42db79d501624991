"""Switching between Mitsuba's variants (`reference.switching`)."""

import drjit as dr
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


@pytest.mark.parametrize("name", NAMES)
def test_integrators_in_python_render_as_their_counterparts_after_switching(rgb, name):
    for other in (*NAMES, *NAMES):
        mi.set_variant(other)
    mi.set_variant(name)
    scene = mi.load_dict(mi.cornell_box())
    paths = {"prb": "path", "prb_basic": "path"}
    for own, stock in paths.items():
        images = [
            np.array(
                mi.render(scene, integrator=mi.load_dict({"type": kind, "max_depth": 4}), spp=64)
            )
            for kind in (own, stock)
        ]
        assert images[0].mean() == pytest.approx(images[1].mean(), rel=0.02)


def test_functions_of_equal_code_keep_their_own_names_and_defaults(rgb):
    def made(factor, default):
        source = {"factor": factor, "dr": dr, "__name__": __name__}
        exec(compile(CODE.replace("DEFAULT", str(default)), __file__, "exec"), source)
        return source["scaled"]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("inspect.getsource", lambda f: CODE.replace("DEFAULT", "3"))
        slow = switching.syntax(made(2, 3))
        fast = switching.syntax(made(5, 3))
    x = mi.Float([1.0, 2.0])
    assert slow(x).numpy().tolist() == [6, 12]
    assert fast(x).numpy().tolist() == [15, 30]


CODE = """
def scaled(x, times=DEFAULT):
    found = type(x)(0)
    done = 0
    while done < times:
        found += factor * x
        done += 1
    return found
"""
