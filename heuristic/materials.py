"""The material of the illumination model: five coefficients."""

from dataclasses import dataclass, fields
from numbers import Real

from heuristic import colours
from heuristic.errors import InputError


@dataclass(frozen=True)
class Material:
    """Reflection coefficients of a surface (8.10, 6.11).

    Parameters
    ----------
    k_i
        Emission (8.1), display-linear, 0 or more.
    k_a, k_d, k_s
        Ambient, diffuse and specular reflection coefficients (8.2, 8.5, 8.8), physically in 0..1.
        Each is a number, RGB, one value for each wavelength, or a Dr.Jit array.
    n
        Phong's exponent, 0 or more. A Python integer up to
        :data:`heuristic.terms.LARGEST_LITERAL_EXPONENT` is compiled into the kernel, and a float or
        a Dr.Jit array is not.

    Raises
    ------
    InputError
        For negative, infinite or NaN values.
    """

    k_i: colours.Coefficient = 0
    k_a: colours.Coefficient = 0
    k_d: colours.Coefficient = 0
    k_s: colours.Coefficient = 0
    n: float = 1

    def __post_init__(self):
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name == "n" and isinstance(value, Real):
                _check_exponent(value)
            else:
                object.__setattr__(self, field.name, colours.checked(field.name, value))


def _check_exponent(n):
    if not (n >= 0 and n < float("inf")):
        raise InputError(f"n = {n!r} is not allowed: Phong's exponent is finite and 0 or more.")
