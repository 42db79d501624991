"""The chapters' figures: kernel against oracle, and kernel against Mitsuba's ``direct``.

The two ways that the model runs by share the terms and nothing else: frames, lights, visibility and
sums are Mitsuba's in one and the kernel's in the other.
"""

import mitsuba as mi
import pytest

from fotismos.comparisons.gallery.builtin import SCENES, THREE_LIGHTS, VIEWER_C
from tests.shared import checks
from tests.shared.checks import everything

FIGURES = [name for name in SCENES if name.startswith("fig-8")]


def test_all_fifteen_figures_are_there():
    """8.5 to 8.7 and 8.8 in three pictures each, 8.9, and 8.11 in both readings."""
    letters = [f"fig-8-{figure}{letter}" for figure in (5, 6, 7, 8) for letter in "abc"]
    assert [*letters, "fig-8-9", "fig-8-11-n9", "fig-8-11-n3"] == FIGURES


@pytest.mark.guarantee(
    "kernel", "The kernel is within 1e-5 of the equations in float64, on every figure."
)
@pytest.mark.parametrize("name", [*FIGURES, "two-intensities"])
def test_the_kernel_agrees_with_the_oracle_everywhere(rgb, name):
    checks.check_figure(SCENES[name].make())


@pytest.mark.guarantee(
    "kernel", "Kernel and `phong` plugin agree to 1e-5, on every pixel of every figure."
)
@pytest.mark.parametrize("name", [*FIGURES, "two-intensities"])
def test_the_kernel_agrees_with_mitsubas_direct_on_every_pixel(rgb, name):
    checks.check_against_direct(SCENES[name].make())


def test_every_light_and_colour_agrees_with_the_oracle(rgb):
    checks.check_figure(everything())


@pytest.mark.parametrize("variant", ["llvm_ad_rgb", "llvm_ad_spectral"], indirect=True)
def test_every_light_and_colour_agrees_with_mitsubas_direct(variant):
    checks.check_against_direct(everything())


@pytest.mark.parametrize("twosided", [False, True])
def test_a_surface_seen_from_behind_agrees_with_mitsubas_direct(rgb, twosided):
    """One-sided it is black in both, two-sided it is lit from the viewer's side in both."""
    scene = everything()
    scene["sphere"] |= {"flip_normals": True}
    scene["sphere"]["bsdf"] |= {"twosided": twosided, "k_i": 0.0, "k_a": 0.0}
    if twosided:
        checks.check_against_direct(scene)
    else:
        assert not checks.render(checks.with_film(scene, 32, 4), 4, 0).any()


def test_the_figures_show_what_the_chapter_says(rgb):
    """Unit sphere, white lights of intensity 1 without attenuation, the viewer at its place."""
    scene = SCENES["fig-8-11-n9"].make()
    _, lights, ambient, viewer = checks.described(scene)
    assert [(light.position, light.intensity) for light in lights] == list(THREE_LIGHTS)
    assert all(light.attenuation == (1, 0, 0) for light in lights)
    assert ambient == 1
    assert tuple(viewer) == VIEWER_C
    sphere = mi.load_dict(scene).shapes()[0]
    assert tuple(sphere.bbox().min) == (-1, -1, -1)
    assert tuple(sphere.bbox().max) == (1, 1, 1)
