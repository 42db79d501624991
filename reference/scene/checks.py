"""Values and files of a scene that Mitsuba renders in silence, or that end the process.

Mitsuba rejects some values that make no sense, and renders others: a sphere of radius NaN is
missing, an infinite index of refraction is black. It does not check whether the faces of PLY and
serialized meshes name vertices that exist, and whether tensor files of `measured` materials are as
long as they say: it reads memory beyond them.
"""

import struct
from collections.abc import Iterator
from functools import lru_cache
from math import prod
from numbers import Real
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic import meshes
from heuristic.errors import InputError
from reference.scene.graph import Graph

LARGEST = float(np.finfo(np.float32).max)

FILM_SIZE = (768, 576)
"""Mitsuba's width and height for a film without its own."""

SMALLEST_RATIO = 1e-14
"""Ratio of singular values of a matrix with rows and columns of length 1; less is rounding."""

PICTURES = ("filename", "bitmap", "data")
CHILDREN = {"blendbsdf": (mi.ObjectType.BSDF, 2), "volume": (mi.ObjectType.Volume, 1)}
CAMERAS, FILMS = "perspective thinlens orthographic", "hdrfilm specfilm"

ABOVE_0, BELOW_180 = float(np.nextafter(0, 1)), float(np.nextafter(180, 0))
ANY, INFINITY = None, float("inf")

RANGES = (
    ("radius", "sphere cylinder", ANY, "a radius other than 0"),
    (
        "fov",
        "perspective thinlens projector",
        (ABOVE_0, BELOW_180),
        "an angle between 0 and 180 degrees, both excluded",
    ),
    ("cutoff_angle", "spot", (ABOVE_0, 180), "an angle above 0 and up to 180 degrees"),
    ("near_clip far_clip focus_distance", CAMERAS, (ABOVE_0, INFINITY), "a distance above 0"),
    ("int_ior ext_ior", "", (ABOVE_0, INFINITY), "an index of refraction above 0"),
    ("eta", "principled principledthin", (ABOVE_0, INFINITY), "an index of refraction above 0"),
    ("eta k", "conductor roughconductor", (0, INFINITY), "values of 0 or more"),
    ("alpha alpha_u alpha_v", "", (-INFINITY, 1000), "a roughness up to 1000"),
    (
        "direction sun_direction",
        "directional distant sunsky timed_sunsky heuristic_directional",
        ANY,
        "a vector of any length but 0",
    ),
    ("width height crop_width crop_height", FILMS, (1, INFINITY), "1 or more pixels"),
    ("crop_offset_x crop_offset_y", FILMS, (0, INFINITY), "0 or more pixels"),
)
"""Parameters, the plugins that have them (all if empty), their range, or ANY but 0, and its words.

Arithmetic overflows far above a roughness of 1000, and all light is lost far below it.
"""


def check(graph: Graph) -> None:
    """Reject values that make no sense, and damaged files, in all elements in use."""
    for index in graph.nodes_in_use():
        check_node(graph, index)
        if objection := _damage(graph, index):
            raise _refusal(graph, index, objection)


def check_node(graph: Graph, index: int) -> None:
    """Reject values of one element that make no sense."""
    props, plugin = graph.props(index), graph.plugin(index)
    for key, value in props.items():
        for allowed in _objections(plugin, key, value):
            raise _refusal(graph, index, f"{key} = {_shown(value)} is not allowed: give {allowed}.")
    for objection in (*_conflicts(plugin, props), *_missing(graph, index)):
        raise _refusal(graph, index, objection)


def _refusal(graph: Graph, index: int, objection: str) -> InputError:
    return InputError(f"{graph.name}: {graph.label(index)}: {objection}")


def _objections(plugin: str, key: str, value: Any) -> Iterator[str]:
    """Yield what would be allowed in place of a wrong value."""
    if isinstance(value, bool):
        return
    if _is_transform(value):
        matrix = np.array(value.matrix, float)
        if not (np.abs(matrix) <= LARGEST).all():
            yield "finite numbers (a lookat has none if its target is its origin or lies along up)"
        # A texture may be stretched without end, which makes stripes.
        elif key != "to_uv" and not _is_invertible(matrix[:3, :3]):
            yield "one that can be inverted (in place of a scale by 0, a small one such as 1e-6)"
        return
    numbers = _numbers(key, value)
    if numbers is None:
        return
    for keys, plugins, ends, allowed in RANGES:
        if key in keys.split() and plugin in (plugins or plugin).split():
            is_met = numbers.any() if ends is ANY else (ends[0] <= numbers) & (numbers <= ends[1])
            if not np.all(is_met):
                yield allowed
    if not (np.abs(numbers) <= LARGEST).all():
        yield f"finite numbers of at most {LARGEST:.2g}"


def _numbers(key: str, value: Any) -> np.ndarray | None:
    """Return the numbers in a value, (n,); None if it has none."""
    if hasattr(value, "wavelengths"):  # a spectrum, whose type Mitsuba does not name
        value = [*value.wavelengths, *value.values]
    elif isinstance(value, str) and key in ("values", "wavelengths"):
        value = value.replace(",", " ").split()
    elif isinstance(value, str):
        return None
    try:
        return np.ravel(np.asarray(value)).astype(float)
    except (TypeError, ValueError, RuntimeError):  # a word in a table, which Mitsuba rejects
        return None


def _is_transform(value: Any) -> bool:
    """Return whether a value is a transform; vectors also have an attribute ``matrix``."""
    return "Transform" in type(value).__name__


def _is_invertible(matrix: np.ndarray) -> bool:
    """Return whether the inverse exists in single precision."""
    even = matrix
    for axis in (1, 0):
        lengths = np.linalg.norm(even, axis=axis, keepdims=True)
        if not lengths.all():
            return False
        even = even / lengths
    sizes = np.linalg.svd(even, compute_uv=False)
    if sizes[-1] < SMALLEST_RATIO * sizes[0]:
        return False
    return bool((np.abs(np.linalg.inv(matrix)) <= LARGEST).all())


def _missing(graph: Graph, index: int) -> Iterator[str]:
    """Yield what an element lacks, if Mitsuba would end the process instead of rejecting it."""
    plugin, props = graph.plugin(index), graph.props(index)
    if plugin == "bitmap" and not any(key in props for key in PICTURES):
        yield f"it has no picture: give one of {', '.join(PICTURES)}."
    if plugin in CHILDREN:
        kind, count = CHILDREN[plugin]
        found = len(graph.children(index, kind))
        if found != count:
            yield f"it needs {count} {kind.name} elements, and has {found}."


def _conflicts(plugin: str, props: mi.Properties) -> Iterator[str]:
    """Yield conflicts between parameters that are allowed individually."""
    if plugin == "cylinder" and "p0" in props and "p1" in props:
        ends = [np.ravel(np.asarray(props[key], float)) for key in ("p0", "p1")]
        if (ends[0] == ends[1]).all():
            yield "p0 and p1 are the same point: give the two ends of the axis."
    if plugin in CAMERAS.split():
        near, far = props.get("near_clip", 0.01), props.get("far_clip", 10000.0)
        if isinstance(near, Real) and isinstance(far, Real) and near >= far:
            yield f"near_clip = {near:g} is not below far_clip = {far:g}: give a smaller one."
    if plugin not in FILMS.split():
        return
    for side, axis, usual in zip(("width", "height"), "xy", FILM_SIZE, strict=True):
        size, begin = props.get(side, usual), props.get(f"crop_offset_{axis}", 0)
        count = props.get(f"crop_{side}", size)
        if all(isinstance(number, int) for number in (size, begin, count)) and begin + count > size:
            yield (
                f"crop_offset_{axis} = {begin} and crop_{side} = {count} reach beyond {side} ="
                f" {size}: give a crop within the film."
            )


def _shown(value: Any) -> str:
    if _is_transform(value):
        rows = np.array(value.matrix, float)
        return "[" + "; ".join(" ".join(f"{number:g}" for number in row) for row in rows) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def _damage(graph: Graph, index: int) -> str:
    """Return what is wrong with the file of a mesh or a table; empty if nothing is."""
    plugin = graph.plugin(index)
    path = graph.file(index) if plugin in ("measured", "ply", "serialized") else None
    if path is None:
        return ""
    state, number = path.stat(), graph.props(index).get("shape_index", 0)
    stamp = state.st_mtime_ns, state.st_size, mi.variant()
    fault = _damage_of_file(plugin, str(path), number, stamp)
    return f"{path}: {fault} Write the file again." if fault else ""


@lru_cache(maxsize=1024)
def _damage_of_file(plugin: str, path: str, number: int, stamp: tuple) -> str:
    """Return the fault of a file, whose content the stamp identifies."""
    return _torn_tensor(Path(path)) if plugin == "measured" else _wrong_mesh(plugin, path, number)


def _wrong_mesh(plugin: str, path: str, number: int) -> str:
    # With face normals nothing is computed at vertices, which may not exist.
    description = {"type": plugin, "filename": path, "face_normals": True}
    if plugin == "serialized":
        description["shape_index"] = number
    try:
        mesh = mi.load_dict(description)
    except Exception:  # making the scene raises it again
        return ""
    faces, count = meshes.rows(mesh, meshes.FACES), mesh.vertex_count()
    if len(faces) and faces.max() >= count:
        return f"a face names vertex {faces.max()}, and there are {count}, numbered from 0."
    lost = ~np.isfinite(meshes.rows(mesh, meshes.POSITIONS)).all(axis=1)
    if lost.any():
        return (
            f"the position of vertex {lost.argmax()} is not finite, and that of"
            f" {np.count_nonzero(lost)} vertices in all."
        )
    return ""


MAGIC = b"tensor_file\0"

BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 8, 8: 8, 9: 2, 10: 4, 11: 8}
"""Bytes of a number, by type: integers of 8 to 64 bits, unsigned and signed, and floats."""


def _torn_tensor(path: Path) -> str:
    """Return what a tensor file lacks; empty for one that Mitsuba itself rejects.

    It has a version of two bytes, the number of fields (uint32), and for each field the length of
    its name (uint16), the name, the number of axes (uint16), the type (uint8), the offset (uint64)
    and the lengths of its axes (uint64).
    """
    with path.open("rb") as file:

        def unpacked(form: str) -> tuple:
            return struct.unpack(form, file.read(struct.calcsize(form)))

        if file.read(len(MAGIC)) != MAGIC:
            return ""
        size = path.stat().st_size
        try:
            _, count = unpacked("<HI")
            for _ in range(count):
                (length,) = unpacked("<H")
                name = file.read(length).decode("ascii", "replace")
                axes, kind, offset = unpacked("<HBQ")
                end = offset + BYTES.get(kind, 0) * prod(unpacked(f"<{axes}Q"))
                if end > size:
                    return f"the field {name} ends at byte {end}, and the file has {size}."
        except struct.error:
            return "the file ends within its table of contents."
    return ""
