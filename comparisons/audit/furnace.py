"""A white furnace for models of reflection: albedos by quadrature, and reciprocity.

A model is its *response* ``s(l, v) = pi f cos(theta_l)``: the value that a viewer sees under a
light of intensity 1, of unit vectors (3, N) to the light and to the viewer. The normal is z. Under
radiance 1 from all directions the viewer sees ``1/pi int s(l, v) dl``, which is 1 for a white
surface. The share of light from ``l`` that is returned is
``1/pi int s(l, v) cos(theta_v) / cos(theta_l) dv``.
"""

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike, NDArray

UP = np.array([[0.0], [0.0], [1.0]])

Response = Callable[[NDArray, NDArray], NDArray]
"""Of directions (3, N) to the light and the viewer: values (C, N)."""

GRID = (240, 180)
"""Azimuths and heights. It errs by a thousandth for GGX of an alpha of 0.1, even at 89 degrees,
where its lobe is 0.2 degrees wide."""


def of_bsdf(bsdf: Any) -> Response:
    """Return the response of a BSDF."""
    return lambda light, view: np.atleast_2d(np.array(evaluate(bsdf, light, view), float))


def evaluate(bsdf: Any, light: NDArray, view: NDArray) -> Any:
    """Return a BSDF's response as a Dr.Jit array; Mitsuba's ``wi`` is the viewer's side."""
    count = max(light.shape[1], view.shape[1])
    toward, wi = (mi.Vector3f(np.broadcast_to(each, (3, count))) for each in (light, view))
    si = dr.zeros(mi.SurfaceInteraction3f, count)
    si.wi = wi
    if mi.is_spectral:
        si.wavelengths = 550.0
    return dr.pi * mi.Spectrum(bsdf.eval(mi.BSDFContext(), si, toward))


def direction(theta: ArrayLike, phi: ArrayLike) -> NDArray:
    """Return unit vectors (3, N) at angles from the normal and about it, in radians."""
    theta, phi = np.broadcast_arrays(np.atleast_1d(theta), phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


def hemisphere(azimuths: int, heights: int) -> tuple[NDArray, NDArray]:
    """Return directions (3, N) above a surface, and the solid angle (N,) of each.

    They are dense about the normal, ``cos(theta) = 1 - t^2``, and about an azimuth of 180 degrees,
    ``phi = pi (1 + u^3)``: opposite to the fixed direction, grazing lobes are narrow.
    """
    t = (np.arange(heights) + 0.5) / heights
    u = (2 * np.arange(azimuths) + 1) / azimuths - 1
    t, u = (grid.ravel() for grid in np.meshgrid(t, u))
    directions = direction(np.arccos(1 - t * t), np.pi * (1 + u**3))
    return directions, 2 * t * 3 * np.pi * u**2 * 2 / len(t)


def seen(response: Response, degrees: float, grid: tuple[int, int]) -> float:
    """Return what a viewer at an angle sees in the furnace: the channel that is farthest from 1."""
    above, solid_angle = hemisphere(*grid)
    view = direction(np.deg2rad(degrees), 0.0)
    total = sum(
        (response(light, view) * solid_angle).sum(axis=1)
        for light in (above, above * [[1], [1], [-1]])
    )
    values = total / np.pi
    return float(values[np.abs(values - 1).argmax()])


def returned(response: Response, degrees: float, grid: tuple[int, int]) -> float:
    """Return the share of the light from an angle that is returned, of the brightest channel."""
    view, solid_angle = hemisphere(*grid)
    light = direction(np.deg2rad(degrees), 0.0)
    values = response(light, view) / light[2, 0]
    return float((values * view[2] * solid_angle).sum(axis=1).max() / np.pi)


def random_pairs(count: int) -> list[NDArray]:
    """Return two sets of random directions (3, N), within 80 degrees of the normal."""
    rng = np.random.default_rng(0)
    return [
        direction(np.arccos(rng.uniform(np.cos(np.deg2rad(80)), 1, count)),
                  rng.uniform(0, 2 * np.pi, count))
        for _ in range(2)
    ]  # fmt: skip


def asymmetries(response: Response, a: NDArray, b: NDArray) -> NDArray:
    """Return ``|f(a, b) - f(b, a)|`` over the mean of both, (C, N).

    It is 0 where the mean is below a thousandth of the largest.
    """
    there, back = response(a, b) / a[2], response(b, a) / b[2]
    mean = (there + back) / 2
    counted = mean > 1e-3 * mean.max()
    return np.divide(np.abs(there - back), mean, out=np.zeros_like(mean), where=counted)


def describe(light: np.ndarray, view: np.ndarray, place: int) -> str:
    """Describe a pair of directions (3, N): angles from the normal, and the azimuth between."""
    light, view = (each[:, place % each.shape[1]] for each in (light, view))
    polar = [np.degrees(np.arctan2(np.hypot(each[0], each[1]), each[2])) for each in (light, view)]
    about = np.degrees(np.arctan2(light[1], light[0]) - np.arctan2(view[1], view[0])) % 360
    return (
        f"light at {polar[0]:.4g}°, viewer at {polar[1]:.4g}°, {min(about, 360 - about):.3g}° apart"
    )


def random_and_mirrored() -> tuple[np.ndarray, np.ndarray]:
    """Return random directions (3, 512) to lights and viewers; half face each other's mirror."""
    light, view = random_pairs(256)
    mirrored = light * [[-1], [-1], [1]]
    return np.hstack([light, light]), np.hstack([view, mirrored])


def grazing() -> tuple[np.ndarray, np.ndarray]:
    """Return lights and viewers (3, N) at the horizon and the normal, and lights below them."""
    azimuth = np.deg2rad([0.0, 90.0, 180.0])
    rows = [np.stack([np.cos(azimuth), np.sin(azimuth), np.full(3, z)]) for z in (0, 1e-7, 1e-3)]
    views = np.concatenate([UP, *rows], axis=1)
    lights = np.concatenate([views, -views], axis=1)
    return np.repeat(lights, views.shape[1], axis=1), np.tile(views, lights.shape[1])
