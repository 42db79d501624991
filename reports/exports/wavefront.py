"""Geometry as Wavefront OBJ: one object per shape, in world space."""

from collections.abc import Iterator

from numpy.typing import NDArray

from comparisons.exports.exported import Exported
from heuristic.scene_data import Triangles


def obj(scene: Exported) -> str:
    """Return the content of the file of a scene's shapes."""
    return "\n".join(_lines(scene)) + "\n"


def _lines(scene: Exported) -> Iterator[str]:
    yield f"# {scene.name}: world space, right-handed, counter-clockwise seen from the front"
    first = {"v": 1, "vt": 1, "vn": 1}
    for shape in scene.shapes:
        yield f"o {shape.name}"
        yield f"g {shape.name}"
        yield from _rows("v", shape.positions)
        yield from _rows("vt", shape.texcoords)
        yield from _rows("vn", shape.normals)
        yield f"s {'off' if shape.normals is None else '1'}"
        for face in shape.faces:
            yield "f " + " ".join(_corner(shape, int(vertex), first) for vertex in face)
        first["v"] += len(shape.positions)
        first["vt"] += 0 if shape.texcoords is None else len(shape.texcoords)
        first["vn"] += 0 if shape.normals is None else len(shape.normals)


def _rows(word: str, rows: NDArray | None) -> Iterator[str]:
    for row in () if rows is None else rows:
        yield f"{word} " + " ".join(f"{value:.9g}" for value in row)


def _corner(shape: Triangles, vertex: int, first: dict[str, int]) -> str:
    texture = "" if shape.texcoords is None else str(vertex + first["vt"])
    normal = "" if shape.normals is None else str(vertex + first["vn"])
    if not normal:
        return f"{vertex + first['v']}/{texture}" if texture else str(vertex + first["v"])
    return f"{vertex + first['v']}/{texture}/{normal}"
