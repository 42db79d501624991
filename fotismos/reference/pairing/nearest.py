"""The phong material that is nearest to a BSDF with a lobe, around others, or transparent.

One function per plugin; any other BSDF, including a user's, is measured (:func:`unknown`).
Transparent BSDFs are seen through without refraction: light that passes at normal incidence,
straight or refracted, becomes the transmittance, reflected light a lobe. A closed body has two such
surfaces on each path.

Users' heuristics also read physical parameters: a plugin's own, with ``alpha`` at least 1e-4 and
``ior`` the index inside over the one outside. For conductors ``base_color`` is the albedo at normal
incidence, ``metallic`` 1 and ``ior`` 1; for dielectrics ``base_color`` is 0. A measured BSDF has
the albedo of its diffuse part, and the index of its lobe's albedo. Index 1 means no interface.
"""

from dataclasses import asdict, replace
from math import inf, sqrt
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic.errors import InputError
from fotismos.heuristic.materials import COEFFICIENTS, SMALLEST_ALPHA
from fotismos.heuristic.terms import normalisation
from fotismos.reference.pairing import albedo, probe
from fotismos.reference.pairing.albedo import RoughPlastic
from fotismos.reference.pairing.bsdfs import (
    BUMP_SHADOWS,
    LAYERED_BUMPS,
    TEXTURE,
    Context,
    NearestPhong,
    Rule,
    has_bump_shadows,
)
from fotismos.reference.pairing.factors import Convention, exponent_of
from fotismos.reference.scene import values
from fotismos.reference.scene.graph import Graph, Reference

NESTED_MAPS, OTHER_NORMALS_BEHIND, TWO_NORMALS = LAYERED_BUMPS

SMOOTH_ALPHA = 0.05
"""Replaces a smaller roughness: a mirror's lobe has no width, and the model's light no extent. The
albedo is kept, so the highlight holds as much as the mirror image of a small light."""

LARGEST_IOR = 4.0
"""Limit of measured indices: germanium has 4."""


def lobe(context: Context, reflected: Any, alpha: Any) -> dict[str, Any]:
    """Return ``k_s``, ``n`` and ``normalised`` of a lobe of an albedo and a roughness.

    ``n`` is :func:`fotismos.reference.pairing.factors.exponent_of` ``alpha``, and ``k_s`` the
    albedo times :func:`fotismos.heuristic.terms.normalisation`; if ``alpha`` is a texture, the
    plugin normalises.
    """
    if values.is_zero(reflected):
        return {}
    level = values.plain(alpha)
    if level is None:
        n = values.node(context.graph, "heuristic_exponent", alpha=alpha)
        return {"k_s": reflected, "n": n, "normalised": True}
    n = exponent_of(max(float(np.mean(level)), SMOOTH_ALPHA))
    scale = float(normalisation("phong", n))
    return {"k_s": values.product(context.graph, reflected, scale), "n": n}


def unknown(context: Context, index: int) -> NearestPhong:
    """The diffuse part as ``k_d``, the rest as a lobe of the same albedo and width."""
    probed = probe.with_values(context.graph, index)
    if probed is None:
        lost = (("reflection", "diffuse of 0.5: it cannot be sampled"),)
        return NearestPhong(k_a=0.5, k_d=0.5, lost=lost, physical=context.physical(0.5))
    graph = context.graph
    level = values.plain(probed.specular)
    # Fresnel's `F = ((ior - 1) / (ior + 1))^2`, solved for the index; 0.04 for a spectrum.
    root = sqrt(min(float(np.mean(level)) if level is not None else 0.04, 0.99))
    ior = min((1 + root) / (1 - root), LARGEST_IOR)
    width = min(max(probed.alpha, SMALLEST_ALPHA), 1.0)
    physical = context.physical(probed.diffuse, width, ior)
    rule = "k_d, k_s and n measured at normal incidence, textures averaged"
    all_but = "all but a diffuse part and a lobe"
    if context.plugin(index) == "hair":
        # Light transmitted by a fibre leaves on the other side of the same strand.
        half = values.total(graph, probed.reflected, probed.passed)
        everything = values.total(graph, half, probed.scattered)
        return NearestPhong(
            k_a=everything,
            k_d=everything,
            twosided=True,
            lost=((all_but, "k_d is the whole albedo"),),
            physical=physical,
        )
    if not values.is_zero(probed.scattered):
        all_but += ", and light scattered through"
    return NearestPhong(
        k_a=probed.reflected,
        k_d=probed.diffuse,
        **lobe(context, probed.specular, probed.alpha),
        transmittance=probed.passed,
        lost=((all_but, rule),),
        physical=physical,
    )


def _alpha(context: Context, index: int) -> Any:
    rough = context.plugin(index).startswith("rough")
    along = context.value(index, "alpha_u", 0.1)
    return _at_least(context.value(index, "alpha", along if rough else 0.0))


def _at_least(alpha: Any) -> Any:
    level = values.plain(alpha)
    return alpha if level is None else max(level, SMALLEST_ALPHA)


def _ior(graph: Graph, index: int, inside: str) -> float:
    inner = values.index_of_refraction(graph, index, "int_ior", inside)
    return inner / values.index_of_refraction(graph, index, "ext_ior", "air")


def _of_plastic(context: Context, index: int, base: Any) -> dict[str, Any]:
    return context.physical(
        base, _alpha(context, index), _ior(context.graph, index, "polypropylene")
    )


MIRROR = ("mirror image", "a highlight of the same albedo")


def roughplastic(context: Context, index: int) -> NearestPhong:
    """``roughplastic``: by the convention (:class:`fotismos.reference.pairing.factors.Convention`).

    A textured reflectance is matched at each point: the diffuse part's albedo is linear in ``rho``,
    with ``nonlinear`` it is ``c rho / (1 - f rho)`` (``_of_base``); the lobe's is linear in
    ``specular_reflectance``.
    """
    graph = context.graph
    base = context.value(index, "diffuse_reflectance", 0.5)
    coat = context.value(index, "specular_reflectance", 1.0)
    physical = _of_plastic(context, index, base)
    if values.plain(base) is not None and values.plain(coat) is not None:
        material = albedo.to_phong(_roughplastic(graph, index), context.convention)
        return NearestPhong(k_a=material.k_d, **asdict(material), physical=physical)
    # A texture: albedos at reflectances of 1 and 0.5 determine all others.
    white = _roughplastic(graph, index, base=(1.0,) * 3, coat=(1.0,) * 3)
    unit = albedo.to_phong(white, context.convention)
    k_s = values.product(graph, coat, unit.k_s[0])
    if context.convention is Convention.LITERAL:
        return NearestPhong(k_a=base, k_d=base, k_s=k_s, n=unit.n, physical=physical)
    half = _roughplastic(graph, index, base=(0.5,) * 3, coat=(1.0,) * 3)
    level = albedo.to_phong(half, context.convention).k_d[0]
    k_d = _of_base(graph, base, whole=unit.k_d[0], half=level)
    return NearestPhong(k_a=k_d, k_d=k_d, k_s=k_s, n=unit.n, physical=physical)


def plastic(context: Context, index: int) -> NearestPhong:
    """``plastic``: ``roughplastic`` in the limit of ``alpha`` to 0.

    The diffuse part is matched in the same way; the coat's mirror image becomes a narrow highlight
    with Fresnel's reflectance at normal incidence.
    """
    graph = context.graph
    base = context.value(index, "diffuse_reflectance", 0.5)
    if context.convention is Convention.LITERAL:
        coat = context.value(index, "specular_reflectance", 1.0)
        n = exponent_of(SMOOTH_ALPHA, "blinn")
        nearest = NearestPhong(k_a=base, k_d=base, k_s=coat, n=n)
        return replace(nearest, lost=(MIRROR,), physical=_of_plastic(context, index, base))
    inside = values.index_of_refraction(graph, index, "int_ior", "polypropylene")
    outside = values.index_of_refraction(graph, index, "ext_ior", "air")
    nonlinear = context.value(index, "nonlinear", False)
    whole, mirror = albedo.of_smooth_plastic(1.0, inside, ext_ior=outside, nonlinear=nonlinear)
    half, _ = albedo.of_smooth_plastic(0.5, inside, ext_ior=outside, nonlinear=nonlinear)
    k_d = _of_base(graph, base, whole=whole, half=half)
    reflected = _tinted(context, index, reflected=mirror, key="specular_reflectance")
    return NearestPhong(
        k_a=k_d,
        k_d=k_d,
        **lobe(context, reflected, 0.0),
        lost=(MIRROR,),
        physical=_of_plastic(context, index, base),
    )


def conductor(context: Context, index: int) -> NearestPhong:
    """``conductor``, ``roughconductor``: ``k_d = 0``, and a lobe of the albedo at normal incidence.

    The albedo is measured with a white ``specular_reflectance``, which then scales it point by
    point; ``n`` gives the width of ``alpha``, or of the mean of ``alpha_u`` and ``alpha_v``. The
    lobe reflects a constant environment: ``k_a`` is that albedo.
    """
    white = probe.measured(context.graph, index, specular_reflectance=1.0)
    reflected = _tinted(context, index, reflected=white.reflected, key="specular_reflectance")
    if context.plugin(index) == "conductor":
        alpha = 0.0
        lost = [MIRROR]
    else:
        alpha = context.value(index, "alpha", white.alpha)
        lost = []
    lost += [("Fresnel reflection", "the reflectance at normal incidence, at all angles")]
    return NearestPhong(
        k_a=reflected,
        **lobe(context, reflected, alpha),
        lost=tuple(lost),
        physical=context.physical(reflected, _alpha(context, index), metallic=1.0),
    )


def principled(context: Context, index: int) -> NearestPhong:
    """``principled``: ``k_d = base_color (1 - metallic) (1 - spec_trans)``; the rest is a lobe.

    The lobe's albedo is measured, averaged over textures, less the diffuse part; its width is that
    of ``alpha = roughness^2``. The share ``spec_trans`` is seen through without refraction.
    """
    graph = context.graph
    k_d = base = context.value(index, "base_color", 0.5)
    for key in ("metallic", "spec_trans"):
        k_d = values.rest(graph, k_d, context.value(index, key, 0.0))
    probed = probe.measured(context.graph, index)
    roughness = context.value(index, "roughness", 0.5)
    alpha = values.product(graph, roughness, roughness)
    specular = values.plain(context.value(index, "specular", 0.5))
    # Mitsuba's reading of `specular`, F0 = 0.08 specular, as an index.
    ior = 2 / (1 - sqrt(0.08 * specular)) - 1 if isinstance(specular, float) else 1.5
    ior = context.value(index, "eta", ior)
    metallic = context.value(index, "metallic", 0.0)
    return NearestPhong(
        k_a=probed.reflected if values.plain(k_d) is not None else k_d,
        k_d=k_d,
        **lobe(context, probed.specular, alpha),
        transmittance=probed.passed,
        lost=(("sheen, clearcoat, Fresnel reflection", "a diffuse part and one lobe"),),
        physical=context.physical(base, _at_least(alpha), ior, metallic),
    )


def _of_base(graph: Graph, rho: Any, whole: float, half: float) -> Any:
    """Return the albedo of a plastic's diffuse base at each point of a reflectance.

    The base reflects again the light that the coat sends back, so the albedo is ``c rho / (1 - f
    rho)``, with ``f = 0`` if ``nonlinear`` is off; ``c`` and ``f`` follow from the albedos at
    ``rho`` of 1 and 0.5: ``a(1) / a(0.5) = (2 - f) / (1 - f)``.
    """
    if min(whole, half) <= 0:  # no light reaches the base and leaves again
        return values.product(graph, rho, 0.0)
    ratio = whole / half
    returned = (ratio - 2) / (ratio - 1)
    if returned < 1e-5:
        return values.product(graph, rho, whole)
    scale = whole * (1 - returned)
    level = values.plain(rho)
    if level is not None:
        shares = level if isinstance(level, tuple) else (level,)
        components = tuple(scale * share / (1 - returned * share) for share in shares)
        return components if len(components) > 1 else components[0]
    return values.node(
        graph, "heuristic_interior", rho=rho, scale=float(scale), **{"return": float(returned)}
    )


def _roughplastic(
    graph: Graph,
    index: int,
    base: tuple[Any, ...] | None = None,
    coat: tuple[Any, ...] | None = None,
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


NEAREST = "seen through without refraction, by the transmittance at normal incidence"


def dielectric(context: Context, index: int) -> NearestPhong:
    """``dielectric``, ``roughdielectric``: lit only from outside; ``thindielectric``: both sides.

    Only the thin one has no refraction.
    """
    is_thin = context.plugin(index) == "thindielectric"
    white = probe.measured(
        context.graph, index, specular_reflectance=1.0, specular_transmittance=1.0
    )
    reflected = _tinted(context, index, reflected=white.reflected, key="specular_reflectance")
    return NearestPhong(
        k_a=reflected,
        **lobe(context, reflected, context.value(index, "alpha", white.alpha)),
        transmittance=_tinted(context, index, reflected=white.passed, key="specular_transmittance"),
        twosided=is_thin,
        lost=(("mirror image" if is_thin else "refraction", NEAREST),),
        physical=context.physical(0.0, _alpha(context, index), _ior(context.graph, index, "bk7")),
    )


def _tinted(context: Context, index: int, reflected: Any, key: str) -> Any:
    """Return an albedo times a parameter that scales it, 1 if it is not given."""
    return values.product(context.graph, reflected, context.value(index, key, 1.0))


def null(context: Context, index: int) -> NearestPhong:
    """``null``: transmittance 1 (exact)."""
    return NearestPhong(transmittance=1.0, twosided=True, physical=context.physical())


def alike(
    graph: Graph, first: NearestPhong, second: NearestPhong
) -> tuple[NearestPhong, NearestPhong]:
    """Return two materials with lobes that can be mixed: scaled alike, and no mirror beside one."""
    first, second = _beside(first, second), _beside(second, first)
    if first.normalised == second.normalised:
        return first, second
    return _normalised(graph, first), _normalised(graph, second)


def _beside(material: NearestPhong, other: NearestPhong) -> NearestPhong:
    """Return a material without its mirror if another has a lobe, since both share one ``n``."""
    exponent = values.plain(material.n)
    others = values.plain(other.n)
    if others == inf and values.is_zero(material.k_s):
        return replace(material, n=inf)
    if exponent == inf != others and not values.is_zero(other.k_s):
        return replace(material, k_s=0.0, n=other.n)
    return material


def _normalised(graph: Graph, material: NearestPhong) -> NearestPhong:
    if material.normalised or values.is_zero(material.k_s):
        return replace(material, normalised=True)
    n = values.plain(material.n)
    if n is None:
        raise InputError(
            f"{graph.name}: a phong whose n is a texture is mixed with a BSDF whose alpha is one:"
            " give the phong a single n, or make it normalised."
        )
    scale = 1 / float(normalisation(material.form, n))
    return replace(material, normalised=True, k_s=values.product(graph, material.k_s, scale))


def twosided(context: Context, index: int) -> NearestPhong:
    """``twosided``: the phong's own parameter; of two BSDFs, each on its side."""
    graph = context.graph
    inner = context.inner(index)
    if len(inner) == 1:
        return replace(inner[0], twosided=True, lost=())
    front, back = alike(graph, inner[0], inner[1])
    sided = {
        name: values.sides(graph, getattr(front, name), getattr(back, name))
        for name in (*COEFFICIENTS, "n", "transmittance")
    }
    physical = {
        name: values.sides(graph, value, back.physical[name])
        for name, value in front.physical.items()
    }
    # A phong has one form of the lobe and one tilt of the normal for both sides.
    lobes = [side for side in (front, back) if not values.is_zero(side.k_s)]
    form = lobes[0].form if lobes else front.form
    lost = []
    if len({side.form for side in lobes}) > 1:
        lost.append(("another form of the lobe behind", f"{form} on both sides"))
    if not _are_tilted_alike(graph, front, back):
        lost.append(OTHER_NORMALS_BEHIND)
    return replace(
        front,
        **sided,
        form=form,
        twosided=True,
        lost=tuple(lost),
        physical=physical,
    )


def mask(context: Context, index: int) -> NearestPhong:
    """``mask``: coefficients times the opacity, the rest passes straight through (exact)."""
    graph = context.graph
    (inner,) = context.inner(index)
    opacity = context.value(index, "opacity", 0.5)
    reflected = {
        name: values.share(graph, getattr(inner, name), opacity) for name in ("k_a", "k_d", "k_s")
    }
    passed = values.total(
        graph, values.rest(graph, 1.0, opacity), values.share(graph, inner.transmittance, opacity)
    )
    return replace(inner, **reflected, transmittance=passed, lost=())


def blend(context: Context, index: int) -> NearestPhong:
    """``blendbsdf``: each coefficient, and the exponent, blended by the weight.

    Exact if only one of the two has a lobe and both have the same normal, or if the weight is 0 or
    1.
    """
    graph = context.graph
    inner = context.inner(index)
    first, second = alike(graph, inner[0], inner[1])
    if first.twosided != second.twosided:
        first = _twosided(graph, first)
        second = _twosided(graph, second)
    weight = context.value(index, "weight", 0.5)
    mixed = {
        name: values.blend(graph, getattr(first, name), getattr(second, name), weight)
        for name in (*COEFFICIENTS, "transmittance")
    }
    lost = []
    lobes = [material for material in (first, second) if not values.is_zero(material.k_s)]
    if len(lobes) == 2:
        mixed["n"] = values.blend(graph, first.n, second.n, weight)
        lost.append(("two lobes", "one, of the blended exponent and coefficient"))
        form = first.form
    else:
        mixed["n"], form = (lobes[0].n, lobes[0].form) if lobes else (1.0, "phong")
    if not _are_tilted_alike(graph, first, second):
        lost.append(TWO_NORMALS)
    return NearestPhong(
        **mixed,
        form=form,
        normalised=first.normalised,
        twosided=first.twosided,
        tilt=first.tilt or second.tilt,
        lost=tuple(lost),
        physical={
            name: values.blend(graph, value, second.physical[name], weight)
            for name, value in first.physical.items()
        },
    )


def _are_tilted_alike(graph: Graph, first: NearestPhong, second: NearestPhong) -> bool:
    """Return whether two materials have the same normals; of two maps, if they share a texture."""
    if first.tilt is None or second.tilt is None:
        return first.tilt is second.tilt
    return bool(graph.props(first.tilt.index()) == graph.props(second.tilt.index()))


def _twosided(graph: Graph, material: NearestPhong) -> NearestPhong:
    """Return a material as a two-sided one, whose back is black if it had none."""
    if material.twosided:
        return material
    front = {
        name: values.sides(graph, getattr(material, name), 0.0)
        for name in COEFFICIENTS
        if not values.is_zero(getattr(material, name))
    }
    return replace(material, **front, twosided=True)


def normal_map(context: Context, index: int) -> NearestPhong:
    """``normalmap``: the nested material, with the mapped normal (exact without shadowing)."""
    normals = context.graph.props(index)["normalmap"]
    _require(context, index, normals, "eval_3", "normal")
    return _tilted(context, index, normals=normals)


def bump_map(context: Context, index: int) -> NearestPhong:
    """``bumpmap``: the nested material, with the displaced surface's normal (exact as above)."""
    ((key, _),) = context.graph.children(index, TEXTURE)
    scale = float(context.value(index, "scale", 1.0))
    heights = context.graph.props(index)[key]
    _require(context, index, heights, "eval_1_grad", "slope")
    return _tilted(context, index, heights=heights, scale=scale)


def _require(context: Context, index: int, texture: Any, ability: str, what: str) -> None:
    """Reject a texture that lacks what its map evaluates; otherwise only shading would reveal it.

    Mitsuba accepts such a texture only with integrators that do not evaluate materials.
    """
    graph = context.graph
    if not isinstance(texture, Reference):
        return
    si = dr.zeros(mi.SurfaceInteraction3f, 1)
    si.shape = mi.ShapePtr(mi.load_dict({"type": "rectangle"}))
    instance = graph.instantiate(texture.index())
    try:
        dr.eval(getattr(instance, ability)(si))
    except RuntimeError as error:
        if f"{ability}()" in str(error):
            raise InputError(
                f"{graph.name}: {graph.label(index)}: a texture {graph.plugin(texture.index())}"
                f" gives {context.plugin(index)} no {what} (Mitsuba cannot {ability} it). Give a"
                " bitmap of three channels."
            ) from error


def _tilted(context: Context, index: int, **parameters: Any) -> NearestPhong:
    (inner,) = context.inner(index)
    lost = []
    if has_bump_shadows(context.graph.props(index)):
        lost.append(BUMP_SHADOWS)
    parameters["flip"] = context.value(index, "flip_invalid_normals", True)
    if inner.tilt is not None:
        lost.append(NESTED_MAPS)
    tilt = values.node(context.graph, "heuristic_tilt", **parameters)
    return replace(inner, tilt=tilt, lost=tuple(lost))


RULES: dict[str, Rule] = {
    "roughplastic": roughplastic,
    "plastic": plastic,
    **dict.fromkeys(("conductor", "roughconductor"), conductor),
    "principled": principled,
    **dict.fromkeys(("dielectric", "roughdielectric", "thindielectric"), dielectric),
    "null": null,
    "twosided": twosided,
    "mask": mask,
    "blendbsdf": blend,
    "normalmap": normal_map,
    "bumpmap": bump_map,
}


def rule_of(plugin: str) -> Rule:
    """Return the rule of a BSDF, by the name of its plugin."""
    return RULES.get(plugin, unknown)
