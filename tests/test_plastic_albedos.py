"""Albedos of plastics by their formulas, against quadratures of Mitsuba's plugins."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest

from reference.pairing import albedo
from reference.pairing.albedo import RoughPlastic

GREY = (0.6,) * 3


def drawn(seed, number):
    """Draw plastics: common ones, smooth and rough ones, faint and strong ones, and bubbles."""
    rng = np.random.default_rng(seed)
    for _ in range(number):
        alpha, ratio = [
            (10 ** rng.uniform(-2, 0.2), rng.uniform(1.02, 3)),
            (10 ** rng.uniform(-4, 3), rng.uniform(1.02, 3)),
            (10 ** rng.uniform(-2, 0.2), 1 + 10 ** rng.uniform(-4, -1)),
            (10 ** rng.uniform(-2, 0.2), rng.uniform(3, 40)),
            (10 ** rng.uniform(-2, 0.2), rng.uniform(0.4, 0.98)),
        ][rng.integers(5)]
        ext_ior = rng.uniform(1, 1.5)
        yield RoughPlastic(
            (float(rng.uniform(0, 1)),) * 3,
            float(alpha),
            float(ratio * ext_ior),
            float(ext_ior),
            tuple(map(float, rng.uniform(0, 1, 3))),
            str(rng.choice(["beckmann", "ggx"])),
            bool(rng.integers(2)),
        )


def evaluated(bsdf, alpha, flag):
    """Return the albedo of a part of a BSDF at normal incidence, by quadrature of the plugin."""
    theta, weight = albedo.nodes(alpha)
    si = dr.zeros(mi.SurfaceInteraction3f, len(theta))
    si.wi = mi.Vector3f(0, 0, 1)
    if mi.is_spectral:
        si.wavelengths = 550.0  # any will do: all spectra here are uniform
    context = mi.BSDFContext()
    context.type_mask = +flag
    wo = mi.Vector3f(mi.Float(np.sin(theta)), 0, mi.Float(np.cos(theta)))
    return float(weight @ np.array(bsdf.eval(context, si, wo)[0], float).ravel())


def assert_as_by_plugin(plastic):
    bsdf = mi.load_dict(
        {
            "type": "roughplastic",
            "diffuse_reflectance": plastic.diffuse_reflectance[0],
            "alpha": plastic.alpha,
            "int_ior": plastic.int_ior,
            "ext_ior": plastic.ext_ior,
            "distribution": plastic.distribution,
            "nonlinear": plastic.nonlinear,
        }
    )
    flags = mi.BSDFFlags.DiffuseReflection, mi.BSDFFlags.GlossyReflection
    diffuse, specular = (evaluated(bsdf, plastic.alpha, flag) for flag in flags)
    found = albedo.of_roughplastic(plastic)
    np.testing.assert_allclose(found.diffuse, diffuse, rtol=0, atol=1e-5)
    expected = specular * np.array(plastic.specular_reflectance)
    np.testing.assert_allclose(found.specular, expected, rtol=2e-5, atol=2e-7)


@pytest.mark.parametrize(
    ("variant", "number"),
    [("llvm_ad_rgb", 32), ("llvm_ad_spectral", 4), ("llvm_ad_mono", 4)],
    indirect=["variant"],
)
def test_the_albedos_of_a_roughplastic_are_what_its_plugin_reflects(variant, number):
    """The plugin's own sums, in single precision, are off by up to 1e-5."""
    for plastic in drawn(number, number):
        assert_as_by_plugin(plastic)
