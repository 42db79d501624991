"""Rules for BSDFs that let light through: seen through without refraction.

What passes straight or refracted at normal incidence becomes the transmittance, what is reflected a
lobe (`probed.lobe`). A closed body has two such surfaces on each path.
"""

from reference.pairing.nearest import operations, probed
from reference.pairing.nearest.material import Context, Nearest, rule

NEAREST = "seen through without refraction, by the transmittance at normal incidence"


@rule("null")
def null(context: Context, index: int) -> Nearest:
    """``null``: transmittance 1 (exact)."""
    return Nearest(transmittance=1.0, twosided=True)


@rule("dielectric", "roughdielectric")
def dielectric(context: Context, index: int) -> Nearest:
    """``dielectric``, ``roughdielectric``: the interface is lit from outside alone."""
    return _clear(context, index, "refraction", twosided=False)


@rule("thindielectric")
def sheet(context: Context, index: int) -> Nearest:
    """``thindielectric``: both sides reflect, and nothing is refracted."""
    return _clear(context, index, "mirror image", twosided=True)


def _clear(context: Context, index: int, lost: str, twosided: bool) -> Nearest:
    given = context.graph.props(index)
    white = probed.with_values(context, index, specular_reflectance=1.0, specular_transmittance=1.0)
    passed = operations.product(
        context.graph, white.passed, given.get("specular_transmittance", 1.0)
    )
    reflected = operations.product(
        context.graph, white.reflected, given.get("specular_reflectance", 1.0)
    )
    return Nearest(
        k_a=reflected,
        **probed.lobe(context, reflected, given.get("alpha", white.alpha)),
        transmittance=passed,
        twosided=twosided,
        lost=((lost, NEAREST),),
    )
