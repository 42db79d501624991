"""What each kind of light declares agrees with what Mitsuba makes of its plugins."""

import pkgutil

import mitsuba as mi
import numpy as np
import pytest

from fotismos.heuristic.lights import PLUGINS
from fotismos.reference import Source
from fotismos.reference.pairing import emitters, lights
from fotismos.reference.pairing.factors import Replacements

PHYSICAL = [plugin for kind in lights.KINDS for plugin in kind.plugins]
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
        kind, (emitter,) = lights.of(plugin), graph_of(plugin).instantiate().emitters()
        assert kind.surrounds is emitter.is_environment()
        # A projector is one point, but which of its rays is taken is drawn from its picture.
        is_delta = mi.has_flag(emitter.flags(), mi.EmitterFlags.Delta)
        assert kind.exact is (is_delta and plugin != "projector")
    assert lights.of("a user's own").surrounds
    assert not lights.is_heuristic("a user's own")


def test_every_light_of_the_heuristic_has_a_physical_form(rgb):
    for plugin in PLUGINS:
        kind = lights.of(plugin)
        assert kind.model is PLUGINS[plugin]
        falls_off = {"k0": 0.0, "k2": 1.0} if kind.has("attenuation") else {}
        replaced = Replacements()
        emitters.to_physical(graph_of(plugin, **falls_off), None, replaced)
        (record,) = replaced.emitters
        assert record.given == plugin
        assert record.derived in kind.plugins


def test_two_kinds_of_light_with_one_plugin_are_refused():
    twin = lights.LightKind(plugins=("area",))
    with pytest.raises(ValueError, match="plugin area"):
        lights.by_plugin([*lights.KINDS, twin])


def test_a_heuristic_light_without_a_physical_form_is_refused(monkeypatch, rgb):
    """It was once paired as a spot."""
    without = lights.LightKind(plugins=(), model=PLUGINS["heuristic_point"])
    monkeypatch.setitem(lights.BY_PLUGIN, "heuristic_point", without)
    with pytest.raises(NotImplementedError, match="heuristic_point has no physical form"):
        emitters.to_physical(graph_of("heuristic_point"), None, Replacements())


def test_every_rule_of_pairing_exists():
    rules = {rule for kind in lights.KINDS for rule in (kind.to_heuristic, kind.to_physical)}
    for rule in rules - {""}:
        assert callable(pkgutil.resolve_name(f"fotismos.reference.pairing.{rule}"))


def test_a_physical_light_is_paired_by_the_rule_of_its_kind(monkeypatch, rgb):
    """A light without a rule is left out, and so is a shape's light of a kind without shapes."""
    for rule, derived in (("", "none"), ("emitters:point_to_heuristic", "heuristic_point")):
        kind = lights.LightKind(plugins=("projector",), to_heuristic=rule)
        monkeypatch.setitem(lights.BY_PLUGIN, "projector", kind)
        replaced = Replacements()
        emitters.to_heuristic(graph_of("projector"), None, False, replaced)
        assert [record.derived for record in replaced.emitters] == [derived]
    monkeypatch.setitem(lights.BY_PLUGIN, "area", kind)
    replaced = Replacements()
    emitters.to_heuristic(graph_of("area"), None, False, replaced)
    assert [record.derived for record in replaced.emitters] == ["none"]
