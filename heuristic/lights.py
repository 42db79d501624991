"""Point, directional and spot lights (chapter 6, sections 6.3.1-6.3.3).

Each light answers one question, ``illuminate(position)``: from which direction ``L``, with what
intensity and over what distance does its light arrive? Occlusion is not its business.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, isfinite
from numbers import Real
from typing import NamedTuple

import drjit as dr

from heuristic import colours, numerics, terms, vectors
from heuristic.errors import InputError
from heuristic.numerics import is_number

UNATTENUATED = (1, 0, 0)
INVERSE_SQUARE = (0, 0, 1)


class Arrival(NamedTuple):
    """How light arrives at a point: ``L``, ``I_p0 f_att`` and ``d``, infinite for parallel rays."""

    toward: object
    intensity: object
    distance: object


@dataclass(frozen=True)
class DirectionalLight:
    """Parallel rays of constant intensity: the limit of a point light at infinity.

    Parameters
    ----------
    direction
        Direction in which the light travels; any length but zero.
    intensity
        ``I_p``, display-linear: a number, RGB, one value for each wavelength, or a Dr.Jit array.

    Raises
    ------
    InputError
        For a zero or non-finite direction, or a negative or non-finite intensity.
    """

    direction: object
    intensity: colours.Coefficient

    def __post_init__(self):
        _set(self, direction=_direction(self.direction), intensity=_intensity(self.intensity))

    def illuminate(self, position):
        """Return ``L = -direction / |direction|`` and ``I_p``, as an :class:`Arrival`."""
        vector_type = type(position)
        toward = -vectors.normalise(vector_type(self.direction))
        return Arrival(toward, colours.as_array(self.intensity, vector_type), inf)

    def wide_toward(self, position):
        """Return ``L`` in double precision, as a vector and its inverse length."""
        return -numerics.wide_unit(type(position)(self.direction)), 1


@dataclass(frozen=True)
class PointLight:
    """A point that shines alike in all directions (6.1).

    Parameters
    ----------
    position
        ``P_L``, in world space.
    intensity
        ``I_0`` (chapter 8: ``I_p0``), display-linear.
    attenuation
        ``(k0, k1, k2)`` of 6.1, each 0 or more and not all 0. ``(1, 0, 0)`` is no attenuation,
        ``(0, 0, 1)`` the inverse square of 8.6.
    clamped
        Use the other form of 8.6, ``min(1 / (c1 + c2 d + c3 d^2), 1)``.

    Raises
    ------
    InputError
        For a non-finite position, a negative or non-finite intensity, or coefficients that are
        negative, non-finite or all zero.
    """

    position: object
    intensity: colours.Coefficient
    attenuation: tuple = UNATTENUATED
    clamped: bool = False

    def __post_init__(self):
        _set(
            self,
            position=_point(self.position),
            intensity=_intensity(self.intensity),
            attenuation=_attenuation(self.attenuation),
        )

    def illuminate(self, position):
        """Return ``L`` (6.26) and ``I_0 f_att`` (6.1, 8.6), as an :class:`Arrival`."""
        vector_type = type(position)
        toward, distance = vectors.light_vector(vector_type(self.position), position)
        intensity = colours.as_array(self.intensity, vector_type)
        return _attenuated(toward, intensity, distance, self, position)

    def wide_toward(self, position):
        """Return ``L`` in double precision, as a vector and its inverse length."""
        return vectors.wide_light_vector(type(position)(self.position), position)


@dataclass(frozen=True)
class SpotLight:
    """A point that shines into a cone about an axis (6.2-6.4).

    Parameters
    ----------
    position, intensity, attenuation, clamped
        As of :class:`PointLight`.
    direction
        ``v_L``, the axis, in the direction of travel; any length but zero.
    cutoff
        ``omega_L``, the angle between the axis and the edge of the cone, in degrees, within (0,
        180).
    exponent
        ``m`` of 6.4, 0 or more; 0 is an even cone.

    Raises
    ------
    InputError
        As :class:`PointLight`, and for a zero direction, a cutoff outside (0, 180) or a negative
        exponent.
    """

    position: object
    direction: object
    intensity: colours.Coefficient
    cutoff: float
    exponent: float = 0
    attenuation: tuple = UNATTENUATED
    clamped: bool = False

    def __post_init__(self):
        if isinstance(self.cutoff, Real) and not 0 < self.cutoff < 180:
            raise InputError(
                f"cutoff = {self.cutoff!r} is not allowed: give an angle between 0 and 180 degrees,"
                " both excluded."
            )
        if isinstance(self.exponent, Real) and not 0 <= self.exponent < inf:
            raise InputError(
                f"exponent = {self.exponent!r} is not allowed: give a finite value of 0 or more."
            )
        _set(
            self,
            position=_point(self.position),
            direction=_direction(self.direction),
            intensity=_intensity(self.intensity),
            attenuation=_attenuation(self.attenuation),
        )

    def illuminate(self, position):
        """Equation 6.3: ``I_0 f_att`` within the cone; times the fall-off of 6.4 where ``m > 0``.

        Returns an :class:`Arrival`.
        """
        vector_type = type(position)
        toward, distance = vectors.light_vector(vector_type(self.position), position)
        axis = vectors.normalise(vector_type(self.direction))
        cos_axis = vectors.chord_cosine(axis, -toward)
        cone = terms.spot_cone(cos_axis, numerics.cosine_of_degrees(self.cutoff))
        if not is_number(self.exponent, 0):
            cosine = cos_axis.value if numerics.is_moderate(self.exponent) else cos_axis
            cone *= terms.spot_falloff(cosine, self.exponent)
        intensity = colours.as_array(self.intensity, vector_type)
        return _attenuated(toward, intensity * cone, distance, self, position)

    def wide_toward(self, position):
        """Return ``L`` in double precision, as a vector and its inverse length."""
        return vectors.wide_light_vector(type(position)(self.position), position)


def is_unattenuated(coefficients):
    """Tell whether coefficients of 6.1 are ``(1, 0, 0)`` by construction."""
    return all(map(is_number, coefficients, UNATTENUATED))


def _attenuated(toward, intensity, distance, light, position):
    if not is_unattenuated(light.attenuation):
        law = terms.clamped_attenuation if light.clamped else terms.attenuation
        if not light.clamped and terms.is_tame(light.attenuation, light.intensity):
            law = terms.tame_attenuation
        inverse = vectors.inverse_distance(type(position)(light.position), position)
        intensity = law(distance, *light.attenuation, intensity, inverse)
    return Arrival(toward, intensity, distance)


def _set(light, **values):
    for name, value in values.items():
        object.__setattr__(light, name, value)


def _triple(name, value):
    """Return three finite floats, or the Dr.Jit array that was given."""
    if dr.is_array_v(value) and dr.is_jit_v(value):
        return value
    try:
        triple = tuple(float(component) for component in value)
    except (TypeError, ValueError):
        triple = ()
    if len(triple) != 3 or not all(map(isfinite, triple)):
        raise InputError(f"{name} = {value!r} is not allowed: give three finite numbers.")
    return triple


def _point(value):
    return _triple("position", value)


def _direction(value):
    direction = _triple("direction", value)
    if isinstance(direction, tuple) and not any(direction):
        raise InputError("direction = (0, 0, 0) points nowhere: give a vector of any other length.")
    return direction


def _intensity(value):
    return colours.checked("intensity", value)


def _attenuation(value):
    """Return three checked numbers; where one is a Dr.Jit value, none is looked at."""
    coefficients = tuple(value) if isinstance(value, Sequence) else ()
    if len(coefficients) == 3 and any(map(dr.is_array_v, coefficients)):
        return coefficients
    are_numbers = all(isinstance(c, Real) and isfinite(c) and c >= 0 for c in coefficients)
    if len(coefficients) != 3 or not are_numbers or not any(coefficients):
        raise InputError(
            f"attenuation = {value!r} is not allowed: give three numbers k0, k1, k2, finite, 0 or"
            " more, and not all 0."
        )
    return coefficients
