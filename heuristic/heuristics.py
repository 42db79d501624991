"""Heuristics: ways to shade the first half of a pair, each one declaration.

A heuristic is a function of a :class:`Point` that returns the colour seen there. ``phong`` and
``blinn`` are here, those of engines in :mod:`heuristic.stand_ins`. Users write a function in a file
(:mod:`heuristic.shading_files`, :mod:`heuristic.glsl`); a program calls :func:`declare`; a package
has an entry point of the group :data:`GROUP` whose object is a :class:`Heuristic`. Flat and Gouraud
shading are not heuristics: they interpolate any heuristic (:mod:`heuristic.interpolation`).
"""

import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from hashlib import sha256
from numbers import Real
from pathlib import Path
from types import SimpleNamespace
from typing import Any

from heuristic.declared import Declared
from heuristic.errors import InputError
from heuristic.materials import check_form
from heuristic.points import INPUTS, Array, Given, Point

GROUP = "fotismos.heuristics"

RESERVED = ("ambient", "hide_emitters", "interpolation", "model", "occlusion", "prune")
"""Parameters of the integrator ``heuristic`` itself; heuristics must use other names."""


THREE = "three:"
"""Prefix of the names of three.js' heuristics."""


@dataclass(frozen=True)
class Range:
    """The bounds of a number, both allowed."""

    low: float
    high: float


@dataclass(frozen=True)
class Parameter:
    """A number that tunes a heuristic.

    Parameters
    ----------
    name
        A Python name, for the attribute in ``point.parameters`` and the integrator's parameter.
    default, low, high
        In the heuristic's own unit; both bounds are allowed.
    prepared
        Whether ``prepare`` depends on it. It then gets the value as a plain keyword argument, and
        is called again when the value changes.

    Raises
    ------
    InputError
        If the default is out of bounds, or the name cannot be used.
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
    """A way to shade the heuristic half.

    Parameters
    ----------
    name
        Used in commands, records and messages: lower case, digits and hyphens; or
        ``FILE.py:function`` or ``FILE.glsl`` for one in a file, or ``three:KIND`` for three.js.
    shade
        ``shade(point)`` takes a :class:`Point` and returns the display-linear colour that the
        viewer sees, a Dr.Jit float or colour of the current variant. It is traced, not called per
        point: use ``drjit.select``, not Python's ``if``, on arrays.
    label
        For people; the name if omitted.
    needs
        Which of :data:`INPUTS` it reads; all but ``visible`` if omitted. A heuristic that needs
        ``visible`` casts its own shadows; for others the integrator may (``occlusion``).
    parameters
        Numbers that tune it.
    prepare
        ``prepare(scene)`` is called once for a Mitsuba scene, before its first sample, and returns
        anything: a table, a depth image. Later edits of the scene do not call it again. Parameters
        that are ``prepared`` are keyword arguments.
    refuse
        ``refuse(scene)`` returns why it cannot shade a scene, such as "there is no environment";
        empty if it can.
    form
        Form of the specular lobe for all materials; None for each material's own.
    reads
        What it read on trial (:func:`heuristic.trial.examine`), such as ``material.k_d``.
    code
        Digest of its files, if known.
    traced
        Whether Dr.Jit can record ``shade``. A function that evaluates its arrays is called in
        evaluated loops, and has no derivatives.
    remarks
        Warnings that every record of it carries.

    Raises
    ------
    InputError
        For an invalid name, unknown needs or form, or two parameters of one name.
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
    code: str = ""
    traced: bool = True
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        word = self.name.removeprefix(THREE).replace("-", "")
        is_word = word.isalnum() and self.name == self.name.lower()
        if not is_word and not in_file(self.name):
            raise InputError(
                f"heuristic {self.name!r}: a name has lower-case letters, digits and hyphens only."
            )
        if unknown := ", ".join(sorted(set(self.needs) - set(INPUTS))):
            known = ", ".join(INPUTS)
            raise InputError(f"heuristic {self.name} needs {unknown}: choose from {known}.")
        names = [parameter.name for parameter in self.parameters]
        if len(set(names)) < len(names):
            raise InputError(f"heuristic {self.name} has two parameters of one name: {names}.")
        if self.form is not None:
            check_form(self.form)
        object.__setattr__(self, "needs", frozenset(self.needs))
        object.__setattr__(self, "label", self.label or self.name)

    def prepared(self, scene: Any, values: dict[str, float]) -> Any:
        """Prepare for a scene, with the values of all parameters, and return the result.

        Raises
        ------
        InputError
            With the reason why it cannot shade the scene.
        """
        if self.refuse is not None and (reason := self.refuse(scene)):
            raise InputError(
                f"heuristic {self.name} cannot shade this scene: {reason}. Choose another one."
            )
        return self.prepare(scene, **values) if self.prepare is not None else None

    def digest(self) -> str:
        """Return a digest of the files that ``shade`` and ``prepare`` are in."""
        if self.code:
            return self.code
        modules = {function.__module__ for function in (self.shade, self.prepare) if function}
        files = [getattr(sys.modules[module], "__file__", None) for module in sorted(modules)]
        return sha256(b"".join(Path(file).read_bytes() for file in files if file)).hexdigest()

    def evaluate(
        self,
        given: Given,
        uv: Array,
        parameters: dict[str, Array],
        prepared: Any,
        wavelengths: Array = (),
    ) -> Array:
        """Return the colour at points; :class:`Point` passes the arguments on.

        Raises
        ------
        InputError
            If a user's heuristic fails, or does not return a colour.
        """
        tuned = SimpleNamespace(**parameters)
        point = Point(self.needs, given, uv, tuned, prepared, wavelengths)
        if self.is_own:
            return self.shade(point)
        from heuristic import trial  # built-in heuristics do not need it

        return trial.shaded(self, point)

    @property
    def inputs(self) -> tuple[str, ...]:
        """What it read on trial, or else its needs."""
        return self.reads or tuple(sorted(self.needs))

    @property
    def is_own(self) -> bool:
        """Whether the package itself declares it."""
        return HEURISTICS.is_own(self)


HEURISTICS: Declared[Heuristic] = Declared("heuristic", GROUP, home="heuristic.stand_ins")
"""All heuristics, by name."""

declare = HEURISTICS.declare
"""Declare a heuristic in this process, and return it."""


def named(name: str) -> Heuristic:
    """Return a declared heuristic.

    Raises
    ------
    InputError
        If none has the name, an entry point cannot be loaded, or a file cannot be used.
    """
    if name.endswith(GLSL):
        from heuristic.glsl import shader_files

        return shader_files.opened(name)
    if name.startswith(THREE):
        from heuristic.three_js import three_heuristics

        return three_heuristics.opened(name)
    if in_file(name):
        from heuristic import shading_files

        return shading_files.opened(name)
    if name not in HEURISTICS:
        raise InputError(
            f"heuristic {name!r} is not declared: choose one of {', '.join(sorted(HEURISTICS))}, or"
            " give a file with a function `shade(point)`, as FILE.py, FILE.py:FUNCTION or"
            " FILE.glsl. A package declares its own by an entry point of the group"
            f" {GROUP}, a program by heuristic.heuristics.declare."
        )
    return HEURISTICS[name]


def known_as(given: "str | Heuristic | Callable[[Point], Array]") -> str:
    """Return the name of a heuristic; declare one that is given as an object or a function.

    A function defined in a notebook or program is known only in its process.
    """
    if isinstance(given, str):
        return given
    if not isinstance(given, Heuristic):
        name = getattr(given, "__name__", "shade").lower().replace("_", "-").strip("-")
        from heuristic.functions import heuristic_of

        given = heuristic_of(given, name)
    return declare(given).name


GLSL = ".glsl"
"""Suffix of the names of heuristics in GLSL."""

_WORDS = re.compile(r"(.+\.py)(?::(\w+))?|(.+\.glsl)", re.DOTALL)


def in_file(name: str) -> tuple[str, str] | None:
    """Return the file and the function of a name ``FILE.py:function``, None for others.

    The function is empty if the name has none, such as ``FILE.glsl``.
    """
    found = _WORDS.fullmatch(name)
    return found and (found[1] or found[3], found[2] or "")


_READ = frozenset(INPUTS) - {"uv", "visible"}
PHONG = HEURISTICS.own(Heuristic("phong", Point.textbook, "Phong", _READ))
BLINN = HEURISTICS.own(Heuristic("blinn", Point.textbook, "Blinn", _READ, form="blinn"))
