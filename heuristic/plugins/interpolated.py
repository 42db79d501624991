"""The integrator ``heuristic`` with ``interpolation`` ``flat`` or ``gouraud`` (6.6.1, 6.35, 6.36).

In RGB variants the heuristic runs once per vertex or face before the rendering, for the sensor that
renders, and Mitsuba interpolates the stored values. Spectral variants draw other wavelengths for
each ray; there the heuristic runs at the corners of the face that a ray hits.
"""

from typing import Any

import drjit as dr
import mitsuba as mi

from heuristic.arrays import Position
from heuristic.errors import InputError
from heuristic.interpolation import Interpolation
from heuristic.mesh_shading import MeshCorners, shade_mesh, shading_points, stored_shade


def interpolating(base: type) -> type:
    """Return the class for the current variant, made from that of the integrator ``heuristic``."""

    class InterpolatingIntegrator(base):
        """See the module's docstring."""

        def render(self, scene, sensor=0, seed=0, spp=0, develop=True, evaluate=True):
            if not mi.is_spectral:
                self._store(scene, scene.sensors()[sensor] if isinstance(sensor, int) else sensor)
            return super().render(scene, sensor, seed, spp, develop, evaluate)

        def surface_colour(self, scene, si, view, active):
            if mi.is_spectral:
                return self._at_corners(scene, si, view, active)
            twosided = any(shape.bsdf().twosided for shape in scene.shapes())
            values = stored_shade(si, self.interpolation, twosided=twosided, active=active)
            return mi.Color3f(values) if mi.is_rgb else mi.Spectrum(values[0])

        def _store(self, scene, sensor):
            viewer = viewpoint(sensor)
            for mesh in _meshes(scene):
                at = shading_points(mesh, self.interpolation)
                shade_mesh(
                    mesh,
                    self.interpolation,
                    viewer,
                    mesh.bsdf().material(
                        at, True, self.prune, self.model.form, not self.model.is_own
                    ),
                    self.lights(scene, at, True),
                    self.ambient_at(at, True),
                    self.visibility(scene, at, True),
                    # Stored for all, because reading cannot distinguish the shapes.
                    twosided=any(shape.bsdf().twosided for shape in scene.shapes()),
                    model=self.model_at(scene, at),
                )

        def _at_corners(self, scene, si, view, active):
            _meshes(scene)
            corners = MeshCorners(scene).at(si, active)
            viewer = si.p + view * si.t
            front = dr.dot(si.n, view) > 0
            if self.interpolation is Interpolation.FLAT:
                corners = [(mi.Float(1), _centroid(si, corners))]
            colour = mi.Spectrum(0)
            for weight, corner in corners:
                normal = dr.select(front, mi.Vector3f(corner.sh_frame.n), -corner.sh_frame.n)
                value = self.shaded(scene, corner, viewer - corner.p, normal, active)
                colour += weight * value
            twosided = self.twosided(scene, si, active)
            return dr.select(active & (twosided | front), colour, 0)

    return InterpolatingIntegrator


def _meshes(scene):
    """Return the scene's shapes; reject those that are not meshes."""
    for shape in scene.shapes():
        if not shape.is_mesh():
            raise InputError(
                f"shape {shape.id()!r} is a {shape.class_name()}: flat and Gouraud shading need"
                " triangle meshes. Make one with heuristic.meshes.to_mesh; fotismos does so itself."
            )
    return scene.shapes()


def viewpoint(sensor: Any) -> Position:
    """Return the viewer's position; reject cameras without one."""
    if not isinstance(sensor, mi.ProjectiveCamera) or "Orthographic" in sensor.class_name():
        raise InputError(
            f"sensor {sensor.id()!r} ({sensor.class_name()}) has no single viewpoint, which flat"
            " and Gouraud shading need: use perspective or thinlens, or phong interpolation."
        )
    return sensor.world_transform().translation()


def _centroid(si, corners):
    """Return the interaction at the centroid of the face, with the face's own normal."""
    point = mi.SurfaceInteraction3f(si)
    point.p = sum(corner.p for _, corner in corners) / 3
    point.uv = sum(corner.uv for _, corner in corners) / 3
    point.sh_frame.n = point.n = si.n
    return point
