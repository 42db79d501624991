"""Wrapped diffuse: light reaches beyond the horizon, as if it were scattered below the surface."""

from fotismos import Range  # isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr


def shade(point, wrap: Range(0, 1) = 0.5):
    """Diffuse light whose cosine is 0 only at `wrap` beyond the horizon."""
    color = point.material.base_color
    value = point.ambient * color
    for light in point.lights:
        cosine = (dr.dot(point.normal, light.toward) + wrap) / (1 + wrap)
        value += color * light.intensity * dr.maximum(cosine, 0)
    return value
