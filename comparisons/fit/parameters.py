"""Which parameters are fitted, within which bounds, and how a vector of numbers stands for them.

=============  ======================================  ==================  ================
Parameter      Number in the vector                    Bounds              A natural change
=============  ======================================  ==================  ================
``k_a, k_d``   itself                                  0 to 1              1
``k_s``        the lobe's albedo at normal incidence,  0 to 1              1
               ``k_s`` over
               :func:`heuristic.terms.normalisation`
``n``          ``ln n``                                :data:`EXPONENTS`   a factor e
an intensity   ``ln`` of a factor on the paired one    :data:`FACTORS`     a factor e
=============  ======================================  ==================  ================

An image shows the lobe's albedo for any ``n``, so the two are nearly independent in the search. It
also makes a form and its normalised variant one and the same fit: they are the same set of images,
in which ``k_s`` has another meaning.

A coefficient is one number if it is grey in the scene, and three if it has a colour. With a texture
it is a factor on it. If the loss sees luminance alone, it is its largest component, with the others
in proportion.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import log

import numpy as np
from numpy.typing import NDArray

from comparisons.fit.samples import Surface
from heuristic.arrays import Colour
from reference.pairing.factors import Phong, alpha_of, exponent_of, specular_albedo

EXPONENTS = (0.5, 4096.0)
"""Below, a lobe is as broad as the hemisphere; above, it is narrower than a pixel's view of it."""

FACTORS = (1 / 64, 64.0)

GREY = (1.0, 1.0, 1.0)
LARGEST_FACTOR = 4.0
"""On a texture, whose values are unknown here."""


@dataclass(frozen=True)
class Parameter:
    """One number to be fitted.

    Attributes
    ----------
    name
        ``k_a``, ``k_d``, ``k_s``, ``n`` or ``intensity``.
    owner
        Index of the material, or of the light.
    paired, low, high
        Value by the pairing table, and bounds, as in the vector.
    tint
        RGB of which a coefficient is a multiple.
    channel
        ``R``, ``G`` or ``B`` of a coefficient with three numbers, otherwise empty.
    is_factor
        Whether the number is a factor on a texture.
    """

    name: str
    owner: int
    paired: float
    low: float
    high: float
    tint: tuple[float, ...] = GREY
    channel: str = ""
    is_factor: bool = False

    @property
    def is_linear(self) -> bool:
        """Whether the image is linear in it."""
        return self.name.startswith("k_")


def parameters(
    surface: Surface, form: str, sees_colour: bool = True, intensities: bool = False
) -> tuple[Parameter, ...]:
    """Return the parameters that a fit of one form has on a surface, material by material.

    Parameters
    ----------
    surface
        The surface that is seen.
    form
        Of the lobe, ``phong`` or ``blinn``.
    sees_colour
        Whether the loss sees colour; otherwise coefficients keep their paired colour.
    intensities
        Whether lights' intensities are fitted. The first light keeps its own: only the products of
        intensities with ``k_d`` and ``k_s`` show.
    """
    found: list[Parameter] = []
    for owner, material in enumerate(surface.materials):
        textured = surface.samples[owner].textures
        if ambient_of(surface, intensities) is not None:
            found += _coefficients("k_a", owner, material.k_a, sees_colour, "k_a" in textured)
        found += _coefficients("k_d", owner, material.k_d, sees_colour, "k_d" in textured)
        paired = specular_albedo(
            Phong(material.k_d, material.k_s, material.n, material.form, material.normalised)
        )
        found += _coefficients("k_s", owner, tuple(paired), sees_colour, "k_s" in textured)
        n = exponent_of(alpha_of(material.n, material.form), form)
        low, high = EXPONENTS
        found.append(Parameter("n", owner, log(min(max(n, low), high)), log(low), log(high)))
    if intensities:
        low, high = map(log, FACTORS)
        others = range(1, len(surface.lights))
        found += [Parameter("intensity", light, 0.0, low, high) for light in others]
    return tuple(found)


def ambient_of(surface: Surface, intensities: bool) -> Colour | None:
    """Return ``I_a``, None if there is none to fit.

    If intensities are fitted and the scene has no ambient light, it is 1: the image shows only
    ``I_a k_a``.
    """
    if isinstance(surface.ambient, int):
        return 1.0 if intensities else None
    return surface.ambient


def start(parameters: Sequence[Parameter]) -> NDArray[np.float64]:
    """Return the paired values as a vector, moved into the bounds."""
    return np.array([min(max(p.paired, p.low), p.high) for p in parameters])


def bounds(parameters: Sequence[Parameter]) -> NDArray[np.float64]:
    """Return the lower and upper bounds as two vectors."""
    return np.array([[p.low for p in parameters], [p.high for p in parameters]])


def _coefficients(
    name: str, owner: int, paired: Colour, sees_colour: bool, is_textured: bool
) -> list[Parameter]:
    """Return the parameters of one coefficient."""
    if is_textured:
        return [Parameter(name, owner, float(paired[0]), 0.0, LARGEST_FACTOR, is_factor=True)]
    largest = float(max(paired))
    if np.ptp(paired) <= 1e-6 * largest:
        return [Parameter(name, owner, largest, 0.0, 1.0)]
    if not sees_colour:
        return [Parameter(name, owner, largest, 0.0, 1.0, tuple(np.divide(paired, largest)))]
    return [
        Parameter(name, owner, float(paired[i]), 0.0, 1.0, tuple(np.eye(3)[i]), channel)
        for i, channel in enumerate("RGB")
    ]
