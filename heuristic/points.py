"""The points that a heuristic shades: positions, directions, material, lights."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from types import SimpleNamespace
from typing import Any, NamedTuple

import drjit as dr

from heuristic import kernel, terms, vectors
from heuristic.errors import InputError
from heuristic.materials import Material

INPUTS = ("position", "normal", "view", "uv", "material", "ambient", "lights", "visible")
"""The possible needs of a heuristic; ``visible`` is a shadow ray to a light."""

Array = Any
"""A Dr.Jit array of the current variant, one entry per point; a plain number if all are equal."""


class ShadingArguments(NamedTuple):
    """The arguments of :func:`heuristic.shade`."""

    position: Array
    normal: Array
    view: Array
    material: Material
    lights: list[Any]
    ambient: Array = 0
    visible: Callable[[Array, Array], Array] | None = None


@dataclass(frozen=True)
class LightAtPoint:
    """A light as it arrives at a point.

    ``toward`` is the unit vector from the point towards the light, in world space; zero on the
    light itself. ``distance`` is in units of the scene; infinite for parallel light. ``intensity``
    is ``I_p``, display-linear, with attenuation and cone: a white diffuse surface that faces the
    light has this value. If the integrator has ``occlusion``, and the heuristic does not need
    ``visible``, it is 0 at points that the light does not reach.
    """

    toward: Array
    distance: Array
    intensity: Array
    _point: "Point"

    def visible(self) -> Array:
        """Return the mask of points that the light reaches, by a shadow ray (a need)."""
        self._point.require("visible")
        ray: Any = self._point.arguments.visible  # there is one, since it was declared
        return ray(self.toward, self.distance)


def _input(read: Callable[["Point"], Any]) -> cached_property:
    """Make an attribute of :class:`Point` that a heuristic can read if it declares the need."""

    def checked(point: "Point") -> Any:
        point.require(read.__name__)
        return read(point)

    return cached_property(checked)


@dataclass(frozen=True)
class Point:
    """The points to shade, all at once, as read by a heuristic.

    ``parameters`` has the heuristic's as attributes, ``prepared`` is the result of its ``prepare``
    for the scene. ``wavelengths`` are those of colours in nm: four in spectral variants, otherwise
    none. Reading what is not among the heuristic's ``needs`` raises InputError.
    """

    needs: frozenset[str]
    arguments: ShadingArguments
    _uv: Array
    parameters: SimpleNamespace
    prepared: Any = None
    wavelengths: Array = ()

    @_input
    def position(self) -> Array:
        """Position in world space, in units of the scene."""
        return self.arguments.position

    @_input
    def normal(self) -> Array:
        """Unit shading normal in world space, towards the viewer's side of two-sided surfaces."""
        return vectors.normalise(self.arguments.normal)

    @_input
    def view(self) -> Array:
        """Unit vector towards the viewer, in world space."""
        return vectors.normalise(self.arguments.view)

    @_input
    def uv(self) -> Array:
        """Texture coordinates, two components."""
        return self._uv

    @_input
    def material(self) -> Material:
        """The material of the surface, a :class:`heuristic.materials.PairedMaterial`.

        ``k_i``, ``k_a``, ``k_d``, ``k_s`` and ``n`` as paired, for a lobe without normalisation;
        ``base_color``, ``alpha``, ``ior`` and ``metallic`` as the physical half has them.
        """
        material = self.arguments.material
        if not material.normalised:
            return material
        k_s = material.k_s * terms.normalisation(material.form, material.n)
        return replace(material, k_s=k_s, normalised=False)

    @_input
    def ambient(self) -> Array:
        """``I_a``, display-linear."""
        return self.arguments.ambient

    @_input
    def lights(self) -> tuple[LightAtPoint, ...]:
        """The scene's lights at the points, in the order of the scene."""
        return tuple(map(self._light, self.arguments.lights))

    def textbook(self, **instead: Any) -> Array:
        """Return the chapters' model at the points, :func:`heuristic.shade`.

        Named arguments replace those given there, such as ``ambient=0``.
        """
        return kernel.shade(*self.arguments._replace(**instead))

    def _light(self, light: Any) -> LightAtPoint:
        toward, intensity, distance = light.illuminate(self.arguments.position)
        if self.arguments.visible is not None and "visible" not in self.needs:
            intensity = dr.select(self.arguments.visible(toward, distance), intensity, 0)
        return LightAtPoint(toward, distance, intensity, self)

    def require(self, name: str) -> None:
        """Raise InputError for an input that is not among the heuristic's needs."""
        if name not in self.needs:
            raise InputError(f"{name!r} is read, but not declared: add it to the needs.")
