"""What each kind of light declares agrees with what Mitsuba makes of its plugins."""

import mitsuba as mi
import numpy as np
import pytest

from heuristic.light import PLUGINS
from reference import Source
from reference.pairing import lights, nearest
from reference.pairing.nearest.material import Nearest, rule
from reference.planning.facts import examine

PHYSICAL = [plugin for kind in lights.KINDS for plugin in kind.plugins]
NEEDED = {"projector": {"irradiance": 1.0}}


def graph_of(plugin, **parameters):
    light = {"type": plugin, **NEEDED.get(plugin, {}), **parameters}
    if plugin == "envmap":
        light["bitmap"] = mi.Bitmap(np.ones((4, 8, 3), np.float32))
    scene = {"type": "scene", "ball": {"type": "sphere"}}
    if lights.of(plugin).on_shapes:
        scene["ball"]["emitter"] = light
    else:
        scene["light"] = light
    return Source("a test", scene).parse()


@pytest.mark.usefixtures("rgb")
@pytest.mark.parametrize("plugin", [*PHYSICAL, *PLUGINS])
def test_facts_are_mitsubas_own(plugin):
    kind, (emitter,) = lights.of(plugin), graph_of(plugin).instantiate().emitters()
    assert kind.surrounds is emitter.is_environment()
    # A projector is one point, but which of its rays is taken is drawn from its picture.
    is_delta = mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta)
    assert kind.exact is (is_delta and plugin != "projector")
    assert kind.on_shapes is mi.has_flag(emitter.flags(), mi.EmitterFlags.Surface)


@pytest.mark.usefixtures("rgb")
@pytest.mark.parametrize(
    ("plugin", "name"),
    [
        (plugin, name)
        for kind in lights.KINDS
        for plugin, names in kind.edits.items()
        for name in names.values()
    ],
)
def test_what_a_study_edits_is_there(plugin, name):
    found = [key for key, _ in mi.traverse(graph_of(plugin).instantiate())]
    assert any(key.endswith(f".{name}") for key in found)


@pytest.mark.usefixtures("rgb")
@pytest.mark.parametrize("plugin", PLUGINS)
def test_every_light_of_the_heuristic_has_a_physical_form(plugin):
    kind = lights.of(plugin)
    assert kind.model is PLUGINS[plugin]
    falls_off = {"k0": 0.0, "k2": 1.0} if kind.has("attenuation") else {}
    (record,) = lights.to_physical(graph_of(plugin, **falls_off), surface=None)
    assert record.given == plugin
    assert record.derived in kind.plugins


@pytest.mark.usefixtures("rgb")
def test_an_unknown_plugin_is_taken_for_an_environment():
    assert lights.of("a user's own").surrounds
    assert not lights.is_heuristic("a user's own")


@pytest.mark.usefixtures("rgb")
@pytest.mark.parametrize(("reflectances", "opaque"), [({"reflectance": 0.5}, True), (None, False)])
def test_a_rule_for_a_material_is_all_that_planning_asks_for(monkeypatch, reflectances, opaque):
    monkeypatch.delitem(nearest.RULES, "diffuse")
    rule("diffuse", reflectances=reflectances)(lambda context, index: Nearest(k_d=0.1))
    bsdf = {"type": "diffuse"}
    graph = Source("a test", {"type": "scene", "ball": {"type": "sphere", "bsdf": bsdf}}).parse()
    (facts,) = examine(graph, graph.instantiate()).shapes
    assert facts.opaque is opaque
