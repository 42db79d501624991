"""The tree over shapes, against a loop over all pairs; and how many pairs it looks at."""

from itertools import product

import numpy as np
import pytest

from reference.effects.obstacles import FAR, _between, _facing
from reference.planning.facts import LightFacts, Structure
from reference.planning.forms import ROUNDING, Form
from reference.planning.shape_tree import Queries, ShapeTree
from reference.planning.shapes import ShapeFacts


def may_face(shape, other):
    """Tell whether a shape can receive light from another one, corner by corner."""
    if shape.plane is None or shape.outer == shape.inner:
        return True
    point, normal = shape.plane
    facing = normal if shape.outer else -normal
    margin = ROUNDING * np.max(np.abs(other.high - other.low), initial=1e-30)
    return bool(np.max((other.corners() - point) @ facing) > margin)


def may_hide(structure, light, receiver, obstacle):
    """Tell whether an obstacle meets the box around a light and a receiver."""
    if not may_face(receiver, obstacle):
        return False
    if light.position is not None:
        ends = light.position[None]
    elif light.toward is not None:
        size = max(np.max(np.abs([shape.low, shape.high])) for shape in structure.shapes)
        toward = light.toward / np.linalg.norm(light.toward)
        ends = receiver.corners() + FAR * max(size, 1.0) * toward
    elif light.shape is not None:
        ends = structure.shape(light.shape).corners()
    else:
        return True
    low = np.minimum(receiver.low, ends.min(axis=0))
    high = np.maximum(receiver.high, ends.max(axis=0))
    return bool(np.all(low <= obstacle.high) and np.all(obstacle.low <= high))


def between(structure):
    for light in structure.lights:
        shining = structure.shape(light.shape)
        if light.shape is not None and (shining is None or shining.hides_itself):
            return f"{light.shape}: may hide its own light"
        for receiver, obstacle in product(structure.shapes, structure.shapes):
            if not receiver.reflects or obstacle in (receiver, shining):
                continue
            if may_hide(structure, light, receiver, obstacle):
                return f"{obstacle.name} may stand between {light.name} and {receiver.name}"
    return None


def facing(structure):
    reflecting = [shape for shape in structure.shapes if shape.reflects]
    for number, first in enumerate(reflecting):
        for second in reflecting[number + 1 :]:
            if may_face(first, second) and may_face(second, first):
                return f"{first.name} and {second.name} may see each other"
    return None


class Shown:
    """Facts with nothing but a structure."""

    def __init__(self, structure):
        self.structure = structure


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


def random_structure(seed):
    rng = np.random.default_rng(seed)
    layout = rng.choice(["tiles", "ball", "rows", "anywhere"])
    shapes = tuple(random_shape(f"shape {i}", rng, layout) for i in range(rng.integers(0, 12)))
    lights = tuple(random_light(f"light {i}", rng, shapes) for i in range(rng.integers(0, 4)))
    return Structure(shapes, lights, camera=None)


@pytest.mark.guarantee(
    "plans",
    "In 600 random scenes a tree finds the same possible occluders of lights, and the same "
    "shapes that may see each other, as a loop over all pairs.",
)
def test_the_tree_says_what_a_loop_over_all_pairs_says():
    said = {"hidden": 0, "clear": 0, "facing": 0, "apart": 0}
    for seed in range(600):
        structure = random_structure(seed)
        hidden, seen = between(structure), facing(structure)
        assert _between(Shown(structure)) == hidden, seed
        found = _facing(Shown(structure))
        assert found == seen, seed
        said["clear" if hidden is None else "hidden"] += 1
        said["apart" if seen is None else "facing"] += 1
    assert min(said.values()) > 60, said


def test_a_shape_without_faces_is_nowhere(recwarn):
    rng = np.random.default_rng(0)
    empty = random_shape("empty", rng, "anywhere")
    object.__setattr__(empty, "low", np.full(3, np.inf))
    object.__setattr__(empty, "high", np.full(3, -np.inf))
    tree = ShapeTree.of((empty, random_shape("other", rng, "tiles")))
    assert tree.first(Queries.everywhere(np.array([1]))) is None
    assert np.isfinite(tree.largest_coordinate)
    assert not recwarn.list


@pytest.mark.parametrize("layout", ["tiles", "rows"])
def test_work_grows_with_shapes_not_with_their_square(layout, monkeypatch):
    looked = []
    counting = ShapeTree._may_hold

    def counted(self, level, node, *rest):
        looked[-1] += len(node)
        return counting(self, level, node, *rest)

    monkeypatch.setattr(ShapeTree, "_may_hold", counted)
    for count in (250, 2000):
        rng, side = np.random.default_rng(1), int(count**0.5) + 1
        shapes = tuple(tile(i, side, i % 3 if layout == "rows" else 0) for i in range(count))
        lamp = LightFacts("lamp", "point", position=np.array([0.5, 0.5, 9.0]) + rng.random(3))
        structure = Structure(shapes, (lamp,), camera=None)
        looked.append(0)
        assert _facing(Shown(structure)) is None
        if layout == "tiles":
            assert _between(Shown(structure)) is None
    assert looked[1] < 10 * looked[0]


def tile(number, side, height):
    centre = np.array([number % side, number // side, 0.0]) / side + (0, 0, height)
    size = np.array([0.5, 0.5, 0.0]) / side
    plane = centre, np.array([0.0, 0, 1])
    name = f"tile {number}"
    return ShapeFacts(
        name, centre - size, centre + size, Form.FLAT, True, False, True, plane, True, True
    )
