"""Replacing the BSDFs of a scene by their counterparts, after the conventions of pairing."""

from dataclasses import asdict, dataclass, field
from functools import lru_cache

import mitsuba as mi

from heuristic.errors import InputError
from reference import pairing, values
from reference.albedo import RoughPlastic
from reference.pairing import Convention, Phong
from reference.scene import properties

BSDF = mi.ObjectType.BSDF
COLOURS = {
    "diffuse": ("reflectance",),
    "roughplastic": ("diffuse_reflectance", "specular_reflectance"),
    "phong": ("k_i", "k_a", "k_d", "k_s"),
    "twosided": (),
}
"""The BSDFs that can be paired, and their colours."""


@dataclass(frozen=True)
class PairedBSDF:
    """What a BSDF was replaced by, and what the replacement misses."""

    name: str
    given: str
    derived: str
    parameters: dict
    misses: tuple = field(default=())


def to_heuristic(graph, convention):
    """Replace every physical BSDF of the graph by ``phong``; returns a :class:`PairedBSDF` each."""
    return _replace(graph, convention, _phong_properties)


def to_physical(graph, convention):
    """Replace every ``phong`` of the graph by ``diffuse`` or ``roughplastic``."""
    return _replace(graph, convention, _physical_properties)


def give_default(graph):
    """Give shapes without a BSDF the one that Mitsuba gives them, so that it can be paired."""
    for shape in graph.nodes(mi.ObjectType.Shape):
        if not graph.children(shape, BSDF) and not graph.children(shape, mi.ObjectType.Shape):
            default = graph.add(BSDF, properties("diffuse", reflectance=0.5))
            graph.attach(shape, "bsdf", default)


def check(graph):
    """Refuse BSDFs that are not in the pairing table, and coefficients that are no reflectances.

    Raises
    ------
    InputError
        Naming the plugin and its place, or the coefficient and its value.
    """
    for index in graph.nodes(BSDF):
        plugin = graph.plugin(index)
        if plugin not in COLOURS:
            raise InputError(
                f"{graph.name}: {graph.label(index)}: the BSDF {plugin!r} cannot be paired yet."
                f" Known are {', '.join(COLOURS)}."
            )
        values.check_colours(graph, index, COLOURS[plugin])
        if plugin == "twosided" and len(graph.children(index, BSDF)) != 1:
            raise InputError(
                f"{graph.name}: {graph.label(index)}: twosided with two different sides cannot be"
                " paired yet. Give one BSDF."
            )


def _replace(graph, convention, convert):
    """Apply ``convert(graph, index, convention) -> (properties, record) or None`` to all BSDFs."""
    records = []
    for index in graph.nodes(BSDF):
        if graph.plugin(index) == "twosided":
            continue
        converted = convert(graph, index, convention)
        if converted is not None:
            props, record = converted
            graph.replace(index, props)
            records.append(record)
    for index in graph.nodes(BSDF):
        if graph.plugin(index) == "twosided":
            _fold_twosided(graph, index)
        elif graph.plugin(index) != "phong":
            _unfold_twosided(graph, index)
    return records


def _fold_twosided(graph, index):
    """Turn ``twosided`` around a ``phong`` into the phong's own parameter."""
    ((_, inner),) = graph.children(index, BSDF)
    if graph.plugin(inner) == "phong":
        props = mi.Properties(graph.props(inner))
        props["twosided"] = True
        graph.replace(index, props)


def _unfold_twosided(graph, index):
    """Turn the mark that a replaced phong left into Mitsuba's ``twosided``."""
    props = graph.props(index)
    if "twosided" in props:
        del props["twosided"]
        inner = mi.Properties(props)
        inner.set_id("")
        outer = mi.Properties("twosided")
        graph.replace(index, outer)
        graph.attach(index, "bsdf", graph.add(BSDF, inner))


def _phong_properties(graph, index, convention):
    plugin = graph.plugin(index)
    if plugin == "phong":
        return None
    if plugin == "diffuse":
        given = graph.props(index)
        reflectance = given.get("reflectance", 0.5)
        props = properties("phong", k_a=reflectance, k_d=reflectance)
        return props, PairedBSDF(graph.label(index), "diffuse", "phong", {"k_d": "reflectance"})
    found, misses = _phong_of(_roughplastic(graph, index), convention)
    props = properties("phong", k_a=found.k_d, **asdict(found))
    record = PairedBSDF(graph.label(index), "roughplastic", "phong", asdict(found), tuple(misses))
    return props, record


def _physical_properties(graph, index, convention):
    if graph.plugin(index) != "phong":
        return None
    given = graph.props(index)
    k_s = values.colour(graph, index, "k_s", 0.0)
    if not any(k_s):
        is_lit = "k_d" in given and values.may_be_nonzero(given["k_d"])
        source = "k_d" if is_lit else "k_a"
        reflectance = given.get(source, 0.0)
        props = properties("diffuse", reflectance=reflectance)
        record = PairedBSDF(graph.label(index), "phong", "diffuse", {"reflectance": source})
    else:
        plastic, misses = _roughplastic_of(phong(graph, index), convention)
        props = properties("roughplastic", **asdict(plastic))
        record = PairedBSDF(
            graph.label(index), "phong", "roughplastic", asdict(plastic), tuple(misses)
        )
    if given.get("twosided"):
        props["twosided"] = True
    return props, record


def phong(graph, index):
    """Read the parameters of a ``phong``, with the plugin's defaults.

    Raises
    ------
    InputError
        When a coefficient is a texture or a tabulated spectrum, or not allowed.
    """
    props = graph.props(index)
    return Phong(
        k_d=values.colour(graph, index, "k_d", 0.0),
        k_s=values.colour(graph, index, "k_s", 0.0),
        n=values.number(graph, index, "n", 1.0),
        form=props.get("form", "phong"),
        normalised=props.get("normalised", False),
    )


def _roughplastic(graph, index):
    """Read a roughplastic's parameters, with Mitsuba's defaults."""
    props = graph.props(index)
    return RoughPlastic(
        diffuse_reflectance=values.colour(graph, index, "diffuse_reflectance", 0.5),
        alpha=values.number(graph, index, "alpha", 0.1),
        int_ior=values.index_of_refraction(graph, index, "int_ior", "polypropylene"),
        ext_ior=values.index_of_refraction(graph, index, "ext_ior", "air"),
        specular_reflectance=values.colour(graph, index, "specular_reflectance", 1.0),
        distribution=props.get("distribution", "beckmann"),
        nonlinear=props.get("nonlinear", False),
    )


@lru_cache(maxsize=256)
def _phong_of(plastic: RoughPlastic, convention: Convention):
    return pairing.to_phong(plastic, convention)


@lru_cache(maxsize=256)
def _roughplastic_of(phong: Phong, convention: Convention):
    return pairing.to_roughplastic(phong, convention)
