"""The shading kernel: the whole illumination model at many points at once (8.10)."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields
from numbers import Real
from typing import Any

import drjit as dr
import numpy as np

from heuristic import materials, numerics, terms, vectors
from heuristic.convention import Array, Colour, Mask, Position, Vector
from heuristic.errors import InputError
from heuristic.lights import Light
from heuristic.materials import COEFFICIENTS, Material

HOW = "give a Dr.Jit array of three components, such as drjit.auto.Array3f(x, y, z)"


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
        integers are computed in single precision. Where a component is NaN, so is the result.
    material
        The coefficients.
    lights
        Any number of them. Numbers in up to :data:`BLOCK` lights, and in the material, are compiled
        into the kernel; opaque Dr.Jit values are not.
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
        with one component per wavelength. No term of a light exceeds the type's largest float, but
        their sum may, and is then infinite: next to a light of inverse-square type, say.

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
    position, normal, view = checked_vectors(position, normal, view)
    lights = _checked_lights(lights)
    if not isinstance(material, Material):
        raise InputError(f"material is {_kind(material)}: give a heuristic.Material.")
    visible = _checked_visibility(visible)
    ambient = materials.checked_colour("ambient", ambient)
    _check_sizes((position, normal, view), material, lights, ambient)
    values = {name: getattr(material, name) for name in COEFFICIENTS} | {"ambient": ambient}
    own = {f"lights[{i}].intensity": light.intensity for i, light in enumerate(lights)}
    materials.common_wavelength_count(values | own)
    vector_type = type(position)
    k_i, k_a, k_d, k_s, ambient = (
        materials.as_array(value, vector_type) for value in values.values()
    )

    present = []
    if not materials.is_zero(material.k_i):
        present.append(terms.emission(k_i))
    if not (materials.is_zero(material.k_a) or materials.is_zero(ambient)):
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
    # The type of a sum of all terms, whether or not each is there.
    arrays = [value for value in (k_i, k_a, k_d, k_s, ambient) if dr.is_array_v(value)]
    float_type = dr.value_t(vector_type)
    total = (dr.expr_t(float_type, *map(type, arrays)) if arrays else float_type)(0)
    for term in present:
        total = total + term
    return total


BLOCK = 16
"""Lights in one kernel. More are summed block after block by the same kernel: with 256 lights the
first picture takes 1.1 s in place of 19 s, nearly all of it compiling, and later ones the same. A
loop inside the kernel would fetch each parameter again per pixel, and take twice as long."""


def sum_lights(
    position: Any,
    normal: Any,
    view: Any,
    material: Material,
    lights: Sequence[Light],
    visible: Callable[[Any, Any], Any] | None = None,
) -> tuple[Any, Any]:
    """Return the diffuse and specular sums of 8.10, with ``k_d`` and ``k_s`` taken out of them.

    Each is None if its coefficient is zero. More than :data:`BLOCK` lights are evaluated in blocks,
    so compile time, kernel size and memory do not grow with their number. They are unrolled if
    there is nothing to evaluate (scalar arrays) or it is impossible (in a symbolic loop or call).
    """
    has_diffuse = not materials.is_zero(material.k_d)
    has_specular = not materials.is_zero(material.k_s)
    if not (has_diffuse or has_specular):
        return None, None
    in_blocks = (
        len(lights) > BLOCK and dr.is_jit_v(position) and not dr.flag(dr.JitFlag.SymbolicScope)
    )
    blocks = _blocks(lights, type(position)) if in_blocks else _portions(lights)
    lobe = vectors.lobe(material, normal, view) if has_specular else None
    normal = vectors.normalise(normal)
    sums: dict[str, tuple[Array, Array]] = {}
    for block in blocks:
        if in_blocks and sums:
            dr.eval(sums)  # the last block's sums stay open, for the caller's kernel
        parts: dict[str, Array] = {}
        for light in block:
            toward, intensity, distance = light.illuminate(position)
            cos_incidence = dr.dot(normal, toward)
            if visible is not None:
                intensity = dr.select(visible(toward, distance), intensity, 0)
            if has_diffuse:
                _add(parts, "diffuse", terms.diffuse(intensity, 1, cos_incidence))
            if lobe:
                cosine = lobe(light, position, toward, cos_incidence)
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
        for block in _portions(group):
            yield _opaque(block, vector_type)


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


def checked_vectors(position: Any, normal: Any, view: Any) -> tuple[Any, Any, Any]:
    """Return the three vectors as Dr.Jit arrays of floats of at least single precision.

    Three plain numbers, in a list, tuple or NumPy array, are one vector for all points; at least
    one argument must be a Dr.Jit array. Half precision and integers become single.
    """
    vectors_ = {"position": position, "normal": normal, "view": view}
    arrays = {name: _array(name, v) for name, v in vectors_.items() if dr.is_array_v(v)}
    if not arrays:
        raise InputError(f"position, normal, view: {HOW}; none of them is one.")
    common = type(next(iter(arrays.values())))
    plain = {
        name: common(*_plain(name, value)) for name, value in vectors_.items() if name not in arrays
    }
    found = arrays | plain
    return found["position"], found["normal"], found["view"]


def _checked_lights(lights: Any) -> Sequence[Light]:
    if isinstance(lights, (str, bytes, Mapping)) or not isinstance(lights, Iterable):
        raise InputError(
            f"lights is {_kind(lights)}: give a list of PointLight, DirectionalLight or SpotLight,"
            " empty for none."
        )
    lights = lights if isinstance(lights, Sequence) else list(lights)
    for number, light in enumerate(lights):
        if not isinstance(light, Light):
            raise InputError(
                f"lights[{number}] is {_kind(light)}: give a PointLight, DirectionalLight or"
                " SpotLight."
            )
    return lights


def _checked_visibility(visible: Any) -> Callable[[Any, Any], Any] | None:
    """Return a function that returns masks, or None."""
    if visible is None:
        return None
    if not callable(visible):
        raise InputError(
            f"visible is {_kind(visible)}: give a function of a direction and a distance that"
            " returns a mask, or None."
        )

    def mask(toward: Any, distance: Any) -> Any:
        seen = visible(toward, distance)
        if not (isinstance(seen, bool) or (dr.is_array_v(seen) and dr.is_mask_v(seen))):
            raise InputError(f"visible returned {_kind(seen)}: it must return a mask.")
        return seen

    return mask


def _check_sizes(point: tuple, material: Material, lights: Sequence[Light], ambient: Any) -> None:
    """Reject Dr.Jit arrays of different numbers of points; one point fits any number."""
    if dr.flag(dr.JitFlag.SymbolicScope):
        return
    values = dict(zip(("position", "normal", "view"), point, strict=True))
    values |= {name: getattr(material, name) for name in (*COEFFICIENTS, "n")}
    for number, light in enumerate(lights):
        kind: Any = light  # a dataclass, as each kind is
        own = {entry.name: getattr(light, entry.name) for entry in fields(kind)}
        values |= {f"lights[{number}].{name}": value for name, value in own.items()}
    values["ambient"] = ambient
    widths = {name: dr.width(value) for name, value in values.items() if dr.is_jit_v(value)}
    several = {name: width for name, width in widths.items() if width != 1}
    if len(set(several.values())) > 1 or 0 in several.values():
        listing = ", ".join(f"{name} has {width}" for name, width in several.items())
        raise InputError(
            f"Mixed numbers of points: {listing}. Give each array one entry, or the same number."
        )


def _array(name: str, value: Any) -> Any:
    is_vector = dr.depth_v(value) == 1 + dr.is_jit_v(value) and dr.size_v(value) == 3
    if not is_vector or dr.is_mask_v(value) or dr.is_complex_v(value):
        raise InputError(f"{name} is {_kind(value)}: {HOW}.")
    if not dr.is_float_v(value) or dr.itemsize_v(value) < 4:
        return dr.float32_array_t(type(value))(value)
    return value


def _plain(name: str, value: Any) -> tuple[float, ...]:
    is_sequence = isinstance(value, (list, tuple, np.ndarray))
    numbers = list(value) if is_sequence and np.ndim(np.asarray(value, object)) == 1 else []
    if len(numbers) != 3 or not all(isinstance(number, Real) for number in numbers):
        raise InputError(f"{name} is {_kind(value)}: {HOW}, or three numbers.")
    return tuple(map(float, numbers))


def _kind(value: Any) -> str:
    shape = f" of shape {value.shape}" if isinstance(value, np.ndarray) else ""
    if isinstance(value, (list, tuple)):
        shape = f" of {len(value)}"
    kind = f"{type(value).__module__}.{type(value).__qualname__}{shape}"
    return f"of type {kind}".replace("builtins.", "")
