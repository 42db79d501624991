"""The names of the materials that the camera sees."""

import mitsuba as mi

from fotismos.reference.rendering.gbuffer import gbuffer
from tests.shared.parts import look_at

HALVES = """
<scene version="3.0.0">
  <sensor type="orthographic">
    <transform name="to_world"><lookat origin="0,0,2" target="0,0,0" up="0,1,0"/></transform>
  </sensor>
  <shape type="rectangle" id="near">
    <transform name="to_world"><scale x="0.4" y="0.4"/><translate z="0.5"/></transform>{near}
  </shape>
  <shape type="rectangle" id="far">{far}</shape>
</scene>
"""


def seen(near, far):
    scene = mi.load_string(HALVES.format(near=near, far=far), optimize=False)
    return {name for name in gbuffer(scene, (16, 16)).bsdf.names if name}


def test_a_material_is_named_by_its_id_or_else_after_its_shape(rgb):
    assert seen('<bsdf type="diffuse" id="a"/>', '<bsdf type="diffuse" id="b"/>') == {"a", "b"}
    none = '<bsdf type="diffuse"/>'
    assert seen(none, none) == {"unnamed material of near", "unnamed material of far"}
    assert seen('<bsdf type="diffuse" id="a"/>', none) == {"a", "unnamed material of far"}


def test_equal_names_are_told_apart(rgb):
    bsdf = {"type": "diffuse"}
    shapes = {name: {"type": "sphere", "radius": 0.4, "bsdf": bsdf | {"reflectance": grey},
                     "center": (x, 0, 0)}
              for name, x, grey in (("one", -0.5, 0.2), ("two", 0.5, 0.3))}  # fmt: skip
    to_world = look_at((0, 0, 4), up=(0, 1, 0))
    scene = mi.load_dict(
        {"type": "scene", "sensor": {"type": "orthographic", "to_world": to_world}, **shapes},
        optimize=False,
    )
    assert {name for name in gbuffer(scene, (16, 16)).bsdf.names if name} in (
        {"bsdf of one", "bsdf of two"},
        {"unnamed material of one", "unnamed material of two"},
    )
