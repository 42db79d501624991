"""Mitsuba plugins around the illumination model.

==========================  ==========  ==========================================================
Plugin                      Kind        What it is
==========================  ==========  ==========================================================
``phong``                   BSDF        diffuse and specular terms behind Mitsuba's BSDF interface
``heuristic``               integrator  calls the kernel :func:`heuristic.shade` where a ray hits
``heuristic_point``         emitter     point light with the chapters' attenuation
``heuristic_spot``          emitter     spot light with cone, exponent and attenuation
``heuristic_directional``   emitter     parallel light
``heuristic_glow``          emitter     emission and ambient light of a shape, for Mitsuba's own
                                        integrators; it lights nothing else
``heuristic_product`` …     textures    coefficients computed from textures
                                        (:mod:`heuristic.plugins.textures`)
``heuristic_tilt``          texture     the normal from a bump or normal map
==========================  ==========  ==========================================================
"""

import mitsuba as mi

from heuristic import llvm
from heuristic.errors import InputError
from heuristic.plugins import emitters, integrator, phong, textures

_registered: set[str] = set()


def register() -> None:
    """Register the plugins with Mitsuba for the current variant. Calling it again does nothing."""
    variant = mi.variant()
    if variant is None or "polarized" in variant or variant.startswith("scalar"):
        raise InputError(
            f"The plugins cannot be registered for the variant {variant!r}: they trace arrays"
            " of unpolarised light. Call mitsuba.set_variant with llvm_ad_rgb or llvm_ad_spectral"
            " first."
        )
    if variant in _registered:
        return
    if variant.startswith("llvm"):
        llvm.check()
    for module in (textures, phong, emitters, integrator):
        module.define()
    _registered.add(variant)
