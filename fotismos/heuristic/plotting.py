"""Stand-ins for plotting and simulation libraries: what their windows show of the same scene.

They take each colour of a material as a person picks it, on the screen, and the other numbers as
they are: three of them compute with the codes of sRGB, as if these were light. Light sums and is
cut at 1; nothing casts shadows.

===========  =====================================================================================
vtk          VTK 9.7.2 and PyVista, ``Rendering/OpenGL2/vtkOpenGLPolyDataMapper.cxx``: Phong's lobe
             in the surface's colour, in codes
mujoco       MuJoCo 4.0.0, ``src/render/classic/render_gl3.c``: Blinn's lobe, in codes, and the
             headlight that every model has: parallel to the camera's axis, ambient 0.1, diffuse
             0.4, specular 0.5
matplotlib   matplotlib 3.11.2, ``_shade_colors`` of ``mpl_toolkits/mplot3d/art3d.py``: 0.65 + 0.35
             N.L of the code, for the first light alone, whose colour does not count
pygfx        pygfx 0.17.0, ``renderers/wgpu/wgsl/light_phong.wgsl``: Blinn's lobe with a Fresnel
             factor, in light; ``I_p`` of 1 is the default intensity of 3, of which 1 / pi returns
===========  =====================================================================================
"""

from dataclasses import replace
from math import inf, pi
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.heuristic import numerics, terms, vectors
from fotismos.heuristic.convention import Array, Colour
from fotismos.heuristic.heuristics import Heuristic, Point
from fotismos.heuristic.indirect_light import refuse
from fotismos.heuristic.lights import DirectionalLight

INTENSITY = 3.0
"""The default intensity of pygfx's lights."""

NEEDS = frozenset({"position", "normal", "view", "material", "ambient", "lights"})


def code(light: Colour) -> Colour:
    """Return sRGB's code, 0..1, of a display-linear colour."""
    light = dr.clip(light, 0, 1)
    curve = 1.055 * dr.power(dr.maximum(light, 0.0031308), 1 / 2.4) - 0.055
    return dr.select(light <= 0.0031308, 12.92 * light, curve)


def light_of(value: Colour) -> Colour:
    """Return the display-linear colour of a code, cut to 0..1."""
    value = dr.clip(value, 0, 1)
    curve = dr.power((dr.maximum(value, 0.04045) + 0.055) / 1.055, 2.4)
    return dr.select(value <= 0.04045, value / 12.92, curve)


def coded(material: Any) -> Any:
    """Return a material whose emitted, ambient and diffuse colours are codes."""
    return replace(material, k_i=code(material.k_i), k_a=code(material.k_a), k_d=code(material.k_d))


def vtk(point: Point) -> Array:
    """Return the chapters' model of codes; ``SetColor`` tints the highlight, too."""
    material = coded(point.material)
    tinted = replace(material, k_s=material.k_s * material.k_d)
    return light_of(point.textbook(material=tinted))


def camera_axis(scene: Any) -> list[float]:
    """Return the direction in which the camera looks."""
    axis = scene.sensors()[0].world_transform() @ mi.Vector3f(0, 0, 1)
    return [float(component) for component in np.ravel(dr.normalize(axis))]


def mujoco(point: Point) -> Array:
    """Return the chapters' model of codes, with the headlight; it has no ``k_a`` of its own."""
    material = coded(point.material)
    headlight = DirectionalLight(direction=point.prepared, intensity=0.4, specular_intensity=0.5)
    return light_of(
        point.textbook(
            material=replace(material, k_a=material.k_d),
            lights=[*point.arguments.lights, headlight],
            ambient=point.ambient + 0.1,
        )
    )


def matplotlib(point: Point) -> Array:
    """Return the code of the diffuse colour times ``0.65 + 0.35 N.L``; as it is without lights."""
    shown = code(point.material.k_d)
    for light in point.lights[:1]:
        shown = shown * (0.65 + 0.35 * dr.dot(point.normal, light.toward))
    return light_of(shown)


def pygfx(point: Point) -> Array:
    """Return diffuse light, and Blinn's lobe with Schlick's factor as Epic approximates it."""
    material = point.material
    total = material.k_i + INTENSITY / pi * point.ambient * material.k_a
    for light in point.lights:
        cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
        total = total + INTENSITY / pi * terms.diffuse(light.intensity, material.k_d, cosine)
        if not numerics.is_number(material.n, inf):
            half = vectors.normalise(light.toward + point.view)
            slant = dr.maximum(dr.dot(point.view, half), 0)
            fresnel = dr.exp2((-5.55473 * slant - 6.98316) * slant)
            strength = material.k_s * (1 - fresnel) + fresnel
            lobe = numerics.power(dr.dot(point.normal, half), material.n)
            density = (0.5 * material.n + 1) / pi * lobe
            total = total + INTENSITY * cosine * light.specular_intensity * strength * density / 4
    return dr.clip(total, 0, 1)


VTK = Heuristic(name="vtk", shade=vtk, label="VTK", needs=NEEDS, form="phong", refuse=refuse)
MUJOCO = Heuristic(
    name="mujoco",
    shade=mujoco,
    label="MuJoCo",
    needs=NEEDS,
    form="blinn",
    prepare=camera_axis,
    refuse=refuse,
)
MATPLOTLIB = Heuristic(name="matplotlib", shade=matplotlib, needs=NEEDS, refuse=refuse)
PYGFX = Heuristic(name="pygfx", shade=pygfx, needs=NEEDS, form="blinn", refuse=refuse)
