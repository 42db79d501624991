"""The terms of 8.10 read from the kernel, at a grid of pixels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.typing import NDArray

from comparisons.options import Options
from comparisons.terms import polar
from comparisons.terms.term_grid import GridLight, TermGrid, TermMaterial
from heuristic import arguments, colours, lobes, terms, vectors
from heuristic.arrays import Scene
from heuristic.interpolation import Interpolation
from heuristic.materials import COEFFICIENTS, FORMS, Material
from reference.rendering.gbuffer import image_size, pixel_rays
from reference.rendering.renderer import Renderer, variant

if TYPE_CHECKING:  # it imports this module
    from comparisons.compare import Prepared

SIDE = 64
"""Points along the longer side of the grid, at most."""

VALUES = 8192
"""Points times lights, at most: more lights leave a coarser grid."""

LIGHTS = 4
"""Lights with separate terms: the strongest ones. The others are summed."""

MOST_LIGHTS = 64
"""With more lights no terms are read: each light is evaluated separately."""

MATERIALS = 256
"""Different sets of coefficients, at most: textures have more."""


def trace(ready: Prepared, options: Options) -> tuple[TermGrid | None, str]:
    """Return the terms of a prepared scene, or why there are none.

    Parameters
    ----------
    ready
        The scene.
    options
        How it is shaded.
    """
    half = ready.heuristic
    if options.image:
        return None, "The heuristic half is a picture, which has no terms."
    with variant(half.variant):
        if reason := _without(half, options):
            return None, reason
        grid = _traced(half.scene, half.integrator)
    if grid is None:
        return None, f"Its textures make more than {MATERIALS} different materials."
    return polar.completed(grid, ready.scene), ""


def _without(half: Renderer, options: Options) -> str:
    """Return why equation 8.10 does not describe a half's shading; empty if it does."""
    if options.heuristic not in ("phong", "blinn"):
        return f"The heuristic {options.heuristic} is not the sum of equation 8.10."
    if options.interpolation is not Interpolation.PHONG:
        return (
            f"{options.interpolation.value.capitalize()} shading does not evaluate 8.10 at pixels."
        )
    if mi.is_spectral:
        return "The heuristic half is rendered by wavelength, so its terms are not RGB."
    if len(half.scene.emitters()) > MOST_LIGHTS:
        return f"There are more than {MOST_LIGHTS} lights."
    if any(bsdf.is_clear for bsdf in half.integrator.known(half.scene).materials.bsdfs):
        return "Some surfaces are transparent, so a pixel shows several of them at once."
    return ""


def _traced(scene: Scene, integrator: Any) -> TermGrid | None:
    emitters = [emitter for emitter in scene.emitters() if hasattr(emitter, "light")]
    resolution = image_size(scene)
    columns, rows = _pixels(resolution, min(max(len(emitters), 1), LIGHTS))
    points = _Points(scene, integrator, pixel_rays(scene, resolution, *np.meshgrid(columns, rows)))
    materials, places = points.materials()
    if len(materials) > MATERIALS:
        return None
    shape = len(rows), len(columns)
    lights = [points.light(emitter, shape) for emitter in emitters]
    grid = TermGrid(resolution, columns, rows, materials, places.reshape(shape),
                    points.floats(dr.dot(points.normal, points.view)).reshape(shape),
                    tuple(lights))  # fmt: skip
    return _strongest(grid) if len(lights) > LIGHTS else grid


def _pixels(resolution: tuple[int, int], lights: int) -> tuple[NDArray, NDArray]:
    """Return the columns and rows of the pixels in the middles of the cells."""
    longest = min(SIDE, int((VALUES / 2 / lights) ** 0.5) if lights > 2 else SIDE)
    scale = min(1.0, longest / max(resolution))
    counts = (max(1, round(scale * side)) for side in resolution)
    columns, rows = (
        (2 * np.arange(count) + 1) * side // (2 * count)
        for count, side in zip(counts, resolution, strict=True)
    )
    return columns, rows


class _Points:
    """The kernel's arguments at the points that rays see."""

    def __init__(self, scene: Scene, integrator: Any, ray: Any) -> None:
        self.si = scene.ray_intersect(ray)
        normal, is_shaded = integrator.seen_side(scene, self.si, self.si.is_valid())
        self.hit = np.array(self.si.is_valid() & is_shaded)
        self.position, normal, view = arguments.vectors(self.si.p, normal, mi.Vector3f(-ray.d))
        self.normal, self.view = vectors.normalise(normal), vectors.normalise(view)
        self.known = integrator.known(scene).materials
        self.given = self.known.at(self.si, self.si.is_valid())
        self.ambient = integrator.ambient_at(self.si, self.si.is_valid())

    def floats(self, value: Any) -> NDArray[np.float64]:
        """Return a value of each point, (N,)."""
        return np.array(mi.Float(value) + dr.zeros(mi.Float, len(self.hit)), np.float64)

    def colours(self, value: Any) -> NDArray[np.float64]:
        """Return a colour of each point, (N, 3)."""
        value = colours.as_array(value, mi.Vector3f)
        value = value[0] if dr.depth_v(value) > 1 and len(value) == 1 else value
        return np.array(mi.Color3f(value) + dr.zeros(mi.Color3f, len(self.hit)), np.float64).T

    def select(self, read: Callable[[Material], NDArray]) -> NDArray[np.float64]:
        """Return numbers read from the material at each point, (N, C)."""
        found = np.zeros(())
        for material, mask in self.given:
            held = np.array(mi.Bool(mask) & dr.full(mi.Bool, True, len(self.hit)))[:, None]
            found = found + np.where(held, read(material), 0.0)
        return found

    def materials(self) -> tuple[tuple[TermMaterial, ...], NDArray[np.int64]]:
        """Return the different materials, and the index of each point's."""
        number = self.floats(self.known.index(self.si, self.si.is_valid()))
        rows = np.column_stack((number, self.select(self._row), self.colours(self.ambient)))
        different, places = np.unique(rows[self.hit], axis=0, return_inverse=True)
        found = np.full(len(self.hit), -1)
        found[self.hit] = places.ravel()
        return tuple(map(self._material, different.tolist())), found

    def _row(self, material: Material) -> NDArray[np.float64]:
        k_i, k_a, k_d, k_s = (self.colours(getattr(material, name)) for name in COEFFICIENTS)
        if material.normalised:
            k_s *= self.floats(terms.normalisation(material.form, material.n))[:, None]
        form = np.full(len(self.hit), FORMS.index(material.form))
        return np.column_stack((k_i, k_a, k_d, k_s, self.floats(material.n), form))

    def _material(self, row: list[float]) -> TermMaterial:
        number, *values = row
        k_i, k_a, k_d, k_s, ambient = (
            (red, green, blue)
            for red, green, blue in (values[begin : begin + 3] for begin in (0, 3, 6, 9, 14))
        )
        name, form = self.known.bsdfs[int(number)].id(), FORMS[int(values[13])]
        return TermMaterial(name, k_i, k_a, k_d, k_s, values[12], form, ambient)

    def light(self, emitter: Any, shape: tuple[int, int]) -> GridLight:
        """Return a light at all points."""
        light = emitter.light(self.si, self.si.is_valid())
        toward, arriving, _ = light.illuminate(self.position)
        cos_incidence = dr.dot(self.normal, toward)

        def lobe(material: Material) -> NDArray:
            cosine = lobes.lobe(material, self.normal, self.view)
            cosine = cosine(light, self.position, toward, cos_incidence)
            return self.floats(terms.specular(1, 1, cosine, material.n))[:, None]

        intensity, arriving = self.colours(light.intensity)[0], self.colours(arriving)
        brightest = int(np.argmax(intensity))
        scale = arriving[:, brightest] / (intensity[brightest] or 1.0)
        each = (scale, self.floats(cos_incidence), self.floats(dr.dot(toward, self.view)))
        arrays = (*each, self.select(lobe))
        return GridLight(
            emitter.id(), tuple(intensity.tolist()), *(a.reshape(shape) for a in arrays)
        )


def _strongest(grid: TermGrid) -> TermGrid:
    """Keep the lights that are strongest over all points; sum the others."""
    given = [grid.light_image(light) for light in grid.lights]
    order = np.argsort([-image.sum() for image in given], kind="stable")
    kept, others = sorted(order[:LIGHTS]), order[LIGHTS:]
    lights = tuple(grid.lights[number] for number in kept)
    return replace(grid, lights=lights, others=sum(given[number] for number in others))
