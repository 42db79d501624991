"""The hard cases of sides: lights and viewers behind a surface, and normals of other lengths.

Rounding hardly matters here. The naive forms are common ones: 8.5 and 8.9 without their condition
``N.L > 0``, a normal turned to face the viewer, an interpolated normal that is not normalised.
"""

from functools import partial

import numpy as np

from comparisons.hard import textbook
from comparisons.hard.kernel import POINTS, shaded
from comparisons.hard.textbook import Setting

_UNCONDITIONAL = partial(textbook.shade, horizon=False)
_AS_IT_COMES = partial(textbook.shade, unit_normal=False)


def _facing_viewer(setting, dtype):
    """Turn normals to the viewer's side, as shaders do for surfaces with two sides."""
    behind = (setting.normal * setting.view).sum(axis=-1, keepdims=True) < 0
    normal = np.where(behind, -setting.normal, setting.normal)
    return textbook.shade(
        Setting(normal=normal, view=setting.view, light=setting.light, k_d=setting.k_d), dtype
    )


def _directions(seed):
    """Return three sets of random unit vectors, (POINTS, 3) each."""
    vectors = np.random.default_rng(seed).normal(size=(3, POINTS, 3))
    return vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)


def _turned(axis, toward, degrees):
    """Tilt directions by angles (POINTS,), each at right angles to another direction."""
    side = np.cross(axis, toward)
    side /= np.linalg.norm(side, axis=1, keepdims=True)
    angle = np.deg2rad(degrees)[:, None]
    return np.cos(angle) * axis + np.sin(angle) * side


def _inside():
    """Points of a sphere of radius 2 with a light within, seen from outside."""
    normal, view, _ = _directions(11)
    view *= np.sign((view * normal).sum(axis=1, keepdims=True))
    return Setting(
        position=2 * normal, normal=normal, view=view, light=(0.9, -0.4, 1.1), k_d=0.5, k_s=0.5, n=4
    )


def _behind():
    """Shading normals 91 to 180 degrees away from a light, seen about the mirror direction."""
    light, side, jitter = _directions(12)
    normal = _turned(light, side, np.linspace(91, 180, POINTS))
    mirrored = 2 * (normal * light).sum(axis=1, keepdims=True) * normal - light
    return Setting(
        normal=normal, light=light, view=mirrored + 0.1 * jitter, k_d=0.5, k_s=0.5, n=9.5
    )


def _unseen():
    """Shading normals 91 to 120 degrees away from the viewer, with a light on their own side."""
    view, side, light = _directions(13)
    normal = _turned(view, side, np.linspace(91, 120, POINTS))
    height = (light * normal).sum(axis=1, keepdims=True)
    light += (np.abs(height) + 0.1 - height) * normal
    return Setting(normal=normal, light=light, view=view, k_d=1.0)


def _opposing():
    """Normals exactly opposite to the light, which is its own mirror image; seen from there."""
    light = np.array([(0, 0, 1), (0, 3, 4), (-1, 2, 2)], float)
    return Setting(normal=-light, light=light, view=light, k_d=0.2, k_s=0.8, n=8)


def _shortened():
    """Interpolated normals, 0.1 to 1 long."""
    normal, light, view = _directions(14)
    light *= np.sign((light * normal).sum(axis=1, keepdims=True))
    length = np.linspace(0.1, 1, POINTS)[:, None]
    return Setting(normal=length * normal, light=light, view=view, k_d=0.5, k_s=0.5, n=9.5)


CASES = (
    shaded("a light inside the object", "geometry",
           "N·L < 0 all over the outside: without its condition the diffuse term takes light away,"
           " and an even power makes a highlight of R·V < 0.", 1e-6, _inside(), _UNCONDITIONAL),
    shaded("normals opposite to the light", "geometry",
           "R is then L itself: a full highlight on the dark side, unless N·L > 0 is required.",
           1e-6, _opposing(), _UNCONDITIONAL),
    shaded("normals that are not unit vectors", "geometry",
           "Interpolation leaves lengths below 1, which dim the surface and bend R.", 2e-4,
           _shortened(), _AS_IT_COMES),
    shaded("a shading normal that faces away from the light", "shading",
           "Mirrored about such a normal, the light points to the viewer: a highlight in the dark.",
           1e-6, _behind(), _UNCONDITIONAL),
    shaded("a shading normal that faces away from the viewer", "shading",
           "At the silhouettes of smoothed meshes. 8.5 ignores the viewer; a normal turned to face"
           " the viewer loses its light.", 1e-5, _unseen(), _facing_viewer),
)  # fmt: skip
"""The cases of sides."""
