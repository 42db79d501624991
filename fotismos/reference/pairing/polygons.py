"""The textbook half's shapes as meshes, for flat and Gouraud shading."""

import shutil
import weakref
from pathlib import Path
from tempfile import mkdtemp

import mitsuba as mi

from fotismos.heuristic import tessellation
from fotismos.heuristic.convention import Scene
from fotismos.heuristic.errors import InputError, OutputError
from fotismos.heuristic.heuristics import Interpolation
from fotismos.heuristic.plugins.interpolated import viewpoint
from fotismos.reference.scene.graph import Graph, Reference, properties


def replace_shapes(
    graph: Graph,
    scene: Scene,
    resolution: int | None,
    interpolation: Interpolation,
    weights: str | None,
) -> None:
    """Replace every shape of a graph by a mesh of the same place, name, material and light.

    ``scene`` has the same shapes, instantiated; ids identify them. Gouraud shading needs one normal
    per vertex, hence separate faces if the mesh has ``face_normals``. With ``weights``, vertex
    normals are those of 6.32, 6.33 or 6.34, whatever a mesh has.
    """
    if interpolation is not Interpolation.PHONG:
        viewpoint(scene.sensors()[0])  # raises before anything renders
    folder = _Folder()
    shapes = {shape.id(): shape for shape in scene.shapes()}
    for index in graph.nodes(mi.ObjectType.Shape):
        props = graph.props(index)
        if props.id() not in shapes or graph.plugin(index) == "instance":
            raise InputError(
                f"{graph.name}: {graph.label(index)}: instances and their groups cannot become"
                " separate meshes. Give `interpolation=phong`."
            )
        mesh = tessellation.to_mesh(shapes[props.id()], resolution or tessellation.RESOLUTION)
        if mesh.has_face_normals():
            if interpolation is Interpolation.GOURAUD:
                mesh = tessellation.split_faces(mesh)
        elif weights or not mesh.has_vertex_normals():
            mesh = tessellation.with_vertex_normals(mesh, weights or "angle")
        path = folder.path / f"{index}.ply"
        try:
            mesh.write_ply(str(path))
        except RuntimeError as error:
            raise OutputError(
                f"{graph.name}: {error}. Free some space, or set TMPDIR to another folder."
            ) from error
        children = {key: value for key, value in props.items() if isinstance(value, Reference)}
        # The file holds world coordinates; a mesh without vertex normals has flat faces.
        derived = properties("ply", filename=str(path), **children)
        if mesh.has_face_normals():
            derived["face_normals"] = True
        graph.replace(index, derived)
    graph.folders.append(folder)


class _Folder:
    """A temporary folder that goes away with the last graph; ``TemporaryDirectory`` would warn."""

    def __init__(self) -> None:
        self.path = Path(mkdtemp(prefix="fotismos-"))
        weakref.finalize(self, shutil.rmtree, self.path, ignore_errors=True)
