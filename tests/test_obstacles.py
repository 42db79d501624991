"""Occluders and facing shapes that rules find, against a loop over all pairs."""

from itertools import product

import numpy as np
import pytest

from reference.planning.facts import ROUNDING, Facts, Form, LightFacts, ShapeFacts
from reference.planning.rules import FAR, facing_pair, occluder


def corners(shape):
    return np.array(list(product(*zip(shape.low, shape.high, strict=True))))


def may_face(shape, other):
    """Tell whether a shape can receive light from another one, corner by corner."""
    if shape.plane is None or shape.outer == shape.inner:
        return True
    point, normal = shape.plane
    facing = normal if shape.outer else -normal
    margin = ROUNDING * np.max(np.abs(other.high - other.low), initial=1e-30)
    return bool(np.max((corners(other) - point) @ facing) > margin)


def may_hide(facts, light, receiver, obstacle):
    """Tell whether an obstacle meets the box around a light and a receiver."""
    if not may_face(receiver, obstacle):
        return False
    if light.position is not None:
        ends = light.position[None]
    elif light.toward is not None:
        size = max(np.max(np.abs([shape.low, shape.high])) for shape in facts.shapes)
        toward = light.toward / np.linalg.norm(light.toward)
        ends = corners(receiver) + FAR * max(size, 1.0) * toward
    elif light.shape is not None:
        ends = corners(facts.by_name[light.shape])
    else:
        return True
    low = np.minimum(receiver.low, ends.min(axis=0))
    high = np.maximum(receiver.high, ends.max(axis=0))
    return bool(np.all(low <= obstacle.high) and np.all(obstacle.low <= high))


def between(facts):
    for light in facts.lights:
        shining = facts.by_name.get(light.shape)
        if light.shape is not None and (shining is None or shining.hides_itself):
            return f"{light.shape}: may hide its own light"
        for receiver, obstacle in product(facts.shapes, facts.shapes):
            if not receiver.reflects or obstacle in (receiver, shining):
                continue
            if may_hide(facts, light, receiver, obstacle):
                return f"{obstacle.name} may stand between {light.name} and {receiver.name}"
    return None


def facing(facts):
    reflecting = [shape for shape in facts.shapes if shape.reflects]
    for number, first in enumerate(reflecting):
        for second in reflecting[number + 1 :]:
            if may_face(first, second) and may_face(second, first):
                return f"{first.name} and {second.name} may see each other"
    return None


def random_shape(name, rng, layout):
    """A shape in a layout that shadows little or much: on a plane, around a ball, or anywhere."""
    size = rng.choice([0.0, 0.01, 0.1, 0.5]) * rng.random(3)
    centre, normal = rng.normal(size=3), rng.normal(size=3)
    if layout == "tiles":
        centre[2], normal, size[2] = 0.0, np.array([0, 0, rng.choice([1.0, 1.0, -1.0])]), 0.0
    if layout == "ball":
        centre /= np.linalg.norm(centre)
        normal = centre * rng.choice([1.0, 1.0, 1.0, -1.0])
        size *= 0.0
    if layout == "rows":
        centre = np.array([rng.integers(4), rng.integers(4), rng.integers(3)], float)
        normal, size = np.array([0.0, 0, 1]), np.array([0.3, 0.3, 0])
    normal = normal / np.linalg.norm(normal)
    is_flat = layout != "anywhere" or rng.random() < 0.5
    sides = rng.random(2) < (0.9, 0.05 if layout != "anywhere" else 0.3)
    return ShapeFacts(
        name=name,
        low=centre - size,
        high=centre + size,
        form=Form.FLAT if is_flat else Form.CLOSED,
        outer=bool(sides[0]),
        inner=bool(sides[1]),
        shines_outwards=True,
        plane=(centre, normal) if is_flat else None,
        opaque=True,
        sampled_as_hit=True,
        is_mesh=False,
    )


def random_light(name, rng, shapes):
    kind = rng.integers(8)
    if kind == 0:
        return LightFacts(name, "constant")
    if kind < 3:
        return LightFacts(name, "directional", toward=rng.normal(size=3))
    if kind < 5 and shapes:
        return LightFacts(name, "area", shape=shapes[rng.integers(len(shapes))].name)
    return LightFacts(name, "point", position=5 * rng.normal(size=3))


def random_facts(seed):
    rng = np.random.default_rng(seed)
    layout = rng.choice(["tiles", "ball", "rows", "anywhere"])
    shapes = tuple(random_shape(f"shape {i}", rng, layout) for i in range(rng.integers(0, 12)))
    lights = tuple(random_light(f"light {i}", rng, shapes) for i in range(rng.integers(0, 4)))
    return Facts(None, shapes, lights, camera=None)


@pytest.mark.guarantee(
    "plans", "Possible occluders are those of a loop over all pairs, in 600 random scenes."
)
def test_obstacles_are_those_of_a_loop_over_all_pairs():
    said = {"hidden": 0, "clear": 0, "facing": 0, "apart": 0}
    for seed in range(600):
        facts = random_facts(seed)
        hidden, seen = between(facts), facing(facts)
        assert occluder(facts) == hidden, seed
        assert facing_pair(facts) == seen, seed
        said["clear" if hidden is None else "hidden"] += 1
        said["apart" if seen is None else "facing"] += 1
    assert min(said.values()) > 60, said
