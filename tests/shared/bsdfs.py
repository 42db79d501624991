"""Directions, grids of them, and the χ² test of a BSDF."""

import drjit as dr
import mitsuba as mi
import numpy as np
import pytest


def direction(degrees, azimuth=0.0):
    theta, phi = np.deg2rad([degrees, azimuth])
    return [
        float(np.sin(theta) * np.cos(phi)),
        float(np.sin(theta) * np.sin(phi)),
        float(np.cos(theta)),
    ]


def interaction(wi, count=1):
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = mi.Vector3f(wi)
    return si


@pytest.fixture(autouse=True)
def elsewhere(monkeypatch, tmp_path):
    """Mitsuba's χ² test writes a file into the current folder when it rejects."""
    monkeypatch.chdir(tmp_path)


def chi2(values, wi, context=None):
    sample, pdf = mi.chi2.BSDFAdapter("phong", phong(**values), wi=wi, ctx=context)

    def reflected(numbers):
        wo, weight = sample(numbers)
        return wo, dr.select(dr.norm(wo + mi.Vector3f(wi)) > 0, weight, 0)  # what passes has no pdf

    return mi.chi2.ChiSquareTest(
        domain=mi.chi2.SphericalDomain(),
        sample_func=reflected,
        pdf_func=pdf,
        sample_dim=3,
        sample_count=200_000,
        res=101,
        ires=16,
    )


def spherical_grid(size=500):
    """Directions over the sphere and the solid angle of each, midpoints in cosine and azimuth."""
    cosine = (np.arange(2 * size) + 0.5) / size - 1
    azimuth = (np.arange(2 * size) + 0.5) * np.pi / size
    z, phi = (axis.ravel() for axis in np.meshgrid(cosine, azimuth))
    sine = np.sqrt(1 - z**2)
    wo = mi.Vector3f(mi.Float(sine * np.cos(phi)), mi.Float(sine * np.sin(phi)), mi.Float(z))
    return wo, np.pi / size**2


def phong(**values):
    return {"type": "phong", **values}
