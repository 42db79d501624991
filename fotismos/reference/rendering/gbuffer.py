"""The geometry that the camera sees."""

from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np

import fotismos.reference.scene  # noqa: F401  it gives Mitsuba a variant
from fotismos.heuristic.convention import Scene
from fotismos.heuristic.errors import InputError, NonFiniteError
from fotismos.reference.rendering.passes import wrong_pixels

GRID = 192
"""Rays along each side for means over visible surfaces: some 37,000, enough for three digits."""


UNNAMED = "unnamed"


@dataclass(frozen=True)
class ObjectIds:
    """The object seen by each pixel (H, W), as its position among ids; -1 for none."""

    places: np.ndarray
    names: tuple[str, ...]


@dataclass(frozen=True)
class GBuffer:
    """The first surface on a regular grid of camera rays, in world space, where ``hit`` (H, W).

    ``position`` and ``normal`` (H, W, 3), the shading normal of the visible side, are 0 elsewhere.
    """

    position: np.ndarray
    normal: np.ndarray
    hit: np.ndarray
    shape: ObjectIds
    bsdf: ObjectIds

    def places(self, count: int) -> tuple[np.ndarray, np.ndarray]:
        """Return up to ``count`` positions and normals (M, 3), spread over the picture."""
        step = max(1, int(self.hit.sum()) // count)
        return self.position[self.hit][::step], self.normal[self.hit][::step]

    def mean_irradiance(
        self,
        light_position: Sequence[float],
        falloff: Callable[[np.ndarray, np.ndarray], np.ndarray],
    ) -> float:
        """Return the mean of ``(N.L)+ falloff(d, travel)`` over the surface, for a unit light.

        ``travel`` holds the unit vectors from the light to the surface, (M, 3).
        """
        offset = np.asarray(light_position) - self.position[self.hit]
        distance = np.linalg.norm(offset, axis=1)
        # On the light itself there is no direction: an infinite distance makes the cosine 0.
        distance = np.where(distance > 0, distance, np.inf)
        cosine = np.sum(self.normal[self.hit] * offset, axis=1) / distance
        travel = -offset / distance[:, None]
        lit = np.maximum(cosine, 0) * falloff(distance, travel)
        return float(np.mean(lit)) if len(distance) else 0.0


def require_surface(hit: np.ndarray, name: str) -> None:
    """Reject a picture (H, W) in which no pixel sees a surface: nothing could differ in it."""
    if not hit.any():
        height, width = hit.shape
        raise InputError(
            f"{name}: no pixel sees a surface: the rays through the centres of all"
            f" {width}x{height} pixels hit nothing. Check the camera (to_world, fov, near_clip,"
            " far_clip, the film's crop) and the shapes in front of it. To allow an empty picture,"
            " give `allow_empty`."
        )


def image_size(scene: Scene) -> tuple[int, int]:
    """Return width and height of the images of a scene's first sensor: its film's crop."""
    width, height = scene.sensors()[0].film().crop_size()
    return int(width), int(height)


def size_of_width(scene: Scene, size: tuple[int, int], width: int) -> tuple[int, int]:
    """Return the size of a scene's images, scaled to a width in pixels.

    A crop keeps its size: another one would lie elsewhere, by parts of a pixel.
    """
    columns, rows = size
    if tuple(scene.sensors()[0].film().size()) != image_size(scene):
        return columns, rows
    return width, max(1, round(rows * width / columns))


def resize(scene: Scene, size: tuple[int, int]) -> None:
    """Give images of a scene's first sensor a size of the same shape; a crop keeps its place."""
    if (before := image_size(scene)) != tuple(size):
        parameters = mi.traverse(scene.sensors()[0])
        for name in ("film.size", "film.crop_offset", "film.crop_size"):
            sides = zip(parameters[name], size, before, strict=True)
            parameters[name] = [round(int(old) * new / side) for old, new, side in sides]
        parameters.update()


def gbuffer(
    scene: Scene, size: tuple[int, int] = (GRID, GRID), film: tuple[int, int] | None = None
) -> GBuffer:
    """Trace rays through the centres of ``size``, columns and rows, of cells of the film.

    For ``film`` see :func:`pixel_rays`.
    """
    width, height = size
    si = scene.ray_intersect(centre_rays(scene, size, film))
    hit = si.is_valid()
    # `wi` points to the viewer: with a negative z the back is seen.
    normal = dr.mulsign(mi.Vector3f(si.sh_frame.n), si.wi.z)
    points = np.array(dr.select(hit, mi.Vector3f(si.p), 0)).T.reshape(height, width, 3)
    normals = np.array(dr.select(hit, normal, 0)).T.reshape(height, width, 3)
    seen = np.array(hit).reshape(height, width)
    # An instance stands for all shapes of its group.
    shape = dr.select(si.instance != None, si.instance, si.shape)  # noqa: E711  of pointers
    shapes = _object_ids(shape, seen)
    right = np.isfinite(normals)
    if not right.all():
        owner = shapes.names[shapes.places[~right.all(axis=2)][0]]
        wrong = wrong_pixels(normals, right, "without a finite normal")
        raise NonFiniteError(f"{owner}: {wrong}. Correct the normals of that shape.")
    return GBuffer(
        position=points,
        normal=normals,
        hit=seen,
        shape=shapes,
        bsdf=_named_apart(_object_ids(si.bsdf(), seen), shapes),
    )


def _named_apart(materials: ObjectIds, shapes: ObjectIds) -> ObjectIds:
    seen = materials.places >= 0
    unseen = len(shapes.names)
    times = Counter(materials.names)
    # The first shape that shows each material, or `unseen`.
    first = np.full(len(materials.names), unseen)
    np.minimum.at(first, materials.places[seen], shapes.places[seen])

    def named(name: str, shape: int) -> str:
        if shape == unseen or (name != UNNAMED and times[name] == 1):
            return name
        return f"{'unnamed material' if name == UNNAMED else name} of {shapes.names[shape]}"

    return replace(materials, names=tuple(map(named, materials.names, first)))


def _object_ids(pointers: Any, seen: np.ndarray) -> ObjectIds:
    """Return the :class:`ObjectIds` of an array of pointers, one per pixel."""
    numbers = np.array(dr.reinterpret_array(mi.UInt32, pointers)).reshape(seen.shape)
    ids, first, places = np.unique(numbers, return_index=True, return_inverse=True)
    named = zip(ids, first, strict=True)
    # Number 0 is the null pointer, which has no id.
    names = tuple((pointers[int(at)].id() or UNNAMED) if number else "" for number, at in named)
    return ObjectIds(np.where(seen, places.reshape(seen.shape), -1), names)


def centre_rays(scene: Scene, size: tuple[int, int], film: tuple[int, int] | None = None) -> Any:
    """Return the camera rays through the centres of all cells of a film, row by row.

    For ``film`` see :func:`pixel_rays`.
    """
    width, height = size
    x, y = np.meshgrid(np.arange(width), np.arange(height))
    return pixel_rays(scene, size, x=x, y=y, film=film)


def pixel_rays(
    scene: Scene,
    size: tuple[int, int],
    x: np.ndarray,
    y: np.ndarray,
    film: tuple[int, int] | None = None,
) -> Any:
    """Return the camera rays through the cells in columns ``x`` and rows ``y`` of a film.

    ``film`` is its width and height in pixels, whose ratio gives the view its shape: needed where
    a scene was rendered at several sizes.
    """
    if film is not None:
        resize(scene, film)
    width, height = size
    across = mi.Float((np.ravel(x) + 0.5) / width)
    down = mi.Float((np.ravel(y) + 0.5) / height)
    places = mi.Point2f(across, down)
    return scene.sensors()[0].sample_ray_differential(0.0, 0.5, places, mi.Point2f(0.5))[0]
