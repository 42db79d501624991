"""Wrong kernels are found out: the checks of the suite fail on each of them.

A kernel is made wrong around the right one, or by a wrong term in place of a right one. The checks
are the very ones that `test_kernel` and `test_figures` run.
"""

from dataclasses import replace

import drjit as dr
import drjit.llvm.ad
import pytest

from fotismos.heuristic import DirectionalLight, Material, kernel, terms
from tests.shared import checks
from tests.shared.checks import everything

right, specular = kernel.shade, terms.specular


def without_horizon(position, normal, view, material, lights, ambient=0, visible=None):
    """The mirror vector is the same for both sides of a surface: add the other side's highlight."""
    other_side = Material(k_s=material.k_s, n=material.n)
    colour = right(position, normal, view, material, lights, ambient, visible)
    return colour + right(position, -normal, view, other_side, lights)


def with_swapped_lights(position, normal, view, material, lights, ambient=0, visible=None):
    """Each light has the intensity of the one before it."""
    swapped = [
        replace(light, intensity=lights[place - 1].intensity) for place, light in enumerate(lights)
    ]
    return right(position, normal, view, material, swapped, ambient, visible)


def with_swapped_intensities(position, normal, view, material, lights, ambient=0, visible=None):
    """``L_d`` and ``L_s`` of each light are mixed up."""
    swapped = [
        replace(
            light,
            diffuse_intensity=light.intensities[-1],
            specular_intensity=light.intensities[0],
        )
        for light in lights
    ]
    return right(position, normal, view, material, swapped, ambient, visible)


def with_half_vector(position, normal, view, material, lights, ambient=0, visible=None):
    """``(N.H)^n`` in place of ``(R.V)^n``."""
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


# Wrong in the kernel alone, so that the plugins, which share its terms, tell too.
KERNELS = [
    without_horizon,
    with_swapped_lights,
    with_swapped_intensities,
    with_half_vector,
]


def no_attenuation(distance, k0, k1, k2, intensity=1, inverse=None):
    return intensity


WRONG_TERMS = {
    "attenuation": no_attenuation,
    "clamped_attenuation": terms.attenuation,
    "spot_cone": lambda cos_axis, cos_cutoff: 1.0,
    "specular": lambda intensity, k_s, cosine, n: specular(intensity, k_s, cosine, n + 1),
    "emission": lambda k_i: 0.9 * k_i,
}


def require_found_out(check, *given):
    with pytest.raises(AssertionError, match="values are off"):
        check(*given)


@pytest.mark.guarantee("kernel", "Kernels that are wrong on purpose are detected.")
@pytest.mark.parametrize("wrong", [*KERNELS, *WRONG_TERMS])
def test_the_oracle_finds_a_wrong_kernel(rgb, monkeypatch, wrong):
    """In random points and in a picture; by Mitsuba's ``direct`` too what is wrong in it alone."""
    if wrong in KERNELS:
        monkeypatch.setattr(kernel, "shade", wrong)
        require_found_out(checks.check_against_direct, everything())
    else:
        monkeypatch.setattr(terms, wrong, WRONG_TERMS[wrong])
    require_found_out(checks.check_kernel, drjit.llvm.ad.Array3f, 1e-5)
    require_found_out(checks.check_figure, everything())
