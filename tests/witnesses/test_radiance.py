"""The reference against Radiance: whole diffuse scenes, with many orders of reflection."""

from functools import cache

import numpy as np
import pytest
from scipy import stats

from fotismos.comparisons.case import open_case
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.rendering.passes import passes
from tests.shared import parts
from tests.witnesses import radiance, stage
from tests.witnesses.witness import BLOCKS, CHANCE, ROUNDING, means

pytestmark = pytest.mark.thorough

SIZE, SPP, PASSES = 48, 8192, 8

MEAN, BLOCK = 3e-3, 1e-2
"""Half widths of the intervals of the mean and of blocks, at most."""


def cornell_box(max_depth=8, **changes):
    scene = SCENES["cornell-box"].make() | changes
    return scene | {"integrator": {"type": "path", "max_depth": max_depth}}


def with_a_hidden_lamp(max_depth=5):
    """The lamp shines at the ceiling: all that is seen is lit indirectly."""
    upwards = parts.look_at((0, 0.3, 0), (0, 1, 0), (0, 0, 1)).scale(0.5)
    return cornell_box(max_depth, light=cornell_box()["light"] | {"to_world": upwards})


def with_a_window():
    """Sun and sky through the open side, a point light, and a dim lamp."""
    return cornell_box(
        light=cornell_box()["light"] | {"emitter": stage.shining(4.0)},
        sun={"type": "directional", "direction": (0.5, -0.6, -1), "irradiance": 0.4},
        sky={"type": "constant", "radiance": parts.rgb_of(0.1, 0.2, 0.3)},
        point={"type": "point", "position": (0.6, 0.2, 0.4), "intensity": 0.1},
    )


CASES = {
    "lambert-sphere": (SCENES["lambert-sphere"].make, 2, 1),
    "cornell-box": (cornell_box, 8, 6),
    "box with a hidden lamp": (with_a_hidden_lamp, 5, 10),
    "box with a window": (with_a_window, 8, 3),
}
"""What makes a scene, the depth of its paths, and how often Radiance renders :data:`PASSES`."""


def reference(make):
    """Return what is rendered, and passes (P, H, W, 3)."""
    case = open_case(make, Options(resolution=(SIZE, SIZE), spp=SPP), "a scene")
    ready = prepare(case.source, case.options)
    images = [one[0] for one in passes((ready.reference,), 0, ready.passes)]
    return ready, np.array(images, float)


@cache
def both(name):
    """Return passes of the reference and of Radiance."""
    make, depth, times = CASES[name]
    ready, images = reference(make)
    found = [radiance.render(ready.scene, depth, PASSES) for _ in range(times)]
    return images, np.concatenate(found)


def deviation(images, attested):
    """Return reference less Radiance, and its standard error, of the mean and of blocks (17, 3).

    They are in units of the image's mean, or of the block's if that is brighter.
    """
    variance = sum(means(each.var(axis=0, ddof=1)) / len(each) for each in (images, attested))
    pixels = SIZE**2 / np.array([1, *[BLOCKS**2] * BLOCKS**2])[:, None]
    image, other = means(images.mean(axis=0)), means(attested.mean(axis=0))
    unit = np.maximum(other, other[0])
    return (image - other) / unit, np.sqrt(variance / pixels) / unit


def require_agreement(images, attested):
    found, error = deviation(images, attested)
    half_width = stats.norm.isf(CHANCE / found.size / 2) * error + ROUNDING
    assert half_width[0].max() < MEAN
    assert half_width[1:].max() < BLOCK
    np.testing.assert_array_less(np.abs(found), half_width)


@pytest.mark.guarantee(
    "reference", "Four diffuse scenes match Radiance, known to 0.3 % of their mean."
)
@pytest.mark.parametrize("name", CASES)
def test_a_diffuse_scene_is_that_of_radiance(rgb, name):
    require_agreement(*both(name))


def test_a_lamp_a_bounce_and_a_cosine_that_are_wrong_are_found_out(rgb, monkeypatch):
    """In light of the hidden lamp, which ``even`` divides by its cosine at the lamp."""
    images, attested = both("box with a hidden lamp")
    ready, short = reference(lambda: with_a_hidden_lamp(max_depth=4))
    right, even = radiance.translated, "\nvoid brightfunc even 2 1/Rdot . 0 0\neven light"
    monkeypatch.setattr(radiance, "translated", lambda *a: right(*a).replace("\nvoid light", even))
    flat = np.tile(radiance.render(ready.scene, 5, 2), (40, 1, 1, 1))
    for image in (0.99 * images, 1.01 * images, short):
        with pytest.raises(AssertionError, match="strictly ordered"):
            require_agreement(image, attested)
    with pytest.raises(AssertionError, match="strictly ordered"):
        require_agreement(images, flat)
