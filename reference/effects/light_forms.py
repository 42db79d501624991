"""Effects of lights that differ in form: fall-off, cone, extent, surroundings."""

from collections.abc import Iterable

import mitsuba as mi

from reference.effects.effect import Effect
from reference.pairing import lights
from reference.planning.facts import EMITTER, SHAPE, Facts
from reference.scene.graph import Graph, graft


def _inexact(facts: Facts, with_cone: bool) -> list[str]:
    """Return the keys of the scene's lights whose two forms differ by cone, or only by fall-off.

    A spot's attenuation goes with its cone: Mitsuba has no spot with another fall-off.
    """
    heuristic, physical = facts.pair.heuristic, dict(facts.pair.physical.children(0, EMITTER))
    inexact = {record.name for record in facts.pair.emitters if not record.exact}
    return [
        key
        for key, index in heuristic.children(0, EMITTER)
        if key in physical
        and lights.of(heuristic.plugin(index)).has("attenuation")
        and lights.of(heuristic.plugin(index)).has("cutoff") is with_cone
        and heuristic.label(index) in inexact
    ]


def _replace(graph: Graph, facts: Facts, keys: Iterable[str]) -> None:
    """Replace the lights under some keys of the scene by those of the heuristic half."""
    own = dict(facts.pair.heuristic.children(0, EMITTER))
    for key in keys:
        graph.attach(0, key, graft(graph, facts.pair.heuristic, own[key]))


def _attenuated(facts: Facts) -> tuple[bool, str]:
    """Distance attenuation: any point or spot whose ``f_att`` is not 1."""
    graph = facts.pair.heuristic
    attenuated = [
        graph.label(index)
        for index in graph.nodes(EMITTER)
        if lights.of(graph.plugin(index)).has("attenuation")
        and (graph.props(index).get("k1", 0.0), graph.props(index).get("k2", 0.0)) != (0.0, 0.0)
    ]
    if attenuated:
        return True, f"{attenuated[0]} falls off with distance"
    return False, "no light of the heuristic half falls off with distance"


def _coned(facts: Facts) -> tuple[bool, str]:
    halves = facts.pair.heuristic, facts.pair.physical
    plugins = (half.plugin(index) for half in halves for index in half.nodes(EMITTER))
    return any(lights.of(plugin).has("cutoff") for plugin in plugins), facts.lights_in_words


def _shining(facts: Facts) -> list[int]:
    """Return the shapes of the physical half that are lights."""
    graph = facts.pair.physical
    return [shape for shape in graph.nodes(SHAPE) if graph.children(shape, EMITTER)]


def _replace_shining(graph: Graph, facts: Facts) -> None:
    """Replace area lights by the heuristic half's points and spots."""
    for shape in _shining(facts):
        for key, _ in graph.children(shape, EMITTER):
            graph.detach(shape, key)
            if facts.pair.hide_emitters:
                graph.remove(shape)
    given = dict(facts.pair.physical.children(0, EMITTER))
    own = facts.pair.heuristic.children(0, EMITTER)
    _replace(graph, facts, (key for key, _ in own if key not in given))


def _surroundings(facts: Facts) -> list[str]:
    """Return the keys of the physical half's lights that have no single point or direction."""
    graph = facts.pair.physical
    children = graph.children(0, EMITTER)
    return [key for key, index in children if not lights.of(graph.plugin(index)).exact]


def _surrounded(facts: Facts) -> tuple[bool, str]:
    found = (light.kind for light in facts.structure.lights if light.shape is None)
    return any(lights.of(kind).surrounds for kind in found), facts.lights_in_words


def _detach_surroundings(graph: Graph, facts: Facts) -> None:
    for key in _surroundings(facts):
        graph.detach(0, key)


def _emitted(phong: mi.Properties, facts: Facts) -> dict:
    return {"k_i": phong["k_i"]} if "k_i" in phong else {}


def _ambient(phong: mi.Properties, facts: Facts) -> dict:
    if "k_a" not in phong or "ambient" not in facts.kernel:
        return {}
    return {"k_a": phong["k_a"], "ambient": facts.kernel["ambient"]}


ATTENUATION = Effect(
    order=50,
    label="distance attenuation",
    heuristic="f_att (6.1, 8.6)",
    reference="1 / d^2",
    cost="a division per light",
    rule=_attenuated,
    part="light form",
    colour="#d55e00",
    differs=lambda facts, called_for: bool(_inexact(facts, with_cone=False)),
    graft=lambda graph, facts: _replace(graph, facts, _inexact(facts, with_cone=False)),
)

CONE = Effect(
    order=60,
    label="spot cone",
    heuristic="6.2-6.4",
    reference="spot",
    cost="a comparison and a power per light",
    rule=_coned,
    part="light form",
    colour="#999933",
    differs=lambda facts, called_for: bool(_inexact(facts, with_cone=True)),
    graft=lambda graph, facts: _replace(graph, facts, _inexact(facts, with_cone=True)),
)

EXTENDED = Effect(
    order=100,
    label="extended lights",
    heuristic="a spot or point",
    reference="sampled area lights",
    cost="samples, two rays each",
    rule=lambda facts: (
        any(light.shape is not None for light in facts.structure.lights),
        facts.lights_in_words,
    ),
    part="light form",
    colour="#56b4e9",
    sampled=True,
    differs=lambda facts, called_for: bool(_shining(facts)),
    graft=_replace_shining,
    glow=_emitted,
)

ENVIRONMENT = Effect(
    order=110,
    label="environment",
    heuristic="ambient light",
    reference="light from everywhere",
    cost="samples, or a table",
    rule=_surrounded,
    part="light form",
    colour="#009e73",
    sampled=True,
    differs=lambda facts, called_for: bool(_surroundings(facts)),
    graft=_detach_surroundings,
    glow=_ambient,
)
