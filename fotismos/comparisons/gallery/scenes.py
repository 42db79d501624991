"""The dictionaries of the built-in scenes, as ``mitsuba.load_dict`` takes them.

The figures of the chapters give every number but the field of view and the up vector; one camera
that frames the sphere serves those of chapter 8. The figures of chapter 6 have no numbers.
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

BLOCK = Path(__file__).with_name("block.obj")
"""A block of 8 vertices, 2 by 1 by 1, each side divided along one diagonal."""

HIGHLIGHT = (0.45, -0.3, 0.0)
"""Where the light of figure 6.14 is mirrored to the viewer: inside one of the two triangles."""


def looking_from(origin: Sequence[float]) -> Any:
    """Return the transform of a camera or lamp at a place that faces the origin; z is up."""
    return mi.ScalarTransform4f().look_at(origin, (0, 0, 0), (0, 0, 1))


def _camera(viewer: Sequence[float], field_of_view: float = 40.0) -> dict[str, Any]:
    return {
        "type": "perspective",
        "fov": field_of_view,
        "to_world": looking_from(viewer),
        "film": {"type": "hdrfilm", "width": 512, "height": 512, "rfilter": {"type": "box"}},
    }


def _sphere(**bsdf: Any) -> dict[str, Any]:
    return {"type": "sphere", "bsdf": {"id": "sphere material", **bsdf}}


def _ball(center: Sequence[float], **bsdf: Any) -> dict[str, Any]:
    return {"type": "sphere", "center": center, "bsdf": bsdf}


def _floor(**coefficients: float) -> dict[str, Any]:
    return {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate((0, 0, -1)).scale(6),
        "bsdf": {"type": "phong", "id": "floor material", **coefficients},
    }


def _textbook(
    viewer: Sequence[float], field_of_view: float = 40.0, /, **content: Any
) -> dict[str, Any]:
    sensor = _camera(viewer, field_of_view)
    integrator = {"type": "heuristic"}
    return {"type": "scene", "integrator": integrator, "sensor": sensor, **content}


def figure(lights: Any, viewer: Any, **coefficients: float) -> dict[str, Any]:
    """A unit sphere at the origin; lights with ``I_p0 = 1`` and ``f_att = 1``; ``I_a = 1``."""
    scene = _textbook(viewer, sphere=_sphere(type="phong", **coefficients))
    if "k_a" in coefficients:
        scene["integrator"]["ambient"] = 1.0
    for number, (position, colour) in enumerate(lights, 1):
        scene[f"light {number}"] = {
            "type": "heuristic_point",
            "position": position,
            "intensity": {"type": "rgb", "value": colour},
        }
    return scene


def emission() -> dict[str, Any]:
    """Equation 8.1: a ball that glows beside a matt one; in the model it lights nothing."""
    return _textbook(
        (0, -6, 2.5),
        38.0,
        floor=_floor(k_d=0.6),
        **{
            "matt ball": _ball((1.1, 0, 0), type="phong", id="matt", k_d=0.7),
            "glowing ball": _ball(
                (-1.1, 0, 0),
                type="phong",
                id="glowing",
                k_i={"type": "rgb", "value": (0.9, 0.55, 0.15)},
            ),
        },
        light={"type": "heuristic_directional", "direction": (1, 2, -3), "intensity": 0.4},
    )


def mirror() -> dict[str, Any]:
    """Equation 8.7: a ball that mirrors, and a matt one that it should show."""
    return _textbook(
        (0, -6, 2.5),
        38.0,
        integrator={"type": "heuristic", "ambient": 1.0},
        floor=_floor(k_a=0.1, k_d=0.5),
        **{
            "matt ball": _ball(
                (1.1, 0, 0),
                type="phong",
                id="matt",
                # A fifth of k_d, like the floor's: the sky that gives it is white.
                k_a={"type": "rgb", "value": (0.16, 0.06, 0.02)},
                k_d={"type": "rgb", "value": (0.8, 0.3, 0.1)},
            ),
            "mirror ball": _ball((-1.1, 0, 0), type="phong", id="mirror", k_s=0.9, n=float("inf")),
        },
        light={"type": "heuristic_directional", "direction": (1, 2, -3)},
    )


def fall_offs() -> dict[str, Any]:
    """Equation 6.1 and the text at 8.6: constant, linear, quadratic and clamped, from the left.

    Four beams, each along its own strip of floor, from near to far. All are alike at distance 3.
    """
    scene = _textbook((0, -8.5, 8), 42.0, floor=_floor(k_d=0.9))
    attenuations = {
        "constant": {"k0": 1.0, "k1": 0.0, "k2": 0.0},
        "linear": {"k0": 0.0, "k1": 1 / 3, "k2": 0.0},
        "quadratic": {"k0": 0.0, "k1": 0.0, "k2": 1 / 9},
        "clamped": {"k0": 0.0, "k1": 0.0, "k2": 1 / 9, "clamped": True},
    }
    for number, (name, attenuation) in enumerate(attenuations.items()):
        scene[f"{name} lamp"] = {
            "type": "heuristic_spot",
            "position": (2.6 * number - 3.9, -4, -0.3),
            "direction": (0, 1, -0.2),
            "intensity": 1.5,
            "cutoff": 9.0,
            **attenuation,
        }
    return scene


def vertex_normals() -> dict[str, Any]:
    """Equations 6.32 to 6.34: a block whose corners have one normal each, the mean of the faces'.

    A side has one or two triangles at a corner, and counts once or twice in 6.32.
    """
    return _textbook(
        (-2.2, -4, 2),
        30.0,
        block={
            "type": "obj",
            "filename": str(BLOCK),
            "bsdf": {"type": "phong", "id": "block material", "k_d": 0.7, "k_s": 0.3, "n": 20},
        },
        light={"type": "heuristic_directional", "direction": (1, 2, -1.5)},
    )


def two_intensities() -> dict[str, Any]:
    """Equations 6.6 and 6.8: a light whose highlight is white and whose diffuse light is orange."""
    return _textbook(
        (0, -4, 1),
        36.0,
        sphere=_sphere(type="phong", k_d=0.8, k_s=0.6, n=20),
        light={
            "type": "heuristic_directional",
            "direction": (2.5, 3.5, -3),
            "diffuse_intensity": {"type": "rgb", "value": (0.9, 0.4, 0.1)},
            "specular_intensity": 1.0,
        },
    )


def spot(exponent: float) -> dict[str, Any]:
    """Figure 6.5: a spot on a white floor; a small ``m`` gives a beam without a clear border.

    But the cone, of 60 degrees, cuts off the floor's corners.
    """
    return _textbook(
        (0, -6, 5),
        45.0,
        floor={
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().scale(4),
            "bsdf": {"type": "phong", "id": "floor material", "k_d": 0.9},
        },
        spot={
            "type": "heuristic_spot",
            "position": (0, 0, 3),
            "direction": (0, 0, -1),
            "cutoff": 60.0,
            "exponent": exponent,
        },
    )


def coarse_sphere() -> dict[str, Any]:
    """Figure 6.10: a sphere of few polygons, whose edges show under flat shading."""
    return _textbook(
        (0, -4, 1),
        36.0,
        integrator={"type": "heuristic", "ambient": 1.0},
        sphere=_sphere(type="phong", k_a=0.1, k_d=0.6, k_s=0.4, n=20),
        light={"type": "heuristic_point", "position": (-2.5, -3.5, 3)},
    )


def highlight_in_a_triangle() -> dict[str, Any]:
    """Figure 6.14: a highlight inside a triangle, which none of its vertices sees."""
    viewer = (0.0, -2.6, 3.0)
    # The mirror image of the viewer about the plane's normal through the highlight.
    light = tuple(2 * h - v for h, v in zip(HIGHLIGHT[:2], viewer[:2], strict=True)) + viewer[2:]
    return _textbook(
        viewer,
        square={
            "type": "rectangle",
            "bsdf": {"type": "phong", "id": "square material", "k_d": 0.3, "k_s": 0.6, "n": 60},
        },
        light={"type": "heuristic_point", "position": light},
    )


def cornell_box() -> dict[str, Any]:
    """Mitsuba's Cornell box, with independent pixels."""
    scene: dict[str, Any] = mi.cornell_box()
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
            "to_world": looking_from((-3, -4, 7)).scale(0.5),
            "emitter": {"type": "area", "radiance": 250.0},
        },
    }
    for number, (x, alpha) in enumerate(((-2.2, 0.1), (0.0, 0.2), (2.2, 0.4)), 1):
        scene[f"sphere-{number}"] = {
            "type": "sphere",
            "center": (x, 0, 0),
            "bsdf": {
                "type": "roughplastic",
                "id": f"plastic {alpha:g}",
                "alpha": alpha,
                "diffuse_reflectance": {"type": "rgb", "value": (0.1, 0.27, 0.36)},
            },
        }
    return scene


# --- Scenes whose colours need spectra -----------------------------------------------------------

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
