"""Rules for BSDFs that are made of others."""

from dataclasses import replace
from typing import Any

import drjit as dr
import mitsuba as mi

from heuristic.errors import InputError
from heuristic.materials import COEFFICIENTS
from reference.pairing.nearest import operations
from reference.pairing.nearest.material import BSDF, Context, Nearest, alike, rule
from reference.pairing.nearest.operations import TEXTURE
from reference.scene.graph import Reference


@rule("twosided", wraps=True)
def twosided(context: Context, index: int) -> Nearest:
    """``twosided``: the phong's own parameter; of two BSDFs, each on its side."""
    graph = context.graph
    inner = [context.nearest(child) for _, child in graph.children(index, BSDF)]
    if len(inner) == 1:
        return replace(inner[0], twosided=True)
    front, back = alike(graph, *inner[:2])
    sided = {
        name: operations.sides(graph, getattr(front, name), getattr(back, name))
        for name in (*COEFFICIENTS, "n", "transmittance")
    }
    return replace(front, **sided, twosided=True, lost=front.lost + back.lost)


@rule("mask", wraps=True)
def mask(context: Context, index: int) -> Nearest:
    """``mask``: coefficients times the opacity, the rest passes straight through (exact)."""
    graph = context.graph
    ((_, child),) = graph.children(index, BSDF)
    inner = context.nearest(child)
    opacity = context.value(index, "opacity", 0.5)
    reflected = {
        name: operations.share(graph, getattr(inner, name), opacity)
        for name in ("k_a", "k_d", "k_s")
    }
    passed = operations.total(
        graph,
        operations.rest(graph, 1.0, opacity),
        operations.share(graph, inner.transmittance, opacity),
    )
    return replace(inner, **reflected, transmittance=passed)


@rule("blendbsdf", wraps=True)
def blend(context: Context, index: int) -> Nearest:
    """``blendbsdf``: each coefficient, and the exponent, blended by the weight.

    Exact if only one of the two has a lobe, or if the weight is 0 or 1.
    """
    graph = context.graph
    inner = [context.nearest(child) for _, child in graph.children(index, BSDF)]
    first, second = alike(graph, *inner[:2])
    weight = context.value(index, "weight", 0.5)
    mixed = {
        name: operations.blend(graph, getattr(first, name), getattr(second, name), weight)
        for name in (*COEFFICIENTS, "transmittance")
    }
    lost: tuple[tuple[str, str], ...] = ()
    lobes = [material for material in (first, second) if not operations.is_zero(material.k_s)]
    if len(lobes) == 2:
        mixed["n"] = operations.blend(graph, first.n, second.n, weight)
        lost = (("two lobes", "one, of the blended exponent and coefficient"),)
        form = first.form
    else:
        mixed["n"], form = (lobes[0].n, lobes[0].form) if lobes else (1.0, "phong")
    return Nearest(
        **mixed,
        form=form,
        normalised=first.normalised,
        twosided=first.twosided or second.twosided,
        tilt=first.tilt or second.tilt,
        lost=first.lost + second.lost + lost,
        misses=first.misses + second.misses,
    )


@rule("normalmap", wraps=True)
def normal_map(context: Context, index: int) -> Nearest:
    """``normalmap``: the nested material, with the mapped normal (exact without shadowing)."""
    normals = context.graph.props(index)["normalmap"]
    _require(context, index, normals, "eval_3", "normal")
    return _tilted(context, index, normals=normals)


@rule("bumpmap", wraps=True)
def bump_map(context: Context, index: int) -> Nearest:
    """``bumpmap``: the nested material, with the displaced surface's normal (exact likewise)."""
    ((key, _),) = context.graph.children(index, TEXTURE)
    scale, heights = float(context.value(index, "scale", 1.0)), context.graph.props(index)[key]
    _require(context, index, heights, "eval_1_grad", "slope")
    return _tilted(context, index, heights=heights, scale=scale)


def _require(context: Context, index: int, texture: Any, ability: str, what: str) -> None:
    """Reject a texture that lacks what its map evaluates; otherwise only shading would find out.

    Mitsuba accepts such a texture only with integrators that do not evaluate materials.
    """
    graph = context.graph
    if not isinstance(texture, Reference):
        return
    si = dr.zeros(mi.SurfaceInteraction3f, 1)
    si.shape = mi.ShapePtr(mi.load_dict({"type": "rectangle"}))
    made = graph.instantiate(texture.index())
    try:
        dr.eval(getattr(made, ability)(si))
    except RuntimeError as error:
        if f"{ability}()" in str(error):
            raise InputError(
                f"{graph.name}: {graph.label(index)}: a texture {graph.plugin(texture.index())}"
                f" gives {context.plugin(index)} no {what} (Mitsuba cannot {ability} it). Give a"
                " bitmap of three channels."
            ) from error


def _tilted(context: Context, index: int, **values: Any) -> Nearest:
    ((_, child),) = context.graph.children(index, BSDF)
    inner = context.nearest(child)
    lost = inner.lost
    if context.value(index, "use_shadowing_function", True):
        lost += (("shadows that mapped bumps cast on each other", "none"),)
    values["flip"] = context.value(index, "flip_invalid_normals", True)
    if inner.tilt is not None:
        lost += (("nested normal maps", "only the outer one"),)
    tilt = operations.node(context.graph, "heuristic_tilt", **values)
    return replace(inner, tilt=tilt, lost=lost)
