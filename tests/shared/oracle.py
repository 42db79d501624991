"""The illumination model once more, in plain NumPy of double precision.

It shares no code with `heuristic`, so that the two can only agree by both being right. Equation
numbers are those of the two chapters. Every function takes arrays of points: vectors are (N, 3),
colours (N, C) or (C,).
"""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Light:
    """A light as plain numbers; ``kind`` is point, directional or spot.

    Its numbers may also be arrays with a row for each point.
    """

    kind: str
    intensity: object
    position: tuple = (0.0, 0.0, 0.0)
    direction: tuple = (0.0, 0.0, 1.0)
    cutoff: float = 90.0
    exponent: float = 0.0
    attenuation: tuple = (1.0, 0.0, 0.0)
    clamped: bool = False
    diffuse_intensity: object = None
    specular_intensity: object = None

    def intensities(self):
        """Return ``L_d`` of 6.6 and ``L_s`` of 6.8, both ``I_p`` unless given; (C,) or (N, C)."""
        own = self.diffuse_intensity, self.specular_intensity
        return [
            np.atleast_1d(np.asarray(self.intensity if each is None else each, float))
            for each in own
        ]

    def arriving(self, position):
        """Return ``L``, the factor on the intensity, and how near each point is to the cone's edge.

        The factor is ``f_att`` of 6.1 and 8.6, times cone and fall-off of 6.2-6.4.
        """
        count = len(position)
        if self.kind == "directional":
            toward = -unit(np.array(self.direction, float))
            toward = np.broadcast_to(toward, (count, 3))
            return toward, np.ones(count), np.full(count, np.inf)
        offset = np.array(self.position, float) - position
        distance = np.sqrt(np.sum(offset**2, axis=1))
        toward = offset / distance[:, None]
        k0, k1, k2 = self.attenuation
        factor = 1 / (k0 + k1 * distance + k2 * distance**2)
        if self.clamped:
            factor = np.minimum(factor, 1)
        margin = np.full(count, np.inf)
        if self.kind == "spot":
            cos_axis = -np.sum(toward * unit(np.array(self.direction, float)), axis=1)
            margin = cos_axis - np.cos(np.deg2rad(self.cutoff))
            fading = np.where(cos_axis > 0, cos_axis, 0) ** self.exponent
            factor = np.where(margin >= 0, factor * fading, 0)
        return toward, factor, np.abs(margin)


@dataclass(frozen=True)
class Material:
    """The coefficients as plain numbers or sequences."""

    k_i: object = 0.0
    k_a: object = 0.0
    k_d: object = 0.0
    k_s: object = 0.0
    n: float = 1.0


def unit(vector):
    """Return vectors of length 1."""
    return vector / np.linalg.norm(vector, axis=-1, keepdims=True)


def shade(position, normal, view, material, lights, ambient=0.0):
    """Equations 8.10 and 6.12 for each wavelength; an array (N, C)."""
    position = np.asarray(position, float)
    normal, view = unit(np.asarray(normal, float)), unit(np.asarray(view, float))
    k_i, k_a, k_d, k_s, ambient = (
        np.atleast_1d(np.asarray(value, float))
        for value in (material.k_i, material.k_a, material.k_d, material.k_s, ambient)
    )
    colour = np.zeros((len(position), 1)) + k_i + ambient * k_a
    for light in lights:
        toward, factor, _ = light.arriving(position)
        cos_incidence = np.sum(normal * toward, axis=1)
        mirrored = 2 * normal * cos_incidence[:, None] - toward
        cos_reflection = np.sum(mirrored * view, axis=1)
        lobe = np.zeros(len(position))
        seen = (cos_incidence > 0) & (cos_reflection > 0)
        lobe[seen] = cos_reflection[seen] ** np.broadcast_to(material.n, len(position))[seen]
        cosine = np.maximum(cos_incidence, 0)
        diffuse, specular = light.intensities()
        reflected = diffuse * k_d * cosine[:, None] + specular * k_s * lobe[:, None]
        colour = colour + factor[:, None] * reflected
    return colour


def near_an_edge(position, normal, lights, margin):
    """Tell where the model jumps: on a light's horizon and on the edge of its cone.

    There a rounding step decides, so that two right answers may differ by the whole highlight.
    """
    normal = unit(np.asarray(normal, float))
    near = np.zeros(len(position), bool)
    for light in lights:
        toward, _, cone_margin = light.arriving(np.asarray(position, float))
        near |= np.abs(np.sum(normal * toward, axis=1)) < margin
        near |= cone_margin < margin
    return near


def require_close(value, expected, absolute=0.0, relative=0.0, where=None):
    """Raise AssertionError, naming the worst entry, where ``value`` is too far from ``expected``.

    A NaN in either is an error too. ``where`` (N,) selects the entries that count.
    """
    value, expected = np.asarray(value, float), np.asarray(expected, float)
    assert value.shape == expected.shape, f"shapes {value.shape} and {expected.shape}"
    if where is not None:
        value, expected = value[where], expected[where]
    assert value.size, "nothing to compare"
    excess = np.abs(value - expected) - (absolute + relative * np.abs(expected))
    excess = np.where(np.isnan(excess), np.inf, excess)
    worst = np.unravel_index(np.argmax(excess), excess.shape)
    assert excess[worst] <= 0, (
        f"{np.count_nonzero(excess > 0)} of {excess.size} values are off, the worst at "
        f"{tuple(map(int, worst))}: {value[worst]!r} instead of {expected[worst]!r}"
    )
