"""Heuristics: ways to shade the textbook half of a pair, each one declaration.

A heuristic is a function of a :class:`Point` that returns the colour seen there. ``phong`` and
``blinn`` are here, those of engines in :mod:`fotismos.heuristic.shadow_maps` and
:mod:`fotismos.heuristic.indirect_light`. Users write a function in a file
(:mod:`fotismos.heuristic.user_shaders`, :mod:`fotismos.heuristic.glsl.shader`); a program calls
:func:`declare`; a package has an entry point of the group :data:`GROUP` whose object is a
:class:`Heuristic`. Flat and Gouraud shading are not heuristics: they interpolate any heuristic
(:mod:`fotismos.heuristic.plugins.interpolated`).
"""

import pkgutil
import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from functools import cache, cached_property
from hashlib import sha256
from importlib.metadata import entry_points
from numbers import Real
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

from fotismos.heuristic import kernel, vectors
from fotismos.heuristic.convention import Array, Visibility
from fotismos.heuristic.declared import Declared
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.lights import Extent
from fotismos.heuristic.materials import Material, check_form

GROUP = "fotismos.heuristics"

INPUTS = (
    "position", "normal", "view", "uv", "material", "ambient", "environment", "lights", "visible",
)  # fmt: skip
"""The possible needs of a heuristic; ``visible`` is a shadow ray to a light."""

RESERVED = ("ambient", "hide_emitters", "interpolation", "model", "occlusion", "prune")
"""Parameters of the integrator ``heuristic`` itself; heuristics must use other names."""

READERS = {
    ".py": "fotismos.heuristic.user_shaders:from_file",
    ".glsl": "fotismos.heuristic.glsl.shader:from_file",
}
"""The function that reads a user's file, by the file's suffix; imported at its first use.

A package adds its own by an entry point of :data:`GROUP` whose name is the suffix, such as `.osl`.
"""

OF_FUNCTION = "fotismos.heuristic.user_shaders:of_function"
SHADED = "fotismos.heuristic.user_shaders:shaded"
PREPARED = "fotismos.heuristic.user_shaders:prepared"
"""Functions that make a heuristic of a user's function, and call it; imported as late."""

_PYTHON = re.compile(r"(.+\.py)(?::(\w+))?", re.DOTALL)


class Interpolation(Enum):
    """The quantity interpolated over a face: none, the intensity, or the normal."""

    FLAT = "flat"
    GOURAUD = "gouraud"
    PHONG = "phong"


class ShadingArguments(NamedTuple):
    """The arguments of :func:`fotismos.heuristic.shade`."""

    position: Array
    normal: Array
    view: Array
    material: Material
    lights: list[Any]
    ambient: Array = 0
    visible: Visibility | None = None


@dataclass(frozen=True)
class LightAtPoint:
    """A light as it arrives at a point.

    ``toward`` is the unit vector from the point towards the light, in world space; zero on the
    light itself. ``distance`` is in units of the scene; infinite for parallel light. ``intensity``
    is ``I_p``, display-linear, with attenuation and cone: a white diffuse surface that faces the
    light has this value. ``specular_intensity`` is ``L_s`` of a light that has its own, otherwise
    the same; ``diffuse_intensity`` is another name of ``intensity``. If the integrator has
    ``occlusion``, and the heuristic does not need ``visible``, all are 0 at points that the light
    does not reach. ``extent`` is the size of the lamp in whose place the light is, 0 for others.
    """

    toward: Array
    distance: Array
    intensity: Array
    specular_intensity: Array
    extent: Extent
    _reach: Array
    _point: "Point"

    @property
    def diffuse_intensity(self) -> Array:
        """``L_d``, which is ``intensity``."""
        return self.intensity

    def visible(self) -> Array:
        """Return the mask of points that the light reaches, by a shadow ray (a need)."""
        self._point.require("visible")
        ray: Any = self._point.arguments.visible  # there is one, since it was declared
        return ray(self.toward, self._reach)


def _input(read: Callable[["Point"], Any]) -> cached_property[Any]:
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
    _environment: Callable[[Array], Array] | None = None

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
        """The material of the surface, a :class:`fotismos.heuristic.materials.PairedMaterial`.

        ``k_i``, ``k_a``, ``k_d``, ``k_s`` and ``n`` as paired, for a lobe without normalisation;
        ``base_color``, ``alpha``, ``ior`` and ``metallic`` as the physical half has them.
        """
        return self.arguments.material

    @_input
    def ambient(self) -> Array:
        """``I_a``, display-linear; of a scene with an environment its mean, without a sun."""
        return self.arguments.ambient

    def environment(self, direction: Array) -> Array:
        """Return the radiance of the background in a direction of any length, in world space.

        Display-linear: under a uniform one of 1, a white diffuse surface has the value 1. Without
        an environment it is ``I_a``.
        """
        self.require("environment")
        return self.arguments.ambient if self._environment is None else self._environment(direction)

    @_input
    def lights(self) -> tuple[LightAtPoint, ...]:
        """The scene's lights at the points, in the order of the scene."""
        return tuple(map(self._light, self.arguments.lights))

    def textbook(self, **instead: Any) -> Array:
        """Return the chapters' model at the points, :func:`fotismos.heuristic.shade`.

        Named arguments replace those given there, such as ``ambient=0``.
        """
        return kernel.shade(*self.arguments._replace(**instead))

    def _light(self, light: Any) -> LightAtPoint:
        # A heuristic that needs `visible` asks for each shadow itself.
        visible = None if "visible" in self.needs else self.arguments.visible
        toward, diffuse, specular, reach = light.illuminate(self.arguments.position, visible)
        none = type(self.arguments.position)(0)
        extent = light.extent or Extent(none.x, none, none)
        # `reach` ends at the body of a lamp, the distance at its centre.
        distance = reach + getattr(light, "shell", 0)
        return LightAtPoint(
            toward=toward,
            distance=distance,
            intensity=diffuse,
            specular_intensity=specular,
            extent=extent,
            _reach=reach,
            _point=self,
        )

    def require(self, name: str) -> None:
        """Raise InputError for an input that is not among the heuristic's needs."""
        if name not in self.needs:
            raise InputError(f"{name!r} is read, but not declared: add it to the needs.")


@dataclass(frozen=True)
class Range:
    """The bounds of a number, both allowed."""

    low: float
    high: float


@dataclass(frozen=True)
class Parameter:
    """A number that tunes a heuristic, in the heuristic's own unit; both bounds are allowed.

    ``name`` is the attribute in ``point.parameters`` and the integrator's parameter. If ``prepare``
    depends on it, it is ``prepared``: ``prepare`` gets its value as a plain keyword argument, and
    is called again when the value changes.
    """

    name: str
    default: float
    low: float
    high: float
    prepared: bool = False

    def __post_init__(self) -> None:
        if not self.name.isidentifier() or self.name in RESERVED:
            raise InputError(
                f"parameter {self.name!r} is not allowed: give a Python name other than"
                f" {', '.join(RESERVED)}."
            )
        self.checked(self.default)

    def checked(self, value: float) -> float:
        """Return a value if it is within the bounds; raise InputError otherwise."""
        if not (isinstance(value, Real) and self.low <= value <= self.high):
            allowed = f"{self.low:g} to {self.high:g}"
            raise InputError(
                f"{self.name} = {value!r} is not allowed: give a value from {allowed}."
            )
        return float(value)


@dataclass(frozen=True)
class Heuristic:
    """A way to shade the textbook half.

    ===========  ===================================================================================
    name         used in commands, records and messages: lower case, digits and hyphens; or
                 ``FILE.py:function`` or ``FILE.glsl`` for one in a file
    shade        takes a :class:`Point` and returns the display-linear colour that the viewer sees,
                 a Dr.Jit float or colour of the current variant. It is traced, not called per
                 point: use ``drjit.select``, not Python's ``if``, on arrays
    label        for people; the name if omitted
    needs        which of :data:`INPUTS` it reads. A heuristic that needs ``visible`` casts its own
                 shadows; for others the integrator may (``occlusion``)
    parameters   numbers that tune it
    prepare      ``prepare(scene)`` is called once for a Mitsuba scene, before its first sample, and
                 returns anything: a table, a depth image. Later edits of the scene do not call it
                 again. Parameters that are ``prepared`` are keyword arguments
    form         form of the specular lobe for all materials; None for each material's own
    refuse       ``refuse(scene)`` returns why it cannot shade a scene; empty if it can
    reads        what it read on trial (:func:`fotismos.heuristic.user_shaders.examine`)
    files, code  the user's files that it depends on, and a digest of their content
    traced       whether Dr.Jit can record ``shade``; otherwise it is called in evaluated loops, and
                 has no derivatives
    remarks      warnings that every record of it carries
    ===========  ===================================================================================
    """

    name: str
    shade: Callable[[Point], Array]
    label: str = ""
    needs: frozenset[str] = frozenset(INPUTS) - {"visible"}
    parameters: tuple[Parameter, ...] = ()
    prepare: Callable[..., Any] | None = None
    form: str | None = None
    refuse: Callable[[Any], str] | None = None
    reads: tuple[str, ...] = ()
    files: tuple[Path, ...] = ()
    code: str = ""
    traced: bool = True
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        is_word = self.name.replace("-", "").isalnum() and self.name == self.name.lower()
        if not is_word and not in_file(self.name):
            raise InputError(
                f"heuristic {self.name!r}: a name has lower-case letters, digits and hyphens only."
            )
        if unknown := ", ".join(sorted(set(self.needs) - set(INPUTS))):
            inputs = ", ".join(INPUTS)
            raise InputError(f"heuristic {self.name} needs {unknown}: choose from {inputs}.")
        names = [parameter.name for parameter in self.parameters]
        if len(set(names)) < len(names):
            raise InputError(f"heuristic {self.name} has two parameters of one name: {names}.")
        if self.form is not None:
            check_form(self.form)
        object.__setattr__(self, "needs", frozenset(self.needs))
        object.__setattr__(self, "label", self.label or self.name)

    def prepared(self, scene: Any, values: dict[str, float]) -> Any:
        """Prepare for a scene, with the values of all parameters, and return the result."""
        if self.refuse is not None and (reason := self.refuse(scene)):
            raise InputError(
                f"heuristic {self.name} cannot shade this scene: {reason}. Choose another one."
            )
        if self.prepare is None:
            return None
        if self.is_builtin:
            return self.prepare(scene, **values)
        return pkgutil.resolve_name(PREPARED)(self.name, self.prepare, scene, values)

    def digest(self) -> str | None:
        """Return what identifies the code: a name of the package's, or a digest of GLSL.

        None for a user's Python, which may read files that nobody knows of, and for GLSL with a
        table that such Python makes.
        """
        if self.is_builtin:
            return self.name
        return self.code if self.name.endswith(".glsl") and len(self.files) == 1 else None

    def evaluate(
        self,
        arguments: ShadingArguments,
        uv: Array,
        parameters: dict[str, Array],
        prepared: Any,
        wavelengths: Array = (),
        environment: Callable[[Array], Array] | None = None,
    ) -> Array:
        """Return the colour at points; InputError if a user's function fails or gives none."""
        tuned = SimpleNamespace(**parameters)
        point = Point(
            needs=self.needs,
            arguments=arguments,
            _uv=uv,
            parameters=tuned,
            prepared=prepared,
            wavelengths=wavelengths,
            _environment=environment,
        )
        if self.is_builtin:
            return self.shade(point)
        return pkgutil.resolve_name(SHADED)(self.name, self.shade, point)

    @property
    def inputs(self) -> tuple[str, ...]:
        """What it read on trial, or else its needs."""
        return self.reads or tuple(sorted(self.needs))

    @property
    def is_builtin(self) -> bool:
        """Whether the package itself declares it."""
        return HEURISTICS.is_builtin(self)


HEURISTICS: Declared[Heuristic] = Declared(
    "heuristic",
    GROUP,
    phong="fotismos.heuristic.heuristics:PHONG",
    blinn="fotismos.heuristic.heuristics:BLINN",
    shadow_map="fotismos.heuristic.shadow_maps:MAP",
    hemisphere_ambient="fotismos.heuristic.indirect_light:HEMISPHERE",
    vtk="fotismos.heuristic.plotting:VTK",
    mujoco="fotismos.heuristic.plotting:MUJOCO",
    matplotlib="fotismos.heuristic.plotting:MATPLOTLIB",
    pygfx="fotismos.heuristic.plotting:PYGFX",
)
"""All heuristics."""

declare = HEURISTICS.declare
"""Declare a heuristic in this process, and return it."""


def named(name: str) -> Heuristic:
    """Return a declared heuristic, or the one in a user's file."""
    if file := in_file(name):
        heuristic: Heuristic = pkgutil.resolve_name(readers()[Path(file[0]).suffix])(name)
        return heuristic
    if name not in HEURISTICS:
        raise InputError(
            f"heuristic {name!r} is not declared: choose one of {', '.join(sorted(HEURISTICS))}, or"
            " give a file with a function `shade(point)`, as FILE.py, FILE.py:FUNCTION or"
            " FILE.glsl. A package declares its own by an entry point of the group"
            f" {GROUP}, a program by fotismos.declare."
        )
    return HEURISTICS[name]


def known_as(heuristic: "str | Heuristic | Callable[[Point], Array]") -> str:
    """Return the name of a heuristic; declare one that is given as an object or a function.

    A function defined in a notebook or program is known only in its process.
    """
    if isinstance(heuristic, str):
        return heuristic
    if not isinstance(heuristic, Heuristic):
        name = getattr(heuristic, "__name__", "shade").lower().replace("_", "-").strip("-")
        heuristic = pkgutil.resolve_name(OF_FUNCTION)(heuristic, name)
    return str(declare(heuristic).name)


def in_file(name: str) -> tuple[str, str] | None:
    """Return the file and the function of a name ``FILE.py:function``, None for others.

    The function is empty if the name has none, such as ``FILE.glsl``.
    """
    if match := _PYTHON.fullmatch(name):
        return match[1], match[2] or ""
    suffix = Path(name).suffix
    return (name, "") if suffix and suffix in readers() else None


@cache
def readers() -> dict[str, str]:
    """Return :data:`READERS` and those of installed packages."""
    entries = entry_points(group=GROUP)
    return {entry.name: entry.value for entry in entries if entry.name[:1] == "."} | READERS


def content_digest(files: Iterable[Path]) -> str:
    """Return a digest of the content of files; a missing file counts, too."""
    whole = sha256()
    for file in sorted(files):
        content = file.read_bytes() if file.is_file() else b"gone"
        whole.update(f"{len(content)} ".encode() + content)
    return whole.hexdigest()


_READ = frozenset(INPUTS) - {"uv", "environment", "visible"}
PHONG = Heuristic(name="phong", shade=Point.textbook, label="Phong", needs=_READ)
BLINN = Heuristic(name="blinn", shade=Point.textbook, label="Blinn", needs=_READ, form="blinn")
