"""Point, directional and spot lights (chapter 6, sections 6.3.1-6.3.3): one class per kind."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from typing import Any

import drjit as dr

from heuristic import colours, numerics, terms, vectors
from heuristic.arrays import Colour, Direction, Number, Position, Vector
from heuristic.light import Arrival, Light
from heuristic.numerics import is_number

UNATTENUATED = (1, 0, 0)
INVERSE_SQUARE = (0, 0, 1)


def is_unattenuated(coefficients: Sequence) -> bool:
    """Return whether coefficients of 6.1 are ``(1, 0, 0)`` by construction."""
    return all(map(is_number, coefficients, UNATTENUATED))


@dataclass(frozen=True)
class DirectionalLight(Light, plugin="heuristic_directional"):
    """Parallel rays of constant intensity: the limit of a point light at infinity.

    Parameters
    ----------
    direction
        Direction in which the light travels; any length but zero.
    intensity
        ``I_p``, display-linear: a number, RGB, one value per wavelength, or a Dr.Jit array.

    Raises
    ------
    InputError
        For a zero or non-finite direction, or a negative or non-finite intensity.
    """

    direction: Direction
    intensity: Colour

    def illuminate(self, position: Position) -> Arrival:
        """Return ``L = -direction / |direction|`` and ``I_p``."""
        vector_type = type(position)
        toward = -vectors.normalise(vector_type(self.direction))
        return Arrival(toward, colours.as_array(self.intensity, vector_type), inf)

    def wide_toward(self, position: Position) -> tuple[Vector, Number]:
        return -numerics.wide_unit(type(position)(self.direction)), 1


class _LightFromPoint(Light):
    """Base of lights with a position: ``L``, the distance, and attenuation."""

    position: Position
    attenuation: tuple[Number, Number, Number]
    clamped: bool
    shell: Number

    def wide_toward(self, position: Position) -> tuple[Vector, Number]:
        return vectors.wide_light_vector(type(position)(self.position), position)

    def compiled(self) -> dict[str, Any]:
        even = {"attenuation": UNATTENUATED} if is_unattenuated(self.attenuation) else {}
        bare = {"shell": 0} if is_number(self.shell, 0) else {}
        return {"clamped": self.clamped} | even | bare

    def _attenuated(
        self, toward: Direction, intensity: Colour, distance: Number, position: Position
    ) -> Arrival:
        if not is_unattenuated(self.attenuation):
            law: Callable[..., Colour]
            law = terms.clamped_attenuation if self.clamped else terms.attenuation
            if not self.clamped and terms.is_tame(self.attenuation, self.intensity):
                law = terms.tame_attenuation
            inverse = vectors.inverse_distance(type(position)(self.position), position)
            intensity = law(distance, *self.attenuation, intensity, inverse)
        if not is_number(self.shell, 0):
            distance = dr.maximum(distance - self.shell, 0)
        return Arrival(toward, intensity, distance)


@dataclass(frozen=True)
class PointLight(_LightFromPoint, plugin="heuristic_point"):
    """A point that shines equally in all directions (6.1).

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
    shell
        Radius about the position in which nothing casts a shadow: the body of the lamp.

    Raises
    ------
    InputError
        For a non-finite position, a negative or non-finite intensity, or coefficients that are
        negative, non-finite or all zero.
    """

    position: Position
    intensity: Colour
    attenuation: tuple[Number, Number, Number] = UNATTENUATED
    clamped: bool = False
    shell: Number = 0

    def illuminate(self, position: Position) -> Arrival:
        """Return ``L`` (6.26) and ``I_0 f_att`` (6.1, 8.6)."""
        vector_type = type(position)
        toward, distance = vectors.light_vector(vector_type(self.position), position)
        intensity = colours.as_array(self.intensity, vector_type)
        return self._attenuated(toward, intensity, distance, position)


@dataclass(frozen=True)
class SpotLight(_LightFromPoint, plugin="heuristic_spot"):
    """A point that shines into a cone about an axis (6.2-6.4).

    Parameters
    ----------
    position, intensity, attenuation, clamped, shell
        See :class:`PointLight`.
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
        Same as :class:`PointLight`, and for a zero direction, a cutoff outside (0, 180) or a
        negative exponent.
    """

    position: Position
    direction: Direction
    intensity: Colour
    cutoff: float
    exponent: float = 0
    attenuation: tuple[Number, Number, Number] = UNATTENUATED
    clamped: bool = False
    shell: Number = 0

    def compiled(self) -> dict[str, Any]:
        even = {"exponent": 0} if is_number(self.exponent, 0) else {}
        return super().compiled() | even

    def illuminate(self, position: Position) -> Arrival:
        """Equation 6.3: ``I_0 f_att`` within the cone; times the fall-off of 6.4 where ``m > 0``.

        Returns an :class:`heuristic.light.Arrival`.
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
        return self._attenuated(toward, intensity * cone, distance, position)
