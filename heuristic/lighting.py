"""The sum over the lights of 8.10, for a handful of lights and for thousands."""

from collections import defaultdict
from dataclasses import fields, replace
from numbers import Real

import drjit as dr
import numpy as np

from heuristic import colours, lobes, numerics, terms, vectors
from heuristic.lights import UNATTENUATED, is_unattenuated
from heuristic.numerics import is_number

BLOCK = 16
"""Lights in one kernel. More are summed block after block by the same kernel, each light costing
about what it costs unrolled; a loop inside the kernel would fetch each parameter for each pixel
anew, and take twice as long. Larger blocks compile longer and gain little (see the benchmarks)."""


def sum_lights(position, normal, view, material, lights, visible=None):
    """Sum the light terms of 8.10, with ``k_d`` and ``k_s`` taken out of the sum.

    Parameters
    ----------
    position, normal, view
        As of :func:`heuristic.shade`: normals and views of any length.
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


def _summed(pair):
    if pair is None or isinstance(pair[1], int):
        return pair and pair[0]
    return numerics.summed(*pair)


def _add(parts, name, term):
    parts[name] = parts[name] + term if name in parts else term


def _portions(lights):
    """Split lights into blocks as they are."""
    return [lights[begin : begin + BLOCK] for begin in range(0, len(lights), BLOCK)]


def _blocks(lights, vector_type):
    """Split lights into blocks that share one kernel: of one structure, with opaque numbers."""
    alike = defaultdict(list)
    for light in lights:
        alike[_structure(light)].append(light)
    for group in alike.values():
        for begin in range(0, len(group), BLOCK):
            yield _opaque(group[begin : begin + BLOCK], vector_type)


def _structure(light):
    """Return what decides on a light's instructions, apart from its numbers."""
    return (
        type(light),
        is_unattenuated(getattr(light, "attenuation", UNATTENUATED)),
        getattr(light, "clamped", False),
        is_number(getattr(light, "exponent", None), 0),
        colours.wavelength_count(light.intensity),
    )


def _opaque(lights, vector_type):
    """Move the numbers of a block of lights out of the kernel's code, into one small array.

    Which light comes from where in the array is the same for all blocks of a structure, and so is
    the kernel.
    """
    values = [value for light in lights for value in _numbers(light).values()]
    flat = [number for value in values for number in np.ravel(value)]
    buffer = dr.leaf_t(vector_type)(flat)
    dr.eval(buffer)
    place = iter(range(len(flat)))

    def fetch(value):
        if isinstance(value, tuple):
            return tuple(map(fetch, value))
        return dr.gather(type(buffer), buffer, next(place))

    def fetched(name, value):
        fetched = fetch(value)
        if name in ("position", "direction"):
            return vector_type(fetched)
        return colours.as_array(fetched, vector_type) if name == "intensity" else fetched

    return [
        replace(light, **{name: fetched(name, value) for name, value in _numbers(light).items()})
        for light in lights
    ]


def _numbers(light):
    """Return the fields of a light that are numbers, less those that its structure fixes."""
    fixed = {"clamped"}
    if is_unattenuated(getattr(light, "attenuation", UNATTENUATED)):
        fixed.add("attenuation")
    if is_number(getattr(light, "exponent", None), 0):
        fixed.add("exponent")
    given = {field.name: getattr(light, field.name) for field in fields(light)}
    return {
        name: value
        for name, value in given.items()
        if name not in fixed and all(isinstance(part, Real) for part in _parts(value))
    }


def _parts(value):
    return value if isinstance(value, tuple) else (value,)
