"""A comparison with its images, its causes by pixel, and its terms at points."""

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from msgspec import structs
from numpy.typing import NDArray

from fotismos.comparisons.records.comparison import Attribution, ComparisonRecord
from fotismos.comparisons.records.departure import Colour, VisibleShare
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.errors import InputError
from fotismos.reference.records import Missing
from fotismos.reference.rendering.sums import DifferenceEstimate, Grouped

Whole = NDArray[np.int64]


@dataclass(frozen=True)
class TermMaterial:
    """The kernel's material at some points; a lobe's normalisation is part of ``k_s``."""

    name: str
    k_i: Colour
    k_a: Colour
    k_d: Colour
    k_s: Colour
    n: float
    form: str
    ambient: Colour


@dataclass(frozen=True)
class GridLight:
    """A light at all points, arrays (H, W).

    ``intensity`` and ``specular_intensity`` are ``L_d`` and ``L_s``, mostly both ``I_p0``; RGB,
    display-linear. ``attenuation`` is ``f_att``, the cone of a spot light included;
    ``cos_incidence`` is ``N·L``, below 0 if the light is behind the surface; ``cos_view`` is
    ``L·V``, which gives ``R·V = 2 (N·L) (N·V) − L·V``; ``lobe`` is the kernel's ``(R·V)^n`` or
    ``(N·H)^n``, 0 below the horizon.
    """

    name: str
    intensity: Colour
    specular_intensity: Colour
    attenuation: Any
    cos_incidence: Any
    cos_view: Any
    lobe: Any


@dataclass(frozen=True)
class LightTerms(GridLight):
    """One light at one point, with its terms as RGB, display-linear; arrays are numbers here."""

    cos_reflection: float
    diffuse: Colour
    specular: Colour


@dataclass(frozen=True)
class PixelTerms:
    """Equation 8.10 at the centre of a pixel; colours are RGB, display-linear.

    ``pixel`` is column and row of the nearest point of the grid, ``cos_view`` is ``N·V``, and
    ``others`` the sum of the lights that are not listed.
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
        return colour(sum(map(np.array, (self.emission, self.ambient, self.others, *lit))))


@dataclass(frozen=True)
class TermGrid:
    """The terms at a grid of pixels, whose ``columns`` and ``rows`` are given.

    ``material`` (H, W) is the index in ``materials``, -1 where no shaded surface is seen;
    ``cos_view`` (H, W) is ``N·V``. ``others`` (H, W, 3) is the sum of the lights that are not in
    ``lights``.
    """

    resolution: tuple[int, int]
    columns: Whole
    rows: Whole
    materials: tuple[TermMaterial, ...]
    material: Whole
    cos_view: NDArray[np.float64]
    lights: tuple[GridLight, ...]
    others: NDArray[np.float64] | None = None

    def at(self, x: int, y: int) -> PixelTerms | None:
        """Return the terms at the grid's point nearest to a pixel; None for the background."""
        width, height = self.resolution
        if not (0 <= x < width and 0 <= y < height):
            raise InputError(
                f"pixel {x}, {y} is outside the image: give 0, 0 to {width - 1}, {height - 1}."
            )
        cell = y * len(self.rows) // height, x * len(self.columns) // width
        number = self.material[cell]
        if number < 0:
            return None
        material = self.materials[number]
        return PixelTerms(
            pixel=(int(self.columns[cell[1]]), int(self.rows[cell[0]])),
            material=material,
            cos_view=float(self.cos_view[cell]),
            emission=material.k_i,
            ambient=colour(np.multiply(material.ambient, material.k_a)),
            lights=tuple(self._light(light, material, cell) for light in self.lights),
            others=colour((0, 0, 0) if self.others is None else self.others[cell]),
        )

    def light_image(self, light: GridLight) -> NDArray[np.float64]:
        """Return one light's terms, (H, W, 3); 0 where no shaded surface is seen."""
        # The background's index, −1, is that of the black material at the end.
        k_d = np.array([material.k_d for material in self.materials] + [(0.0, 0.0, 0.0)])
        k_s = np.array([material.k_s for material in self.materials] + [(0.0, 0.0, 0.0)])
        diffuse = k_d[self.material] * np.maximum(light.cos_incidence, 0)[..., None]
        specular = k_s[self.material] * light.lobe[..., None]
        reflected = light.intensity * diffuse + light.specular_intensity * specular
        image: NDArray[np.float64] = light.attenuation[..., None] * reflected
        return image

    def _light(self, light: GridLight, material: TermMaterial, cell: tuple[int, int]) -> LightTerms:
        arrays = ("attenuation", "cos_incidence", "cos_view", "lobe")
        here = vars(light) | {name: float(getattr(light, name)[cell]) for name in arrays}
        n_l = here["cos_incidence"]
        fading = here["attenuation"]
        return LightTerms(
            **here,
            cos_reflection=2 * n_l * float(self.cos_view[cell]) - here["cos_view"],
            diffuse=colour(np.multiply(light.intensity, material.k_d) * fading * max(n_l, 0)),
            specular=colour(
                np.multiply(light.specular_intensity, material.k_s) * fading * here["lobe"]
            ),
        )


@dataclass(frozen=True)
class LivePoints:
    """What 8.10 reads at the pixels of a coarse film, so that a page can shade them again.

    ``planes`` (H, W) are ``material``, 1 more than the index in ``materials``, 0 where no shaded
    surface is seen; ``depth``, the logarithm of the distance from a ray's origin; ``normal.x`` and
    so on; ``face_normal.x`` and so on, if faces of meshes have other normals; and ``k_d.x`` and so
    on, factors on the materials', if they vary. ``lights`` have a name, and the fields of
    :mod:`fotismos.heuristic.lights` as lists of numbers. ``rays`` (2, 3, 3) are origins and
    directions, of any length, of the rays of three pixels in the corners: left, right, and left
    again below.
    """

    planes: dict[str, Floats]
    materials: tuple[TermMaterial, ...]
    lights: tuple[dict[str, Any], ...]
    rays: list[Any]
    is_flat: bool


def colour(values: object) -> Colour:
    """Return three numbers as a colour."""
    red, green, blue = np.asarray(values, float).tolist()
    return red, green, blue


@dataclass(frozen=True)
class Light:
    """The reference before a tone map: its mean and standard error, (H, W, 3), linear."""

    mean: np.ndarray
    standard_error: np.ndarray


@dataclass(frozen=True)
class Causes:
    """The attribution of a departure, and where in the image the effects remove what.

    ``maps`` are ``{effect: (H, W)}``, the ΔE2000 that each removes; with ``left``, what remains
    when all are simulated, they add up to ``departure``. ``counted`` (H, W) are the pixels that
    count. ``previews`` are ``{labels of the simulated effects: (f H, f W, 3)}``, linear, and
    ``visible`` the shares of their pixels that differ visibly, by rising threshold.
    """

    record: Attribution
    maps: dict[str, Floats]
    departure: Floats
    left: Floats
    counted: NDArray[np.bool_]
    previews: dict[tuple[str, ...], Floats]
    visible: dict[tuple[str, ...], tuple[VisibleShare, ...]]


@dataclass(frozen=True)
class Images:
    """The images of a comparison; (H, W, 3) linear, or (H, W) for maps.

    ``maps`` are those of the perceptual metrics and ``log2_luminance``. ``objects`` and
    ``materials`` hold the index in the record of what each pixel sees, -1 for uncounted pixels.
    Two pictures without a scene have neither these nor ``position`` and ``normal``. ``light`` is
    the reference before its tone map, if it has one.
    ``terms`` are those of 8.10 in the textbook half, by layer, if it has any. ``difference`` is
    that of the halves with its noise, until all is measured: it takes much memory. ``grouped`` are
    its groups of passes at a sample of the pixels.
    """

    heuristic: np.ndarray
    reference: np.ndarray
    reference_stderr: np.ndarray
    maps: dict[str, np.ndarray]
    significant: np.ndarray
    counted: np.ndarray
    position: np.ndarray | None = None
    normal: np.ndarray | None = None
    objects: np.ndarray | None = None
    materials: np.ndarray | None = None
    terms: dict[str, np.ndarray] = field(default_factory=dict)
    light: Light | None = None
    difference: DifferenceEstimate | None = None
    grouped: Grouped | None = None


NO_TERMS = Missing("Terms are traced with the causes, which were not asked for.")


NOT_LIVE = Missing("It needs the causes, which were not asked for.")


@dataclass(frozen=True)
class Comparison:
    """What a comparison returns: the content of ``comparison.json``, and the images.

    Steps add the others: ``terms`` of 8.10 at pixels, ``live``, the points that a page shades
    again, and ``causes``, those of ``record.why``, by pixel.
    """

    record: ComparisonRecord
    images: Images
    terms: TermGrid | Missing = NO_TERMS
    live: LivePoints | Missing = NOT_LIVE
    causes: Causes | None = None

    def warned(self, warnings: Iterable[str]) -> "Comparison":
        """Return the comparison with more warnings."""
        record = structs.replace(self.record, warnings=(*self.record.warnings, *warnings))
        return replace(self, record=record)

    def timed(self, stage: str, seconds: float) -> "Comparison":
        """Return the comparison with the time of one more stage."""
        time = self.record.time
        time = structs.replace(time, stages=time.stages | {stage: seconds})
        return replace(self, record=structs.replace(self.record, time=time))
