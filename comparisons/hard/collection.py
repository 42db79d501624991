"""All hard cases, and their evaluation for the tests and the report.

Cases of the group ``reference`` need a Mitsuba variant and the plugins.
"""

from dataclasses import dataclass

import numpy as np

from comparisons.hard import (
    colour_values,
    furnace,
    kernel,
    orientation,
    physical,
    samplers,
    surfaces,
)
from comparisons.hard.cases import Outcome, Statement, evaluate
from comparisons.hard.conventions import CONVENTIONS
from comparisons.hard.furnace import Furnace
from comparisons.hard.textbook import NAIVE, Setting, shade

CASES = tuple(
    case
    for module in (kernel, orientation, surfaces, physical, samplers, colour_values)
    for case in module.CASES
)

PICTURE = 160
"""Pixels along each side of a picture."""


@dataclass(frozen=True)
class Picture:
    """The same view by the naive formula and by ours: images (H, W) of values from 0 to 1."""

    title: str
    naive: np.ndarray
    ours: np.ndarray


@dataclass(frozen=True)
class HardCases:
    """All cases with their errors, the conventions, pictures of some, and the models' energy.

    ``conventions`` are pairs of a statement and whether it holds; ``furnaces`` have the models'
    albedo under light from each of ``angles``, in degrees, and their asymmetry.
    """

    outcomes: tuple[Outcome, ...]
    conventions: tuple[tuple[Statement, bool], ...]
    pictures: tuple[Picture, ...]
    furnaces: tuple[Furnace, ...]
    angles: tuple[float, ...] = furnace.ANGLES

    def of_group(self, name: str) -> list[Outcome]:
        """Return the outcomes of the cases of a group."""
        return [outcome for outcome in self.outcomes if outcome.case.group == name]


def collect() -> HardCases:
    """Evaluate everything, in the current Mitsuba variant; a few seconds."""
    return HardCases(
        outcomes=tuple(map(evaluate, CASES)),
        conventions=tuple(
            (convention.described(), convention.holds()) for convention in CONVENTIONS
        ),
        pictures=(
            _picture("A highlight of n = 1e6, 0.4 degrees wide", _highlight(1e6, 0.0035)),
            _picture("A highlight of n = 1e7, 0.13 degrees wide", _highlight(1e7, 0.00115)),
            _picture("The spot of a cutoff of 0.005 degrees", _spot(0.005)),
        ),
        furnaces=tuple(furnace.table()),
    )


def _picture(title, setting):
    setting = setting.rounded()
    naive = shade(setting, NAIVE)
    images = (naive, kernel.by_kernel(setting))
    return Picture(title, *(image.reshape(PICTURE, PICTURE) for image in images))


def _grid(half):
    x, y = np.meshgrid(*[np.linspace(-half, half, PICTURE)] * 2)
    return x.ravel()[:, None], y.ravel()[:, None]


def _highlight(n, half):
    """Return a setting of views in a square about the mirror direction of a light."""
    base = kernel.highlight(n, 1)
    axis = np.array(base.view)[0]
    side = np.cross(axis, (0.3, 0.5, -0.8))
    side /= np.linalg.norm(side)
    x, y = _grid(half)
    view = axis + x * side + y * np.cross(axis, side)
    return Setting(normal=base.normal, light=base.light, view=view, k_s=1.0, n=n)


def _spot(cutoff):
    """Return a setting of points in a square below a slightly tilted spot."""
    x, y = _grid(2.5 * np.deg2rad(cutoff))
    position = np.concatenate([x, y, 0 * x], axis=1)
    light = (0.3, 0.4, 0.8)
    return Setting(
        position=position, light=light, direction=tuple(-c for c in light), cutoff=cutoff, k_d=1.0
    )
