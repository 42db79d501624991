"""The phong material that is nearest to each of Mitsuba's BSDFs: one rule a plugin.

==================================================  ================================================
BSDF                                                Rule
==================================================  ================================================
``diffuse``, ``roughplastic``, ``plastic``,         :mod:`reference.pairing.nearest.opaque`
``conductor``, ``roughconductor``, ``principled``
``null``, ``dielectric``, ``roughdielectric``,      :mod:`reference.pairing.nearest.clear`
``thindielectric``
``twosided``, ``mask``, ``blendbsdf``, ``bumpmap``, :mod:`reference.pairing.nearest.wrapped`
``normalmap``
any other, a user's own included                    :mod:`reference.pairing.nearest.probed`
==================================================  ================================================
"""

from reference.pairing.nearest import clear, opaque, probed, wrapped
from reference.pairing.nearest.material import BSDF, Context, Nearest

RULES = {
    "phong": opaque.phong,
    "diffuse": opaque.diffuse,
    "roughplastic": opaque.roughplastic,
    "plastic": opaque.plastic,
    "conductor": opaque.conductor,
    "roughconductor": opaque.conductor,
    "principled": opaque.principled,
    "null": clear.null,
    "dielectric": clear.dielectric,
    "roughdielectric": clear.dielectric,
    "thindielectric": clear.sheet,
    "twosided": wrapped.twosided,
    "mask": wrapped.mask,
    "blendbsdf": wrapped.blend,
    "normalmap": wrapped.normal_map,
    "bumpmap": wrapped.bump_map,
}

WRAPPERS = ("twosided", "mask", "blendbsdf", "normalmap", "bumpmap")

__all__ = ["BSDF", "RULES", "WRAPPERS", "Nearest", "nearest_of"]


def nearest_of(graph, index, convention, found=None):
    """Return the :class:`Nearest` material of a BSDF node.

    ``found``, where given, is completed with it and with those of nested nodes, by index.
    """
    found = {} if found is None else found

    def nearest(inner):
        if inner not in found:
            rule = RULES.get(graph.plugin(inner), probed.nearest)
            found[inner] = rule(Context(graph, convention, nearest), inner)
        return found[inner]

    return nearest(index)
