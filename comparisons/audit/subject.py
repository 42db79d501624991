"""What can be audited: anything that returns how much light it reflects between two directions."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from comparisons.hard import furnace

ALPHAS = (0.1, 0.3, 0.6, 1.0)
"""Roughness of the materials; the quadrature resolves their lobes at every angle."""

ROUNDING = 1e-5
"""A value below 0 by less than this, in units of display white, is a rounding error."""


@dataclass(frozen=True)
class Fault:
    """A value that light cannot have, and where it was found."""

    where: str
    value: float

    def told(self) -> str:
        """Describe it."""
        return f"{self.value:.3g} ({self.where})"


@dataclass(frozen=True)
class Tuned:
    """A number to differentiate with respect to.

    ``shade`` maps a Dr.Jit float, one for all points or one per point, to one per point.
    """

    name: str
    centre: float
    shade: Callable[[Any], Any]


@dataclass(frozen=True)
class Setting:
    """A hard case.

    Attributes
    ----------
    words
        Description of the case.
    values
        Function without arguments that returns the values (C, N).
    pairs
        Directions (3, N) to the light and to the viewer, if they identify the case.
    """

    words: str
    values: Callable[[], np.ndarray]
    pairs: tuple[np.ndarray, np.ndarray] | None = None

    def told(self, place: int) -> str:
        """Describe the case of one value."""
        if self.pairs is None:
            return self.words
        light, view = (each[:, place % each.shape[1]] for each in self.pairs)
        return f"{self.words}: {told(light, view)}"


@dataclass
class Subject(ABC):
    """A heuristic or a BSDF, with the normal along z.

    Attributes
    ----------
    materials
        The white materials that it is evaluated with, which absorb nothing: names, and the
        roughness of those that have several.
    untuned
        Why no derivative can be checked, if so.
    grid
        Azimuths and heights of the quadrature over a hemisphere.
    pairs
        Random pairs of directions for the check of reciprocity.
    faults
        Values that light cannot have, found during any check.
    """

    materials: dict[str, float | None]
    grid: tuple[int, int] = (240, 180)
    pairs: int = 20_000
    faults: list[Fault] = field(default_factory=list, kw_only=True)
    untuned: str = field(default="it depends on no number", kw_only=True)

    @abstractmethod
    def evaluate(self, material: str, light: np.ndarray, view: np.ndarray) -> np.ndarray:
        """Return what ``response`` returns, before it is checked."""

    @abstractmethod
    def settings(self) -> Iterator[Setting]:
        """Yield the hard cases."""

    @abstractmethod
    def tuned(self) -> Iterator[Tuned]:
        """Yield the numbers that it depends on."""

    def response(self, material: str, light: np.ndarray, view: np.ndarray) -> np.ndarray:
        """Return ``pi f cos(theta_l)``, (C, N), for unit vectors (3, N) to a light and a viewer.

        A viewer sees this value under a light of intensity 1; on a white diffuse surface it is the
        cosine. Values that are not finite, or negative, are noted and count as 0.
        """
        count = max(light.shape[1], view.shape[1])
        light, view = (np.broadcast_to(each, (3, count)) for each in (light, view))
        found = np.broadcast_to(self.evaluate(material, light, view), (3, count))
        self.noted(found, lambda place: f"{material}, {told(light[:, place], view[:, place])}")
        return np.where(np.isfinite(found) & (found > 0), found, 0.0)

    def noted(self, values: np.ndarray, where: Callable[[int], str]) -> int:
        """Note the first value (C, N) that is not finite, or negative; return their number."""
        is_wrong = ~(np.isfinite(values) & (values >= -ROUNDING))
        if is_wrong.any():
            channel, place = np.argwhere(is_wrong)[0]
            self.faults.append(Fault(where(place), float(values[channel, place])))
        return int(is_wrong.sum())


def random_and_mirrored() -> tuple[np.ndarray, np.ndarray]:
    """Return random directions (3, 512) to lights and viewers; half face each other's mirror."""
    light, view = furnace.random_pairs(256)
    mirrored = light * [[-1], [-1], [1]]
    return np.hstack([light, light]), np.hstack([view, mirrored])


def told(light: np.ndarray, view: np.ndarray) -> str:
    """Describe a pair of directions: angles from the normal, and the azimuth between."""
    polar = [np.degrees(np.arctan2(np.hypot(each[0], each[1]), each[2])) for each in (light, view)]
    about = np.degrees(np.arctan2(light[1], light[0]) - np.arctan2(view[1], view[0])) % 360
    return (
        f"light at {polar[0]:.4g}°, viewer at {polar[1]:.4g}°, {min(about, 360 - about):.3g}° apart"
    )
