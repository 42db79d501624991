"""The terms of 8.10 at a grid of pixels, and at one of them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from heuristic.errors import InputError

Colour = tuple[float, float, float]


@dataclass(frozen=True)
class TermMaterial:
    """The kernel's material at some points; a lobe's normalisation is part of ``k_s``.

    Attributes
    ----------
    physical
        ``(incidences, views)``, see :mod:`comparisons.terms.polar`: the luminance that the physical
        partner reflects of a light of intensity 1.
    """

    name: str
    k_i: Colour
    k_a: Colour
    k_d: Colour
    k_s: Colour
    n: float
    form: str
    ambient: Colour
    physical: NDArray[np.float64] | None = None


@dataclass(frozen=True)
class GridLight:
    """A light at all points, arrays (H, W).

    Attributes
    ----------
    intensity
        ``I_p0``, RGB, display-linear.
    attenuation
        ``f_att``, the cone of a spot light included.
    cos_incidence
        ``N·L``; below 0 if the light is behind the surface.
    cos_view
        ``L·V``, which gives ``R·V = 2 (N·L) (N·V) − L·V``.
    lobe
        The kernel's ``(R·V)^n`` or ``(N·H)^n``, 0 below the horizon.
    """

    name: str
    intensity: Colour
    attenuation: NDArray[np.float64]
    cos_incidence: NDArray[np.float64]
    cos_view: NDArray[np.float64]
    lobe: NDArray[np.float64]


@dataclass(frozen=True)
class LightTerms:
    """The terms of one light at a point; ``diffuse`` and ``specular`` are RGB, display-linear."""

    name: str
    intensity: Colour
    attenuation: float
    cos_incidence: float
    cos_view: float
    cos_reflection: float
    lobe: float
    diffuse: Colour
    specular: Colour


@dataclass(frozen=True)
class PixelTerms:
    """Equation 8.10 at the centre of a pixel, with its numbers; colours are RGB, display-linear.

    Attributes
    ----------
    pixel
        Column and row of the nearest point of the grid.
    cos_view
        ``N·V``.
    others
        The sum of the lights that are not listed.
    """

    pixel: tuple[int, int]
    material: TermMaterial
    cos_view: float
    emission: Colour
    ambient: Colour
    lights: tuple[LightTerms, ...]
    others: Colour

    @property
    def total(self) -> Colour:
        """The sum, which equals the kernel's value here."""
        lit = [part for light in self.lights for part in (light.diffuse, light.specular)]
        return _colour(sum(map(np.array, (self.emission, self.ambient, self.others, *lit))))


@dataclass(frozen=True)
class TermGrid:
    """The terms at the centres of pixels, one in the middle of each cell of a regular grid.

    Attributes
    ----------
    columns, rows
        Of the pixels.
    material
        (H, W), the index in ``materials``; -1 where no shaded surface is seen.
    cos_view
        (H, W), ``N·V``.
    others
        (H, W, 3), the sum of the lights that are not in ``lights``; None if there are none.
    """

    resolution: tuple[int, int]
    columns: NDArray[np.int64]
    rows: NDArray[np.int64]
    materials: tuple[TermMaterial, ...]
    material: NDArray[np.int64]
    cos_view: NDArray[np.float64]
    lights: tuple[GridLight, ...]
    others: NDArray[np.float64] | None = None

    def at(self, x: int, y: int) -> PixelTerms | None:
        """Return the terms at the grid's point nearest to a pixel; None for the background.

        Raises
        ------
        InputError
            For a pixel outside the image.
        """
        width, height = self.resolution
        if not (0 <= x < width and 0 <= y < height):
            raise InputError(
                f"pixel {x}, {y} is outside the image: give 0, 0 to {width - 1}, {height - 1}."
            )
        place = y * len(self.rows) // height, x * len(self.columns) // width
        if self.material[place] < 0:
            return None
        material = self.materials[self.material[place]]
        others = (0.0, 0.0, 0.0) if self.others is None else self.others[place]
        return PixelTerms(
            pixel=(int(self.columns[place[1]]), int(self.rows[place[0]])),
            material=material,
            cos_view=float(self.cos_view[place]),
            emission=material.k_i,
            ambient=_colour(np.multiply(material.ambient, material.k_a)),
            lights=tuple(self._light(light, material, place) for light in self.lights),
            others=_colour(others),
        )

    def light_image(self, light: GridLight) -> NDArray[np.float64]:
        """Return one light's terms, (H, W, 3); 0 where no shaded surface is seen."""
        k_d, k_s = (
            np.array([getattr(material, name) for material in self.materials] + [(0.0, 0.0, 0.0)])
            for name in ("k_d", "k_s")
        )
        diffuse = k_d[self.material] * np.maximum(light.cos_incidence, 0)[..., None]
        specular = k_s[self.material] * light.lobe[..., None]
        return np.multiply(light.intensity, light.attenuation[..., None]) * (diffuse + specular)

    def total(self) -> NDArray[np.float64]:
        """Return the sum of all terms, (H, W, 3), which equals the kernel's image."""
        even = [np.add(m.k_i, np.multiply(m.ambient, m.k_a)) for m in self.materials]
        image = np.array([*even, np.zeros(3)])[self.material]
        image = image + sum(map(self.light_image, self.lights))
        return image if self.others is None else image + self.others

    def _light(self, light: GridLight, material: TermMaterial, place: tuple) -> LightTerms:
        arrays = ("attenuation", "cos_incidence", "cos_view", "lobe")
        f_att, n_l, l_v, lobe = (float(getattr(light, name)[place]) for name in arrays)
        arriving = np.multiply(light.intensity, f_att)
        return LightTerms(
            name=light.name,
            intensity=light.intensity,
            attenuation=f_att,
            cos_incidence=n_l,
            cos_view=l_v,
            cos_reflection=2 * n_l * float(self.cos_view[place]) - l_v,
            lobe=lobe,
            diffuse=_colour(arriving * material.k_d * max(n_l, 0)),
            specular=_colour(arriving * material.k_s * lobe),
        )


def _colour(values: object) -> Colour:
    return tuple(np.asarray(values, float).tolist())
