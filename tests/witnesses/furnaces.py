"""Spheres in a sky of radiance 1, seen without perspective: each angle shows the albedo for it."""

from collections.abc import Callable
from functools import partial

import numpy as np

from tests.witnesses import fresnel, stage
from tests.witnesses.witness import Witness

HALF = 0.7
"""Of the camera's width, in radii: angles up to 82 degrees from the normal, in the corners."""

ETA, K = 0.2, 3.0
ETA_OF_COAT = 1.5
COAT = {"int_ior": ETA_OF_COAT, "ext_ior": 1.0}


def _furnace(bsdf):
    def make():
        sphere = {"type": "sphere", "bsdf": bsdf}
        sky = {"type": "constant", "radiance": 1.0}
        camera = stage.camera((0, 0, 3), (0, 0, 0), (0, 1, 0), HALF)
        return stage.scene(camera, sphere=sphere, sky=sky)

    return make


def _witness(
    name: str,
    form: str,
    bsdf: dict,
    albedo: Callable | float,
    source: str = "energy",
    **more: float,
) -> Witness:
    def radiance(x, y):
        if not callable(albedo):
            return np.full_like(x, albedo)
        return albedo(np.sqrt(1 - HALF**2 * (x**2 + y**2)))

    return Witness(f"furnace: {name}", form, source, _furnace(bsdf), radiance, **more)


def _metal(**rest):
    return {"type": "roughconductor", "material": "none", "alpha": 0.3, **rest}


SMITH = "quadrature of microfacets (Walter et al. 2007)"

WITNESSES = (
    _witness("diffuse", "ρ", stage.diffuse(0.5), 0.5),
    _witness("perfect mirror", "1", {"type": "conductor", "material": "none"}, 1.0),
    _witness(
        "conductor",
        "F(θ)",
        {"type": "conductor", "eta": ETA, "k": K},
        lambda cosine: fresnel.conductor(cosine, ETA, K),
        "Fresnel's equations",
    ),
    _witness("glass", "1", {"type": "dielectric", **COAT}, 1.0),
    _witness("thin glass", "1", {"type": "thindielectric", **COAT}, 1.0),
    _witness("nothing", "1", {"type": "null"}, 1.0),
    *(
        _witness(
            f"smooth plastic, ρ = 0.5{', nonlinear' if nonlinear else ''}",
            f"F + (1 − F) {'ρ (1 − R) / (1 − ρ R)' if nonlinear else 'ρ'}",
            {"type": "plastic", "diffuse_reflectance": 0.5, "nonlinear": nonlinear, **COAT},
            partial(fresnel.smooth_plastic, rho=0.5, eta=ETA_OF_COAT, nonlinear=nonlinear),
            "Fresnel's equations",
            form_error=3e-4,
        )
        for nonlinear in (False, True)
    ),
    *(
        _witness(
            f"rough mirror, {name}, α = 0.3",
            "∫ D G / (4 cos θ) dω",
            _metal(distribution=name.lower()),
            partial(fresnel.rough_mirror, alpha=0.3, distribution=name.lower()),
            SMITH,
            form_error=3e-4,
        )
        for name in ("Beckmann", "GGX")
    ),
    *(
        _witness(
            f"rough plastic, ρ = {albedo:g}, α = 0.2",
            formula,
            {"type": "roughplastic", "diffuse_reflectance": albedo, "alpha": 0.2, **COAT},
            partial(fresnel.rough_plastic, rho=albedo, alpha=0.2, eta=ETA_OF_COAT),
            SMITH,
            form_error=error,
        )
        for albedo, error, formula in (
            (0.0, 3e-4, "∫ F D G / (4 cos θ) dω"),
            (0.5, 8e-4, "the same, and T(θ) T̄ ρ / ((1 − R) η²) of the base"),
        )
    ),
)  # fmt: skip
