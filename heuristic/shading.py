"""The shading kernel: the whole illumination model at many points at once (8.10)."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from dataclasses import fields
from typing import Any

import drjit as dr
import numpy as np

from heuristic import arguments, colours, lobes, numerics, terms, vectors
from heuristic.arrays import Array, Colour, Mask, Position, Vector
from heuristic.light import Light
from heuristic.materials import COEFFICIENTS, Material


def shade(
    position: Position,
    normal: Vector,
    view: Vector,
    material: Material,
    lights: Sequence[Light],
    ambient: Colour = 0,
    visible: Callable[..., Mask] | None = None,
) -> Colour:
    """Equations 8.10-8.12, 6.11-6.15: the sum of all terms over all lights.

    ``I = k_i + I_a k_a + sum_k I_p0^k f_att^k [k_d (N.L^k) + k_s (R^k.V)^n]``, evaluated for each
    wavelength (8.11) or for RGB (8.12, 6.13-6.15). Lights at or below the horizon (``N.L <= 0``)
    give neither diffuse nor specular light. Only terms that can be non-zero are traced: a
    coefficient of 0, or an empty list of lights, adds no instruction.

    Parameters
    ----------
    position, normal, view
        Dr.Jit arrays of three components, of any float type: ``P``, ``N`` and ``V``, in one space.
        Normals and views of any length are normalised; a zero vector receives no light. Three plain
        numbers stand for all points if another of the three is a Dr.Jit array. Half precision and
        integers are computed in single precision.
    material
        The coefficients.
    lights
        Any number of them. Numbers in up to :data:`heuristic.shading.BLOCK` lights, and in the
        material, are compiled into the kernel; opaque Dr.Jit values are not.
    ambient
        ``I_a``: a number, RGB, one value per wavelength, or a Dr.Jit array.
    visible
        ``visible(toward, distance)`` returns a mask of the points that a light in that direction,
        at that distance, reaches. The chapters' model has no shadows; if omitted, nothing is
        hidden.

    Returns
    -------
    Dr.Jit array
        The display-linear value: a float if all coefficients are single numbers, otherwise a colour
        with one component per wavelength.

    Raises
    ------
    InputError
        For arguments of other types or shapes, a negative or non-finite ``ambient``, or mixed
        numbers of points or wavelengths.

    Examples
    --------
    Two points under a light from straight above, the second of them tilted:

    >>> from heuristic import DirectionalLight, Material, shade
    >>> from drjit.auto import Array3f
    >>> sun = DirectionalLight(direction=(0, 0, -1), intensity=1.0)
    >>> normals = Array3f([0, 0.6], [0, 0], [1, 0.8])
    >>> shade(Array3f(0), normals, Array3f(0, 0, 1), Material(k_d=0.5), [sun])
    [0.5, 0.4]
    """
    position, normal, view = arguments.vectors(position, normal, view)
    material, lights = arguments.material(material), arguments.lights(lights)
    visible = arguments.visibility(visible)
    ambient = colours.checked("ambient", ambient)
    _check_sizes((position, normal, view), material, lights, ambient)
    _check_wavelengths(material, lights, ambient)
    vector_type = type(position)
    k_i, k_a, k_d, k_s, ambient = (
        colours.as_array(value, vector_type)
        for value in (material.k_i, material.k_a, material.k_d, material.k_s, ambient)
    )

    present = []
    if not colours.is_zero(material.k_i):
        present.append(terms.emission(k_i))
    if not (colours.is_zero(material.k_a) or colours.is_zero(ambient)):
        present.append(terms.ambient(ambient, k_a))
    if lights:
        if material.normalised:
            k_s = k_s * terms.normalisation(material.form, material.n)
        diffuse, specular = sum_lights(position, normal, view, material, lights, visible)
        present += [
            coefficient * term
            for coefficient, term in ((k_d, diffuse), (k_s, specular))
            if term is not None
        ]
    coefficients = (k_i, k_a, k_d, k_s, ambient)
    return _total(present, _value_type(coefficients, dr.value_t(vector_type)))


def _check_sizes(point, material, lights, ambient):
    values = dict(zip(("position", "normal", "view"), point, strict=True))
    values |= {name: getattr(material, name) for name in (*COEFFICIENTS, "n")}
    for number, light in enumerate(lights):
        own = {entry.name: getattr(light, entry.name) for entry in fields(light)}
        values |= {f"lights[{number}].{name}": value for name, value in own.items()}
    arguments.require_one_size(values | {"ambient": ambient})


def _value_type(coefficients, float_type):
    """Return the type of a sum of all terms, whether or not each is there."""
    arrays = [value for value in coefficients if dr.is_array_v(value)]
    return dr.expr_t(float_type, *map(type, arrays)) if arrays else float_type


def _total(present, value_type):
    """Add up terms of any kind into one value of a type."""
    total = value_type(0)
    for term in present:
        total = total + term
    return total


def _check_wavelengths(material, lights, ambient):
    values = {name: getattr(material, name) for name in ("k_i", "k_a", "k_d", "k_s")}
    values |= {f"lights[{i}].intensity": light.intensity for i, light in enumerate(lights)}
    colours.common_wavelength_count(values | {"ambient": ambient})


BLOCK = 16
"""Lights in one kernel. More are summed block after block by the same kernel, at about the cost of
unrolling; a loop inside the kernel would fetch each parameter again per pixel, and take twice as
long. Larger blocks compile longer and gain little (see the benchmarks)."""


def sum_lights(
    position: Any,
    normal: Any,
    view: Any,
    material: Material,
    lights: Sequence[Light],
    visible: Callable[[Any, Any], Any] | None = None,
) -> tuple[Any, Any]:
    """Sum the light terms of 8.10, with ``k_d`` and ``k_s`` taken out of the sum.

    Parameters
    ----------
    position, normal, view
        See :func:`heuristic.shade`: normals and views of any length.
    material
        Determines which of the two sums are needed, and the form and exponent of the specular term.
    lights
        Any number. More than :data:`BLOCK` are evaluated in blocks, so compile time, kernel size
        and memory do not grow with their number. They are unrolled if there is nothing to evaluate
        (scalar arrays) or it is impossible (in a symbolic loop or call).
    visible
        ``visible(toward, distance)`` returns a mask of the points that the light reaches.

    Returns
    -------
    diffuse, specular
        The two sums, each None if its coefficient is zero.
    """
    has_diffuse = not colours.is_zero(material.k_d)
    has_specular = not colours.is_zero(material.k_s)
    if not (has_diffuse or has_specular):
        return None, None
    in_blocks = (
        len(lights) > BLOCK and dr.is_jit_v(position) and not dr.flag(dr.JitFlag.SymbolicScope)
    )
    blocks = _blocks(lights, type(position)) if in_blocks else _portions(lights)
    lobe = lobes.lobe(material, normal, view) if has_specular else None
    normal = vectors.normalise(normal)
    sums: dict[str, tuple[Array, Array]] = {}
    for block in blocks:
        if in_blocks and sums:
            dr.eval(sums)  # the last block's sums stay open, for the caller's kernel
        parts: dict[str, Array] = {}
        for light in block:
            arrival = light.illuminate(position)
            cos_incidence = dr.dot(normal, arrival.toward)
            intensity = arrival.intensity
            if visible is not None:
                seen = visible(arrival.toward, arrival.distance)
                intensity = dr.select(seen, intensity, 0)
            if has_diffuse:
                _add(parts, "diffuse", terms.diffuse(intensity, 1, cos_incidence))
            if lobe:
                cosine = lobe(light, position, arrival.toward, cos_incidence)
                _add(parts, "specular", terms.specular(intensity, 1, cosine, material.n))
        for name, part in parts.items():
            # A sum of thousands would lose terms below its last digit (Neumaier).
            sums[name] = numerics.add(*sums[name], part) if name in sums else (part, 0)
    return tuple(_summed(sums.get(name)) for name in ("diffuse", "specular"))


def _summed(pair: tuple | None) -> Any:
    if pair is None or isinstance(pair[1], int):
        return pair and pair[0]
    return numerics.summed(*pair)


def _add(parts: dict, name: str, term: Any) -> None:
    parts[name] = parts[name] + term if name in parts else term


def _portions(lights: Sequence[Light]) -> list[Sequence[Light]]:
    """Split lights into blocks, unchanged."""
    return [lights[begin : begin + BLOCK] for begin in range(0, len(lights), BLOCK)]


def _blocks(lights: Sequence[Light], vector_type: type) -> Iterator[list[Light]]:
    """Split lights into blocks that share one kernel: of one structure, with opaque numbers."""
    alike = defaultdict(list)
    for light in lights:
        alike[light.structure()].append(light)
    for group in alike.values():
        for begin in range(0, len(group), BLOCK):
            yield _opaque(group[begin : begin + BLOCK], vector_type)


def _opaque(lights: Sequence[Light], vector_type: type) -> list[Light]:
    """Move the numbers of a block of lights out of the kernel's code, into one small array.

    The layout of the array is the same for all blocks of one structure, and so is the kernel.
    """
    values = [value for light in lights for value in light.numbers().values()]
    flat = [number for value in values for number in np.ravel(value)]
    buffer = dr.leaf_t(vector_type)(flat)
    dr.eval(buffer)
    place = iter(range(len(flat)))

    def fetched(value: Any) -> Any:
        if isinstance(value, tuple):
            return tuple(map(fetched, value))
        return dr.gather(type(buffer), buffer, next(place))

    return [light.with_numbers(fetched, vector_type) for light in lights]
