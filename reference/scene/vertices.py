"""Meshes of files, looked at before a scene is made of them.

Mitsuba takes the vertex numbers of PLY and serialized files as they are: it reads whatever lies
beyond the mesh in memory, or the process ends there. OBJ files it checks by itself.
"""

from functools import lru_cache

import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from reference.scene.graph import Graph

PLUGINS = ("ply", "serialized")


def check(graph: Graph) -> None:
    """Refuse meshes whose faces name vertices that are not there, or whose vertices are nowhere.

    Raises
    ------
    InputError
        Naming the element, its file, and what is wrong with it.
    """
    for index in graph.nodes(mi.ObjectType.Shape):
        plugin, path = graph.plugin(index), graph.file(index)
        if plugin in PLUGINS and path is not None:
            state = path.stat()
            stamp = state.st_mtime_ns, state.st_size, mi.variant()
            number = graph.props(index).get("shape_index", 0)
            fault = _fault(plugin, str(path), number, stamp)
            if fault:
                raise InputError(
                    f"{graph.name}: {graph.label(index)}: {path}: {fault} Write the file again."
                )


@lru_cache(maxsize=1024)
def _fault(plugin: str, path: str, number: int, stamp: tuple) -> str:
    """Return what is wrong with a mesh; nothing for one that Mitsuba refuses by itself.

    ``stamp`` tells one content of the file from another.
    """
    # With face normals nothing is computed at vertices, which may not be there.
    description = {"type": plugin, "filename": path, "face_normals": True}
    if plugin == "serialized":
        description["shape_index"] = number
    try:
        mesh = mi.load_dict(description)
    except Exception:  # whatever it is, the scene's own attempt raises it again
        return ""
    faces, count = np.array(mesh.faces_buffer()), mesh.vertex_count()
    if len(faces) and faces.max() >= count:
        return f"a face names vertex {faces.max()}, and there are {count}, numbered from 0."
    lost = ~np.isfinite(np.array(mesh.vertex_positions_buffer()).reshape(-1, 3)).all(axis=1)
    if lost.any():
        return (
            f"the position of vertex {lost.argmax()} is not finite, and that of"
            f" {np.count_nonzero(lost)} vertices in all."
        )
    return ""
