"""Light that diffuse surfaces send each other: once in closed form, for ever by radiosity.

Light falls straight down on a square floor, with the irradiance ``E``, and along a square wall that
stands on one of its sides: all that the wall shows came from the floor.
"""

from functools import cache

import numpy as np
from scipy.interpolate import RegularGridInterpolator

from tests.shared.parts import moved
from tests.witnesses import configuration, stage
from tests.witnesses.witness import Witness

FLOOR, WALL = 0.7, 0.6
"""Reflectances. The floor goes from 0 to 1 in x and from -0.5 to 0.5 in y, the wall is at x = 0."""

HALF = 0.25
"""Of the side of what is seen: the wall's part next to the floor."""

IRRADIANCE = 2.0
CELLS = 24
"""Along each side, of the radiosity solution. 32 change the mean over a block by 1e-4."""


def _corner(max_depth):
    to_world = moved((0.5, 0, 0), 0.5)
    camera = stage.camera((2, 0, HALF), (0, 0, HALF), (0, 0, 1), HALF)
    wall = stage.plate((0, 0, 0.5), (1, 0, 0.5), (0, 0, 1), 0.5, 0.5)
    sun = {"type": "directional", "direction": (0, 0, -1), "irradiance": IRRADIANCE}
    return stage.scene(
        camera,
        max_depth,
        floor={"type": "rectangle", "to_world": to_world, "bsdf": stage.diffuse(FLOOR)},
        wall=wall | {"bsdf": stage.diffuse(WALL)},
        sun=sun,
    )


def _factor(height, y, along_x=(0.0, 1.0), along_y=(-0.5, 0.5)):
    """Return F of a part of the floor for points of the wall."""
    return configuration.upright_rectangle(height, y, along_y, along_x)


def _once(x, y):
    height, across = HALF * (1 + y), HALF * x
    return WALL * FLOOR * IRRADIANCE / np.pi * _factor(height, across)


@cache
def _radiosity():
    """Return the wall's radiance as a function of y and z, by collocation at the cells' centres."""
    sides = np.linspace(-0.5, 0.5, CELLS + 1)
    steps = np.linspace(0, 1, CELLS + 1) ** 2  # finer towards the corner
    centres = [(edges[1:] + edges[:-1]) / 2 for edges in (sides, steps)]
    across, away = (grid.ravel() for grid in np.meshgrid(*centres, indexing="ij"))
    cells = [(i, j) for i in range(CELLS) for j in range(CELLS)]

    def factors(height, y):
        """Return F of every cell of the floor for points of the wall, (points, cells)."""
        return np.stack(
            [_factor(height, y, steps[j : j + 2], sides[i : i + 2]) for i, j in cells], axis=-1
        )

    transfer = factors(away, across)
    # By symmetry the same matrix leads from floor to wall and back.
    direct = np.full(len(cells), FLOOR * IRRADIANCE)
    back_and_forth = np.eye(len(cells)) - FLOOR * WALL * transfer @ transfer
    floor = np.linalg.solve(back_and_forth, direct)

    grid = (np.cos(np.linspace(np.pi, 0, 65)) + 1) / 2 * 0.998 + 0.001
    y, z = np.meshgrid(grid - 0.5, grid, indexing="ij")
    values = WALL / np.pi * factors(z, y) @ floor
    return RegularGridInterpolator((grid - 0.5, grid), values, "cubic", False, None)


def _for_ever(x, y):
    return _radiosity()(np.stack([HALF * x, HALF * (1 + y)], axis=1))


EMISSION, WALLS = 0.5, 0.5


def _box():
    """A cube seen from inside, whose walls shine and reflect."""
    camera = stage.camera((0, 0, 0.5), (0, 0, -1), (0, 1, 0), 0.9)
    box = {
        "type": "cube", "flip_normals": True, "bsdf": stage.diffuse(WALLS),
        "emitter": stage.shining(EMISSION),
    }  # fmt: skip
    return stage.scene(camera, box=box)


WITNESSES = (
    Witness(
        "wall of a corner, light from the floor once",
        "ρ ρ′ E F / π, F of the floor",
        "Lambert's contour integral",
        lambda: _corner(3),
        _once,
        size=160,
    ),
    Witness(
        "wall of a corner, light to and fro",
        "(1 − ρ ρ′ F F) B = ρ E, in 24² cells with F of each cell in closed form",
        "radiosity equation",
        lambda: _corner(-1),
        _for_ever,
        form_error=4e-4,
        precision=1.5e-3,
        size=192,
    ),
    Witness(
        "inside a shining box",
        "L = L_e / (1 − ρ), ρ = 0.5",
        "energy",
        _box,
        lambda x, y: np.full_like(x, EMISSION / (1 - WALLS)),
    ),
)
