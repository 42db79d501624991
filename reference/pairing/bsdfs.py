"""Replacing the BSDFs of a scene by their counterparts, by the conventions of pairing."""

from dataclasses import asdict

import mitsuba as mi

from reference.pairing import factors
from reference.pairing.factors import Convention, Phong, Replacements
from reference.pairing.nearest import WRAPPERS, Context
from reference.scene import values
from reference.scene.graph import Graph, properties

BSDF = mi.ObjectType.BSDF
COLOURS = {
    "diffuse": ("reflectance",),
    "roughplastic": ("diffuse_reflectance", "specular_reflectance"),
    "principled": ("base_color",),
    "phong": ("k_i", "k_a", "k_d", "k_s"),
}
"""Colours that pairing reads; they are checked before."""


PLASTICS = (1.3, 1.8)
"""Indices of refraction of real plastics: fluoropolymers have 1.3, those rich in sulphur 1.76."""


def give_default(graph: Graph) -> None:
    """Give shapes without a BSDF Mitsuba's default, so it can be paired."""
    for shape in graph.nodes(mi.ObjectType.Shape):
        if not graph.children(shape, BSDF) and not graph.children(shape, mi.ObjectType.Shape):
            glows = graph.children(shape, mi.ObjectType.Emitter)
            default = properties("diffuse", reflectance=0.0 if glows else 0.5)
            graph.attach(shape, "bsdf", graph.add(BSDF, default))


def check(graph: Graph) -> None:
    """Reject coefficients that are not reflectances."""
    for index in graph.nodes(BSDF):
        values.check_colours(graph, index, COLOURS.get(graph.plugin(index), ()))


def to_heuristic(graph: Graph, convention: Convention, replaced: Replacements) -> None:
    """Replace the BSDFs of all shapes by the nearest ``phong`` (:mod:`reference.pairing.nearest`).

    Those that were not ``phong`` are recorded, also nested ones, but not those around others.
    """
    nodes = graph.nodes(BSDF)
    context = Context(graph, convention)
    for shape in graph.nodes(mi.ObjectType.Shape):
        for _, index in graph.children(shape, BSDF):
            context.nearest(index)
    for index, material in sorted(context.found.items()):
        label, plugin = graph.label(index), graph.plugin(index)
        if plugin not in ("phong", *WRAPPERS):
            is_diffuse = plugin == "diffuse"
            parameters = {"k_d": "reflectance"} if is_diffuse else material.parameters()
            replaced.bsdf(label, plugin, "phong", parameters)
            for lost, rule in material.lost:
                replaced.lose(label, plugin, lost, rule)
    for index in nodes:
        if index in context.found:
            graph.replace(index, context.found[index].properties())


def to_physical(graph: Graph, convention: Convention, replaced: Replacements) -> None:
    """Replace every ``phong`` of the graph by ``diffuse`` or ``roughplastic``."""
    phongs = [index for index in graph.nodes(BSDF) if graph.plugin(index) == "phong"]
    glossy = [index for index in phongs if any(values.colour(graph, index, "k_s", 0.0))]
    for index in phongs:
        label, props = graph.label(index), physical_partner(graph, index, convention)
        if index in glossy:
            plastic, misses = factors.to_roughplastic(phong(graph, index), convention)
            replaced.bsdf(label, "phong", "roughplastic", asdict(plastic), _unreal(plastic))
            replaced.misses += misses
        else:
            replaced.bsdf(label, "phong", "diffuse", {"reflectance": _base(graph.props(index))})
        is_twosided = graph.props(index).get("twosided", False)
        graph.replace(index, mi.Properties("twosided") if is_twosided else props)
        if is_twosided:
            graph.attach(index, "bsdf", graph.add(BSDF, props))


def physical_partner(graph: Graph, index: int, convention: Convention) -> mi.Properties:
    """Return the properties of the physical BSDF that replaces a ``phong``."""
    if any(values.colour(graph, index, "k_s", 0.0)):
        plastic, _ = factors.to_roughplastic(phong(graph, index), convention)
        return properties("roughplastic", **asdict(plastic))
    given = graph.props(index)
    return properties("diffuse", reflectance=given.get(_base(given), 0.0))


def _base(given: mi.Properties) -> str:
    """Return the coefficient of a phong without a lobe that becomes its reflectance."""
    return "k_d" if "k_d" in given and values.may_be_nonzero(given["k_d"]) else "k_a"


def _unreal(plastic):
    """Return a note on an index of refraction that no real plastic has, or an empty string."""
    low, high = PLASTICS
    index = plastic.int_ior / plastic.ext_ior
    if low <= index <= high:
        return ""
    return f"no real plastic has the index {index:.3g}: they have {low:g} to {high:g}"


def phong(graph: Graph, index: int) -> Phong:
    """Read the parameters of a ``phong``, with the plugin's defaults."""
    props = graph.props(index)
    return Phong(
        k_d=values.colour(graph, index, "k_d", 0.0),
        k_s=values.colour(graph, index, "k_s", 0.0),
        n=values.number(graph, index, "n", 1.0),
        form=props.get("form", "phong"),
        normalised=props.get("normalised", False),
    )
