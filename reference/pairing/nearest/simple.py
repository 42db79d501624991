"""Rules for BSDFs that are not made of others: opaque ones and transparent ones.

The latter are seen through without refraction. Light that passes at normal incidence, straight or
refracted, becomes the transmittance, reflected light a lobe (`probe.lobe`). A closed body has two
such surfaces on each path.
"""

from dataclasses import asdict
from functools import lru_cache
from typing import Any

from heuristic.errors import InputError
from heuristic.plugins.mapped import SMALLEST_ALPHA
from reference.pairing import albedo, factors
from reference.pairing.albedo import RoughPlastic
from reference.pairing.factors import Convention, Phong, exponent_of
from reference.pairing.nearest import operations, probe
from reference.pairing.nearest.material import BSDF, Context, Nearest, rule
from reference.scene import values
from reference.scene.graph import Graph

MIRROR = ("mirror image", "a highlight of the same albedo")


@rule("phong", reflectances={"k_d": 0.0, "k_s": 0.0})
def phong(context: Context, index: int) -> Nearest:
    """``phong``: itself."""
    props = context.graph.props(index)
    names = ("k_i", "k_a", "k_d", "k_s", "n", "form", "normalised", "twosided", "transmittance")
    given = {name: props[name] for name in (*names, "tilt") if name in props}
    return Nearest(**given)


@rule("diffuse", reflectances={"reflectance": 0.5})
def diffuse(context: Context, index: int) -> Nearest:
    """``diffuse``: ``k_d = k_a = rho`` (exact)."""
    reflectance = context.value(index, "reflectance", 0.5)
    return Nearest(k_a=reflectance, k_d=reflectance)


@rule("roughplastic", reflectances={"diffuse_reflectance": 0.5, "specular_reflectance": 1.0})
def roughplastic(context: Context, index: int) -> Nearest:
    """``roughplastic``: by the convention (:class:`reference.pairing.factors.Convention`).

    A textured reflectance is matched at each point: the diffuse part's albedo is linear in ``rho``,
    with ``nonlinear`` it is ``c rho / (1 - f rho)`` (``_of_base``); the lobe's is linear in
    ``specular_reflectance``.
    """
    base, coat = (
        context.value(index, key, default)
        for key, default in (("diffuse_reflectance", 0.5), ("specular_reflectance", 1.0))
    )
    textured = operations.plain(base) is None or operations.plain(coat) is None
    if not textured:
        found, misses = _phong_of(_roughplastic(context.graph, index), context.convention)
        return Nearest(k_a=found.k_d, **asdict(found), misses=tuple(misses))
    graph = context.graph
    white = _roughplastic(graph, index, (1.0,) * 3, (1.0,) * 3)
    unit, _ = _phong_of(white, context.convention)
    k_s = operations.product(graph, coat, unit.k_s[0])
    if context.convention is Convention.LITERAL:
        return Nearest(k_a=base, k_d=base, k_s=k_s, n=unit.n)
    half = _roughplastic(graph, index, (0.5,) * 3, (1.0,) * 3)
    k_d = _of_base(graph, base, unit.k_d[0], _phong_of(half, context.convention)[0].k_d[0])
    return Nearest(k_a=k_d, k_d=k_d, k_s=k_s, n=unit.n)


@rule("plastic", reflectances={"diffuse_reflectance": 0.5, "specular_reflectance": 1.0})
def plastic(context: Context, index: int) -> Nearest:
    """``plastic``: ``roughplastic`` in the limit of ``alpha`` to 0.

    The diffuse part is matched likewise; the coat's mirror image becomes a narrow highlight with
    Fresnel's reflectance at normal incidence.
    """
    graph = context.graph
    base = context.value(index, "diffuse_reflectance", 0.5)
    coat = context.value(index, "specular_reflectance", 1.0)
    if context.convention is Convention.LITERAL:
        n = exponent_of(probe.SMOOTH_ALPHA, "blinn")
        return Nearest(k_a=base, k_d=base, k_s=coat, n=n, lost=(MIRROR,))
    levels = [
        albedo.of_smooth_plastic(
            level,
            values.index_of_refraction(graph, index, "int_ior", "polypropylene"),
            values.index_of_refraction(graph, index, "ext_ior", "air"),
            context.value(index, "nonlinear", False),
        )
        for level in (1.0, 0.5)
    ]
    k_d = _of_base(graph, base, *(diffuse for diffuse, _ in levels))
    reflected = operations.product(graph, coat, levels[0][1])
    return Nearest(k_a=k_d, k_d=k_d, **probe.lobe(context, reflected, 0.0), lost=(MIRROR,))


@rule("conductor", "roughconductor", reflectances={"specular_reflectance": 1.0})
def conductor(context: Context, index: int) -> Nearest:
    """``conductor``, ``roughconductor``: ``k_d = 0``, and a lobe of the albedo at normal incidence.

    The albedo is measured with a white ``specular_reflectance``, which then scales it point by
    point; ``n`` gives the width of ``alpha``, or of the mean of ``alpha_u`` and ``alpha_v``. The
    lobe reflects a constant environment: ``k_a`` is that albedo.
    """
    white = probe.measured(context, index, specular_reflectance=1.0)
    reflected = operations.product(
        context.graph, white.reflected, context.value(index, "specular_reflectance", 1.0)
    )
    if context.plugin(index) == "conductor":
        alpha, lost = 0.0, [MIRROR]
    else:
        alpha, lost = context.value(index, "alpha", white.alpha), []
    lost += [("Fresnel reflection", "the reflectance at normal incidence, at all angles")]
    return Nearest(k_a=reflected, **probe.lobe(context, reflected, alpha), lost=tuple(lost))


@rule("principled", reflectances={}, transmittances={"spec_trans": 0.0})
def principled(context: Context, index: int) -> Nearest:
    """``principled``: ``k_d = base_color (1 - metallic) (1 - spec_trans)``; the rest is a lobe.

    The lobe's albedo is measured, averaged over textures, less the diffuse part; its width is that
    of ``alpha = roughness^2``. The share ``spec_trans`` is seen through without refraction.
    """
    graph = context.graph
    k_d = context.value(index, "base_color", 0.5)
    for key in ("metallic", "spec_trans"):
        k_d = operations.rest(graph, k_d, context.value(index, key, 0.0))
    found = probe.measured(context, index)
    roughness = context.value(index, "roughness", 0.5)
    return Nearest(
        k_a=found.reflected if operations.plain(k_d) is not None else k_d,
        k_d=k_d,
        **probe.lobe(context, found.specular, operations.product(graph, roughness, roughness)),
        transmittance=found.passed,
        lost=(("sheen, clearcoat, Fresnel reflection", "a diffuse part and one lobe"),),
    )


def _of_base(graph: Graph, rho: Any, whole: float, half: float) -> Any:
    """Return the albedo of a plastic's diffuse base at each point of a reflectance.

    The base reflects again the light that the coat sends back, so the albedo is ``c rho / (1 - f
    rho)``, with ``f = 0`` if ``nonlinear`` is off; ``c`` and ``f`` follow from the albedos at
    ``rho`` of 1 and 0.5: ``a(1) / a(0.5) = (2 - f) / (1 - f)``.
    """
    if min(whole, half) <= 0:  # no light reaches the base and leaves again
        return operations.product(graph, rho, 0.0)
    ratio = whole / half
    returned = (ratio - 2) / (ratio - 1)
    if returned < 1e-5:
        return operations.product(graph, rho, whole)
    scale = whole * (1 - returned)
    level = operations.plain(rho)
    if level is not None:
        shares = level if isinstance(level, tuple) else (level,)
        found = tuple(scale * share / (1 - returned * share) for share in shares)
        return found if len(found) > 1 else found[0]
    return operations.node(
        graph, "heuristic_interior", rho=rho, scale=float(scale), **{"return": float(returned)}
    )


def prepare(graph: Graph, convention: Convention) -> None:
    """Compute together what the rules need for the rough plastics of a graph."""
    if convention is Convention.MATCHED:
        found = (_rough(graph, index) for index in graph.nodes(BSDF))
        albedo.prepare(one for one in found if one is not None)


def _rough(graph: Graph, index: int) -> RoughPlastic | None:
    """Return a white roughplastic, None for other BSDFs and those that pairing will reject."""
    if graph.plugin(index) != "roughplastic":
        return None
    try:
        return _roughplastic(graph, index, (1.0,) * 3, (1.0,) * 3)
    except (InputError, RuntimeError):
        return None


def _roughplastic(
    graph: Graph, index: int, base: tuple | None = None, coat: tuple | None = None
) -> RoughPlastic:
    """Read a roughplastic's parameters, with Mitsuba's defaults; reflectances can be given."""
    props = graph.props(index)
    return RoughPlastic(
        diffuse_reflectance=base or values.colour(graph, index, "diffuse_reflectance", 0.5),
        alpha=max(values.number(graph, index, "alpha", 0.1), SMALLEST_ALPHA),
        int_ior=values.index_of_refraction(graph, index, "int_ior", "polypropylene"),
        ext_ior=values.index_of_refraction(graph, index, "ext_ior", "air"),
        specular_reflectance=coat or values.colour(graph, index, "specular_reflectance", 1.0),
        distribution=props.get("distribution", "beckmann"),
        nonlinear=props.get("nonlinear", False),
    )


@lru_cache(maxsize=albedo.KEPT)
def _phong_of(plastic: RoughPlastic, convention: Convention) -> tuple[Phong, list]:
    return factors.to_phong(plastic, convention)


NEAREST = "seen through without refraction, by the transmittance at normal incidence"


@rule("null")
def null(context: Context, index: int) -> Nearest:
    """``null``: transmittance 1 (exact)."""
    return Nearest(transmittance=1.0, twosided=True)


@rule("dielectric", "roughdielectric")
def dielectric(context: Context, index: int) -> Nearest:
    """``dielectric``, ``roughdielectric``: the interface is lit only from outside."""
    return _clear(context, index, "refraction", twosided=False)


@rule("thindielectric")
def sheet(context: Context, index: int) -> Nearest:
    """``thindielectric``: both sides reflect, without refraction."""
    return _clear(context, index, "mirror image", twosided=True)


def _clear(context: Context, index: int, lost: str, twosided: bool) -> Nearest:
    given = context.graph.props(index)
    white = probe.measured(context, index, specular_reflectance=1.0, specular_transmittance=1.0)
    passed = operations.product(
        context.graph, white.passed, given.get("specular_transmittance", 1.0)
    )
    reflected = operations.product(
        context.graph, white.reflected, given.get("specular_reflectance", 1.0)
    )
    return Nearest(
        k_a=reflected,
        **probe.lobe(context, reflected, given.get("alpha", white.alpha)),
        transmittance=passed,
        twosided=twosided,
        lost=((lost, NEAREST),),
    )
