"""Scene files for tests: a ball over a floor."""

import re

SCENE = """<scene version="3.0.0">
  <integrator type="path"><integer name="max_depth" value="3"/></integrator>
  <sensor type="perspective">
    <transform name="to_world">
      <lookat origin="0, -5, 2" target="0, 0, 0" up="0, 0, 1"/>
    </transform>
    <film type="hdrfilm">
      <integer name="width" value="24"/><integer name="height" value="16"/>
    </film>
  </sensor>
  <shape type="sphere">
    <bsdf type="roughplastic">
      <rgb name="diffuse_reflectance" value="0.2, 0.3, 0.5"/><float name="alpha" value="0.2"/>
    </bsdf>
  </shape>
  <shape type="rectangle">
    <transform name="to_world"><translate z="-1"/><scale x="5" y="5"/></transform>
    <bsdf type="twosided"><bsdf type="diffuse"/></bsdf>
  </shape>
  <emitter type="point">
    <point name="position" x="2" y="-3" z="4"/><rgb name="intensity" value="60"/>
  </emitter>
  <emitter type="constant"><rgb name="radiance" value="0.2"/></emitter>
</scene>
"""
"""Lit by a point and a constant emitter: it has most effects."""

PLAIN = re.sub(r"  <emitter type=.constant.*\n", "", SCENE)
PLAIN = re.sub(r'(?s)"roughplastic">.*?</bsdf>', '"diffuse"/>', PLAIN, count=1)
PLAIN = PLAIN.replace('"max_depth" value="3"', '"max_depth" value="2"')
"""Diffuse, under the point alone, light reflected once: shadows are its one effect. So its study of
cost has few methods and effects, for tests that are not about effects.
"""

IN_PYTHON = """scene = {
    "type": "scene",
    "sensor": {"type": "perspective"},
    "lamp": {"type": "point", "position": (0, 0, 0)},
    "ball": {"type": "sphere", "center": (0, 0, 4)},
}
"""
"""A sphere, in a file of Python."""
