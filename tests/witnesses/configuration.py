"""Configuration factors in closed form: shares of the light of a Lambertian source that arrive.

The irradiance at a small plane from a source of radiance ``L`` is ``pi L F``. The factors of plane
elements are Lambert's contour integral, the others their means; all are in Howell's catalogue.
"""

import numpy as np


def parallel_rectangle(x, y, along_x, along_y, height):
    """Return F at the points (x, y, 0), facing up, of a rectangle at a height, facing down."""

    def corner(a, b):
        a, b = a / height, b / height
        one, other = np.hypot(1, a), np.hypot(1, b)
        return a / one * np.arctan(b / one) + b / other * np.arctan(a / other)

    return _over_corners(corner, x, y, along_x, along_y) / (2 * np.pi)


def upright_rectangle(distance, y, along_y, along_z):
    """Return F at points of a floor, facing up, of a rectangle on an upright plane that faces them.

    ``distance`` is that to the plane, ``along_z`` from 0 upwards, ``y`` along the plane's foot.
    """

    def corner(b, c):
        slant = np.hypot(c, distance)
        return np.arctan(b / distance) - distance / slant * np.arctan(b / slant)

    return _over_corners(corner, y, 0.0, along_y, along_z) / (2 * np.pi)


def parallel_disc(offset, radius, height):
    """Return F at points facing up, of a disc at a height whose axis is at ``offset``."""
    sum_of_squares = offset**2 + height**2 + radius**2
    root = np.sqrt(sum_of_squares**2 - 4 * offset**2 * radius**2)
    return (1 - (offset**2 + height**2 - radius**2) / root) / 2


def sphere(cosine, distance, radius):
    """Return F of a sphere that is wholly above the horizon: ``(r / d)^2 cos``."""
    return (radius / distance) ** 2 * cosine


def between_parallel_squares(side, distance):
    """Return F from one square to the equal one that is opposite."""
    x = side / distance
    root = np.hypot(1, x)
    logarithm = np.log((1 + x * x) / np.sqrt(1 + 2 * x * x))
    return 2 / (np.pi * x * x) * (logarithm + 2 * x * (root * np.arctan(x / root) - np.arctan(x)))


def between_squares_of_a_corner():
    """Return F from one square to the equal one that stands upright on one of its sides."""
    root = np.sqrt(2)
    return (np.pi / 2 - root * np.arctan(1 / root) + np.log(3 / 4) / 4) / np.pi


def disc_to_sphere(disc, sphere, distance):
    """Return F from a disc to a sphere whose centre is on its axis."""
    seen = (1 - 1 / np.hypot(1, disc / distance)) / 2  # from the sphere to the disc
    return seen * 4 * (sphere / disc) ** 2


def _over_corners(corner, x, y, along_x, along_y):
    (x0, x1), (y0, y1) = along_x, along_y
    return (
        corner(x1 - x, y1 - y)
        - corner(x0 - x, y1 - y)
        - corner(x1 - x, y0 - y)
        + corner(x0 - x, y0 - y)
    )
