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
    _witness(
        "rough mirror, Beckmann, α = 0.3",
        "∫ D G / (4 cos θ) dω",
        _metal(distribution="beckmann"),
        lambda cosine: fresnel.rough_mirror(cosine, 0.3, "beckmann"),
        SMITH,
        form_error=3e-4,
    ),
    _witness(
        "rough mirror, GGX, α = 0.3",
        "∫ D G / (4 cos θ) dω",
        _metal(distribution="ggx"),
        lambda cosine: fresnel.rough_mirror(cosine, 0.3, "ggx"),
        SMITH,
        form_error=3e-4,
    ),
    _witness(
        "rough plastic, ρ = 0, α = 0.2",
        "∫ F D G / (4 cos θ) dω",
        {
            "type": "roughplastic", "diffuse_reflectance": 0.0, "alpha": 0.2,
            **COAT,
        },
        lambda cosine: fresnel.rough_plastic(cosine, 0.0, 0.2, ETA_OF_COAT),
        SMITH,
        form_error=3e-4,
    ),
    _witness(
        "rough plastic, ρ = 0.5, α = 0.2",
        "the same, and T(θ) T̄ ρ / ((1 − R) η²) of the base",
        {
            "type": "roughplastic", "diffuse_reflectance": 0.5, "alpha": 0.2,
            **COAT,
        },
        lambda cosine: fresnel.rough_plastic(cosine, 0.5, 0.2, ETA_OF_COAT),
        SMITH,
        form_error=8e-4,
    ),
)  # fmt: skip
