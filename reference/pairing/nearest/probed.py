"""The rule for any BSDF: what it reflects at normal incidence, measured, as k_d, k_s and n."""

from dataclasses import dataclass

import mitsuba as mi

from heuristic.terms import normalisation
from reference.pairing.factors import exponent_of
from reference.pairing.nearest import operations
from reference.pairing.nearest.material import Context, Nearest
from reference.pairing.nearest.probe import as_value, probe

SMOOTH_ALPHA = 0.05
"""In place of a smaller roughness: a mirror's lobe has no width, and the model's light no extent.
Its albedo is kept, so that the highlight holds what the mirror image of a small light would."""


@dataclass(frozen=True)
class White:
    """The probe's albedos as values of the graph, and the lobe's width."""

    reflected: object
    diffuse: object
    specular: object
    passed: object
    scattered: object
    alpha: float


def nearest(context: Context, index: int) -> Nearest:
    """The diffuse part as ``k_d``, the rest as a lobe of the same albedo and width."""
    found = with_values(context, index)
    if found is None:
        return Nearest(
            k_a=0.5, k_d=0.5, lost=(("reflection", "diffuse of 0.5: it cannot be sampled"),)
        )
    graph = context.graph
    rule = "k_d, k_s and n measured at normal incidence, textures averaged"
    lost = "all but a diffuse part and a lobe"
    if context.plugin(index) == "hair":
        # Light that a fibre lets through leaves it on the other side of the same strand.
        everything = operations.total(
            graph, operations.total(graph, found.reflected, found.passed), found.scattered
        )
        lost = ((lost, "k_d is the whole albedo"),)
        return Nearest(k_a=everything, k_d=everything, twosided=True, lost=lost)
    if not operations.is_zero(found.scattered):
        lost += ", and light scattered through"
    return Nearest(
        k_a=found.reflected,
        k_d=found.diffuse,
        **lobe(context, found.specular, found.alpha),
        transmittance=found.passed,
        lost=((lost, rule),),
    )


def with_values(context: Context, index: int, **values: object) -> White | None:
    """Probe a node's BSDF with some parameters changed; returns :class:`White`, None in vain.

    Only parameters that are given are changed: what has its default keeps it.
    """
    graph = context.graph.copy()
    props = mi.Properties(graph.props(index))
    for key, value in values.items():
        if key in props:
            props[key] = value
    graph.replace(index, props)
    found = probe(graph.instantiate(index))
    if found is None:
        return None
    parts = (found.reflected, found.diffuse, found.specular, found.passed, found.scattered)
    return White(*(as_value(context.graph, part) for part in parts), found.alpha)


def lobe(context: Context, albedo: object, alpha: object) -> dict[str, object]:
    """Return ``k_s``, ``n`` and ``normalised`` of a lobe of an albedo and a roughness.

    ``n`` is :func:`reference.pairing.factors.exponent_of` ``alpha``, and ``k_s`` the albedo times
    :func:`heuristic.terms.normalisation`; where ``alpha`` is a texture, the plugin normalises.
    """
    if operations.is_zero(albedo):
        return {}
    known = operations.plain(alpha)
    if known is None:
        n = operations.exponent(context.graph, alpha)
        return {"k_s": albedo, "n": n, "normalised": True}
    n = exponent_of(max(known, SMOOTH_ALPHA))
    scale = float(normalisation("phong", n))
    return {"k_s": operations.product(context.graph, albedo, scale), "n": n}
