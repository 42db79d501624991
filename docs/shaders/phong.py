"""The chapters' model (8.10): what the built-in heuristic `phong` computes."""

import fotismos  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import drjit as dr


def shade(point):
    """Ambient, diffuse and specular light."""
    material = point.material
    value = material.k_i + point.ambient * material.k_a
    for light in point.lights:
        cosine = dr.dot(point.normal, light.toward)
        mirrored = 2 * cosine * point.normal - light.toward
        along = dr.dot(mirrored, point.view)
        lobe = dr.select(along > 0, dr.maximum(along, 1e-6) ** material.n, 0)  # 0 ** 0 is NaN
        diffuse = light.diffuse_intensity * material.k_d * cosine
        specular = light.specular_intensity * material.k_s * lobe
        value += dr.select(cosine > 0, diffuse + specular, 0)
    return value
