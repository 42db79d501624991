"""The heuristic against POV-Ray: the figures of chapter 8, pixel by pixel."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.case import open_case
from fotismos.comparisons.gallery.builtin import SCENES
from fotismos.comparisons.options import Options
from fotismos.comparisons.plain_scene import plain_scene
from fotismos.comparisons.prepared import prepare
from fotismos.heuristic import kernel
from tests.witnesses import povray, povray_scenes

pytestmark = [
    pytest.mark.thorough,
    pytest.mark.skipif(
        povray.PROGRAM is None, reason="POV-Ray is not installed; as root: apt-get install povray"
    ),
]

SIZE = 96
FIGURES = [name for name in SCENES if name.startswith("fig-8")]
OTHERS = ["fig-6-5-m1", "fig-6-5-m40", "fig-6-14"]

HALF = 2.0**-11
"""Half precision rounds by no more, relative."""

SINGLE = 1e-6
"""And the kernel by no more than this, absolute: positions and normals are of single precision."""

SILHOUETTE = 8
"""Pixels, of some thousands, that one of the two alone may see: edges, and where light ends."""

MEAN = 5e-5
"""What ties in the rounding to half precision leave in the mean over a figure, relative."""


def kernel_picture(scene):
    """Render a figure by the integrator ``heuristic``, one ray through the centre of each pixel."""
    sensor = dict(scene["sensor"])
    sensor["film"] = sensor["film"] | {"width": SIZE, "height": SIZE}
    sensor["sampler"] = {"type": "stratified", "sample_count": 1, "jitter": False}
    made = mi.load_dict({**scene, "sensor": sensor}, optimize=False)
    return np.array(mi.render(made, spp=1, seed=0), float)


def seen_by_both(scene, folder):
    """Return the pixels (N, 3) that kernel and POV-Ray see, and how many one of them alone sees."""
    kernel, witness = kernel_picture(scene), povray.render(scene, SIZE, folder)
    seen, attested = (picture.max(axis=2) > SINGLE for picture in (kernel, witness))
    both = seen & attested
    return kernel[both], witness[both], int(np.count_nonzero(seen != attested))


def require_agreement(name, folder):
    """Compare kernel and POV-Ray on all pixels that both see, and in the mean over them."""
    kernel, witness, alone = seen_by_both(SCENES[name].make(), folder)
    assert len(witness) > 0.1 * SIZE**2, "the picture should not be black"
    assert alone <= SILHOUETTE
    np.testing.assert_array_less(np.abs(kernel - witness), HALF * kernel + SINGLE)
    assert witness.mean() == pytest.approx(kernel.astype(np.float16).mean(dtype=float), rel=MEAN)


@pytest.mark.guarantee(
    "kernel", "Chapter 8's figures match POV-Ray's to half-float rounding, pixel by pixel."
)
@pytest.mark.parametrize("name", FIGURES + OTHERS)
def test_a_figure_is_that_of_povray_to_half_float_rounding(rgb, name, tmp_path):
    require_agreement(name, tmp_path)


@pytest.mark.parametrize("name", ["fig-8-9", "lambert-sphere"])
def test_a_whole_scene_is_that_of_povray(rgb, name, tmp_path):
    """As triangles, whose normals are a little apart from the sphere's, and with its materials."""
    case = open_case(name, Options(resolution=(SIZE, SIZE), spp=64, tessellation=48))
    text = povray_scenes.translated(plain_scene(case.source, case.options))
    witness = povray.drawn(text, SIZE, tmp_path)
    ready = prepare(case.source, case.options)
    kernel = np.array(ready.heuristic.render(1), float)
    inside = (kernel.max(axis=2) > 0.05) & (witness.max(axis=2) > 0.05)
    assert inside.sum() > 0.3 * SIZE**2
    relative = np.abs(kernel / np.maximum(witness, 0.01) - 1)[inside]
    assert np.percentile(relative, 90) < 5e-3
    assert np.median(relative) < 1e-3


def test_a_kernel_that_is_wrong_by_a_ten_thousandth_is_found_out(rgb, tmp_path, monkeypatch):
    right = kernel.shade
    monkeypatch.setattr(kernel, "shade", lambda *given: 1.0001 * right(*given))
    with pytest.raises(AssertionError):
        require_agreement("fig-8-9", tmp_path)
