"""A scene file for tests: a ball over a floor, lit by a point and a constant emitter."""

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
