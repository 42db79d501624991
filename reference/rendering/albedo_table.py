"""Light of a constant environment without sampling: the albedo of a BSDF, tabulated."""

from typing import Any, ClassVar

import drjit as dr
import mitsuba as mi
import numpy as np

from heuristic.arrays import Colour, Number
from reference.pairing.nearest.probe import lattice

NODES = 256
SAMPLES = 8192


class AlbedoTable:
    """The albedo of a uniform, isotropic BSDF over the cosine of the view direction, RGB.

    If nothing stands between a surface and a constant environment of radiance ``L``, the reflected
    radiance is ``L a(mu)``, with the albedo for the view direction of cosine ``mu``. It is
    tabulated once, by Mitsuba's sampling of the BSDF on a rank-1 lattice, and looked up at each
    camera ray, without Monte Carlo in the image.

    Nodes are even in ``sqrt(mu)``: Fresnel's terms bend most towards grazing. A BSDF that also
    reflects on its back does so in the same way.
    """

    DRJIT_STRUCT: ClassVar = {"table": Any}  # what dr.freeze must know of

    def __init__(self, bsdf: Any):
        self.has_back = mi.has_flag(bsdf.flags(), mi.BSDFFlags.BackSide)
        mu = np.linspace(1e-3, 1, NODES) ** 2
        # Spread out in the kernel: millions of numbers need not be sent.
        places = dr.arange(mi.UInt32, NODES * SAMPLES)
        grid_mu = dr.gather(mi.Float, mi.Float(mu), places // SAMPLES)
        rows = lattice(SAMPLES)[:3]
        points = [dr.gather(mi.Float, mi.Float(row), places % SAMPLES) for row in rows]
        si = dr.zeros(mi.SurfaceInteraction3f, NODES * SAMPLES)
        si.wi = mi.Vector3f(dr.safe_sqrt(1 - dr.square(grid_mu)), 0, grid_mu)
        _, weight = bsdf.sample(mi.BSDFContext(), si, points[0], mi.Point2f(*points[1:]))
        # Thousands of equal terms lose four digits in single precision.
        means = [
            mi.Float(dr.block_sum(mi.Float64(channel), SAMPLES) / SAMPLES) for channel in weight
        ]
        self.table = dr.ravel(mi.Color3f(*means))
        dr.eval(self.table)

    def at(self, mu: Number) -> Colour:
        """Interpolate linearly at cosines ``mu``; behind a one-sided surface, 0."""
        mu = abs(mu) if self.has_back else mu
        place = (dr.safe_sqrt(mu) - 1e-3) / (1 - 1e-3) * (NODES - 1)
        place = dr.clip(place, 0, NODES - 1)
        below = dr.minimum(mi.UInt32(place), NODES - 2)
        low, high = (dr.gather(mi.Color3f, self.table, below + i) for i in (0, 1))
        return dr.select(mu > 0, dr.lerp(low, high, place - mi.Float(below)), 0)
