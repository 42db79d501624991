"""The lobes of the physical materials in the plane of incidence, tabulated.

For a light of intensity 1, a physical surface has the value ``pi f(V, L) (N·L)``, and the
textbook's ``k_d (N·L) + k_s (R·V)^n``: both are on one scale, and neither is normalised.
"""

from dataclasses import replace

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.terms.term_grid import TermGrid
from heuristic.arrays import Interaction, Number, Scene, Vector
from heuristic.convention import IRRADIANCE_PER_INTENSITY
from reference.rendering.gbuffer import pixel_rays

GRAZING = 89.9
"""Degrees, in place of the horizon."""

INCIDENCES = GRAZING * (1 - np.linspace(1, 0, 25) ** 2.5)
"""Degrees from the normal to the light, closest at the horizon, where lobes change most."""

_EVEN = np.linspace(-1, 1, 73)
VIEWS = _EVEN * abs(_EVEN)
"""Directions of view: 0 is the mirror direction, -1 and 1 are the horizon on the light's side and
on the opposite side. So lobes stay in place between incidences, and are finest at their peak."""

SPECTRA = 16
"""Sets of wavelengths over which luminance is summed in spectral variants."""


def view_angles(incidence: float) -> NDArray[np.float64]:
    """Return :data:`VIEWS` for an incidence, in degrees from the normal."""
    side = np.where(VIEWS < 0, GRAZING + incidence, GRAZING - incidence)
    return incidence + VIEWS * side


def completed(grid: TermGrid, scene: Scene) -> TermGrid:
    """Return a grid whose materials have the lobes of their physical partners in a scene."""
    first = [np.argwhere(grid.material == number)[0] for number in range(len(grid.materials))]
    if not first:
        return grid
    row, column = np.transpose(first)
    table = _table(scene, grid.resolution, grid.columns[column], grid.rows[row])
    materials = zip(grid.materials, table, strict=True)
    return replace(grid, materials=tuple(replace(m, physical=lobe) for m, lobe in materials))


def _table(
    scene: Scene, resolution: tuple[int, int], x: NDArray, y: NDArray
) -> NDArray[np.float64]:
    """Return the luminance that the surfaces at pixels reflect, (pixels, incidences, views)."""
    incidence = np.repeat(INCIDENCES, len(VIEWS))
    view = np.concatenate([view_angles(each) for each in INCIDENCES])
    directions = len(view)
    pixels = np.repeat(x, directions), np.repeat(y, directions)
    si = scene.ray_intersect(pixel_rays(scene, resolution, *pixels))
    si.wi = _in_plane(np.tile(view, len(x)))
    toward = _in_plane(np.tile(-incidence, len(x)))
    value = IRRADIANCE_PER_INTENSITY * _luminance(si, toward)
    return np.array(value, np.float64).reshape(len(x), len(INCIDENCES), len(VIEWS))


def _in_plane(degrees: NDArray[np.float64]) -> Vector:
    angle = mi.Float(np.radians(degrees))
    return mi.Vector3f(dr.sin(angle), 0, dr.cos(angle))


def _luminance(si: Interaction, toward: Vector) -> Number:
    """Return the luminance of BSDF times cosine, relative to a white spectrum's."""
    context, bsdf = mi.BSDFContext(), si.bsdf()
    if not mi.is_spectral:
        value = bsdf.eval(context, si, toward)
        return mi.luminance(mi.Color3f(value)) if mi.is_rgb else value[0]
    total, white = mi.Float(0), mi.Float(0)
    for number in range(SPECTRA):
        place = (np.arange(4) + (number + 0.5) / SPECTRA) / 4
        wavelengths = 360 + 470 * place
        si.wavelengths = mi.Spectrum(*map(float, wavelengths))
        total += mi.luminance(bsdf.eval(context, si, toward), si.wavelengths)
        white += mi.luminance(mi.Spectrum(1), si.wavelengths)
    return total / white
