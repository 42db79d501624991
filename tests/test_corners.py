"""The corners of the lattice of effects: their pictures, errors and places in the page."""

from dataclasses import replace

import mitsuba as mi
import numpy as np
import pytest

from comparisons.case import Request, open_case
from comparisons.compare import guarded
from comparisons.cost.cost import cost
from comparisons.cost.effort import QUICK
from comparisons.cost.methods import Methods
from comparisons.cost.rungs import Kernel
from comparisons.departure.metrics import delta_e_2000
from comparisons.effects.lattice import LEAST_SPP, PREVIEW, Lattice
from reference.effects import labelled
from reference.rendering.passes import Stream, passes
from tests.test_objects import shadowed

OCCLUSION = "occlusion"


def case(filter="box", size=24, **options):
    scene = shadowed(size)
    scene["sensor"]["film"]["rfilter"] = {"type": filter}
    return open_case(scene, Request.of({"resolution": (size, size)} | options), "shadowed")


def made(filter="box", spp=16):
    opened = case(filter)
    ready = guarded(opened.source, opened.options)
    methods = Methods(opened.source, opened.options, ready)
    return methods, Lattice(opened.options, methods, 3, spp, 0)


def test_a_preview_is_the_same_image_in_finer_pixels():
    _, lattice = made()
    assert lattice.finer == 2
    for effects in ((), (OCCLUSION,)):
        found = lattice.simulating({labelled(effect) for effect in effects})
        height, width, _ = found.preview.shape
        assert (height, width) == (48, 48)
        blocks = found.preview.reshape(24, 2, 24, 2, 3).mean(axis=(1, 3))
        np.testing.assert_allclose(blocks, found.images.mean(axis=0), rtol=1e-5, atol=1e-6)


def test_a_filter_that_is_no_box_leaves_the_pixels_as_they_are():
    _, lattice = made("gaussian")
    found = lattice.simulating(())
    assert lattice.finer == 1
    np.testing.assert_array_equal(found.preview, found.images.mean(axis=0))


@pytest.mark.parametrize(("spp", "finer"), [(1, 1), (8, 1), (16, 2), (64, 4), (4096, 8)])
def test_a_preview_is_bounded_and_keeps_stratified_samples(spp, finer):
    _, lattice = made(spp=spp)
    assert lattice.finer == finer
    assert finer * 24 <= PREVIEW
    assert finer == 1 or spp / finer**2 >= LEAST_SPP


def test_films_keep_their_size():
    methods, lattice = made()
    lattice.simulating({labelled(OCCLUSION)})
    lattice.simulating(())
    for scene in (methods.ready.scene, methods.ready.heuristic.scene):
        assert tuple(scene.sensors()[0].film().size()) == (24, 24)


@pytest.mark.guarantee(
    "prices",
    "A preview of the switchboard equals a rendering that simulates its effects.",
)
def test_the_corner_of_shadows_is_the_kernel_with_shadows():
    """By the kernel's own shadow rays, where the corner has Mitsuba's direct light."""
    methods, lattice = made()
    shown = lattice.simulating({labelled(OCCLUSION)}).preview
    renderer = methods.renderer(Kernel(shadows=True), 4, (48, 48))
    loop = passes([renderer], 0, 3, stream=Stream.REPLICATES)
    wanted = np.mean([np.array(one.images[0]) for one in loop], axis=0)
    np.testing.assert_allclose(shown, wanted, rtol=1e-3, atol=1e-4)
    assert abs(shown - lattice.simulating(()).preview).max() > 0.05


@pytest.fixture(scope="module")
def study():
    opened = case()
    return cost(opened.source, opened.options, replace(QUICK, rounds=2), None)


def test_every_corner_has_a_picture_an_error_and_a_time(study):
    corners = study.record.prices.corners
    assert [corner.effects for corner in corners] == [(), (OCCLUSION,)]
    assert set(study.previews) == {corner.effects for corner in corners}
    assert all(corner.seconds > 0 for corner in corners)


def test_errors_of_corners_are_those_of_their_pictures(study):
    """Against the reference, by the definition, but for the noise of edges."""
    for corner in study.record.prices.corners:
        preview = study.previews[corner.effects]
        small = preview.reshape(24, 2, 24, 2, 3).mean(axis=(1, 3))
        distance = delta_e_2000(small, study.reference, study.record.viewing)
        mean = distance[study.counted].mean()
        assert corner.error == pytest.approx(mean, abs=study.record.prices.floor + 0.02 * mean)
    first, last = study.record.prices.corners
    assert first.error > 1 > 20 * abs(last.error)
    assert first.error == study.record.prices.departure
    assert mi.variant() == "llvm_ad_rgb"
