"""Values of parameters, combined: plain ones as in NumPy, others by nodes of the same value."""

import mitsuba as mi
import numpy as np
import pytest

from fotismos.heuristic.errors import InputError
from fotismos.reference.scene import values
from fotismos.reference.scene.source import Source
from tests.shared.parts import camera


def graph(**bsdf):
    shape = {"type": "sphere", "bsdf": {"type": "diffuse"} | bsdf}
    return Source("a test", {"type": "scene", "shape": shape, "camera": camera((0, -4, 0))}).parse()


def test_a_texture_combines_in_a_node_that_has_the_value_at_each_point(rgb):
    board = {"type": "checkerboard", "color0": 0.2, "color1": 0.6}
    made = graph(reflectance=board)
    (index,) = (i for i in made.nodes(mi.ObjectType.BSDF) if made.plugin(i) == "diffuse")
    reflectance = made.props(index)["reflectance"]
    doubled = made.instantiate(values.product(made, reflectance, 0.5).index())
    si = mi.SurfaceInteraction3f()
    si.uv = mi.Point2f([0.25, 0.75], [0.25, 0.25])
    assert np.array(doubled.eval_1(si)).tolist() == pytest.approx([0.3, 0.1])


@pytest.mark.parametrize("value", [-0.5, float("nan"), float("inf")])
def test_a_colour_that_is_not_allowed_is_refused(rgb, value):
    made = graph(reflectance=value)
    (index,) = (i for i in made.nodes(mi.ObjectType.BSDF) if made.plugin(i) == "diffuse")
    with pytest.raises(InputError, match=r"reflectance = .* is not allowed: give finite values"):
        values.colour(made, index, "reflectance", 0.5)
