"""The options of a comparison."""

from dataclasses import dataclass
from math import inf
from numbers import Integral, Real
from typing import Any

from comparisons.departure.spaces import DEFAULT_VIEWING, Viewing
from heuristic import heuristics
from heuristic.errors import InputError
from heuristic.interpolation import FINEST, Interpolation
from reference.pairing.factors import Convention
from reference.pairing.halves import Pair, pair
from reference.scene.source import Source

LARGEST_SPP = 2**20
"""Samples per pixel: the noise is a thousandth of one sample's, and an image takes days."""

WHOLE = {
    "seed": (0, 2**64 - 1),
    "spp": (2, LARGEST_SPP),  # the noise needs at least 2
    "tessellation": (1, FINEST),
    "sensor": (0, 2**31 - 1),
}
"""Inclusive bounds of the options that are whole numbers."""


@dataclass(frozen=True)
class Options:
    """The options of a comparison.

    Parameters
    ----------
    seed
        Of the run; each pass hashes its own from it (`pass_seed`).
    spp
        Total samples per pixel, instead of the plan's. They are split into the plan's number of
        passes, or fewer (at least 2) to keep 4 per pass. With ``noise``, the limit.
    noise
        Render until the 95th percentile of the noise in ΔE2000 is at most this
        (:mod:`comparisons.render`).
    resolution
        ``(width, height)`` instead of the film's own.
    convention
        How roughplastic and phong are paired.
    heuristic
        Name of the declaration that shades the heuristic half (:mod:`heuristic.heuristics`).
    interpolation, tessellation
        How the heuristic half shades its surfaces, and how fine its meshes are.
    viewing
        The viewing conditions.
    heuristic_variant
        Variant of the heuristic half if not the current one, as for RGB shading against a
        spectral reference.
    everything
        Switch off all pruning, in the kernel and in the reference.
    sensor
        Number of the sensor, from 0.
    image, transfer
        Pictures instead of the heuristic half, several being repeats, and the transfer function
        of their values (:mod:`comparisons.pictures.picture_files`).
    allow_empty
        Accept a scene in which no pixel sees a surface.

    Raises
    ------
    InputError
        For a number outside its bounds in :data:`WHOLE`, a noise target that is not positive and
        finite, a resolution below 1, or a heuristic that is not declared.
    """

    seed: int = 0
    spp: int | None = None
    noise: float | None = None
    resolution: tuple[int, int] | None = None
    convention: Convention = Convention.MATCHED
    heuristic: str = heuristics.PHONG.name
    interpolation: Interpolation = Interpolation.PHONG
    tessellation: int | None = None
    viewing: Viewing = DEFAULT_VIEWING
    heuristic_variant: str | None = None
    everything: bool = False
    sensor: int = 0
    allow_empty: bool = False
    image: tuple[str, ...] = ()
    transfer: str | None = None

    def __post_init__(self) -> None:
        heuristics.named(self.heuristic)
        if self.image and self.heuristic != heuristics.PHONG.name:
            raise InputError(
                f"heuristic {self.heuristic} and image {self.image[0]}: give one of them."
            )
        for name, bounds in WHOLE.items():
            _require_whole(name, getattr(self, name), *bounds)
        if self.noise is not None and not (isinstance(self.noise, Real) and 0 < self.noise < inf):
            raise InputError(
                f"noise = {self.noise!r} is not allowed: give a ΔE2000 above 0, such as 0.5."
            )
        if self.resolution is not None and not _is_size(self.resolution):
            raise InputError(
                f"resolution {self.resolution!r} is not allowed: give width and height, whole"
                " numbers of at least 1."
            )

    def require_model(self, what: str) -> None:
        """Raise InputError if a picture replaces the heuristic half, which ``what`` renders."""
        if self.image:
            raise InputError(
                f"{what} needs a heuristic to render, and {self.image[0]} is a picture. Omit the"
                " image."
            )

    def pair(self, source: Source) -> Pair:
        """Derive both halves of a scene, for the current variant (:func:`reference.pair`)."""
        return pair(
            source,
            self.convention,
            self.resolution,
            self.interpolation,
            self.tessellation,
            prune=not self.everything,
            sensor=self.sensor,
            heuristic=self.heuristic,
        )


def _require_whole(name: str, value: Any, low: int, high: int) -> None:
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    if value is not None and not (is_whole and low <= int(value) <= high):
        raise InputError(
            f"{name} = {value!r} is not allowed: give a whole number from {low} to {high}."
        )


def _is_size(resolution: object) -> bool:
    if not isinstance(resolution, (tuple, list)):
        return False
    sides = [side for side in resolution if isinstance(side, Integral) and int(side) >= 1]
    return len(sides) == len(resolution) == 2
