"""``three:phong`` and ``three:lambert``: pixels that three.js drew, as heuristics.

``prepare`` draws the scene once, with several fragments per pixel, by its own camera. ``shade``
then looks up the picture where a point is seen, between four fragments. So camera rays, film and
noise are the same as for other heuristics. Fragments left empty at an outline take the nearest
colour.
"""

from dataclasses import dataclass
from functools import cache
from math import sqrt
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.ndimage import distance_transform_edt

from heuristic.errors import InputError
from heuristic.heuristics import THREE, Heuristic
from heuristic.points import Array, Point
from heuristic.three_js import browser, three_scene

KINDS = {"phong": "MeshPhong", "lambert": "MeshLambert"}

FINER = 4
"""Fragments along each side of a pixel, at most."""

FRAGMENTS = 3 << 19
"""Fragments of a picture at most, unless it has more pixels."""


@dataclass
class Drawn:
    """A picture, with rows from the top, and the matrix from the world to it."""

    colours: Any
    to_clip: Any


def opened(name: str) -> Heuristic:
    """Return the heuristic that ``three:KIND`` names.

    Raises
    ------
    InputError
        For any other kind.
    InstallationError
        If three.js or a browser is missing.
    """
    kind = name.removeprefix(THREE)
    if kind not in KINDS:
        known = ", ".join(THREE + each for each in KINDS)
        raise InputError(f"heuristic {name!r} is not declared: choose one of {known}.")
    browser.require()
    return _declared(name, kind)


@cache
def _declared(name: str, kind: str) -> Heuristic:
    label = f"three.js {browser.version()}, {KINDS[kind]}"
    return Heuristic(
        name,
        shade,
        label,
        frozenset({"position"}),
        prepare=lambda scene: prepared(scene, kind),
        refuse=_refused,
        code=f"{browser.version()} {kind}",
    )


def _refused(scene: mi.Scene) -> str:
    if not mi.is_rgb:
        return f"three.js needs RGB colours, which {mi.variant()} does not have"
    film = scene.sensors()[0].film()
    is_cropped = list(film.size()) != list(film.crop_size())
    return "its film is cropped" if is_cropped else ""


def prepared(scene: mi.Scene, kind: str) -> Drawn:
    """Draw a scene; whatever three.js lacks becomes a warning in the record."""
    given, lost = three_scene.said(scene, kind)
    if lost:
        mi.Log(mi.LogLevel.Warn, f"three.js does not have, of {'; of '.join(lost)}.")
    pixels = given["width"] * given["height"]
    finer = max(1, min(FINER, int(sqrt(FRAGMENTS / pixels))))
    given["width"], given["height"] = finer * given["width"], finer * given["height"]
    picture = _filled(browser.draw(given))
    to_clip = np.array(given["projection"]) @ np.array(given["view"])
    between = {"filter_mode": dr.FilterMode.Linear, "wrap_mode": dr.WrapMode.Clamp}
    colours = mi.Texture2f(mi.TensorXf(np.ascontiguousarray(picture)), **between)
    return Drawn(colours, mi.Matrix4f(to_clip))


def _filled(picture: np.ndarray) -> np.ndarray:
    """Return the colours (H, W, 3); empty fragments take those of the nearest surface."""
    empty = picture[..., 3] == 0
    if not empty.any() or empty.all():
        return picture[..., :3]
    rows, columns = distance_transform_edt(empty, return_distances=False, return_indices=True)
    return picture[rows, columns, :3]


def shade(point: Point) -> Array:
    """Return the colours of the picture where points are seen."""
    drawn, place = point.prepared, point.position
    clip = drawn.to_clip @ mi.Vector4f(place.x, place.y, place.z, 1)
    seen = mi.Point2f(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w)
    return mi.Color3f(*drawn.colours.eval(seen))
