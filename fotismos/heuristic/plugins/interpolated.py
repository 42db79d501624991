"""Flat and Gouraud shading of triangle meshes (chapter 6, section 6.6).

The chapter interpolates twice along straight lines: along two edges to the points D and E where a
scan line meets them (6.35, 6.37), then along the scan line (6.36, 6.38). On a triangle this is the
same as weighting the three vertices by barycentric coordinates, for every direction of the scan
line. Renderers use the latter, on the surface itself; the chapter's scan lines lie in the image,
where perspective would need a correction.

:func:`shade_mesh` evaluates the model once per vertex (Gouraud) or face (flat), and stores the
values in the mesh. :func:`stored_shade` reads them where a ray hits, interpolated by Mitsuba. They
hold for one viewer and one set of lights; spectral variants, whose wavelengths change from ray to
ray, have none. Phong shading needs neither: Mitsuba interpolates the vertex normals.
"""

from collections.abc import Callable, Sequence
from functools import cache
from typing import Any

import drjit as dr
import mitsuba as mi

from fotismos.heuristic import meshes, tessellation
from fotismos.heuristic.convention import (
    Colour,
    Direction,
    Interaction,
    Mask,
    Mesh,
    Position,
    Scene,
    Visibility,
)
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import Interpolation
from fotismos.heuristic.kernel import shade
from fotismos.heuristic.lights import Light
from fotismos.heuristic.materials import Material


def shading_points(mesh: Mesh, interpolation: Interpolation) -> Interaction:
    """Return the points of a mesh at which flat or Gouraud shading evaluates the model.

    GOURAUD are the vertices with their normals, or those of 6.34 if it has none; FLAT the faces'
    centroids with theirs. They are in the order of the vertices or faces, as far as textures need
    it: ``p``, ``n``, ``sh_frame.n``, ``uv``, ``shape`` and ``prim_index``. GOURAUD has no such
    points on a mesh with ``face_normals``.
    """
    corners = meshes.faces(mesh)
    points = meshes.positions(mesh)
    uv = meshes.texture_coordinates(mesh)
    face = dr.arange(mi.UInt32, mesh.face_count())
    if interpolation is Interpolation.FLAT:
        si = dr.zeros(mi.SurfaceInteraction3f, mesh.face_count())
        points = _mean(points, corners)
        uv = None if uv is None else _mean(uv, corners)
        si.n = tessellation.face_normals(mesh)
        si.prim_index = face
    else:
        if mesh.has_face_normals():
            raise InputError(
                f"mesh {mesh.id()!r} has face_normals, so several normals at a vertex. Gouraud"
                " shading needs one: pass it through"
                " fotismos.heuristic.tessellation.split_faces, or take face_normals off."
            )
        si = dr.zeros(mi.SurfaceInteraction3f, mesh.vertex_count())
        si.n = tessellation.normals(mesh)
        for corner in range(3):  # any of the faces around a vertex will do
            dr.scatter(si.prim_index, face, corners[corner])
    si.p = mi.Point3f(points)
    si.uv = si.uv if uv is None else uv
    si.sh_frame.n = si.n
    si.shape = mi.ShapePtr(mesh)
    # An empty interaction is infinitely far away, and would not count as valid.
    si.t = mi.Float(0)
    return si


def shade_mesh(
    mesh: Mesh,
    interpolation: Interpolation,
    viewer: Position,
    material: Material,
    lights: Sequence[Light],
    ambient: Colour = 0,
    visible: Visibility | None = None,
    twosided: bool = False,
    model: Callable[..., Colour] = shade,
    towards_viewer: Direction | None = None,
) -> None:
    """Evaluate the model (8.10) at a mesh's vertices or faces, and store the values in the mesh.

    The values are as seen by a ``viewer`` ``P_V``: three numbers, or a Dr.Jit point. A viewer
    infinitely far away is in one direction, ``towards_viewer``, which replaces it. ``twosided``
    also stores those of the back, with reversed normals. ``model`` has the arguments of
    :func:`fotismos.heuristic.shade`; Dr.Jit values hold one entry, or one per vertex or face.
    Colours are RGB or single numbers: Mitsuba 3.9.1 reads attributes of 1 or 3 components.
    """
    si = shading_points(mesh, interpolation)
    position = mi.Vector3f(si.p)
    normal = mi.Vector3f(si.n)
    view = mi.Vector3f(viewer) - position if towards_viewer is None else towards_viewer
    # Terms that do not depend on the position are a single number until spread out.
    everywhere = dr.zeros(mi.Float, dr.width(position))
    attributes = {}
    for back in (False, True) if twosided else (False,):
        facing = -normal if back else normal
        colour = model(position, facing, view, material, lights, ambient, visible)
        if dr.depth_v(colour) > 1 and len(colour) == 1:  # of llvm_ad_mono
            colour = colour[0]
        attributes[_name(interpolation, back)] = mi.Color3f(colour) + everywhere
    meshes.store(mesh, attributes)


def stored_shade(
    si: Interaction, interpolation: Interpolation, twosided: bool = False, active: Mask = True
) -> Colour:
    """Read what :func:`shade_mesh` stored, at the surface interactions of rays.

    A face shows its front if the ray hits the side from which its vertices are anticlockwise,
    whatever its vertex normals say. Its back is black, or with ``twosided`` has its stored value.
    Shapes without stored values read as black.
    """
    is_front = dr.dot(si.n, si.to_world(si.wi)) > 0
    value = si.shape.eval_attribute_3(_name(interpolation, False), si, active & is_front)
    back: Any = 0
    if twosided:
        back = si.shape.eval_attribute_3(_name(interpolation, True), si, active & ~is_front)
    return dr.select(is_front, value, back)


def _mean(values: Any, corners: Any) -> Any:
    return sum(dr.gather(type(values), values, corners[i]) for i in range(3)) / 3


def _name(interpolation: Interpolation, back: bool) -> str:
    """Return the name of an attribute: ``vertex_heuristic`` or ``face_heuristic``, and a suffix."""
    element = "face" if interpolation is Interpolation.FLAT else "vertex"
    return f"{element}_heuristic" + ("_back" if back else "")


@cache
def derived(base: type) -> type:
    """Return a variant's integrator ``heuristic`` with ``flat`` or ``gouraud`` (6.35, 6.36).

    The heuristic runs once per vertex or face before the rendering, for the sensor that renders.
    """
    require_colours()

    class InterpolatingIntegrator(base):
        """See :mod:`fotismos.heuristic.plugins.integrator`."""

        def render(self, scene: Scene, sensor: Any = 0, *others: Any, **named: Any) -> Any:
            camera = scene.sensors()[sensor] if isinstance(sensor, int) else sensor
            viewer, towards_viewer = viewpoint(camera)
            # Stored for all shapes alike, because reading cannot distinguish them.
            twosided = _is_twosided(scene)
            for mesh in _meshes(scene):
                at = shading_points(mesh, self.interpolation)
                material = mesh.bsdf().material(
                    at, True, self.prune, self.model.form, not self.model.is_builtin
                )
                shade_mesh(
                    mesh,
                    self.interpolation,
                    viewer=viewer,
                    material=material,
                    lights=self.lights(scene, at, True),
                    ambient=self.ambient_at(at, True),
                    visible=self.visibility(scene, at, True),
                    twosided=twosided,
                    model=self.model_at(scene, at),
                    towards_viewer=towards_viewer,
                )
            return super().render(scene, sensor, *others, **named)

        def surface_colour(self, scene: Scene, si: Interaction, view: Any, active: Mask) -> Colour:
            value = stored_shade(
                si, self.interpolation, twosided=_is_twosided(scene), active=active
            )
            # `llvm_ad_mono` has one channel, which was stored three times.
            return value if mi.is_rgb else mi.Spectrum(value.x)

    return InterpolatingIntegrator


def _is_twosided(scene: Scene) -> bool:
    return any(shape.bsdf().twosided for shape in scene.shapes())


def _meshes(scene: Scene) -> list[Mesh]:
    """Return the scene's shapes; reject those that are not meshes."""
    shapes: list[Mesh] = scene.shapes()
    for shape in shapes:
        if not shape.is_mesh():
            raise InputError(
                f"shape {shape.id()!r} is a {shape.class_name()}: flat and Gouraud shading need"
                " triangle meshes. Make one with fotismos.heuristic.tessellation.to_mesh;"
                " fotismos does so itself."
            )
    return shapes


def viewpoint(sensor: Any) -> tuple[Position, Direction | None]:
    """Return the viewer's position, and the direction to an orthographic camera, else None.

    Cameras that have neither are rejected.
    """
    if not isinstance(sensor, mi.ProjectiveCamera):
        raise InputError(
            f"sensor {sensor.id()!r} ({sensor.class_name()}) has no single viewpoint, which flat"
            " and Gouraud shading need: use perspective, thinlens or orthographic, or phong"
            " interpolation."
        )
    to_world = sensor.world_transform()
    position = to_world.translation()
    if "Orthographic" not in sensor.class_name():
        return position, None
    # A camera looks along +z.
    return position, dr.normalize(mi.Vector3f(to_world @ mi.Vector3f(0, 0, -1)))


def require_colours() -> None:
    """Reject spectral variants, whose wavelengths change from ray to ray."""
    if mi.is_spectral:
        raise InputError(
            f"{mi.variant()} has wavelengths, and flat and Gouraud shading need RGB: give"
            " `heuristic_variant=llvm_ad_rgb`, or use phong interpolation."
        )
