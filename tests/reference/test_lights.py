"""What each kind of light declares agrees with what Mitsuba makes of its plugins."""

import mitsuba as mi
import numpy as np

from fotismos.heuristic.lights import PLUGINS
from fotismos.reference import Source
from fotismos.reference.pairing import emitters, kinds, lights
from fotismos.reference.pairing.factors import Replacements

PHYSICAL = [plugin for kind in kinds.all_kinds() for plugin in kind.plugins]
NEEDED = {"projector": {"irradiance": 1.0}}


def graph_of(plugin, **parameters):
    light = {"type": plugin, **NEEDED.get(plugin, {}), **parameters}
    if plugin == "envmap":
        light["bitmap"] = mi.Bitmap(np.ones((4, 8, 3), np.float32))
    scene = {"type": "scene", "ball": {"type": "sphere"}}
    if plugin == "area":
        scene["ball"]["emitter"] = light
    else:
        scene["light"] = light
    return Source("a test", scene).parse()


def test_facts_are_mitsubas_own(rgb):
    for plugin in (*PHYSICAL, *PLUGINS):
        kind, (emitter,) = kinds.of(plugin), graph_of(plugin).instantiate().emitters()
        assert kind.surrounds is emitter.is_environment()
        # A projector is one point, but which of its rays is taken is drawn from its picture.
        is_delta = mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta)
        assert kind.exact is (is_delta and plugin != "projector")
    assert kinds.of("a user's own").surrounds
    assert not lights.is_heuristic("a user's own")


def test_every_light_of_the_heuristic_has_a_physical_form(rgb):
    for plugin in PLUGINS:
        kind = kinds.of(plugin)
        assert kind.model is PLUGINS[plugin]
        falls_off = {"k0": 0.0, "k2": 1.0} if kind.has("attenuation") else {}
        replaced = Replacements()
        emitters.to_physical(graph_of(plugin, **falls_off), None, replaced)
        (record,) = replaced.emitters
        assert record.given == plugin
        assert record.derived in PHYSICAL
