"""Conventions: limits at which no formula breaks, but which mathematics does not settle.

Each could be defined otherwise; tests hold the code to these.
"""

import drjit as dr
import numpy as np
from drjit.llvm import Array3f, Float

import heuristic
from comparisons.departure.metrics import delta_e_2000
from comparisons.hard import cases
from heuristic import vectors
from reference.pairing.factors import Convention, Phong, to_roughplastic
from reference.pairing.refraction import SMALLEST_IOR

FAINT = Phong(k_d=(0.5,) * 3, k_s=(1e-12,) * 3, n=9.0)


def _behind_an_even_spot(exponent):
    """Return the light that arrives 120 degrees from the axis of a spot of cutoff 135 degrees."""
    toward = np.array([np.sqrt(0.75), 0.0, 0.5])
    light = heuristic.SpotLight((0, 0, 0), (0, 0, 1), 1.0, cutoff=135.0, exponent=exponent)
    at = Array3f(*map(float, toward * (1, 1, -1)))
    return np.array(light.illuminate(at).intensity + dr.zeros(Float, 1))


CONVENTIONS = (
    cases.Convention(
        "m = 0 of a spot",
        "An even cone, lit up to its cutoff even beyond 90°, though cos^m is dark there for every"
        " m > 0; the same for a compiled-in m and a run-time m.",
        [1.0, 1.0],
        lambda: np.ravel([_behind_an_even_spot(m) for m in (0, dr.opaque(Float, 0))]),
    ),
    cases.Convention(
        "normals of length 1e-40",
        "Below the smallest normal float a length counts as 0 or as less than 1, as the processor's"
        " threads treat such numbers: the surface may be too dark, but never NaN or too bright.",
        True,
        lambda: float(dr.norm(vectors.normalise(dr.opaque(Array3f, (6e-41, 0, 8e-41))))[0]) <= 1,
    ),
    cases.Convention(
        "IOR 1",
        "Mitsuba rejects it, since it makes no surface. A lobe too faint for any IOR above"
        " 1.0001 gets 1.0001, and reflects 2.5e-9.",
        SMALLEST_IOR,
        lambda: (
            to_roughplastic(Phong((0.5,) * 3, (1e-12,) * 3, 9.0), Convention.MATCHED)[0].int_ior
        ),
    ),
    cases.Convention(
        "colours above display white",
        "ΔE2000 and CAM16-UCS see what a display shows: twice and three times white are equal."
        " ΔE ITP tells them apart, up to 10,000 cd/m².",
        0.0,
        lambda: delta_e_2000(np.full((1, 1, 3), 2.0), np.full((1, 1, 3), 3.0)),
    ),
)
