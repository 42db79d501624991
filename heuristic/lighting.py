"""The sum over the lights of 8.10, for a handful of lights and for thousands."""

from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import drjit as dr
import numpy as np

from heuristic import colours, lobes, numerics, terms, vectors
from heuristic.light import Light
from heuristic.materials import Material

BLOCK = 16
"""Lights in one kernel. More are summed block after block by the same kernel, each light costing
about what it costs unrolled; a loop inside the kernel would fetch each parameter for each pixel
anew, and take twice as long. Larger blocks compile longer and gain little (see the benchmarks)."""


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
    material : Material
        Tells which of the two sums are needed, and the form and exponent of the specular term.
    lights : sequence
        Any number. More than :data:`BLOCK` are evaluated in blocks, so that compile time, kernel
        size and memory do not grow with their number. They are unrolled where there is nothing to
        evaluate (scalar arrays) or it is not possible (inside a symbolic loop or call).
    visible : callable, optional
        ``visible(toward, distance)`` returns a mask of the points that the light reaches.

    Returns
    -------
    diffuse, specular
        The two sums, each None where its coefficient is zero.
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
    sums = {}
    for block in blocks:
        if in_blocks and sums:
            dr.eval(sums)  # the last block's sums stay open, for the caller's kernel
        parts = {}
        for light in block:
            arrival = light.illuminate(position)
            cos_incidence = dr.dot(normal, arrival.toward)
            intensity = arrival.intensity
            if visible is not None:
                seen = visible(arrival.toward, arrival.distance)
                intensity = dr.select(seen, intensity, 0)
            if has_diffuse:
                _add(parts, "diffuse", terms.diffuse(intensity, 1, cos_incidence))
            if has_specular:
                cosine = lobe(light, position, arrival.toward, cos_incidence)
                _add(parts, "specular", terms.specular(intensity, 1, cosine, material.n))
        for name, part in parts.items():
            # A sum of thousands would lose what is smaller than its last digit (Neumaier).
            sums[name] = numerics.add(*sums[name], part) if name in sums else (part, 0)
    return tuple(_summed(sums.get(name)) for name in ("diffuse", "specular"))


def _summed(pair: tuple | None) -> Any:
    if pair is None or isinstance(pair[1], int):
        return pair and pair[0]
    return numerics.summed(*pair)


def _add(parts: dict, name: str, term: Any) -> None:
    parts[name] = parts[name] + term if name in parts else term


def _portions(lights: Sequence[Light]) -> list[Sequence[Light]]:
    """Split lights into blocks as they are."""
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

    Which light comes from where in the array is the same for all blocks of a structure, and so is
    the kernel.
    """
    values = [value for light in lights for value in light.numbers().values()]
    flat = [number for value in values for number in np.ravel(value)]
    buffer = dr.leaf_t(vector_type)(flat)
    dr.eval(buffer)
    place = iter(range(len(flat)))

    def fetched(value: object) -> object:
        if isinstance(value, tuple):
            return tuple(map(fetched, value))
        return dr.gather(type(buffer), buffer, next(place))

    return [light.with_numbers(fetched, vector_type) for light in lights]
