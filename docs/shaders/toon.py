"""A toon ramp: the cosine in steps, and a dark outline."""

from fotismos import Range  # isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr


def shade(point, steps: Range(1, 8) = 3, outline: Range(0, 1) = 0.2):
    """Diffuse light in `steps` steps; black where the surface turns away from the viewer."""
    color = point.material.base_color
    value = point.ambient * color
    for light in point.lights:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        value += color * light.intensity * dr.ceil(cosine * steps) / steps
    return dr.select(dr.dot(point.normal, point.view) < outline, 0, value)
