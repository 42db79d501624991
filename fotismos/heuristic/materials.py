"""The material of the model, and colours: numbers, RGB, or a value per wavelength (8.11, 8.12)."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import inf
from numbers import Real
from typing import Any

import drjit as dr
import numpy as np

from fotismos.heuristic import numerics
from fotismos.heuristic.convention import Colour, Number
from fotismos.heuristic.errors import InputError, unknown, with_known_words

FORMS = ("phong", "blinn")

COEFFICIENTS = ("k_i", "k_a", "k_d", "k_s")

PHYSICAL = ("base_color", "alpha", "ior", "metallic")
"""Parameters of the physical partner; all but the first are single numbers."""

SMALLEST_ALPHA = 1e-4
"""Mitsuba replaces every smaller roughness by this one."""


def checked_colour(name: str, value: Any) -> Any:
    """Return ``value`` as a float, a tuple of floats, or an unchanged Dr.Jit array.

    Numbers and sequences must be finite and not negative. Dr.Jit arrays are not checked, because
    that would evaluate them.
    """
    if dr.is_array_v(value) and dr.is_jit_v(value):
        return value
    components = _components(value)
    if components is None:
        raise InputError(
            f"{name} = {value!r} is not a colour: give a number, RGB, or one value per wavelength."
        )
    if not components:
        raise InputError(f"{name} = {value!r} is not allowed: give one value or more.")
    for component in components:
        if not (np.isfinite(component) and component >= 0):
            raise InputError(f"{name} = {value!r} is not allowed: give finite values of 0 or more.")
    return components[0] if len(components) == 1 else components


def _components(value: Any) -> tuple[float, ...] | None:
    """Return the numbers of a value, or None if it is not made of numbers."""
    is_several = isinstance(value, Sequence | np.ndarray) or dr.is_array_v(value)
    if isinstance(value, str) or not (is_several or isinstance(value, Real)):
        return None
    try:
        return tuple(float(component) for component in np.ravel(value))
    except (TypeError, ValueError, OverflowError):
        return None


def checked_flag(name: str, value: Any) -> bool:
    """Return a truth value of Python or NumPy; anything else is not a flag."""
    if not isinstance(value, bool | np.bool_):
        raise InputError(f"{name} = {value!r} is not allowed: give True or False.")
    return bool(value)


def is_zero(value: Any) -> bool:
    """Return whether a checked value is zero by construction; its term is then not traced."""
    if isinstance(value, tuple):
        return not any(value)
    return isinstance(value, float) and value == 0


def wavelength_count(value: Any) -> int:
    """Return the number of components of a checked value, 1 for numbers and Dr.Jit floats."""
    if isinstance(value, tuple):
        return len(value)
    if dr.is_array_v(value) and dr.depth_v(value) > 1:
        return len(value)
    return 1


def require_common_wavelengths(values: Mapping[str, Any]) -> None:
    """Reject values ``{name: value}`` of different numbers of components; single ones fit any."""
    counts = {name: wavelength_count(value) for name, value in values.items()}
    several = {name: count for name, count in counts.items() if count > 1}
    if len(set(several.values())) > 1:
        listing = ", ".join(f"{name} has {count}" for name, count in several.items())
        raise InputError(
            f"Mixed numbers of wavelengths: {listing}. Give each colour one value, or the same"
            " number."
        )


def as_array(value: Any, vector_type: type) -> Colour:
    """Convert a checked value into a factor for the kernel.

    Numbers and Dr.Jit arrays stay unchanged; a tuple of four or fewer becomes a fixed array of
    the backend and precision of ``vector_type``, a longer one a dynamic array.
    """
    if not isinstance(value, tuple):
        return value
    # The first axis holds components, the second points.
    size = len(value) if len(value) <= 4 else -1
    shape = (size, -1) if dr.is_jit_v(vector_type) else (size,)
    return dr.replace_shape_t(vector_type, shape)(value)


@with_known_words
@dataclass(frozen=True)
class Material:
    """Reflection coefficients of a surface (8.10, 6.11).

    ``k_i`` is its emission (8.1), display-linear. ``k_a``, ``k_d`` and ``k_s`` are the ambient,
    diffuse and specular coefficients (8.2, 8.5, 8.8), physically in 0..1. Each is 0 or more: a
    number, RGB, one value per wavelength, or a Dr.Jit array. ``n`` is Phong's exponent, 0 or more:
    a plain number is compiled into the kernel, an integer up to
    :data:`fotismos.heuristic.numerics.LARGEST_LITERAL_EXPONENT` as products; a Dr.Jit array is a
    run-time value, and ``n_is_moderate`` says whether it is known to lie within
    :data:`fotismos.heuristic.numerics.MODERATE_EXPONENTS`, where the kernel may do without double
    precision. A plain ``inf`` makes a mirror (8.7), which shows no light of the kernel
    (:func:`fotismos.heuristic.terms.mirror`); an array is finite.

    ``form`` is ``phong`` for the chapters' ``(R.V)^n`` (8.9), or ``blinn`` for ``(N.H)^n`` of Blinn
    (1977), which OpenGL's fixed pipeline and most engines use. ``normalised`` scales the lobe by
    :func:`fotismos.heuristic.terms.normalisation`; ``k_s`` is then its albedo at normal incidence,
    which the chapters' model does not have.

    >>> Material(k_d=(0.5, 0.4, 0.3), k_s=0.7, n=9).k_d
    (0.5, 0.4, 0.3)
    >>> Material(k_d=-0.5)  # doctest: +ELLIPSIS
    Traceback (most recent call last):
        ...
    fotismos.heuristic.errors.InputError: k_d = -0.5 is not allowed: give finite values ...
    """

    k_i: Colour = 0
    k_a: Colour = 0
    k_d: Colour = 0
    k_s: Colour = 0
    n: float = 1
    form: str = "phong"
    normalised: bool = False
    n_is_moderate: bool = False

    def __post_init__(self) -> None:
        for name in COEFFICIENTS:
            object.__setattr__(self, name, checked_colour(name, getattr(self, name)))
        object.__setattr__(self, "n", _exponent(self.n))
        object.__setattr__(self, "normalised", checked_flag("normalised", self.normalised))
        check_form(self.form)
        if numerics.is_moderate(self.n):
            object.__setattr__(self, "n_is_moderate", True)


@dataclass(frozen=True)
class PairedMaterial(Material):
    """A material with the parameters of its physical partner, as engines have them.

    ``base_color`` is the reflectance of the diffuse base, 0..1; for metals, of the surface at
    normal incidence. ``alpha`` is the root mean square slope of the microfacets, as in Beckmann's
    distribution and GGX: the square of what engines call roughness, 1e-4 to 1. ``ior`` is the index
    of refraction, inside over outside. A surface without an interface has 1 for both. ``metallic``
    is 1 for metals and 0 for all other materials; ``principled`` has its own, 0..1.
    """

    base_color: Colour = 0
    alpha: float = 1
    ior: float = 1
    metallic: float = 0


def _exponent(n: Any) -> Number:
    number = numerics.plain(n)
    if number is None or (isinstance(number, int | float) and not is_exponent(number)):
        raise InputError(
            f"n = {n!r} is not allowed: Phong's exponent is finite and 0 or more, at most"
            f" {numerics.LARGEST_EXPONENT:.2g}; inf makes a mirror."
        )
    return number


def is_exponent(n: float) -> bool:
    """Return whether a plain number is an exponent of the lobe that both precisions hold, or inf.

    A finite one beyond :data:`fotismos.heuristic.numerics.LARGEST_EXPONENT` would become a mirror.
    """
    return 0 <= n <= numerics.LARGEST_EXPONENT or n == inf


def check_form(form: str) -> None:
    """Reject a form of the specular lobe that is not in :data:`FORMS`."""
    if not isinstance(form, str) or form not in FORMS:
        raise unknown("form =", form, FORMS)
