"""The built-in scenes whose colours need spectra: a lamp of one line, and a metameric pair."""

from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.comparisons.gallery.scenes import looking_from

WAVELENGTHS = np.arange(380.0, 721.0, 5.0)
"""Nanometres."""

SODIUM = 589.3
"""The mean of the sodium doublet, nanometres."""


def narrow_band_lamp() -> dict[str, Any]:
    """Four spheres, red, green, blue and white, under a lamp of a single spectral line.

    Under one wavelength every surface has the lamp's colour and differs in lightness alone. RGB
    multiplies the lamp's three numbers by the surface's, and keeps the surfaces' hues.
    """
    line = np.exp(-(((WAVELENGTHS - SODIUM) / 6.0) ** 2))
    colours = {
        "red": (0.63, 0.06, 0.04),
        "green": (0.06, 0.45, 0.10),
        "blue": (0.05, 0.08, 0.50),
        "white": (0.80, 0.80, 0.80),
    }
    spheres = {name: {"type": "rgb", "value": value} for name, value in colours.items()}
    return _row(spheres, _spectrum(_at_luminance(line, 70.0)))


def metameric_pair() -> dict[str, Any]:
    """Two spheres of the same colour in daylight, under an incandescent lamp (CIE A).

    Their reflectances differ by the largest admissible multiple of a metameric black of D65: a
    spectrum that gives X = Y = Z = 0 under that light. RGB, whose numbers are for daylight, cannot
    tell them apart.
    """
    # A cosine less its projection on the three weights, D65 times the colour-matching functions.
    weights = (np.array(mi.cie_d65(mi.Float(WAVELENGTHS))) * _colour_matching()).T
    plain = 0.45 - 0.12 * np.cos(2 * np.pi * (WAVELENGTHS - 380) / 340)
    wave = np.cos(2 * np.pi * (WAVELENGTHS - 560) / 150)
    black = wave - weights @ np.linalg.lstsq(weights, wave, rcond=None)[0]
    # How much of it keeps each reflectance in 0.05 to 0.95: the least value serves all.
    room = np.where(black > 0, (0.95 - plain), (plain - 0.05)) / np.maximum(np.abs(black), 1e-9)
    surfaces = {"plain": _spectrum(plain), "metamer": _spectrum(plain + room.min() * black)}
    return _row(surfaces, _spectrum(_at_luminance(_incandescent(), 70.0)))


def _colour_matching() -> Any:
    """CIE 1931 colour-matching functions at :data:`WAVELENGTHS`, (3, n)."""
    return np.array(mi.cie1931_xyz(mi.Float(WAVELENGTHS)))


def _incandescent() -> Any:
    """CIE illuminant A: Planck's law at 2856 K, relative."""
    metres = WAVELENGTHS * 1e-9
    return metres**-5 / np.expm1(1.435e-2 / (metres * 2856))


def _at_luminance(spectrum: Any, luminance: float) -> Any:
    """Scale a spectrum to a given Y, by Mitsuba's normalisation."""
    y = np.sum(spectrum * _colour_matching()[1]) * (WAVELENGTHS[1] - WAVELENGTHS[0])
    return spectrum * luminance / (y * mi.MI_CIE_Y_NORMALIZATION)


def _spectrum(values: Any) -> dict[str, Any]:
    pairs = list(zip(WAVELENGTHS.tolist(), np.asarray(values).tolist(), strict=True))
    return {"type": "spectrum", "value": pairs}


def _row(surfaces: Any, intensity: Any) -> dict[str, Any]:
    """Diffuse spheres side by side under one point light, which makes the pair exact."""
    count = len(surfaces)
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "sensor": {
            "type": "perspective",
            "fov": 30.0,
            "fov_axis": "x",
            "to_world": looking_from((0, -4.4 * count, 0)),
            "film": {
                "type": "hdrfilm",
                "width": 640,
                "height": 640 // count + 40,
                "rfilter": {"type": "box"},
            },
        },
        "lamp": {"type": "point", "position": (0, -6, 5), "intensity": intensity},
    }
    for number, (name, reflectance) in enumerate(surfaces.items()):
        scene[name] = {
            "type": "sphere",
            "center": ((number - (count - 1) / 2) * 2.3, 0, 0),
            "bsdf": {"type": "diffuse", "id": f"{name} surface", "reflectance": reflectance},
        }
    return scene
