"""The figures of chapter 6 without numbers: spots (6.5) and polygon shading (6.10, 6.14)."""

from typing import Any

import mitsuba as mi

HIGHLIGHT = (0.45, -0.3, 0.0)
"""Where the light of figure 6.14 is mirrored to the viewer: inside one of the two triangles."""


def spot(exponent: float) -> dict[str, Any]:
    """Figure 6.5: a spot on a white floor; a small ``m`` gives a beam without a clear border."""
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": _camera((0, -6, 5), 45.0),
        "floor": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().scale(4),
            "bsdf": {"type": "phong", "id": "floor material", "k_d": 0.9},
        },
        "spot": {
            "type": "heuristic_spot",
            "position": (0, 0, 3),
            "direction": (0, 0, -1),
            "cutoff": 60.0,
            "exponent": exponent,
        },
    }


def coarse_sphere() -> dict[str, Any]:
    """Figure 6.10: a sphere of few polygons, whose edges show under flat shading."""
    return {
        "type": "scene",
        "integrator": {"type": "heuristic", "ambient": 1.0},
        "sensor": _camera((0, -4, 1), 36.0),
        "sphere": {
            "type": "sphere",
            "bsdf": {
                "type": "phong",
                "id": "sphere material",
                "k_a": 0.1,
                "k_d": 0.6,
                "k_s": 0.4,
                "n": 20,
            },
        },
        "light": {"type": "heuristic_point", "position": (-2.5, -3.5, 3)},
    }


def highlight_in_a_triangle() -> dict[str, Any]:
    """Figure 6.14: a highlight inside a triangle, which none of its vertices sees."""
    viewer = (0.0, -2.6, 3.0)
    # The mirror image of the viewer about the plane's normal through the highlight.
    light = tuple(2 * h - v for h, v in zip(HIGHLIGHT[:2], viewer[:2], strict=True)) + viewer[2:]
    return {
        "type": "scene",
        "integrator": {"type": "heuristic"},
        "sensor": _camera(viewer, 40.0),
        "square": {
            "type": "rectangle",
            "bsdf": {"type": "phong", "id": "square material", "k_d": 0.3, "k_s": 0.6, "n": 60},
        },
        "light": {"type": "heuristic_point", "position": light},
    }


def _camera(viewer, field_of_view):
    return {
        "type": "perspective",
        "fov": field_of_view,
        "to_world": mi.ScalarTransform4f().look_at(viewer, (0, 0, 0), (0, 0, 1)),
        "film": {"type": "hdrfilm", "width": 512, "height": 512, "rfilter": {"type": "box"}},
    }
