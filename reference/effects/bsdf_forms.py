"""Effects of surfaces that differ in form between the halves: reflection and transmission."""

from reference.effects.effect import Effect
from reference.pairing.nearest import WRAPPERS
from reference.planning.facts import BSDF, SHAPE, Facts
from reference.scene.graph import Graph, graft


def _inexact(facts: Facts, opaque: bool) -> list[int]:
    """Return the opaque shapes, or the others, whose two BSDFs differ; diffuse ones do not."""
    graph, found = facts.pair.physical, []
    known = {shape.name: shape.opaque for shape in facts.structure.shapes}
    for shape in graph.nodes(SHAPE):
        for _, bsdf in graph.children(shape, BSDF):
            inner = [child for _, child in graph.children(bsdf, BSDF)] or [bsdf]
            is_exact = all(graph.plugin(index) == "diffuse" for index in inner)
            if not is_exact and known.get(graph.props(shape).id(), True) is opaque:
                found.append(shape)
    return found


def _replace(graph: Graph, facts: Facts, opaque: bool) -> None:
    """Give shapes the materials of the heuristic half; shared materials stay shared."""
    grafted = {}
    for shape in _inexact(facts, opaque):
        ((key, _),) = graph.children(shape, BSDF)
        ((_, phong),) = facts.pair.heuristic.children(shape, BSDF)
        if phong not in grafted:
            grafted[phong] = graft(graph, facts.pair.heuristic, phong)
        graph.attach(shape, key, grafted[phong])


def _reflected(facts: Facts) -> tuple[bool, str]:
    graph = facts.pair.physical
    plugins = {graph.plugin(index) for index in graph.nodes(BSDF)}
    return bool(plugins - {"diffuse", "null", *WRAPPERS}), f"BSDFs: {', '.join(sorted(plugins))}"


def _transmitted(facts: Facts) -> tuple[bool, str]:
    if facts.is_clear:
        return True, "a BSDF may let light through"
    return False, "every BSDF is opaque"


MICROFACETS = Effect(
    order=90,
    label="microfacets and Fresnel",
    heuristic="none",
    reference="roughplastic",
    cost="a BSDF evaluation per light",
    rule=_reflected,
    part="BSDF form",
    colour="#cc79a7",
    differs=lambda facts, called_for: bool(_inexact(facts, opaque=True)),
    graft=lambda graph, facts: _replace(graph, facts, opaque=True),
)

TRANSMISSION = Effect(
    order=130,
    label="transmission",
    heuristic="none",
    reference="refraction and media",
    cost="samples, rays per surface",
    rule=_transmitted,
    undecided=True,
    part="BSDF form",
    colour="#44aa99",
    differs=lambda facts, called_for: bool(_inexact(facts, opaque=False)),
    graft=lambda graph, facts: _replace(graph, facts, opaque=False),
)
