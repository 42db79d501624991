"""Mitsuba plugins around the illumination model.

==========================  ==========  ==========================================================
Plugin                      Kind        What it is
==========================  ==========  ==========================================================
``phong``                   BSDF        diffuse and specular terms behind Mitsuba's BSDF interface
``heuristic``               integrator  calls the kernel :func:`fotismos.heuristic.shade` where a
                                        ray hits
``heuristic_point``         emitter     point light with the chapters' attenuation
``heuristic_spot``          emitter     spot light with cone, exponent and attenuation
``heuristic_directional``   emitter     parallel light
``heuristic_glow``          emitter     emission and ambient light of a shape, for Mitsuba's own
                                        integrators; it lights nothing else
``heuristic_product`` …     textures    coefficients computed from textures
                                        (:mod:`fotismos.heuristic.plugins.textures`)
``heuristic_tilt``          texture     the normal from a bump or normal map
==========================  ==========  ==========================================================

Each module defines its classes again for each variant, when a scene first has one of them.
"""

from functools import cache, partial
from importlib import import_module
from typing import Any

import mitsuba as mi

from fotismos.heuristic import lights, llvm
from fotismos.heuristic.errors import InputError

TEXTURES = ("product", "share", "rest", "sum", "blend", "sides", "exponent", "interior", "tilt")
PLUGINS = {"phong": ("bsdf", "phong"), "heuristic": ("integrator", "integrator")}
PLUGINS |= dict.fromkeys([*lights.PLUGINS, "heuristic_glow"], ("emitter", "emitters"))
PLUGINS |= {f"heuristic_{name}": ("texture", "textures") for name in TEXTURES}
"""Kind and module of each plugin."""

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
    for name, (kind, module) in PLUGINS.items():
        getattr(mi, f"register_{kind}")(name, partial(_plugin, name, module))
    _registered.add(variant)


def _plugin(name: str, module: str, props: Any) -> Any:
    return _classes(module, mi.variant())[name](props)


@cache
def _classes(module: str, variant: str) -> Any:
    return import_module(f"fotismos.heuristic.plugins.{module}").define()
