"""Colours prepared once for a scene: RGB, or one value at each of some wavelengths."""

from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi
import numpy as np

KNOTS = 16
"""Wavelengths of a tabulated spectrum, in steps of 31 nm: a multiple of a ray's number."""


def batches() -> list[Any]:
    """Return the wavelengths (nm) to gather light at, a batch per ray; [] for RGB and mono."""
    if not mi.is_spectral:
        return [[]]
    size = dr.size_v(mi.Spectrum)
    knots = np.linspace(mi.MI_CIE_MIN, mi.MI_CIE_MAX, KNOTS).reshape(-1, size)
    return [mi.Spectrum(*map(float, batch)) for batch in knots]


def columns(value: Any, count: int) -> np.ndarray:
    """Return a spectrum at ``count`` points as an array (count, channels)."""
    value = mi.Spectrum(value) + dr.zeros(mi.Spectrum, count)
    return np.array(value, float).reshape(-1, count).T


class Table:
    """A colour at all wavelengths.

    Parameters
    ----------
    values
        (K,), finite: the channels of the variant, or values at the :func:`batches`, in order.
    """

    DRJIT_STRUCT: ClassVar = {"values": object}  # what dr.freeze must know of

    def __init__(self, values: np.ndarray) -> None:
        self.values = mi.Float(np.asarray(values, float))
        dr.eval(self.values)  # as a literal it would compile a kernel for every scene

    def at(self, wavelengths: Any) -> Any:
        """Return the colour at the wavelengths of rays, linear between those tabulated."""
        if not mi.is_spectral:
            numbers = range(dr.size_v(mi.Spectrum))
            return mi.Spectrum([dr.gather(mi.Float, self.values, n) for n in numbers])
        step = (mi.MI_CIE_MAX - mi.MI_CIE_MIN) / (KNOTS - 1)
        place = dr.clip((wavelengths - mi.MI_CIE_MIN) / step, 0, KNOTS - 1)
        below = dr.minimum(mi.UInt32(0) + dr.uint32_array_t(type(place))(place), KNOTS - 2)
        share = place - type(place)(below)
        low, high = (
            mi.Spectrum([dr.gather(mi.Float, self.values, n + more) for n in below])
            for more in (0, 1)
        )
        return dr.lerp(low, high, share)
