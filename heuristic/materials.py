"""The material of the illumination model: coefficients, exponent, and the form of the lobe."""

from dataclasses import dataclass
from math import inf
from numbers import Real

from heuristic import colours, numerics
from heuristic.convention import Colour
from heuristic.errors import InputError, unknown

FORMS = ("phong", "blinn")

COEFFICIENTS = ("k_i", "k_a", "k_d", "k_s")

PHYSICAL = ("base_color", "alpha", "ior", "metallic")
"""Parameters of the physical partner; all but the first are single numbers."""


@dataclass(frozen=True)
class Material:
    """Reflection coefficients of a surface (8.10, 6.11).

    ``k_i`` is its emission (8.1), display-linear. ``k_a``, ``k_d`` and ``k_s`` are the ambient,
    diffuse and specular coefficients (8.2, 8.5, 8.8), physically in 0..1. Each is 0 or more: a
    number, RGB, one value per wavelength, or a Dr.Jit array. ``n`` is Phong's exponent, 0 or more:
    a plain number is compiled into the kernel, an integer up to
    :data:`heuristic.numerics.LARGEST_LITERAL_EXPONENT` as products; a Dr.Jit array is a run-time
    value, and ``n_is_moderate`` says whether it is known to lie within
    :data:`heuristic.numerics.MODERATE_EXPONENTS`, where the kernel may do without double precision.

    ``form`` is ``phong`` for the chapters' ``(R.V)^n`` (8.9), or ``blinn`` for ``(N.H)^n`` of Blinn
    (1977), which OpenGL's fixed pipeline and most engines use. ``normalised`` scales the lobe by
    :func:`heuristic.terms.normalisation`; ``k_s`` is then its albedo at normal incidence, which the
    chapters' model does not have.

    >>> Material(k_d=(0.5, 0.4, 0.3), k_s=0.7, n=9).k_d
    (0.5, 0.4, 0.3)
    >>> Material(k_d=-0.5)
    Traceback (most recent call last):
        ...
    heuristic.errors.InputError: k_d = -0.5 is not allowed: give finite values of 0 or more.
    """

    k_i: Colour = 0
    k_a: Colour = 0
    k_d: Colour = 0
    k_s: Colour = 0
    n: float = 1
    form: str = "phong"
    normalised: bool = False
    n_is_moderate: bool = False

    def __post_init__(self):
        for name in COEFFICIENTS:
            object.__setattr__(self, name, colours.checked(name, getattr(self, name)))
        object.__setattr__(self, "n", _exponent(self.n))
        for name in ("normalised", "n_is_moderate"):
            if not isinstance(getattr(self, name), bool):
                raise InputError(
                    f"{name} = {getattr(self, name)!r} is not allowed: give True or False."
                )
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


def _exponent(n):
    number = numerics.plain(n)
    if number is None or (isinstance(number, Real) and not 0 <= number < inf):
        raise InputError(f"n = {n!r} is not allowed: Phong's exponent is finite and 0 or more.")
    return number


def check_form(form: str) -> None:
    """Reject a form of the specular lobe that is not in :data:`FORMS`."""
    if not isinstance(form, str) or form not in FORMS:
        raise unknown("form =", form, FORMS)
