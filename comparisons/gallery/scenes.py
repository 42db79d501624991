"""The dictionaries of the built-in scenes, as ``mitsuba.load_dict`` takes them.

The figures of the chapters give every number but the field of view and the up vector; one camera
that frames the sphere serves those of chapter 8. The figures of chapter 6 have no numbers.
"""

from functools import lru_cache
from typing import Any

import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

HIGHLIGHT = (0.45, -0.3, 0.0)
"""Where the light of figure 6.14 is mirrored to the viewer: inside one of the two triangles."""

WAVELENGTHS = np.arange(380.0, 721.0, 5.0)
"""Nanometres."""

SODIUM = 589.3
"""The mean of the sodium doublet, nanometres."""


def _looking_from(place):
    return mi.ScalarTransform4f().look_at(place, (0, 0, 0), (0, 0, 1))


def _camera(viewer, field_of_view=40.0):
    return {
        "type": "perspective",
        "fov": field_of_view,
        "to_world": _looking_from(viewer),
        "film": {"type": "hdrfilm", "width": 512, "height": 512, "rfilter": {"type": "box"}},
    }


def _sphere(**bsdf):
    return {"type": "sphere", "bsdf": {"id": "sphere material", **bsdf}}


def figure(lights: Any, viewer: Any, **coefficients: float) -> dict[str, Any]:
    """A unit sphere at the origin; lights with ``I_p0 = 1`` and ``f_att = 1``; ``I_a = 1``."""
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": _camera(viewer),
        "sphere": _sphere(type="phong", **coefficients),
    }
    if "k_a" in coefficients:
        scene["integrator"]["ambient"] = 1.0
    for number, (position, colour) in enumerate(lights, 1):
        scene[f"light {number}"] = {
            "type": "heuristic_point",
            "position": position,
            "intensity": {"type": "rgb", "value": colour},
        }
    return scene


def spot(exponent: float) -> dict[str, Any]:
    """Figure 6.5: a spot on a white floor; a small ``m`` gives a beam without a clear border."""
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": _camera((0, -6, 5), 45.0),
        "floor": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().scale(4),
            "bsdf": {"type": "phong", "id": "floor material", "k_d": 0.9},
        },
        "spot": {
            "type": "heuristic_spot",
            "position": (0, 0, 3),
            "direction": (0, 0, -1),
            "cutoff": 60.0,
            "exponent": exponent,
        },
    }


def coarse_sphere() -> dict[str, Any]:
    """Figure 6.10: a sphere of few polygons, whose edges show under flat shading."""
    return {
        "type": "scene",
        "integrator": {"type": "heuristic", "ambient": 1.0},
        "sensor": _camera((0, -4, 1), 36.0),
        "sphere": _sphere(type="phong", k_a=0.1, k_d=0.6, k_s=0.4, n=20),
        "light": {"type": "heuristic_point", "position": (-2.5, -3.5, 3)},
    }


def highlight_in_a_triangle() -> dict[str, Any]:
    """Figure 6.14: a highlight inside a triangle, which none of its vertices sees."""
    viewer = (0.0, -2.6, 3.0)
    # The mirror image of the viewer about the plane's normal through the highlight.
    light = tuple(2 * h - v for h, v in zip(HIGHLIGHT[:2], viewer[:2], strict=True)) + viewer[2:]
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": _camera(viewer, 40.0),
        "square": {
            "type": "rectangle",
            "bsdf": {"type": "phong", "id": "square material", "k_d": 0.3, "k_s": 0.6, "n": 60},
        },
        "light": {"type": "heuristic_point", "position": light},
    }


def cornell_box() -> dict[str, Any]:
    """Mitsuba's Cornell box, with independent pixels."""
    scene = mi.cornell_box()
    scene["sensor"]["film"]["rfilter"] = {"type": "box"}
    return scene


def lambert_sphere() -> dict[str, Any]:
    """A diffuse sphere under a point light: the pair is exact."""
    return {
        "type": "scene",
        "integrator": {"type": "path"},
        "sensor": _camera((-3, 0, 1)),
        "sphere": _sphere(type="diffuse", reflectance={"type": "rgb", "value": (0.7, 0.45, 0.2)}),
        "light": {"type": "point", "position": (-4.24, -1, 3), "intensity": 60.0},
    }


def plastic_spheres() -> dict[str, Any]:
    """Three rough plastic spheres, from sharp to dull, on a floor under a small square lamp."""
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 8},
        "sensor": _camera((0, -9, 4), 38.0),
        "floor": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate((0, 0, -1)).scale(12),
            "bsdf": {"type": "diffuse", "id": "floor material", "reflectance": 0.5},
        },
        "lamp": {
            "type": "rectangle",
            "to_world": _looking_from((-3, -4, 7)).scale(0.5),
            "emitter": {"type": "area", "radiance": 250.0},
        },
    }
    for number, (place, alpha) in enumerate(((-2.2, 0.1), (0.0, 0.2), (2.2, 0.4)), 1):
        scene[f"sphere-{number}"] = {
            "type": "sphere",
            "center": (place, 0, 0),
            "bsdf": {
                "type": "roughplastic",
                "id": f"plastic {alpha:g}",
                "alpha": alpha,
                "diffuse_reflectance": {"type": "rgb", "value": (0.1, 0.27, 0.36)},
            },
        }
    return scene


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

    Their reflectances differ by a metameric black of D65: a spectrum that gives X = Y = Z = 0 under
    that light. RGB, whose numbers are for daylight, cannot tell them apart.
    """
    plain, other = metamers()
    surfaces = {"plain": _spectrum(plain), "metamer": _spectrum(other)}
    return _row(surfaces, _spectrum(_at_luminance(_incandescent(), 70.0)))


@lru_cache
def metamers() -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return two reflectances at :data:`WAVELENGTHS` that have the same colour under D65.

    The second is the first plus the largest admissible multiple of the metameric black: a cosine
    less its projection on the three weights (D65 times the colour-matching functions).
    """
    weights = (_d65() * _colour_matching()).T
    plain = 0.45 - 0.12 * np.cos(2 * np.pi * (WAVELENGTHS - 380) / 340)
    wave = np.cos(2 * np.pi * (WAVELENGTHS - 560) / 150)
    black = wave - weights @ np.linalg.lstsq(weights, wave, rcond=None)[0]
    room = np.where(black > 0, (0.95 - plain), (plain - 0.05)) / np.maximum(np.abs(black), 1e-9)
    return plain, plain + room.min() * black


def _colour_matching():
    """CIE 1931 colour-matching functions at :data:`WAVELENGTHS`, (3, n)."""
    return np.array(mi.cie1931_xyz(mi.Float(WAVELENGTHS)))


def _d65():
    return np.array(mi.cie_d65(mi.Float(WAVELENGTHS)))


def _incandescent():
    """CIE illuminant A: Planck's law at 2856 K, relative."""
    metres = WAVELENGTHS * 1e-9
    return metres**-5 / np.expm1(1.435e-2 / (metres * 2856))


def _at_luminance(spectrum, luminance):
    """Scale a spectrum to a given Y, by Mitsuba's normalisation."""
    y = np.sum(spectrum * _colour_matching()[1]) * (WAVELENGTHS[1] - WAVELENGTHS[0])
    return spectrum * luminance / (y * mi.MI_CIE_Y_NORMALIZATION)


def _spectrum(values):
    pairs = list(zip(WAVELENGTHS.tolist(), np.asarray(values).tolist(), strict=True))
    return {"type": "spectrum", "value": pairs}


def _row(surfaces, intensity):
    """Diffuse spheres side by side under one point light, which makes the pair exact."""
    count = len(surfaces)
    scene = {
        "type": "scene",
        "integrator": {"type": "path", "max_depth": 2},
        "sensor": {
            "type": "perspective",
            "fov": 30.0,
            "fov_axis": "x",
            "to_world": _looking_from((0, -4.4 * count, 0)),
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
