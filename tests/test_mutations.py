"""Wrong kernels are found out: the checks of the suite fail on each of them.

A kernel is made wrong around the right one, or by a wrong term in place of a right one. The checks
are the very ones that `test_kernel` and `test_figures` run.
"""

from dataclasses import replace

import drjit as dr
import drjit.llvm.ad
import pytest

from comparisons.gallery.builtin import SCENES
from heuristic import DirectionalLight, Material, kernel, terms
from tests import checks
from tests.test_figures import everything

right = kernel.shade


def put_in_place(monkeypatch, wrong):
    monkeypatch.setattr(kernel, "shade", wrong)


def without_horizon(monkeypatch):
    """The mirror vector is the same for both sides of a surface: add the other side's highlight."""

    def wrong(position, normal, view, material, lights, ambient=0, visible=None):
        other_side = Material(k_s=material.k_s, n=material.n)
        return right(position, normal, view, material, lights, ambient, visible) + right(
            position, -normal, view, other_side, lights
        )

    put_in_place(monkeypatch, wrong)


def with_swapped_lights(monkeypatch):
    """Each light has the intensity of the one before it."""

    def wrong(position, normal, view, material, lights, ambient=0, visible=None):
        swapped = [
            replace(light, intensity=lights[place - 1].intensity)
            for place, light in enumerate(lights)
        ]
        return right(position, normal, view, material, swapped, ambient, visible)

    put_in_place(monkeypatch, wrong)


def with_the_first_light_alone(monkeypatch):
    def wrong(position, normal, view, material, lights, ambient=0, visible=None):
        return right(position, normal, view, material, lights[:1], ambient, visible)

    put_in_place(monkeypatch, wrong)


def with_half_vector(monkeypatch):
    """``(N.H)^n`` in place of ``(R.V)^n``."""

    def wrong(position, normal, view, material, lights, ambient=0, visible=None):
        colour = right(position, normal, view, replace(material, k_s=0), lights, ambient, visible)
        vector = type(position)
        for light in lights:
            if isinstance(light, DirectionalLight):
                toward = dr.normalize(-vector(light.direction))
            else:
                toward = dr.normalize(vector(light.position) - position)
            half = dr.normalize(toward + dr.normalize(view))
            arriving = right(position, toward, view, Material(k_d=1), [light])
            lobe = terms.power(dr.dot(dr.normalize(normal), half), material.n)
            above = dr.dot(normal, toward) > 0
            colour = colour + material.k_s * arriving * dr.select(above, lobe, 0)
        return colour

    put_in_place(monkeypatch, wrong)


def without_attenuation(monkeypatch):
    def wrong(distance, k0, k1, k2, intensity=1, inverse=None):
        return intensity

    monkeypatch.setattr(terms, "attenuation", wrong)


def without_clamp(monkeypatch):
    monkeypatch.setattr(terms, "clamped_attenuation", terms.attenuation)


def without_cone(monkeypatch):
    monkeypatch.setattr(terms, "spot_cone", lambda cos_axis, cos_cutoff: 1.0)


def with_a_cosine_on_the_highlight(monkeypatch):
    specular = terms.specular
    monkeypatch.setattr(
        terms, "specular", lambda intensity, k_s, cosine, n: specular(intensity, k_s, cosine, n + 1)
    )


def with_attenuated_emission(monkeypatch):
    monkeypatch.setattr(terms, "emission", lambda k_i: 0.9 * k_i)


MUTATIONS = [
    without_horizon,
    with_swapped_lights,
    with_the_first_light_alone,
    with_half_vector,
    without_attenuation,
    without_clamp,
    without_cone,
    with_a_cosine_on_the_highlight,
    with_attenuated_emission,
]
# Those that are wrong in the kernel alone, so that the plugins, which share its terms, tell too.
OF_THE_KERNEL = [without_horizon, with_swapped_lights, with_the_first_light_alone, with_half_vector]


def name_of(mutation):
    return mutation.__name__


@pytest.mark.guarantee("kernel", "Kernels that are wrong on purpose are detected.")
@pytest.mark.parametrize("mutate", MUTATIONS, ids=name_of)
def test_the_oracle_finds_a_wrong_kernel(monkeypatch, mutate):
    mutate(monkeypatch)
    with pytest.raises(AssertionError, match="values are off"):
        checks.check_kernel(drjit.llvm.ad.Array3f, 1e-5)


@pytest.mark.parametrize("mutate", MUTATIONS, ids=name_of)
def test_the_oracle_finds_a_wrong_kernel_in_a_picture(rgb, monkeypatch, mutate):
    mutate(monkeypatch)
    with pytest.raises(AssertionError, match="values are off"):
        checks.check_figure(everything())


@pytest.mark.parametrize("mutate", OF_THE_KERNEL, ids=name_of)
def test_mitsubas_direct_finds_a_wrong_kernel(rgb, monkeypatch, mutate):
    mutate(monkeypatch)
    with pytest.raises(AssertionError, match="values are off"):
        checks.check_against_direct(everything())


@pytest.mark.parametrize("mutate", [with_swapped_lights, with_half_vector], ids=name_of)
def test_a_figure_of_the_chapter_finds_a_wrong_kernel(rgb, monkeypatch, mutate):
    """With viewer and light on one side and ``f_att = 1``, the figures cannot show the others."""
    mutate(monkeypatch)
    with pytest.raises(AssertionError, match="values are off"):
        checks.check_figure(SCENES["fig-8-11-n9"].make())


def test_the_checks_pass_on_the_kernel_as_it_is(rgb):
    checks.check_kernel(drjit.llvm.ad.Array3f, 1e-5)
    checks.check_figure(everything())
    checks.check_against_direct(everything())
