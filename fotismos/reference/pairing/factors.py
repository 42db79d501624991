"""Pairing: which heuristic value corresponds to which physical one. Factors are stated only here.

Lights and diffuse surfaces pair exactly (:mod:`fotismos.heuristic.convention`: irradiance ``E = pi
I_p``):

=============================================  =====================================================
Physical (Mitsuba)                             Heuristic
=============================================  =====================================================
``diffuse``, reflectance ``rho``               ``k_d = k_a = rho``, ``k_s = 0``
``point``, intensity ``I``                     ``I_p0 = I / pi``, ``f_att = 1 / d^2``
``directional``, irradiance ``E``              ``I_p = E / pi``, ``f_att = 1``
``spot``, intensity ``I``                      ``I_p0 = s I / pi``, ``f_att = 1 / d^2``, the same
                                               cone, ``m`` fitted, ``s`` that of equal flux; the
                                               other way cone and beam width are fitted
                                               (:mod:`fotismos.reference.pairing.lamps`)
small flat ``area`` light, ``L`` and ``A``     spot at its centroid: ``I_p0 = L A / pi``, ``m = 1``,
                                               cone 90 degrees, ``f_att = 1 / d^2``
closed ``area`` light, ``L`` and ``A``         point at its centroid: ``I_p0 = L A / (4 pi)``
``area`` light around the scene, ``L``         ``I_a = L``
``constant``, radiance ``L``                   ``I_a = L``
emission of radiance ``L``                     ``k_i = L``
=============================================  =====================================================

The rules for the level of lights without an exact pair, and for lights of two intensities, are in
:mod:`fotismos.reference.pairing.emitters`.

A flat light of area ``A`` sends the intensity ``L A cos`` in its far field, a convex closed one the
mean projected area ``A / 4`` times ``L`` (Cauchy). The ambient pair is exact for an unoccluded
diffuse surface: a constant environment sends it the irradiance ``pi L``, of which it returns
``rho L``.

``roughplastic`` and ``phong`` have no exact pair; see :class:`Convention`.
"""

from dataclasses import dataclass, field
from enum import Enum
from math import sqrt
from typing import Any

import numpy as np

from fotismos.heuristic.convention import IRRADIANCE_PER_INTENSITY
from fotismos.heuristic.materials import Material
from fotismos.heuristic.terms import normalisation
from fotismos.reference.pairing.pairing_record import BsdfPair, EmitterPair, Miss, Unrepresentable

INTENSITY_FACTOR = 1 / IRRADIANCE_PER_INTENSITY
"""``I_p / E`` and ``I_p0 / I``: the factor of all rows above."""

CLOSED_LIGHT_FACTOR = INTENSITY_FACTOR / 4


class Convention(Enum):
    """How roughplastic and phong are paired.

    ``LITERAL``
        By parameter name, as in a port: ``rho = k_d``, ``alpha = sqrt(2 / (n + 2))`` for any form
        of the lobe, IOR 1.5. In reverse, ``specular_reflectance`` becomes ``k_s``.
    ``MATCHED``
        By albedo at normal incidence (light along the normal, light leaving in all directions):
        ``rho`` such that the diffuse part's albedo is ``k_d``, the IOR such that the specular
        part's is the lobe's (:func:`specular_albedo`), and ``alpha`` such that the top of the lobe
        has the same width (:func:`alpha_of`).
    """

    LITERAL = "literal"
    MATCHED = "matched"


@dataclass(frozen=True)
class Phong:
    """Coefficients, exponent and form of a phong material; three components per coefficient."""

    k_d: tuple[float, float, float]
    k_s: tuple[float, float, float]
    n: float
    form: str = "phong"
    normalised: bool = False


@dataclass
class Replacements:
    """What pairing replaces, misses and loses, recorded as it goes."""

    bsdfs: list[BsdfPair] = field(default_factory=list)
    emitters: list[EmitterPair] = field(default_factory=list)
    misses: list[Miss] = field(default_factory=list)
    lost: list[Unrepresentable] = field(default_factory=list)

    def lose(self, name: str, plugin: str, lost: str, nearest: str) -> None:
        """Record what has no form in the textbook model, see :class:`Unrepresentable`."""
        record = Unrepresentable(name=name, plugin=plugin, lost=lost, nearest=nearest)
        self.lost.append(record)

    def bsdf(
        self, name: str, given: str, derived: str, parameters: dict[str, Any], note: str = ""
    ) -> None:
        """Record the partner of a BSDF; a tuple of equal components becomes one number."""
        short = {
            key: value[0] if isinstance(value, tuple) and len(set(value)) == 1 else value
            for key, value in parameters.items()
        }
        self.bsdfs.append(
            BsdfPair(name=name, given=given, derived=derived, parameters=short, note=note)
        )

    def emitter(
        self, name: str, given: str, derived: str, factor: float, exact: bool = True, note: str = ""
    ) -> None:
        """Record the partner of a light."""
        self.emitters.append(
            EmitterPair(
                name=name, given=given, derived=derived, factor=factor, exact=exact, note=note
            )
        )


def alpha_of(n: float, form: str = "phong") -> float:
    """Return the roughness whose microfacet lobe has the width of a lobe of exponent ``n``.

    At a half-vector angle ``d``, Beckmann's lobe is ``exp(-tan^2(d) / alpha^2)``. Blinn's is
    ``cos^n(d)``, near ``exp(-n d^2 / 2)``, hence the well-known ``alpha = sqrt(2 / (n + 2))``. The
    chapters' is ``cos^n(2 d)``, near ``exp(-2 n d^2)``, because the mirror direction turns by twice
    the half vector: hence ``alpha = sqrt(1 / (2 n + 1))``. Both are 1 at ``n = 0``, and 0 for a
    mirror. The match holds near the top: at half the height, widths agree within 3 % from ``n =
    30`` on.

    >>> alpha_of(12)
    0.2
    >>> alpha_of(48, form="blinn")
    0.2
    """
    return sqrt(2 / (n + 2)) if form == "blinn" else sqrt(1 / (2 * n + 1))


def exponent_of(alpha: float, form: str = "phong") -> float:
    """Return the inverse of :func:`alpha_of`; 0 from ``alpha = 1`` upwards.

    >>> round(exponent_of(0.2), 9)
    12.0
    """
    return max(2 / alpha**2 - 2 if form == "blinn" else (1 / alpha**2 - 1) / 2, 0.0)


def specular_albedo(phong: Phong | Material) -> np.ndarray:
    """Return the albedo of a phong's lobe at normal incidence, per channel.

    ``2 k_s / (n + 2)`` for the chapters' form: the radiance is ``k_s cos^n / pi`` for unit
    irradiance, hence ``(k_s / pi) 2 pi int cos^n cos sin d(theta)``. In general it is ``k_s`` over
    :func:`fotismos.heuristic.terms.normalisation`, and ``k_s`` itself if the lobe is normalised.

    >>> specular_albedo(Phong(k_d=(0.5, 0.5, 0.5), k_s=(0.6, 0.6, 0.6), n=4)).round(9).tolist()
    [0.2, 0.2, 0.2]
    """
    scale = 1.0 if phong.normalised else 1 / normalisation(phong.form, phong.n)
    return np.asarray(phong.k_s) * scale
