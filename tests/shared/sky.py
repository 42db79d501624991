"""A sphere under an environment whose radiance is a function of the direction."""

import mitsuba as mi
import numpy as np

from tests.shared.parts import camera


def two_colours(toward):
    """A blue sky above the plane z = 0, and a brown ground below."""
    sky, ground = np.array((0.3, 0.5, 0.9)), np.array((0.25, 0.15, 0.05))
    return np.where(np.asarray(toward)[:, 2:] > 0, sky, ground)


def sky_above(radiance, height=64, k_d=0.8, ambient=0.0):
    """A scene of the heuristic half; ``radiance`` maps directions (N, 3) to colours (N, 3)."""
    return {
        "type": "scene",
        "integrator": {"type": "heuristic", "ambient": ambient},
        "sensor": camera((0, -5, 0), fov=32.0),
        "ball": {"type": "sphere", "bsdf": {"type": "phong", "k_d": k_d, "k_a": k_d}},
        "sky": {"type": "envmap", "bitmap": mi.Bitmap(_pixels(radiance, height))},
    }


def _pixels(radiance, height):
    """Return the pixels of an environment: y is up in it, and its middle is towards -z."""
    polar = (np.arange(height) + 0.5) / height * np.pi
    turn = (np.arange(2 * height) + 0.5) / height * np.pi
    polar, turn = (part.ravel() for part in np.meshgrid(polar, turn, indexing="ij"))
    flat = np.sin(polar)
    toward = np.stack([flat * np.sin(turn), np.cos(polar), -flat * np.cos(turn)], axis=1)
    return radiance(toward).reshape(height, 2 * height, 3).astype(np.float32)
