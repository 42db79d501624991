"""The hard cases of the reference: where Mitsuba, or a reading of it, would be at fault.

There are two kinds. Where Mitsuba is right but its formula breaks as printed, ours is the
reference's own value, compared with the formula in extended precision. Where Mitsuba itself is at
fault, its error is attributed to the heuristic: the exact value over the reference's, which should
be 1. Naively every pixel counts; ours omits the pixels that :mod:`comparisons.departure.limits`
marks.

All of them need a Mitsuba variant and the plugins.
"""

from collections.abc import Callable
from functools import cache

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

from comparisons.departure.limits import LOST, Lights, Surfaces, find
from comparisons.hard import microfacets, terminators
from comparisons.hard.cases import HardCase, quietly
from comparisons.hard.furnace import evaluate
from comparisons.hard.textbook import EXACT, NAIVE
from reference.pairing import albedo
from reference.pairing.albedo import RoughPlastic

WHITE = (1.0, 1.0, 1.0)
SHARP = np.repeat(np.logspace(-4, 0, 9), 5).astype(np.float32)
ANGLES = np.tile([0, 30, 60, 85, 89.9], 9)
TOO_SHARP = np.logspace(-6, -3.5, 11).astype(np.float32)
ROUGH = (0.01, 0.05, 0.1, 0.2, 0.5, 1.0)
INDICES = (1.3, 1.5, 2.0, 3.0, 5.0, 10.0, 100.0, 1e3)
NEAR_1 = (1.0001, 1.001, 1.01)

Measured = tuple[NDArray, NDArray, NDArray]
"""Exact values, the reference's, and the mask of the pixels where it is at fault."""


def attributed(exact: ArrayLike, reference: NDArray, at_fault: NDArray) -> NDArray:
    """Return the ratio of exact to reference, and 1 where the reference is at fault."""
    return np.where(at_fault, 1, np.asarray(exact, float) / reference)


def _limits(alpha, furnace, mean, error):
    """Return the limits of a row of pixels, seen and lit from above."""
    row = np.broadcast_to([0.0, 0.0, 1.0], (1, len(alpha), 3))
    surfaces = Surfaces(
        np.ones((1, len(alpha)), bool), np.array([alpha], float), np.array([furnace], float),
        0 * row, row, row, row, Lights(np.empty((0, 3)), row[0, :1]),
    )  # fmt: skip
    return find(surfaces, mean, error)


def _row(values):
    return np.repeat(np.asarray(values, float)[None, :, None], 3, axis=2)


# --- Roughness -------------------------------------------------------------------------------


def _directions(alpha, degrees):
    """Return light and view, the view half a lobe off the mirror direction; (N, 3) each."""
    light, view = np.deg2rad(degrees), np.deg2rad(degrees) - alpha / 2
    return (
        np.stack([sign * np.sin(angle), 0 * angle, np.cos(angle)], axis=1).astype(np.float32)
        for sign, angle in ((1, light), (-1, view))
    )


def _by_mitsuba(alpha, light, view):
    """Return the specular part of ``roughplastic`` of IOR 1.5, one roughness per row."""
    values = np.empty(len(alpha))
    for a in np.unique(alpha):
        bsdf, rows = mi.load_dict(_plastic(a, diffuse_reflectance=0.0)), alpha == a
        values[rows] = evaluate(bsdf, view[rows].T, light[rows].T)
    return values


def _plastic(alpha, int_ior=1.5, **more):
    return {
        "type": "roughplastic", "alpha": float(alpha), "int_ior": float(int_ior), "ext_ior": 1.0
    } | more  # fmt: skip


def _lobes(dtype):
    return microfacets.specular(*_directions(SHARP, ANGLES), SHARP, 1.5, dtype)


@cache
def too_sharp() -> Measured:
    """Return exact and Mitsuba's peaks for light from the normal, and the mask."""
    light, view = np.zeros((2, len(TOO_SHARP), 3), np.float32) + np.array([0, 0, 1], np.float32)
    exact = microfacets.specular(light, view, TOO_SHARP, 1.5, EXACT)
    found = _by_mitsuba(TOO_SHARP, light, view)
    mean = _row(found)
    return exact, found, _limits(TOO_SHARP, np.ones_like(TOO_SHARP), mean, 0 * mean).clamped[0]


# --- Energy ----------------------------------------------------------------------------------


@cache
def white(parameters: tuple[tuple[float, float], ...]) -> Measured:
    """Return Mitsuba's albedos of white surfaces of ``(alpha, ior)``, and the mask."""
    albedos = [albedo.of_roughplastic(RoughPlastic(WHITE, *pair)) for pair in parameters]
    found = np.array([float((a.diffuse + a.specular)[0]) for a in albedos])
    mean = _row(found)
    alpha = np.array([pair[0] for pair in parameters])
    return np.ones(len(found)), found, _limits(alpha, found, mean, 0 * mean).energy_loss[0]


def _faint(subtract):
    """Return the specular albedo near an IOR of 1, directly or as total less diffuse part."""
    values = []
    for ior in NEAR_1:
        if not subtract:
            values.append(albedo.of_roughplastic(RoughPlastic(WHITE, 0.1, ior)).specular[0])
            continue
        theta, weight = albedo.nodes(0.1)
        wo = np.stack([np.sin(theta), 0 * theta, np.cos(theta)])
        whole, diffuse = (
            evaluate(mi.load_dict(_plastic(0.1, ior, **part)), np.float32([[0], [0], [1]]), wo)
            for part in ({}, {"specular_reflectance": 0.0})
        )
        values.append(weight @ np.float32(whole - diffuse))
    return np.array(values)


def _naive_weight(k_d, k_s, n, cosine):
    """Return value over density in the mirror direction, for lobes chosen by their shares."""
    share = k_s / (k_d + k_s)
    density = share * (n + 1) / (2 * np.pi) + (1 - share) * cosine / np.pi
    return (k_d * cosine + k_s) / np.pi / density


def _black():
    """Return the sample weights of a surface with a black texture, by our plugin."""
    texture = {"type": "bitmap", "bitmap": mi.Bitmap(np.zeros((2, 2, 3), np.float32)), "raw": True}
    bsdf = mi.load_dict({"type": "phong", "k_d": texture, "k_s": dict(texture), "n": 9})
    si = mi.SurfaceInteraction3f()
    si.wi, si.uv = mi.Vector3f(0.6, 0, 0.8), mi.Point2f(0.3, 0.4)
    _, weight = bsdf.sample(mi.BSDFContext(), si, 0.3, mi.Point2f(0.2, 0.6))
    return np.ravel(weight).astype(float)


# --- Noise -----------------------------------------------------------------------------------

PASSES, PIXELS, RARE, BRIGHT = 16, 48, 2.5e-4, 20.0


@cache
def caustic() -> Measured:
    """Return exact values, estimates and mask of pixels with a path that few passes find.

    Light of :data:`BRIGHT` arrives in one of ``1 / RARE`` passes, on top of steady light of 0.5.
    """
    rng = np.random.default_rng(7)
    passes = 0.5 + 0.01 * rng.normal(size=(PASSES, PIXELS, PIXELS))
    passes += BRIGHT * (rng.random(passes.shape) < RARE)
    mean, error = passes.mean(axis=0), passes.std(axis=0, ddof=1) / np.sqrt(PASSES)
    mean, error = (np.repeat(a[..., None], 3, axis=2) for a in (mean, error))
    row = np.broadcast_to([0.0, 0.0, 1.0], mean.shape)
    ones = np.ones(mean.shape[:2])
    surfaces = Surfaces(
        ones > 0, ones, ones, 0 * row, row, row, row, Lights(np.empty((0, 3)), row[0, :1])
    )
    mask = find(surfaces, mean, error).fireflies
    return (0.5 + RARE * BRIGHT) * ones, mean[..., 0], mask


def _set_aside(name: str, hard: str, bound: float, measure: Callable[[], Measured]) -> HardCase:
    """Make a case in which the pixels at fault are set aside."""

    def naive() -> NDArray:
        exact, reference, _ = measure()
        return attributed(exact, reference, np.zeros(reference.shape, bool))

    return HardCase(
        name, "reference", hard, bound, quietly(naive), quietly(lambda: attributed(*measure())),
        lambda: np.ones(measure()[1].shape),
    )  # fmt: skip


CASES = (
    HardCase(
        "α from 1e-4 to 1", "reference",
        "Beckmann's tan² = 1 / cos² − 1 is rounding noise next to α² = 1e-8. Views to 89.9°.", 1e-3,
        quietly(lambda: _lobes(NAIVE)),
        lambda: _by_mitsuba(SHARP, *_directions(SHARP, ANGLES)),
        lambda: _lobes(EXACT),
    ),
    _set_aside("α below 1e-4",
               "Mitsuba uses 1e-4 instead: its mirror images are up to 10,000 times too dark.",
               1e-5, too_sharp),
    _set_aside("ρ = 1 in a white furnace",
               "A rough white surface follows light through one reflection, and loses the rest.",
               LOST, lambda: white(tuple((a, 1.5) for a in ROUGH))),
    _set_aside("IOR from 1.3 to 1e3 in a white furnace",
               "Light that leaves the base is mostly reflected back inside, and lost.",
               LOST, lambda: white(tuple((0.1, ior) for ior in INDICES))),
    HardCase(
        "IOR just over 1", "reference",
        "The specular albedo is 2.5e-9: as total less diffuse part it is rounding noise, and its"
        " logarithm may not exist.", 1e-3,
        lambda: _faint(subtract=True), lambda: _faint(subtract=False),
        lambda: [((ior - 1) / (ior + 1)) ** 2 for ior in NEAR_1],
    ),
    HardCase(
        "ρ = 0: a black texture", "reference",
        "A sample chooses diffuse or specular by their shares of the albedo: 0 / 0.", 1e-6,
        quietly(lambda: _naive_weight(np.zeros(3), np.zeros(3), 9, 0.8)), _black,
        lambda: np.zeros(3),
    ),
    _set_aside("the terminator of a smoothed mesh",
               "The shading normal sees the light, the face does not: Mitsuba is black.", 1e-3,
               terminators.lit),
    _set_aside("the silhouette of a smoothed mesh",
               "The shading normal faces away from the viewer at grazing pixels: Mitsuba is black.",
               1e-3, terminators.seen),
    _set_aside("fireflies", "One pass of 16 carries all light of a rare path.", LOST, caustic),
)  # fmt: skip
"""The cases of the reference."""
