"""Point, directional and spot lights (chapter 6, sections 6.3.1-6.3.3): one class per kind.

A light answers one question, ``illuminate(position)``: from which direction ``L``, with what
intensity and over what distance does its light arrive? Occlusion is handled elsewhere. A light also
states which of its values determine the kernel's instructions, so lights of one structure can share
a kernel.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from enum import Enum
from inspect import signature
from math import inf, isfinite
from numbers import Real
from typing import Annotated, Any, ClassVar, NamedTuple, Self

import drjit as dr

from fotismos.heuristic import materials, numerics, terms, vectors
from fotismos.heuristic.convention import (
    Colour,
    Direction,
    Mask,
    Number,
    Position,
    Scene,
    Vector,
    Visibility,
)
from fotismos.heuristic.errors import InputError, with_known_words
from fotismos.heuristic.numerics import is_number

UNATTENUATED = (1, 0, 0)
INVERSE_SQUARE = (0, 0, 1)

INTENSITIES = ("intensity", "diffuse_intensity", "specular_intensity")
"""The fields that hold a colour: ``I_p``, and ``L_d`` and ``L_s`` if they differ from it."""

FAR = 1e8
"""Where shadow rays of parallel light end: outside any scene. A Python plugin does not learn the
size of the scene from Mitsuba, and rays of this length still keep their direction to 1e-7."""


STEEPEST = 2.0**24
"""The factor that derivatives close to a light leave room for (:meth:`Light.is_steep`)."""


class Extent(NamedTuple):
    """The size of a lamp about its position, in world space and units of the scene.

    ``radius`` is that of a sphere or a disc, ``u`` and ``v`` are half the edges of a rectangle, as
    vectors. What a lamp does not have is 0.
    """

    radius: Number
    u: Vector
    v: Vector


class Arrival(NamedTuple):
    """How light arrives at a point: ``L``, ``L_d f_att``, ``L_s f_att`` and ``d``.

    ``d`` is infinite for parallel rays, and ends at the shell of a lamp that has one: shadow rays
    go no further.
    """

    toward: Direction
    diffuse: Colour
    specular: Colour
    distance: Number


def _triple(name: str, value: Any) -> Any:
    """Return three finite floats, or the Dr.Jit array that was given."""
    if dr.is_array_v(value) and dr.is_jit_v(value):
        if dr.depth_v(value) == 2 and dr.size_v(value) == 3:
            return value
        raise InputError(f"{name}: {type(value).__name__} is not allowed: give three components.")
    try:
        triple = tuple(float(component) for component in value)
    except (TypeError, ValueError, OverflowError):
        triple = ()
    if len(triple) != 3 or not all(map(isfinite, triple)):
        raise InputError(f"{name} = {value!r} is not allowed: give three finite numbers.")
    return triple


def _direction(name: str, value: Any) -> Any:
    direction = _triple(name, value)
    if isinstance(direction, tuple) and not any(direction):
        raise InputError(f"{name} = (0, 0, 0) points nowhere: give a vector of any other length.")
    return direction


def _attenuation(name: str, value: Any) -> tuple[Any, ...]:
    """Return three checked numbers; if one is a Dr.Jit value, none is checked."""
    coefficients = tuple(value) if isinstance(value, Sequence) else ()
    if len(coefficients) == 3 and any(map(dr.is_array_v, coefficients)):
        return coefficients
    are_numbers = all(isinstance(c, Real) and isfinite(c) and float(c) >= 0 for c in coefficients)
    if len(coefficients) != 3 or not are_numbers or not any(coefficients):
        raise InputError(
            f"{name} = {value!r} is not allowed: give three numbers k0, k1, k2, finite, 0 or"
            " more, and not all 0."
        )
    return coefficients


def _number(is_allowed: Callable[[Any], bool], allowed: str) -> Callable[[str, Any], Any]:
    """Return the check of a number, which says what is ``allowed``."""

    def check(name: str, value: Any) -> Any:
        number = numerics.plain(value)
        if number is None or (isinstance(number, Real) and not is_allowed(number)):
            raise InputError(f"{name} = {value!r} is not allowed: give {allowed}.")
        return number

    return check


def _intensity(name: str, value: Any) -> Any:
    is_omitted = value is None and name != "intensity"
    return None if is_omitted else materials.checked_colour(name, value)


class Derivative(Enum):
    """How light depends on a parameter: smoothly, with edges that move, or not as Mitsuba counts.

    As in Mitsuba's own lights, ``prb`` takes no derivative of the direction in which light arrives.
    """

    SMOOTH = "smooth"
    EDGES = "edges"
    NONE = "none"


@dataclass(frozen=True)
class LightField:
    """What a field of a light is, as metadata of its annotation.

    ``check(name, value)`` returns the value as the kernel takes it, or raises `InputError`.
    ``parameter`` is Mitsuba's type of the plugin's parameter of the same name, such as ``Float``,
    and ``default`` its default; empty if the plugin reads the field in another way. A parameter
    that ``adds_nothing_at_0`` stays a plain 0, for which the kernel has no instruction.
    """

    check: Callable[[str, Any], Any]
    parameter: str = ""
    default: Any = 0.0
    derivative: Derivative = Derivative.SMOOTH
    adds_nothing_at_0: bool = False


Intensity = Annotated[Colour, LightField(_intensity)]
Place = Annotated[
    Position,
    LightField(_triple, parameter="Point3f", default=(0, 0, 0), derivative=Derivative.NONE),
]
Travel = Annotated[
    Direction,
    LightField(_direction, parameter="Vector3f", default=(0, 0, 1), derivative=Derivative.NONE),
]
Axis = Annotated[
    Direction,
    LightField(_direction, parameter="Vector3f", default=(0, 0, 1), derivative=Derivative.EDGES),
]
Cutoff = Annotated[
    float,
    LightField(
        _number(
            lambda degrees: 0 < degrees < 180,
            "an angle between 0 and 180 degrees, both excluded",
        ),
        parameter="Float",
        default=30.0,
        derivative=Derivative.NONE,
    ),
]
Exponent = Annotated[
    float,
    LightField(
        _number(
            lambda m: 0 <= m <= numerics.LARGEST_EXPONENT,
            f"a finite value of 0 or more, at most {numerics.LARGEST_EXPONENT:.2g}",
        ),
        parameter="Float",
    ),
]
Attenuation = Annotated[tuple[Number, Number, Number], LightField(_attenuation)]
Shell = Annotated[
    Number,
    LightField(
        _number(lambda r: 0 <= r < inf, "a finite radius of 0 or more"),
        parameter="Float",
        derivative=Derivative.NONE,
        adds_nothing_at_0=True,
    ),
]
Clamped = Annotated[bool, LightField(materials.checked_flag)]


def light_fields(kind: type["Light"]) -> dict[str, LightField]:
    """Return what the fields of a kind of light are, by their names."""
    of_kind: Any = kind  # a dataclass, which `Light` itself is not
    annotated = {field.name: getattr(field.type, "__metadata__", ()) for field in fields(of_kind)}
    return {name: metadata[0] for name, metadata in annotated.items() if metadata}


class Light:
    """A kind of light, as the kernel sees it; each subclass is a frozen dataclass.

    ``plugin`` is its emitter in a Mitsuba scene. The annotation of a field holds its check and the
    plugin's parameter (:class:`LightField`); fields of one name mean the same in all kinds.
    ``diffuse_intensity`` is ``L_d``, the light that takes part in diffuse reflection (6.6),
    ``specular_intensity`` ``L_s`` (6.8); each is ``intensity`` if omitted. Without a position its
    rays are ``parallel``.
    """

    plugin: ClassVar[str]
    parallel: ClassVar[bool] = False
    intensity: Colour
    diffuse_intensity: Colour
    specular_intensity: Colour
    position: Position
    attenuation: tuple[Number, Number, Number]
    clamped: bool
    shell: Number
    extent: Extent | None = None

    def __post_init__(self) -> None:
        for name, field in light_fields(type(self)).items():
            object.__setattr__(self, name, field.check(name, getattr(self, name)))

    @property
    def intensities(self) -> list[Colour]:
        """``L_d`` and ``L_s``; one colour alone if it is the same."""
        given = self.diffuse_intensity, self.specular_intensity
        colours = [self.intensity if intensity is None else intensity for intensity in given]
        return colours[:1] if colours[0] is colours[1] else colours

    def illuminate(self, position: Position, visible: Visibility | None = None) -> Arrival:
        """Return how light arrives; black where ``visible(toward, distance)`` is false."""
        toward, distance, colours = self.rays(position)
        if visible is not None:
            is_seen = visible(toward, distance)
            colours = [dr.select(is_seen, colour, 0) for colour in colours]
        return Arrival(toward=toward, diffuse=colours[0], specular=colours[-1], distance=distance)

    def rays(self, position: Position) -> tuple[Direction, Number, list[Colour]]:
        """Return ``L`` (6.26), ``d``, and intensities times ``f_att`` (6.1, 8.6) and cone (6.3)."""
        vector_type = type(position)
        toward, distance = vectors.light_vector(vector_type(self.position), position)
        cone = self.cone(toward)
        # With the cone first: the attenuation keeps the whole product in the type's range.
        colours = [
            materials.as_array(intensity, vector_type) * cone for intensity in self.intensities
        ]
        if not is_unattenuated(self.attenuation):
            law: Callable[..., Colour]
            law = terms.clamped_attenuation if self.clamped else terms.attenuation
            inverse = vectors.inverse_distance(vector_type(self.position), position)
            colours = [law(distance, *self.attenuation, colour, inverse) for colour in colours]
        if not is_number(self.shell, 0):
            distance = dr.maximum(distance - self.shell, 0)
        return toward, distance, colours

    def is_steep(self, distance: Number) -> Mask | None:
        """Return where the light's terms count as constants, None for nowhere.

        That is close to the light: the derivative of ``1 / d^2`` is ``-2 / d^3``, which leaves the
        type's range long before the value does. Derivatives are taken as 0 where they would leave
        no room for a factor of 2^24: in single precision for ``d < 4e-11``. Without attenuation
        that holds for the scaled distance, of which the square has vanished: ``d < 4e-30``.
        """
        nearest = (STEEPEST / numerics.largest(distance)) ** (1 / 3)
        if is_unattenuated(self.attenuation):
            nearest *= numerics.smallest(distance) ** 0.5
        return distance < nearest

    def cone(self, toward: Direction) -> Number:
        """Return the factor on the intensity towards a light; 1 unless it is a spot."""
        return 1

    def wide_toward(self, position: Position) -> tuple[Vector, Number]:
        """Return ``L`` in double precision, as a vector and its inverse length."""
        return vectors.wide_light_vector(type(position)(self.position), position)

    def offset(self, position: Position) -> numerics.Compensated:
        """Return a vector towards the light, of any length, and what its rounding lost."""
        half = type(position)(self.position) * 0.5
        return numerics.add((half, 0), -0.5 * position)

    def given(self) -> dict[str, Any]:
        """Return the fields that the kernel reads and that are not omitted, with their values."""
        known = {name: value for name, value in vars(self).items() if name != "extent"}
        return {name: value for name, value in known.items() if value is not None}

    def compiled(self) -> dict[str, Any]:
        """Return the fields that are part of the kernel's code, with their values."""
        even = {"attenuation": UNATTENUATED} if is_unattenuated(self.attenuation) else {}
        bare = {"shell": 0} if is_number(self.shell, 0) else {}
        return {"clamped": self.clamped} | even | bare

    def structure(self) -> tuple[Any, ...]:
        """Return what determines the light's instructions, apart from its numbers; hashable."""
        counts = map(materials.wavelength_count, self.intensities)
        return type(self), tuple(counts), *self.compiled().items()

    def opaque(self, vector_type: type) -> Self:
        """Return the light with its numbers out of the kernel's code, as opaque Dr.Jit values."""

        def moved(value: Any) -> Any:
            if isinstance(value, tuple):
                return tuple(map(moved, value))
            return dr.opaque(float_type, value) if isinstance(value, Real) else value

        float_type = dr.value_t(vector_type)
        compiled = self.compiled()
        values = {
            name: moved(value) for name, value in self.given().items() if name not in compiled
        }
        # Vectors and colours get the kernel's own types, so that all blocks have the same.
        for name in {"position", "direction"} & values.keys():
            values[name] = vector_type(values[name])
        for name in values.keys() & INTENSITIES:
            values[name] = materials.as_array(values[name], vector_type)
        return type(self)(**vars(self) | values)


@with_known_words
@dataclass(frozen=True)
class DirectionalLight(Light):
    """Parallel rays of constant intensity: the limit of a point light at infinity.

    ``direction`` is that in which the light travels, of any length but zero. ``intensity`` is
    ``I_p``, display-linear: a number, RGB, one value per wavelength, or a Dr.Jit array.
    """

    plugin: ClassVar[str] = "heuristic_directional"
    parallel: ClassVar[bool] = True

    direction: Travel
    intensity: Intensity
    diffuse_intensity: Intensity = None
    specular_intensity: Intensity = None

    def rays(self, position: Position) -> tuple[Direction, Number, list[Colour]]:
        """Return ``L = -direction / |direction|``, an infinite distance and the intensities."""
        vector_type = type(position)
        toward = -vectors.normalise(vector_type(self.direction))
        colours = [materials.as_array(intensity, vector_type) for intensity in self.intensities]
        return toward, inf, colours

    def wide_toward(self, position: Position) -> tuple[Vector, Number]:
        return -numerics.wide_unit(type(position)(self.direction)), 1

    def compiled(self) -> dict[str, Any]:
        return {}

    def offset(self, position: Position) -> numerics.Compensated:
        direction = type(position)(self.direction)
        return -direction, 0 * direction

    def is_steep(self, distance: Number) -> None:
        return None


@with_known_words
@dataclass(frozen=True)
class PointLight(Light):
    """A point that shines equally in all directions (6.1).

    ``position`` is ``P_L`` in world space, ``intensity`` ``I_0`` (chapter 8: ``I_p0``),
    display-linear. ``attenuation`` is ``(k0, k1, k2)`` of 6.1, each 0 or more and not all 0: ``(1,
    0, 0)`` means none, ``(0, 0, 1)`` the inverse square of 8.6. ``clamped`` is the other
    form of 8.6, ``min(1 / (c1 + c2 d + c3 d^2), 1)``. Within the radius ``shell`` about the
    position, the body of the lamp, nothing casts a shadow. ``extent`` is for users' shaders: this
    light is a point.
    """

    plugin: ClassVar[str] = "heuristic_point"

    position: Place
    intensity: Intensity
    attenuation: Attenuation = UNATTENUATED
    clamped: Clamped = False
    shell: Shell = 0
    diffuse_intensity: Intensity = None
    specular_intensity: Intensity = None
    extent: Extent | None = None


@with_known_words
@dataclass(frozen=True)
class SpotLight(Light):
    """A point that shines into a cone about an axis (6.2-6.4).

    The axis ``v_L`` is ``direction``, that of travel, of any length but zero; ``cutoff`` is
    ``omega_L``, the angle between axis and edge in degrees, within (0, 180); ``exponent`` is ``m``
    of 6.4, 0 for an even cone. The others are those of :class:`PointLight`.
    """

    plugin: ClassVar[str] = "heuristic_spot"

    position: Place
    direction: Axis
    intensity: Intensity
    cutoff: Cutoff
    exponent: Exponent = 0
    attenuation: Attenuation = UNATTENUATED
    clamped: Clamped = False
    shell: Shell = 0
    diffuse_intensity: Intensity = None
    specular_intensity: Intensity = None
    extent: Extent | None = None

    def cone(self, toward: Direction) -> Number:
        """Equation 6.3: 1 within the cone, else 0; times the fall-off of 6.4 where ``m > 0``."""
        axis = vectors.normalise(type(toward)(self.direction))
        cos_axis = vectors.chord_cosine(axis, -toward)
        cone = terms.spot_cone(cos_axis, numerics.cosine_of_degrees(self.cutoff))
        if is_number(self.exponent, 0):
            return cone
        return cone * terms.spot_falloff(cos_axis, self.exponent)

    def compiled(self) -> dict[str, Any]:
        even = {"exponent": 0} if is_number(self.exponent, 0) else {}
        return super().compiled() | even


PLUGINS: dict[str, type[Light]] = {
    kind.plugin: kind for kind in (PointLight, DirectionalLight, SpotLight)
}
"""The kinds of light, by their emitter plugin in a Mitsuba scene."""


def plugins_with(field: str) -> list[str]:
    """Return the plugins of the kinds of light that have a field."""
    return [plugin for plugin, kind in PLUGINS.items() if has_field(kind, field)]


def has_field(kind: type[Light], field: str) -> bool:
    """Return whether a kind of light has a field, such as ``attenuation`` or ``cutoff``."""
    return field in signature(kind).parameters


def lamps(scene: Scene) -> list[Any]:
    """Return the emitters of a scene that the kernel knows as lights."""
    return [emitter for emitter in scene.emitters() if hasattr(emitter, "light")]


def is_unattenuated(coefficients: Sequence[Number]) -> bool:
    """Return whether coefficients of 6.1 are ``(1, 0, 0)`` by construction."""
    return all(map(is_number, coefficients, UNATTENUATED))
