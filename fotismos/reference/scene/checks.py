"""Values of a scene that Mitsuba renders in silence, or that end the process.

Mitsuba rejects some values that make no sense, and renders others: a sphere of radius NaN is
missing, an infinite index of refraction is black, a normal that is not finite leaves NaN.
"""

import re
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.heuristic import meshes
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.lights import plugins_with
from fotismos.reference.scene.graph import FILENAME, Graph, find_file, require_regular_file

LARGEST = float(np.finfo(np.float32).max)

FILM_SIZE = (768, 576)
"""Mitsuba's width and height for a film without its own."""

SMALLEST_RATIO = 1e-14
"""Ratio of singular values of a matrix with rows and columns of length 1; less is rounding."""

SQUARES = 1e-18, 1e18
"""Lengths of vertex normals between which Mitsuba can normalise them in single precision."""

WITH_NORMALS = re.compile(rb"^[ \t]*vn\s", re.MULTILINE)
WITHOUT_NORMALS = re.compile(
    rb"^[ \t]*f[ \t]+(?:[^\s/]+(?:/[^\s/]*)?|[^\n]*/[^\s/]*/0*)(?=\s|\Z)", re.MULTILINE
)
"""Lines of an OBJ: a normal; a face whose first vertex names none, or any of them an empty one."""

PICTURES = ("filename", "bitmap", "data")
CHILDREN = {"blendbsdf": (mi.ObjectType.BSDF, 2), "volume": (mi.ObjectType.Volume, 1)}

ABOVE_0 = float(np.nextafter(0, 1))
ANY = None
INFINITY = float("inf")

RANGES = (
    ("radius", "sphere cylinder", ANY, "a radius other than 0"),
    ("cutoff_angle", "spot", (ABOVE_0, 180), "an angle above 0 and up to 180 degrees"),
    ("focus_distance", "thinlens", (ABOVE_0, INFINITY), "a distance above 0"),
    ("int_ior ext_ior", "", (ABOVE_0, INFINITY), "an index of refraction above 0"),
    ("eta", "principled principledthin", (ABOVE_0, INFINITY), "an index of refraction above 0"),
    ("eta k", "conductor roughconductor", (0, INFINITY), "values of 0 or more"),
    ("alpha alpha_u alpha_v", "", (0, 10), "a roughness from 0 to 10"),
    (
        "roughness metallic spec_trans spec_tint sheen sheen_tint clearcoat clearcoat_gloss"
        " flatness anisotropic",
        "principled principledthin",
        (0, 1),
        "a share from 0 to 1",
    ),
    ("diff_trans", "principledthin", (0, 2), "a number from 0 to 2"),
    ("opacity", "mask", (0, 1), "a share from 0 to 1"),
    ("weight", "blendbsdf", (0, 1), "a share from 0 to 1"),
    ("sigma_t scale", "homogeneous heterogeneous", (0, INFINITY), "0 or more"),
    ("albedo", "homogeneous heterogeneous", (0, 1), "a share from 0 to 1"),
    (
        "direction sun_direction",
        " ".join(("directional", "distant", "sunsky", "timed_sunsky", *plugins_with("direction"))),
        ANY,
        "a vector of any length but 0",
    ),
    ("sample_count", "", (1, 2**32 - 1), "1 or more samples per pixel"),
    ("width height crop_width crop_height", "hdrfilm specfilm", (1, INFINITY), "1 or more pixels"),
)
"""Parameters, the plugins that have them (all if empty), their range, or ANY but 0, and its words.

A roughness is the root mean square slope of facets: at 10 these lean by 84 degrees.
"""


def check(graph: Graph) -> None:
    """Reject values that make no sense, missing and damaged files, in all elements in use."""
    _require_files(graph)
    for index in graph.nodes_in_use():
        check_node(graph, index)
        if graph.plugin(index) == "blackbody" and not mi.is_spectral:
            # Mitsuba loads it, and raises at the first sample.
            objection = f"it has no colour in {mi.variant()}. Give the variant llvm_ad_spectral."
            raise _refusal(graph, index, objection)
        is_mesh = graph.plugin(index) in ("obj", "ply", "serialized")
        if is_mesh and (objection := damage(graph, index)):
            raise _refusal(graph, index, objection)


def _require_files(graph: Graph) -> None:
    """Reject a scene whose files are missing, with all of them."""
    missing = []
    for index in graph.nodes_in_use():
        name = graph.props(index).get(FILENAME, None)
        if isinstance(name, str) and graph.file(index) is None:
            missing.append(f"{name} ({graph.label(index)})")
    if missing:
        count = "a file is" if len(missing) == 1 else f"{len(missing)} files are"
        raise InputError(
            f"{graph.name}: {count} missing: {'; '.join(missing)}. Correct the paths, which begin"
            " at the scene's folder, or add the files."
        )


def check_node(graph: Graph, index: int) -> None:
    """Reject values of one element that make no sense."""
    props = graph.props(index)
    plugin = graph.plugin(index)
    for key, value in props.items():
        if isinstance(value, str) and (path := find_file(graph.resolver, value)):
            require_regular_file(f"{graph.name}: {graph.label(index)}", value, path)
        for allowed in objections(plugin, key, value):
            raise _refusal(graph, index, f"{key} = {shown(value)} is not allowed: give {allowed}.")
    for objection in _missing(graph, index):
        raise _refusal(graph, index, objection)


def _refusal(graph: Graph, index: int, objection: str) -> InputError:
    return InputError(f"{graph.name}: {graph.label(index)}: {objection}")


def objections(plugin: str, key: str, value: Any) -> Iterator[str]:
    """Yield what is allowed in place of a value that makes no sense."""
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
    if not (np.abs(numbers) <= LARGEST).all() and (plugin, key, value) != ("phong", "n", INFINITY):
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
    even = matrix
    # Columns, then rows, get length 1, so that an uneven scale alone is no fault.
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
    plugin = graph.plugin(index)
    props = graph.props(index)
    if plugin == "bitmap" and not any(key in props for key in PICTURES):
        yield f"it has no picture: give one of {', '.join(PICTURES)}."
    if plugin in CHILDREN:
        kind, count = CHILDREN[plugin]
        children = len(graph.children(index, kind))
        if children != count:
            yield f"it needs {count} {kind.name} elements, and has {children}."
    if plugin == "cylinder" and "p0" in props and "p1" in props:
        ends = [np.ravel(np.asarray(props[key], float)) for key in ("p0", "p1")]
        if (ends[0] == ends[1]).all():
            yield "p0 and p1 are the same point: give the two ends of the axis."


def shown(value: Any) -> str:
    """Return a value as a message gives it."""
    if _is_transform(value):
        rows = np.array(value.matrix, float)
        return "[" + "; ".join(" ".join(f"{number:g}" for number in row) for row in rows) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)


def damage(graph: Graph, index: int) -> str:
    """Return what is wrong with the file of a mesh; empty if nothing is.

    Mitsuba does not check whether the faces of PLY and serialized meshes name vertices that exist:
    it reads memory beyond them.
    """
    plugin = graph.plugin(index)
    path = graph.file(index)
    if path is None:
        return ""
    state = path.stat()
    number = graph.props(index).get("shape_index", 0)
    # A file that is written again has another stamp, and is examined again.
    stamp = state.st_mtime_ns, state.st_size, mi.variant()
    fault = _wrong_mesh(plugin, str(path), number=number, stamp=stamp)
    if not fault and plugin == "obj" and not graph.props(index).get("face_normals", False):
        fault = _lacks_normals(str(path), stamp)
    return f"{path}: {fault} Write the file again." if fault else ""


@lru_cache(maxsize=1024)
def _wrong_mesh(plugin: str, path: str, number: int, stamp: tuple[Any, ...]) -> str:
    # With face normals nothing is computed at vertices, which may not exist.
    description = {"type": plugin, "filename": path, "face_normals": True}
    if plugin == "serialized":
        description["shape_index"] = number
    try:
        mesh = mi.load_dict(description)
    except (RuntimeError, ValueError):  # making the scene raises it again
        return ""
    if not mesh.face_count():
        return "it has no faces, which a shape must have."
    faces = meshes.rows(mesh, meshes.FACES)
    count = mesh.vertex_count()
    if faces.max() >= count:
        return f"a face names vertex {faces.max()}, and there are {count}, numbered from 0."
    lost = ~np.isfinite(meshes.rows(mesh, meshes.POSITIONS)).all(axis=1)
    if lost.any():
        return (
            f"the position of vertex {lost.argmax()} is not finite, and that of"
            f" {np.count_nonzero(lost)} vertices in all."
        )
    return ""


@lru_cache(maxsize=1024)
def _lacks_normals(path: str, stamp: tuple[Any, ...]) -> str:
    """Return which face of an OBJ has no normals while the file has some; empty if none."""
    content = Path(path).read_bytes()
    face = WITHOUT_NORMALS.search(content)
    if not face or not WITH_NORMALS.search(content):
        return ""
    line = content.count(b"\n", 0, face.start()) + 1
    return (
        f"the face in line {line} names no normal, and the file has some: Mitsuba leaves those of"
        " its vertices undefined. Give normals to all faces or to none, or set face_normals."
    )


def require_frames(name: str, scene: mi.Scene) -> None:
    """Reject a mesh whose normals or texture coordinates give no shading frame, by its name."""
    for mesh in scene.shapes():
        if not mesh.is_mesh():
            continue
        normals = meshes.rows(mesh, meshes.NORMALS)
        places = meshes.rows(mesh, meshes.TEXCOORDS)
        if normals is not None:
            lengths = np.linalg.norm(normals.astype(float), axis=1)
            low, high = SQUARES
            _require_vertices(name, mesh, "normal", normals, (low < lengths) & (lengths < high))
        if places is not None:
            is_finite = np.isfinite(places).all(axis=1)
            _require_vertices(name, mesh, "texture coordinate", places, is_finite)


def _require_vertices(
    name: str, mesh: mi.Mesh, what: str, rows: np.ndarray, is_right: np.ndarray
) -> None:
    if is_right.all():
        return
    used = np.unique(meshes.rows(mesh, meshes.FACES))
    wrong = used[~is_right[used]]
    if wrong.size:
        raise InputError(
            f"{name}: {mesh.id()}: the {what} of vertex {wrong[0]} is {rows[wrong[0]].tolist()},"
            f" one of {wrong.size} that cannot be used. Give each vertex a finite one, or none any."
        )
