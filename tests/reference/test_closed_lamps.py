"""Lamps whose light leaves through their own shape: balls, boxes, domes."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import pair_for
from fotismos.comparisons.steps import steps
from fotismos.reference.scene.source import Source
from tests.shared.parts import camera, moved

WHITE = {"type": "diffuse", "reflectance": 0.6}
LAMPS = {
    "ball": {"type": "sphere"},
    "box": {"type": "cube"},
    "tube": {"type": "cylinder", "p0": (0, 0, -1)},
}


def room(kind):
    """A floor, a small ball on it, and a lamp above that is closed or nearly."""
    lamp = LAMPS[kind] | {"to_world": moved((1.5, 0, 3), 0.4)}
    return {
        "type": "scene",
        "sensor": camera((0, -6, 4), size=(48, 36)),
        "floor": {"type": "rectangle", "to_world": moved(0, 4), "bsdf": WHITE},
        "ball": {"type": "sphere", "center": (-1, 0, 0.5), "radius": 0.5, "bsdf": WHITE},
        "lamp": lamp | {"bsdf": WHITE, "emitter": {"type": "area", "radiance": 20.0}},
    }


@pytest.mark.parametrize("kind", LAMPS)
def test_a_lamp_casts_no_shadow_on_what_it_lights(rgb, kind):
    pair = pair_for(Source("lamp", room(kind)), Options())
    scene = pair.heuristic.instantiate()
    floor = {"spp": 16, "seed": 1}
    bare, shadowed, mapped, traced = (
        np.array(mi.render(scene, integrator=mi.load_dict(each), **floor))
        for each in (
            {"type": "heuristic"},
            {"type": "heuristic", "occlusion": True},
            {"type": "heuristic", "model": "shadow-map"},
            {"type": "direct"},
        )
    )
    lit = bare.mean(axis=2) > 0.01
    kept = [np.mean(each.mean(axis=2)[lit] > 0.01) for each in (shadowed, mapped, traced)]
    # The ball's shadow, and the part of the ball that it shades itself.
    assert min(kept) > 0.85
    assert max(kept) < 1


@pytest.mark.thorough
@pytest.mark.parametrize("kind", ["ball", "box"])
def test_shadows_are_not_blamed_for_the_lamp(rgb, kind):
    small = Options(resolution=(48, 36), spp=16)
    found = compare(Source("lamp", room(kind)), small, then=steps(small, True)).record.why
    errors = {each.effects: each.error for each in found.hybrids}
    assert errors["occlusion",] < 1.5 * errors[()]
    removed = {one.effect: one.removes.value for one in found.effects}
    assert removed["occlusion"] > -1
    assert abs(removed["extended lights"]) < 3
