"""Damaged files that Mitsuba reads silently.

Mitsuba does not check the vertex numbers of PLY and serialized meshes: it reads memory beyond the
mesh, or the process ends there, and takes numbers below 0 for 0. It does check OBJ files.

A tensor file, as used by `measured` materials, gives the place of each of its fields: magic
``tensor_file`` and a null byte, a version of two bytes, the number of fields (uint32), and for each
field the length of its name (uint16), the name, the number of axes (uint16), the type (uint8), the
offset (uint64) and the lengths of its axes (uint64). Mitsuba does not check whether the file is
that long.
"""

import os
import struct
from functools import lru_cache, partial
from math import prod
from pathlib import Path
from typing import Any, BinaryIO

import mitsuba as mi
import numpy as np

from heuristic import mesh_arrays
from heuristic.errors import InputError
from reference.scene.graph import Graph

MAGIC = b"tensor_file\0"

BYTES = {1: 1, 2: 1, 3: 2, 4: 2, 5: 4, 6: 4, 7: 8, 8: 8, 9: 2, 10: 4, 11: 8}
"""Bytes of a number, by type: integers of 8 to 64 bits, unsigned and signed, and floats."""


TYPES = {
    b"char": "i1", b"uchar": "u1", b"short": "i2", b"ushort": "u2", b"int": "i4", b"uint": "u4",
    b"float": "f4", b"double": "f8", b"int8": "i1", b"uint8": "u1", b"int16": "i2",
    b"uint16": "u2", b"int32": "i4", b"uint32": "u4", b"float32": "f4", b"float64": "f8",
}  # fmt: skip
"""Numbers in PLY files, as NumPy names them."""


def check(graph: Graph) -> None:
    """Reject incomplete meshes and tables, and those with invalid faces or vertices.

    Raises
    ------
    InputError
        With the element, its file, and the fault.
    """
    for index in graph.nodes_in_use():
        faults = FAULTS.get(graph.plugin(index), ())
        path = graph.file(index) if faults else None
        if path is None:
            continue
        state = path.stat()
        stamp = state.st_mtime_ns, state.st_size, mi.variant()
        for fault_of in faults:
            number = graph.props(index).get("shape_index", 0)
            if fault := fault_of(str(path), number, stamp):
                raise InputError(
                    f"{graph.name}: {graph.label(index)}: {path}: {fault} Write the file again."
                )


@lru_cache(maxsize=1024)
def _fault_of_mesh(plugin: str, path: str, number: int, stamp: tuple) -> str:
    """Return the fault of a mesh; empty for one that Mitsuba itself rejects.

    ``stamp`` identifies the content of the file.
    """
    # With face normals nothing is computed at vertices, which may not exist.
    description = {"type": plugin, "filename": path, "face_normals": True}
    if plugin == "serialized":
        description["shape_index"] = number
    try:
        mesh = mi.load_dict(description)
    except Exception:  # making the scene raises it again
        return ""
    faces, count = mesh_arrays.rows(mesh, mesh_arrays.FACES), mesh.vertex_count()
    if len(faces) and faces.max() >= count:
        return f"a face names vertex {faces.max()}, and there are {count}, numbered from 0."
    lost = ~np.isfinite(mesh_arrays.rows(mesh, mesh_arrays.POSITIONS)).all(axis=1)
    if lost.any():
        return (
            f"the position of vertex {lost.argmax()} is not finite, and that of"
            f" {np.count_nonzero(lost)} vertices in all."
        )
    return ""


@lru_cache(maxsize=1024)
def _fault_of_tensor(path: str, number: int, stamp: tuple) -> str:
    """Return what a tensor file lacks; empty for one that Mitsuba itself rejects."""
    size = stamp[1]
    with Path(path).open("rb") as file:
        if file.read(len(MAGIC)) != MAGIC:
            return ""
        try:
            _, count = _unpacked(file, "<HI")
            for _ in range(count):
                (length,) = _unpacked(file, "<H")
                name = file.read(length).decode("ascii", "replace")
                axes, kind, offset = _unpacked(file, "<HBQ")
                shape = _unpacked(file, f"<{axes}Q")
                end = offset + BYTES.get(kind, 0) * prod(shape)
                if end > size:
                    return f"the field {name} ends at byte {end}, and the file has {size}."
        except struct.error:
            return "the file ends within its table of contents."
    return ""


def _unpacked(file: BinaryIO, form: str) -> tuple:
    return struct.unpack(form, file.read(struct.calcsize(form)))


@lru_cache(maxsize=1024)
def _fault_of_ply(path: str, number: int, stamp: tuple) -> str:
    """Return which face of a PLY file names a vertex below 0, if its faces are only lists."""
    with Path(path).open("rb") as file:
        form, elements = _head_of_ply(file)
        for name, count, properties in elements:
            if name == b"face":
                are_lists = len(properties) == 1 and properties[0][:1] == [b"list"]
                found = _negative(file, form, count, properties[0]) if are_lists else None
                return "" if found is None else f"face {found} names a vertex below 0."
            if form == b"ascii":
                # A file may declare more lines than it has.
                if any(not file.readline() for _ in range(count)):
                    return ""
            elif any(words[:1] == [b"list"] or words[0] not in TYPES for words in properties):
                return ""
            else:
                size = sum(np.dtype(TYPES[words[0]]).itemsize for words in properties)
                file.seek(count * size, os.SEEK_CUR)
    return ""


def _head_of_ply(file: BinaryIO) -> tuple[bytes, list[tuple[bytes, int, list[list[bytes]]]]]:
    """Return the format, and name, number and properties of each element."""
    form, elements = b"", list[Any]()
    for line in file:
        words = line.split()
        if words[:1] == [b"element"] and len(words) == 3 and words[2].isdigit():
            elements.append((words[1], int(words[2]), []))
        elif words[:1] == [b"property"] and len(words) > 2 and elements:
            elements[-1][2].append(words[1:])
        elif words[:1] == [b"format"] and len(words) > 1:
            form = words[1]
        elif words == [b"end_header"]:
            return form, elements
    return b"", []


def _negative(file: BinaryIO, form: bytes, count: int, words: list[bytes]) -> int | None:
    """Return the first of some faces with a negative number, None if none has one."""
    if form == b"ascii":
        lines = zip(range(count), file, strict=False)
        return next((i for i, line in lines if b"-" in line), None)
    order = {b"binary_little_endian": "<", b"binary_big_endian": ">"}.get(form)
    if order is None or len(words) < 3 or not {*words[1:3]} <= TYPES.keys():
        return None
    length, number = (np.dtype(order + TYPES[word]) for word in words[1:3])
    if number.kind != "i":
        return None
    content = np.frombuffer(file.read(), np.uint8)
    face = np.dtype([("length", length), ("corners", number, (3,))])
    triangles = content[: len(content) // face.itemsize * face.itemsize].view(face)[:count]
    # After a list of another length the start of the next one is unknown.
    known = np.cumprod(triangles["length"] == 3, dtype=bool)
    bad = np.flatnonzero(known & (triangles["corners"] < 0).any(axis=1))
    return int(bad[0]) if len(bad) else None


FAULTS = {
    "measured": (_fault_of_tensor,),
    "ply": (_fault_of_ply, partial(_fault_of_mesh, "ply")),
    "serialized": (partial(_fault_of_mesh, "serialized"),),
}
"""Functions that find faults in the files of plugins, given the path, the number of the mesh, and a
stamp of the file's content; they return the fault, or an empty string."""
