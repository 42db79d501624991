"""The shading kernel: the whole illumination model at many points at once (8.10)."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import inf
from numbers import Real
from typing import Any

import drjit as dr
import numpy as np

from fotismos.heuristic import materials, numerics, terms, vectors
from fotismos.heuristic.convention import (
    Array,
    Colour,
    Cosines,
    Mask,
    Number,
    Position,
    Vector,
    Visibility,
)
from fotismos.heuristic.errors import InputError, type_of
from fotismos.heuristic.lights import INTENSITIES, PLUGINS, Arrival, Light
from fotismos.heuristic.materials import COEFFICIENTS, Material

HOW = "give a Dr.Jit array of three components, such as drjit.auto.Array3f(x, y, z)"


def shade(
    position: Position,
    normal: Vector,
    view: Vector,
    material: Material,
    lights: Sequence[Light],
    ambient: Colour = 0,
    visible: Visibility | None = None,
) -> Colour:
    """Equations 8.10-8.12, 6.11-6.15: the sum of all terms over all lights.

    ``I = k_i + I_a k_a + sum_k I_p0^k f_att^k [k_d (N.L^k) + k_s (R^k.V)^n]``, evaluated for each
    wavelength (8.11) or for RGB (8.12, 6.13-6.15). A light of two intensities has ``L_d`` in the
    first product and ``L_s`` in the second, in place of ``I_p0`` (6.6-6.12). Lights at or below the
    horizon (``N.L <= 0``) give neither diffuse nor specular light. Only terms that can be non-zero
    are traced: a coefficient of 0, or an empty list of lights, adds no instruction.

    ``P``, ``N`` and ``V`` are Dr.Jit arrays of three components, of any float type, in one space.
    Normals and views of any length are normalised; a zero vector receives no light. Three plain
    numbers stand for all points if another of the three is a Dr.Jit array. Half precision and
    integers are computed in single precision. Where a component is NaN, so is the result. Numbers
    in up to :data:`BLOCK` lights, and in the material, are compiled into the kernel; opaque Dr.Jit
    values are not. ``ambient`` is ``I_a``, any colour. ``visible(toward, distance)`` returns a mask
    of the points that a light in that direction, at that distance, reaches: the chapters' model has
    no shadows.

    The value is display-linear: a float if all coefficients are single numbers, otherwise a colour
    with one component per wavelength. No term of a light exceeds the type's largest float, but
    their sum may, and is then infinite: next to a light of inverse-square type, say.

    Two points under a light from straight above, the second of them tilted:

    >>> from fotismos.heuristic import DirectionalLight, Material, shade
    >>> from drjit.auto import Array3f
    >>> sun = DirectionalLight(direction=(0, 0, -1), intensity=1.0)
    >>> normals = Array3f([0, 0.6], [0, 0], [1, 0.8])
    >>> shade(Array3f(0), normals, Array3f(0, 0, 1), Material(k_d=0.5), [sun])
    [0.5, 0.4]
    """
    position, normal, view = checked_vectors(position, normal, view)
    lights = _checked_lights(lights)
    if not isinstance(material, Material):
        raise InputError(f"material is {type_of(material)}: give a fotismos.heuristic.Material.")
    ambient = materials.checked_colour("ambient", ambient)
    values = {name: getattr(material, name) for name in COEFFICIENTS} | {"ambient": ambient}
    point = {"position": position, "normal": normal, "view": view, "n": material.n}
    _check_sizes(point | values, lights)
    intensities = {
        f"lights[{i}].{name}": value
        for i, light in enumerate(lights)
        for name, value in light.given().items()
        if name in INTENSITIES
    }
    materials.require_common_wavelengths(values | intensities)
    # Factors for the kernel: numbers stay numbers, tuples become arrays.
    vector_type = type(position)
    arrays = [materials.as_array(value, vector_type) for value in values.values()]
    k_i, k_a, k_d, k_s, ambient = arrays
    # The type of a sum of all terms, whether or not each is there.
    arrays = [type(value) for value in arrays if dr.is_array_v(value)]
    float_type = dr.value_t(vector_type)
    total = (dr.expr_t(float_type, *arrays) if arrays else float_type)(0)
    # Terms without a light.
    if not materials.is_zero(material.k_i):
        total = total + terms.emission(k_i)
    if not (materials.is_zero(material.k_a) or materials.is_zero(values["ambient"])):
        total = total + terms.ambient(ambient, k_a)
    # Terms of the lights, with the coefficients outside the sums.
    if lights:
        if material.normalised:
            k_s = k_s * terms.normalisation(material.form, material.n)
        diffuse, specular = sum_lights(position, normal, view, material, lights, visible)
        for coefficient, term in ((k_d, diffuse), (k_s, specular)):
            if term is not None:
                total = total + coefficient * term
    return total


BLOCK = 16
"""Lights in one kernel. More are summed block after block by the same kernel: with 256 lights the
first picture takes 1.1 s in place of 19 s, nearly all of it compiling, and later ones the same. A
loop inside the kernel would fetch each parameter again per pixel, and take twice as long."""


def sum_lights(
    position: Position,
    normal: Vector,
    view: Vector,
    material: Material,
    lights: Sequence[Light],
    visible: Visibility | None = None,
) -> tuple[Colour | None, Colour | None]:
    """Return the diffuse and specular sums of 8.10, with ``k_d`` and ``k_s`` taken out of them.

    Each is None if its coefficient is zero; the specular one is for a mirror, too
    (:func:`fotismos.heuristic.terms.mirror`). More than :data:`BLOCK` lights are evaluated in
    blocks, so compile time, kernel size and memory do not grow with their number. They are unrolled
    if there is nothing to evaluate (scalar arrays) or it is impossible (in a symbolic loop or
    call).
    """
    in_blocks = (
        len(lights) > BLOCK and dr.is_jit_v(position) and not dr.flag(dr.JitFlag.SymbolicScope)
    )
    sums: dict[str, numerics.Compensated] = {}
    for block in _blocks(lights, type(position), in_blocks):
        if in_blocks and sums:
            dr.eval(sums)  # the last block's sums stay open, for the caller's kernel
        parts: dict[str, Array] = {}
        for light in contributions(position, normal, view, material, block, visible):
            for name, term in (("diffuse", light.diffuse), ("specular", light.specular)):
                if term is not None:
                    parts[name] = parts[name] + term if name in parts else term
        for name, part in parts.items():
            # A sum of thousands would lose terms below its last digit (Neumaier).
            sums[name] = numerics.add(sums[name], part) if name in sums else (part, 0)
    diffuse = sums.get("diffuse", (None, 0))
    specular = sums.get("specular", (None, 0))
    return numerics.summed(diffuse), numerics.summed(specular)


@dataclass(frozen=True)
class LightContribution:
    """What one light contributes to 8.10 at points, with ``k_d`` and ``k_s`` taken out.

    ``arrival`` is how its light arrives, ``cos_incidence`` is ``N.L``, and ``cos_lobe`` the lobe's
    cosine. ``diffuse`` is ``I_p0 f_att (N.L)``, ``specular`` is ``I_p0 f_att (R.V)^n``, both 0
    below the horizon. What the material has no coefficient for is None.
    """

    arrival: Arrival
    cos_incidence: Number
    cos_lobe: Cosines | None
    diffuse: Colour | None
    specular: Colour | None


def contributions(
    position: Position,
    normal: Vector,
    view: Vector,
    material: Material,
    lights: Iterable[Light],
    visible: Visibility | None = None,
) -> Iterator[LightContribution]:
    """Yield what each light contributes at each point to the sums over lights of 8.10."""
    has_diffuse = not materials.is_zero(material.k_d)
    has_specular = not (materials.is_zero(material.k_s) or numerics.is_number(material.n, inf))
    if not (has_diffuse or has_specular):
        return
    # The lobe normalises by itself, in double precision where the exponent needs it.
    lobe = vectors.lobe(material, normal, view) if has_specular else None
    normal = vectors.normalise(normal)
    for light in lights:
        arrival = light.illuminate(position, visible)
        cos_incidence = dr.dot(normal, arrival.toward)
        diffuse = specular = cosine = None
        if has_diffuse:
            diffuse = terms.diffuse(arrival.diffuse, 1, cos_incidence)
        if lobe:
            cosine = lobe(light, position, arrival.toward, cos_incidence)
            specular = terms.specular(arrival.specular, 1, cosine, material.n)
        is_steep = light.is_steep(arrival.distance)
        diffuse = _constant_where(is_steep, diffuse)
        specular = _constant_where(is_steep, specular)
        yield LightContribution(
            arrival=arrival,
            cos_incidence=cos_incidence,
            cos_lobe=cosine,
            diffuse=diffuse,
            specular=specular,
        )


def _constant_where(is_steep: Mask | None, term: Colour | None) -> Colour | None:
    """Return a term without derivatives where it is too steep for them; the value is the same."""
    if is_steep is None or term is None:
        return term
    return dr.select(is_steep, dr.detach(term), term)


def _blocks(
    lights: Sequence[Light], vector_type: type, is_shared: bool
) -> Iterator[Sequence[Light]]:
    """Split lights into blocks, which share one kernel: of one structure, with opaque numbers."""
    alike = defaultdict(list)
    for light in lights:
        alike[light.structure() if is_shared else None].append(light)
    for group in alike.values():
        for begin in range(0, len(group), BLOCK):
            block = group[begin : begin + BLOCK]
            yield [light.opaque(vector_type) for light in block] if is_shared else block


def checked_vectors(position: Any, normal: Any, view: Any) -> tuple[Any, ...]:
    """Return the three vectors as Dr.Jit arrays of floats of at least single precision.

    Three plain numbers, in a list, tuple or NumPy array, are one vector for all points; at least
    one argument must be a Dr.Jit array. Half precision and integers become single.
    """
    values = {"position": position, "normal": normal, "view": view}
    arrays = {name: _array(name, value) for name, value in values.items() if dr.is_array_v(value)}
    if not arrays:
        raise InputError(f"position, normal, view: {HOW}; none of them is one.")
    common = type(next(iter(arrays.values())))
    return tuple(
        arrays[name] if name in arrays else common(*_plain(name, value))
        for name, value in values.items()
    )


def _checked_lights(lights: object) -> Sequence[Light]:
    if isinstance(lights, (str, bytes, Mapping)) or not isinstance(lights, Iterable):
        raise InputError(
            f"lights is {type_of(lights)}: give a list of {_kinds_of_light()}, empty for none."
        )
    lights = lights if isinstance(lights, Sequence) else list(lights)
    for number, light in enumerate(lights):
        if not isinstance(light, Light):
            raise InputError(f"lights[{number}] is {type_of(light)}: give a {_kinds_of_light()}.")
    return lights


def _kinds_of_light() -> str:
    names = [kind.__name__ for kind in PLUGINS.values()]
    return f"{', '.join(names[:-1])} or {names[-1]}"


def _check_sizes(values: dict[str, Any], lights: Sequence[Light]) -> None:
    """Reject Dr.Jit arrays of different numbers of points; one point fits any number."""
    # Widths are not known while a loop or call is recorded.
    if dr.flag(dr.JitFlag.SymbolicScope):
        return
    for number, light in enumerate(lights):
        values |= {f"lights[{number}].{name}": value for name, value in light.given().items()}
    widths = {name: dr.width(value) for name, value in values.items() if dr.is_jit_v(value)}
    several = {name: width for name, width in widths.items() if width != 1}
    if len(set(several.values())) > 1 or 0 in several.values():
        listing = ", ".join(f"{name} has {width}" for name, width in several.items())
        raise InputError(
            f"Mixed numbers of points: {listing}. Give each array one entry, or the same number."
        )


def _array(name: str, value: Any) -> Any:
    # Three components of any width: depth 2 for arrays of the JIT, 1 for scalar ones.
    is_vector = dr.depth_v(value) == 1 + dr.is_jit_v(value) and dr.size_v(value) == 3
    if not is_vector or dr.is_mask_v(value) or dr.is_complex_v(value):
        raise InputError(f"{name} is {type_of(value)}: {HOW}.")
    if not dr.is_float_v(value) or dr.itemsize_v(value) < 4:
        return dr.float32_array_t(type(value))(value)
    return value


def _plain(name: str, value: Any) -> tuple[float, ...]:
    is_sequence = isinstance(value, (list, tuple, np.ndarray))
    numbers = list(value) if is_sequence and np.ndim(np.asarray(value, object)) == 1 else []
    if len(numbers) != 3 or not all(isinstance(number, Real) for number in numbers):
        raise InputError(f"{name} is {type_of(value)}: {HOW}, or three numbers.")
    return tuple(map(float, numbers))
