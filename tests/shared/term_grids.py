"""A grid of terms with made-up numbers: a slope under two lamps, and nothing in its first row."""

from dataclasses import replace

import numpy as np

from fotismos.comparisons.records.images import GridLight, LivePoints, TermGrid, TermMaterial

CELL = 4
"""Pixels along the sides of a cell."""


def grid(resolution, pixel=None):
    """Return a grid of half a cell's offset for an image of a width and a height.

    The column and row of a pixel take the place of the nearest.
    """
    columns, rows = (np.arange(CELL // 2, side, CELL) for side in resolution)
    if pixel:
        columns[pixel[0] // CELL] = pixel[0]
        rows[pixel[1] // CELL] = pixel[1]
    across, down = np.meshgrid(np.linspace(0, 1, len(columns)), np.linspace(0, 1, len(rows)))
    material = np.where(down > 0.5, 1, 0)
    material[0] = -1
    view = np.cos(0.2 + 0.8 * down)
    return TermGrid(
        resolution,
        columns,
        rows,
        (_material("matt <b>", 0.0, 1.0), _material("shiny", 0.5, 12.0)),
        material,
        view,
        (
            _light("key", (2.0, 1.5, 1.0), 1.2 * across, view, 0.3 * across, 12.0),
            _light("fill", (0.2, 0.3, 0.5), 1.0 + down, view, 0.8 * down, 12.0),
        ),
    )


def _material(name, k_s, n):
    k_d = (0.6, 0.4, 0.2)
    return TermMaterial(name, (0.0,) * 3, (0.3,) * 3, k_d, (k_s,) * 3, n, "phong", (0.1,) * 3)


def _light(name, intensity, angle, view, azimuth, n):
    """Return a light at an angle from N, turned by an azimuth out of the plane of N and V."""
    cosine, sine = np.cos(angle), np.sin(angle)
    cos_view = cosine * view - sine * np.sqrt(1 - view**2) * np.cos(azimuth)
    lobe = np.where(cosine > 0, np.maximum(2 * cosine * view - cos_view, 0) ** n, 0)
    specular = intensity if name == "key" else intensity[::-1]
    return GridLight(name, intensity, specular, 0.5 + 0.2 * azimuth, cosine, cos_view, lobe)


def points(resolution):
    """Return points of a floor seen from above, with steps at its right, under three lights.

    Its lower half shines a little.
    """
    width, height = resolution
    u, v = np.meshgrid((np.arange(width) + 0.5) / width, (np.arange(height) + 0.5) / height)
    x, y, corners = 2 * u - 1, 1.4 * v - 0.7, ((0, 0), (0, -1), (-1, 0))
    material = np.where(v > 0.5, 2, 1)
    material[0] = 0
    planes = {"material": material, "depth": np.log(2 * np.sqrt(x**2 + y**2 + 4))}
    for name, slope in (("normal", 0.0), ("face_normal", np.where(u > 0.5, 0.6, 0.0))):
        planes |= {f"{name}.x": slope + 0 * u, f"{name}.y": 0 * u}
        planes[f"{name}.z"] = np.sqrt(1 - planes[f"{name}.x"] ** 2)

    def own(colour):
        kinds = ("intensity", "diffuse_intensity", "specular_intensity")
        return {kind: list(colour) for kind in kinds}

    even = {"attenuation": [1.0, 0.0, 0.0], "clamped": [False], "shell": [0.0]}
    key = (
        {
            "name": "key",
            "position": [1.0, 1.0, 2.0],
        }
        | own((2.0, 1.5, 1.0))
        | even
    )
    sun = {"name": "sun", "direction": [0.0, 0.6, -0.8]} | own((0.5, 0.5, 0.9))
    cone = {"name": "cone", "direction": [0.0, 0.0, -1.0], "cutoff": [30.0], "exponent": [2.0]}
    shiny = replace(_material("shiny", 0.5, 12.0), k_i=(0.02, 0.01, 0.0))
    return LivePoints(
        planes,
        (_material("matt <b>", 0.0, 1.0), shiny),
        (key, sun, key | cone),
        [[[0, 0, 4]] * 3, [[x[row, column], y[row, column], -2] for row, column in corners]],
        is_flat=False,
    )
