"""Lobes of engines in docs/shaders: their audits against a quadrature in float64, by formulas.

The quadrature shares neither code nor nodes with the audit, and evaluates f, not pi f cos.
"""

from functools import partial
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from fotismos.comparisons.audit import furnace
from fotismos.comparisons.audit.subjects import ShadingSubject
from fotismos.heuristic import heuristics
from tests.shared.quadrature import dot, integral

SHADERS = Path(__file__).parents[2] / "docs/shaders"
DIELECTRIC = 0.04
METALLIC = {"glossy": 0.0, "mixed": 0.5, "metal": 1.0}
GRID = (120, 90)


def schlick(f0, cosine):
    return f0 + (min(49.5 * f0, 1) - f0) * (1 - cosine) ** 5


def ggx(alpha, f0, light, view, half):
    """Walter et al. (2007), with height-correlated masking by Smith's Lambda (Heitz 2014)."""
    top = half[2]
    distribution = alpha**2 / (np.pi * (top**2 * (alpha**2 - 1) + 1) ** 2)
    hidden = [(np.sqrt(1 + alpha**2 * (1 / z**2 - 1)) - 1) / 2 for z in (light[2], view[2])]
    fresnel = schlick(f0, dot(light, half))
    return distribution * fresnel / (1 + sum(hidden)) / (4 * light[2] * view[2])


def karis(roughness, cosine):
    near = np.minimum((1 - roughness) ** 2, 2 ** (-9.28 * cosine)) * (1 - roughness)
    near += 0.0425 - 0.0275 * roughness
    bias = -0.04 + 0.022 * roughness + 1.04 * near
    return 1.04 - 0.572 * roughness - 1.04 * near, np.maximum(bias, 5e-5)


def mesh_phong(alpha, f0, base, light, view, half):
    n = 2 / alpha**2 - 2
    x = dot(view, half)
    fresnel = f0 + (1 - f0) * 2 ** ((-5.55473 * x - 6.98316) * x)
    return base / np.pi + fresnel * (n + 2) / (2 * np.pi) * half[2] ** n / 4


def filament(alpha, f0, base, light, view, half):
    return base / np.pi + ggx(alpha, f0, light, view, half)


def bevy(alpha, f0, base, light, view, half):
    f90 = 0.5 + 2 * alpha * dot(light, half) ** 2
    burley = np.prod([1 + (f90 - 1) * (1 - z) ** 5 for z in (light[2], view[2])], axis=0)
    scale, _ = karis(np.sqrt(alpha), view[2])
    return base * burley / np.pi + ggx(alpha, f0, light, view, half) * (1 + f0 * (1 / scale - 1))


def layered(alpha, f0, base, light, view, half):
    scale, bias = karis(np.sqrt(alpha), view[2])
    left = 1 - np.minimum(f0 * scale + bias, 1)
    return left * base / np.pi + ggx(alpha, f0, light, view, half)


FORMS = {
    "mesh_phong.py": mesh_phong,
    "standard_material.py:filament": filament,
    "standard_material.py:bevy": bevy,
    "standard_material.py:layered": layered,
}


def exchanged(f):
    """Return a form with light and viewer exchanged."""
    return lambda view, light, half: f(light, view, half)


@pytest.mark.thorough
def test_albedos_are_those_of_an_independent_quadrature(rgb):
    for name, form in FORMS.items():
        subject = ShadingSubject(heuristics.named(str(SHADERS / name)), {})
        for kind, alpha in product(METALLIC, (0.3, 1.0)):
            base = 1 - METALLIC[kind]
            f0 = base * DIELECTRIC + METALLIC[kind]
            response = partial(subject.response, f"{kind}, alpha {alpha:g}")
            for degrees in (0.0, 60.0, 85.0):
                reflected = partial(form, alpha, f0, base)
                expected = integral(reflected, degrees), integral(exchanged(reflected), degrees)
                found = [part(response, degrees, GRID) for part in (furnace.returned, furnace.seen)]
                np.testing.assert_allclose(found, expected, rtol=1e-3, err_msg=name)


def test_single_scattering_loses_what_engines_publish():
    """The table of three.js#33983: roughness, N.V, and what a white metal shows of radiance 1."""
    for roughness, cosine, shown in (
        (0.5, 0.5, 0.86),
        (0.75, 0.5, 0.66),
        (1, 0.5, 0.45),
        (1, 1, 0.31),
    ):
        degrees = float(np.rad2deg(np.arccos(cosine)))
        found = furnace.single_scattering(roughness**2, degrees)
        assert found == pytest.approx(shown, abs=0.006)
        assert found == pytest.approx(integral(partial(ggx, roughness**2, 1.0), degrees), rel=1e-3)
