"""Replacing the BSDFs of a scene by their counterparts, by the conventions of pairing."""

from dataclasses import asdict, dataclass
from functools import lru_cache
from typing import Any

import mitsuba as mi

from reference.pairing import albedo, factors
from reference.pairing.factors import Convention, Phong
from reference.pairing.nearest import WRAPPERS, nearest_of, simple
from reference.pairing.nearest.material import Nearest
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


@dataclass(frozen=True)
class PairedBSDF:
    """The replacement of a BSDF, the quantities that it misses, and what it has no form for.

    ``note`` describes anything odd about the replacement.
    """

    name: str
    given: str
    derived: str
    parameters: dict
    misses: tuple = ()
    lost: tuple = ()
    note: str = ""


def give_default(graph: Graph) -> None:
    """Give shapes without a BSDF Mitsuba's default, so it can be paired."""
    for shape in graph.nodes(mi.ObjectType.Shape):
        if not graph.children(shape, BSDF) and not graph.children(shape, mi.ObjectType.Shape):
            glows = graph.children(shape, mi.ObjectType.Emitter)
            default = properties("diffuse", reflectance=0.0 if glows else 0.5)
            graph.attach(shape, "bsdf", graph.add(BSDF, default))


def check(graph: Graph) -> None:
    """Reject coefficients that are not reflectances.

    Raises
    ------
    InputError
        Naming the coefficient and its value.
    """
    for index in graph.nodes(BSDF):
        values.check_colours(graph, index, COLOURS.get(graph.plugin(index), ()))


def to_heuristic(graph: Graph, convention: Convention) -> list[PairedBSDF]:
    """Replace the BSDFs of all shapes by the nearest ``phong`` (:mod:`reference.pairing.nearest`).

    Returns
    -------
    list of PairedBSDF
        One per BSDF that was not ``phong``, including nested ones, without those around them.
    """
    nodes = graph.nodes(BSDF)
    simple.prepare(graph, convention)
    found: dict[int, Nearest] = {}
    for shape in graph.nodes(mi.ObjectType.Shape):
        for _, index in graph.children(shape, BSDF):
            nearest_of(graph, index, convention, found)
    records = [
        PairedBSDF(
            graph.label(index),
            graph.plugin(index),
            "phong",
            _shown(graph, index, material),
            material.misses,
            material.lost,
        )
        for index, material in sorted(found.items())
        if graph.plugin(index) not in ("phong", *WRAPPERS)
    ]
    for index in nodes:
        if index in found:
            graph.replace(index, found[index].properties())
    return records


def to_physical(graph: Graph, convention: Convention) -> list[PairedBSDF]:
    """Replace every ``phong`` of the graph by ``diffuse`` or ``roughplastic``."""
    glossy = [
        phong(graph, index)
        for index in graph.nodes(BSDF)
        if graph.plugin(index) == "phong" and any(values.colour(graph, index, "k_s", 0.0))
    ]
    factors.prepare(glossy, convention)
    records = []
    for index in graph.nodes(BSDF):
        converted = _physical_properties(graph, index, convention)
        if converted is not None:
            props, record = converted
            graph.replace(index, props)
            records.append(record)
    for index in graph.nodes(BSDF):
        if graph.plugin(index) not in WRAPPERS:
            _unfold_twosided(graph, index)
    return records


def _shown(graph, index, material):
    if graph.plugin(index) == "diffuse":
        return {"k_d": "reflectance"}
    return material.parameters()


def _unfold_twosided(graph, index):
    """Turn the mark left by a replaced phong into Mitsuba's ``twosided``."""
    props = graph.props(index)
    if "twosided" in props:
        del props["twosided"]
        inner = mi.Properties(props)
        inner.set_id("")
        outer = mi.Properties("twosided")
        graph.replace(index, outer)
        graph.attach(index, "bsdf", graph.add(BSDF, inner))


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
            graph.label(index),
            "phong",
            "roughplastic",
            asdict(plastic),
            tuple(misses),
            note=_unreal(plastic),
        )
    if given.get("twosided"):
        props["twosided"] = True
    return props, record


def physical_partner(graph: Graph, index: int, convention: Convention) -> Any:
    """Return the properties of the physical BSDF that replaces a ``phong``."""
    props, _ = _physical_properties(graph, index, convention)
    return props


def _unreal(plastic):
    """Return a note on an index of refraction that no real plastic has, or an empty string."""
    low, high = PLASTICS
    index = plastic.int_ior / plastic.ext_ior
    if low <= index <= high:
        return ""
    return f"no real plastic has the index {index:.3g}: they have {low:g} to {high:g}"


def phong(graph: Graph, index: int) -> Phong:
    """Read the parameters of a ``phong``, with the plugin's defaults.

    Raises
    ------
    InputError
        If a coefficient is a texture or a tabulated spectrum, or not allowed.
    """
    props = graph.props(index)
    return Phong(
        k_d=values.colour(graph, index, "k_d", 0.0),
        k_s=values.colour(graph, index, "k_s", 0.0),
        n=values.number(graph, index, "n", 1.0),
        form=props.get("form", "phong"),
        normalised=props.get("normalised", False),
    )


@lru_cache(maxsize=albedo.KEPT)
def _roughplastic_of(phong: Phong, convention: Convention):
    return factors.to_roughplastic(phong, convention)
