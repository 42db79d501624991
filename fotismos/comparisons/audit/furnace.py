"""A white furnace for models of scattering: albedos by quadrature, and reciprocity.

A model is its *response* ``s(l, v) = pi f |cos(theta_l)|``: the value that a viewer sees under a
light of intensity 1, of unit vectors (3, N) to the light and to the viewer. The normal is z. Under
radiance 1 from all directions the viewer sees ``1/pi int s(l, v) dl``, which is 1 for a white
surface. The share of light from ``l`` that is returned is
``1/pi int s(l, v) |cos(theta_v) / cos(theta_l)| dv``.

What transmits light has a medium of relative index ``eta`` below. Radiance grows by ``eta^2`` as it
enters: that of the furnace is ``eta^2`` there, seen from above, and ``f(l, v) / n_v^2 = f(v, l) /
n_l^2``, with the indices ``n`` on the sides of ``l`` and ``v`` (Veach 1997, section 5.2).
"""

from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any, NamedTuple

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from fotismos.heuristic.convention import Floats

UP = np.array([[0.0], [0.0], [1.0]])

Response = Callable[[Floats, Floats], Floats]
"""Of directions (3, N) to the light and the viewer: values (C, N)."""


class Pairs(NamedTuple):
    """Directions (3, N) to lights and to viewers."""

    light: Floats
    view: Floats


GRID = (240, 180)
"""Azimuths and heights. It errs by less than a thousandth for GGX of an alpha of 0.1, even at 89
degrees, where its lobe is 0.2 degrees wide; so it does for what transmits light, with twice the
heights."""


def of_bsdf(bsdf: Any) -> Response:
    """Return the response of a BSDF."""
    return lambda light, view: np.atleast_2d(np.array(evaluate(bsdf, light, view), float))


def evaluate(bsdf: Any, light: Floats, view: Floats) -> Any:
    """Return a BSDF's response as a Dr.Jit array; Mitsuba's ``wi`` is the viewer's side."""
    count = max(light.shape[1], view.shape[1])
    toward = mi.Vector3f(np.broadcast_to(light, (3, count)))
    si = interaction(np.broadcast_to(view, (3, count)))
    # Mitsuba's `eval` includes the cosine of `wo`, here the light's.
    return dr.pi * mi.Spectrum(bsdf.eval(mi.BSDFContext(), si, toward))


def interaction(view: Floats) -> Any:
    """Return points that are seen from directions (3, N)."""
    si = dr.zeros(mi.SurfaceInteraction3f, view.shape[1])
    si.wi = mi.Vector3f(view)
    if mi.is_spectral:
        si.wavelengths = 550.0
    return si


def direction(theta: ArrayLike, phi: ArrayLike) -> Floats:
    """Return unit vectors (3, N) at angles from the normal and about it, in radians."""
    theta, phi = np.broadcast_arrays(np.atleast_1d(theta), phi)
    return np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])


@lru_cache(maxsize=20)
def sphere(azimuths: int, heights: int, edge: float = 1.0) -> tuple[Floats, Floats]:
    """Return directions (2, 3, N) above a surface and below it, and the solid angle (N,) of each.

    They are dense about the normal, ``|cos(theta)| = 1 - t^2`` at the nodes ``t`` of Gauss and
    Legendre, and about an azimuth of 180 degrees, ``phi = pi (1 + u^3)``: opposite to the fixed
    direction, grazing lobes are narrow. Values may jump at a cosine below 1, the ``edge``.
    """
    # A segment of `t` to each side of the edge: no rule of Gauss straddles a jump.
    ends = np.unique([0, np.sqrt(1 - edge), 1])[:, None]
    nodes, weights = np.polynomial.legendre.leggauss(heights)
    # Half of each, as the nodes lie between -1 and 1.
    lengths = np.diff(ends, axis=0) / 2
    u = (2 * np.arange(azimuths) + 1) / azimuths - 1
    grids = np.meshgrid(ends[:-1] + lengths * (1 + nodes), u)
    t, u = np.reshape(grids, (2, -1))
    above = direction(np.arccos(1 - t * t), np.pi * (1 + u**3))
    # `sin(theta) d theta = 2 t dt`, and `d phi = 3 pi u^2 du` with `du = 2 / azimuths`.
    solid_angle = np.tile((lengths * weights).ravel(), azimuths) * t * 12 * np.pi * u**2 / azimuths
    return np.stack([above, above * [[1], [1], [-1]]]), solid_angle


def radiance(eta: float | None, directions: Floats) -> Floats:
    """Return the square of the index of refraction on the side of directions; 1 above."""
    return np.where(directions[2] < 0, (eta or 1) ** 2, 1.0)


def _about(degrees: float, grid: tuple[int, int], eta: float | None) -> tuple[Floats, ...]:
    """Return the direction (3, 1) at an angle, and :func:`sphere` about it.

    Its edge is the cosine of what an upright facet refracts there: beyond it, none does.
    """
    fixed = direction(np.deg2rad(degrees), 0.0)
    z = fixed[2, 0]
    edge = 1.0 if eta is None else float(z / eta if z > 0 else -z * eta)
    # An edge of 1 or more is none; a cut elsewhere keeps the number of nodes.
    azimuths, heights = grid
    return fixed, *sphere(azimuths, heights, edge if edge < 1 or eta is None else 0.5)


def seen(
    response: Response, degrees: float, grid: tuple[int, int], eta: float | None = None
) -> float:
    """Return what a viewer at an angle sees in the furnace: the channel that is farthest from 1."""
    view, lights, solid_angle = _about(degrees, grid, eta)
    # Relative to the furnace on the viewer's side, so that 1 is white from either side.
    values: Any = sum(
        response(light, view) @ (solid_angle * radiance(eta, light) / radiance(eta, view) / np.pi)
        for light in lights
    )
    return float(values[np.abs(values - 1).argmax()])


def returned(
    response: Response, degrees: float, grid: tuple[int, int], eta: float | None = None
) -> float:
    """Return the share of the light from an angle that leaves, of the brightest channel."""
    light, views, solid_angle = _about(degrees, grid, eta)
    # What leaves takes the viewer's cosine; the light's is divided out of the response.
    values: Any = sum(
        response(light, view) @ (np.abs(view[2] / light[2]) * solid_angle / np.pi)
        for view in (views if eta else views[:1])
    )
    return float(values.max())


@cache
def single_scattering(alpha: float, degrees: float) -> float:
    """Return what GGX with Smith's correlated masking (Heitz 2014) reflects of a white metal."""
    square = alpha * alpha

    def response(light: Floats, view: Floats) -> Floats:
        half = light + view
        # The square of the half vector's cosine.
        top = half[2] ** 2 / (half**2).sum(axis=0)
        # Smith's root for the viewer, then for the light; each goes with the other's cosine.
        paths = (np.sqrt(square + (1 - square) * direction[2] ** 2) for direction in (view, light))
        masked = light[2] * next(paths) + view[2] * next(paths)
        # `pi D G / (4 cos_l cos_v) cos_l`, in which `G / (4 cos_l cos_v) = 1 / (2 masked)`.
        density: Floats = (light[2] * square / (1 - top + square * top) ** 2 / (2 * masked))[None]
        return density

    return returned(response, degrees, GRID)


def random_pairs(count: int, eta: float | None = None) -> list[Floats]:
    """Return two sets of random directions (3, N), within 80 degrees of the normal.

    Of what transmits light, half lie below.
    """
    rng = np.random.default_rng(0)
    pairs = [
        direction(np.arccos(rng.uniform(np.cos(np.deg2rad(80)), 1, count)),
                  rng.uniform(0, 2 * np.pi, count))
        for _ in range(2)
    ]  # fmt: skip
    for directions in pairs if eta else ():
        directions[2] *= rng.choice([-1, 1], count)
    return pairs


def asymmetries(response: Response, a: Floats, b: Floats, eta: float | None = None) -> Floats:
    """Return ``|g(a, b) - g(b, a)|``, ``g = f / n_v^2``, over the mean of both, (C, N).

    It is 0 where the mean is below a thousandth of the largest.
    """
    there = response(a, b) / np.abs(a[2]) / radiance(eta, b)
    back = response(b, a) / np.abs(b[2]) / radiance(eta, a)
    mean = (there + back) / 2
    counted = mean > 1e-3 * mean.max()
    relative: Floats = np.divide(np.abs(there - back), mean, out=np.zeros_like(mean), where=counted)
    return relative


def polar(directions: Floats) -> Any:
    """Return the angles of directions (3,) or (3, N) from the normal, in degrees."""
    return np.degrees(np.arctan2(np.hypot(directions[0], directions[1]), directions[2]))


def describe(light: np.ndarray, view: np.ndarray, index: int) -> str:
    """Describe a pair of directions (3, N): angles from the normal, and the azimuth between."""
    light = light[:, index % light.shape[1]]
    view = view[:, index % view.shape[1]]
    about = np.degrees(np.arctan2(light[1], light[0]) - np.arctan2(view[1], view[0])) % 360
    apart = min(about, 360 - about)
    return f"light at {polar(light):.4g}°, viewer at {polar(view):.4g}°, {apart:.3g}° apart"


def random_and_mirrored() -> Pairs:
    """Return 512 random pairs; half of the viewers are in the direction of the mirrored light."""
    light, view = random_pairs(256)
    mirrored = light * [[-1], [-1], [1]]
    return Pairs(np.hstack([light, light]), np.hstack([view, mirrored]))


def grazing() -> Pairs:
    """Return lights and viewers at the horizon and the normal, and lights below them."""
    azimuth = np.deg2rad([0.0, 90.0, 180.0])
    rows = [np.stack([np.cos(azimuth), np.sin(azimuth), np.full(3, z)]) for z in (0, 1e-7, 1e-3)]
    views = np.concatenate([UP, *rows], axis=1)
    lights = np.concatenate([views, -views], axis=1)
    return Pairs(np.repeat(lights, views.shape[1], axis=1), np.tile(views, lights.shape[1]))
