"""Heuristics made of plain functions, in files or programs: parameters, needs, and a trial.

A file is named as ``FILE.py`` or ``FILE.py:function``; the function is ``shade`` unless another is
named, or a :class:`fotismos.heuristic.heuristics.Heuristic`. A function ``prepare`` beside it makes
what it needs of a scene. Every process finds the same heuristic by the same words, and reads a
changed file again::

    import drjit as dr
    from fotismos.heuristic import Range

    def shade(point, steps: Range(1, 8) = 3):
        value = point.ambient * point.material.k_a
        for light in point.lights:
            cosine = dr.maximum(dr.dot(point.normal, light.toward), 0)
            value += point.material.k_d * light.intensity * dr.ceil(cosine * steps) / steps
        return value

The trial shades :data:`POINTS` points under two lights, seen from many sides. It finds code that
fails or gives infinite or negative values in most scenes, and what the code reads.
"""

import inspect
import os
import runpy
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import wraps
from math import inf, isfinite
from numbers import Real
from pathlib import Path
from types import SimpleNamespace
from typing import Any, get_args

import drjit as dr
import mitsuba as mi
import numpy as np
from numpy.random import default_rng

from fotismos.heuristic import plugins
from fotismos.heuristic.errors import FotismosError, InputError, suggestion, type_of
from fotismos.heuristic.heuristics import (
    INPUTS,
    Heuristic,
    Parameter,
    Point,
    Range,
    ShadingArguments,
    content_digest,
    in_file,
)
from fotismos.heuristic.lights import DirectionalLight, PointLight
from fotismos.heuristic.materials import PairedMaterial
from fotismos.heuristic.user_code import contained, error_text, first_error, place_of, same_variant

FUNCTION = "shade"
"""Name of the function, if omitted."""

MODULE = "_shading_of_a_user"
"""Module of a file's functions: a name that does not hide another."""

POINTS = 256
"""Points of a trial: normals towards the viewer, lights on both sides, all kinds of materials."""

DEFAULT_VARIANT = "llvm_ad_rgb"

ROUNDING = 1e-5
"""A value below 0 by less than this, in units of display white, is a rounding error."""

_known: dict[tuple[str, str, str | None], Heuristic] = {}


def from_file(word: str) -> Heuristic:
    """Return the heuristic that a word names, for the current variant of Mitsuba."""
    name, function = in_file(word) or (word, "")
    path = Path(name)
    function = function or FUNCTION
    key = word, os.path.realpath(path), mi.variant()  # `resolve` fails for links that go round
    known = _known.get(key)
    if known is None or known.code != content_digest(known.files):
        _known[key] = known = _read(word, path, function)
    return known


def forget() -> None:
    """Forget all files: what else they read may have changed."""
    _known.clear()


def names_of(path: Path, content: str) -> dict[str, Any]:
    """Run a user's file and return its names; InputError tells the ``content`` that it needs."""
    if not path.is_file():
        raise InputError(f"{path}: there is no such file. Give a Python file {content}.")
    try:
        with same_variant():
            return runpy.run_path(str(path.resolve()), run_name=MODULE)
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        raise InputError(f"{error_text(error)}. Correct {path}, a file {content}.") from error


def _read(word: str, path: Path, function: str) -> Heuristic:
    with contained(path) as modules:
        names = names_of(path, f"with a function `{FUNCTION}(point)`, as FILE.py, or FILE.py:NAME")
        if function not in names:
            raise _missing(names, function, path)
        label = path.stem if function == FUNCTION else function
        heuristic = of_function(names[function], word, label, names.get("prepare"))
    files = tuple(sorted({path.resolve(), *modules}))
    return replace(heuristic, files=files, code=content_digest(files))


def _missing(names: dict[str, Any], function: str, path: Path) -> InputError:
    functions = [
        name
        for name, value in names.items()
        if getattr(value, "__module__", None) == MODULE and callable(value)
    ]
    has = (
        f"It has {', '.join(functions)}: give {path}:{functions[0]}."
        if functions
        else "It has none."
    )
    return InputError(
        f"{path}: there is no function `{function}`{suggestion(function, functions)}. {has}"
        f" A heuristic is a function `{FUNCTION}(point)` that returns a colour."
    )


def of_function(
    function: Any, name: str, label: str = "", prepare: Callable[[Any], Any] | None = None
) -> Heuristic:
    """Return a user's function or object as a heuristic, after a trial.

    The function takes a :class:`Point`, and numbers with a default: these are the parameters, and a
    :class:`Range` as annotation gives their bounds. A :class:`Heuristic` keeps its own label and
    preparation, and is tried if it has none; a function has ``prepare``, on trial, too.
    """
    if isinstance(function, Heuristic):
        renamed = replace(function, name=name)
        return renamed if renamed.prepare else replace(renamed, reads=examine(renamed))
    if not callable(function):
        raise InputError(
            f"{name} is of type {type(function).__name__}: give a function of a point that returns"
            " a colour, or a fotismos.heuristic.Heuristic."
        )
    parameters = _parameters(function)
    names = [parameter.name for parameter in parameters]

    @wraps(function)
    def shade(point: Point) -> Any:
        return function(point, **{name: getattr(point.parameters, name) for name in names})

    # On trial everything may be read; what is read becomes the needs.
    everything = Heuristic(
        name=name,
        shade=shade,
        label=label,
        needs=frozenset(INPUTS),
        parameters=parameters,
        prepare=prepare,
    )
    read = examine(everything)
    needs = {part.partition(".")[0] for part in read} & set(INPUTS)
    remarks = powers_of_zero(everything) if "material.n" in read else ()
    return replace(everything, needs=frozenset(needs), reads=read, remarks=remarks)


def _parameters(function: Callable[..., Any]) -> tuple[Parameter, ...]:
    """Return the parameters of a function: its arguments besides the point."""
    try:
        signature = inspect.signature(function, eval_str=True)
    except (TypeError, ValueError, NameError) as error:
        raise InputError(f"{place_of(function)}: its signature cannot be read: {error}.") from error
    arguments = list(signature.parameters.values())
    positional = inspect.Parameter.POSITIONAL_ONLY, inspect.Parameter.POSITIONAL_OR_KEYWORD
    if not arguments or arguments[0].kind not in positional:
        raise _unusable(function, "it does not take a point")
    return tuple(_parameter(function, argument) for argument in arguments[1:])


def _parameter(function: Callable[..., Any], argument: inspect.Parameter) -> Parameter:
    if argument.kind in (argument.VAR_POSITIONAL, argument.VAR_KEYWORD, argument.POSITIONAL_ONLY):
        raise _unusable(function, f"{argument} is not a number")
    is_number = isinstance(argument.default, Real) and not isinstance(argument.default, bool)
    if not (is_number and isfinite(argument.default)):
        raise _unusable(function, f"{argument.name!r} has no number as its default")
    parts = argument.annotation, *get_args(argument.annotation)
    bounds = next((part for part in parts if isinstance(part, Range)), Range(-inf, inf))
    try:
        return Parameter(
            name=argument.name, default=float(argument.default), low=bounds.low, high=bounds.high
        )
    except InputError as error:
        raise InputError(f"{place_of(function)}: {error}") from error


def _unusable(function: Callable[..., Any], reason: str) -> InputError:
    return InputError(
        f"{place_of(function)}: {reason}. Write a function such as `{function.__name__}(point,"
        " gloss: Range(0, 1) = 0.5)`: it takes the points, and numbers with a default."
    )


def shaded(name: str, shade: Callable[[Point], Any], point: Point) -> Any:
    """Return the colour that a user's function gives at points, as a spectrum of the variant.

    InputError names file and line if it fails or does not return a colour.
    """
    with _explained(name, shade):
        value = shade(point)
    if isinstance(value, Real) and not isinstance(value, bool):
        return mi.Spectrum(value)
    components = dr.size_v(mi.Spectrum)
    returned = f"{place_of(shade)}: heuristic {name} returned"
    expected = (
        f"return one colour per point, as a Dr.Jit array: a mitsuba.Spectrum of {components}"
        " components, or a mitsuba.Float"
    )
    is_array = dr.is_array_v(value) and dr.is_jit_v(value) and dr.is_float_v(value)
    depth = dr.depth_v(value) if is_array else 0
    if not (depth == 1 or (depth == 2 and dr.size_v(value) == components)):
        raise InputError(f"{returned} a value {type_of(value)}; {expected}.")
    if not dr.flag(dr.JitFlag.SymbolicScope):
        width = dr.width(value)
        points = dr.width(point.arguments.position)
        if width not in (1, points):
            raise InputError(f"{returned} {width} values for {points} points; {expected}.")
    return mi.Spectrum(value)


def prepared(
    name: str, prepare: Callable[..., Any], scene: Any, values: Mapping[str, float]
) -> Any:
    """Return what a user's function prepares for a scene; InputError names file and line."""
    with _explained(name, prepare):
        return prepare(scene, **values)


@contextmanager
def _explained(name: str, function: Callable[..., Any]) -> Iterator[None]:
    """Call a user's function in the block: errors name its file and line, and the variant stays."""
    variant = mi.variant()
    try:
        with np.errstate():
            yield
    except FotismosError as error:
        where, line, _ = error_text(error).partition(f"{type(error).__name__}: ")
        raise type(error)(f"{where if line else ''}{error}") from error
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        raise InputError(f"{error_text(error)} (heuristic {name}).{_advice(error)}") from error
    if mi.variant() != variant:
        changed = mi.variant()
        mi.set_variant(variant)
        raise InputError(
            f"{place_of(function)}: heuristic {name} switched Mitsuba to {changed}, but the"
            f" comparison is in {variant}. Remove its mitsuba.set_variant: the variant is an option"
            " of the comparison."
        )


def _advice(error: BaseException) -> str:
    """Return advice for the most frequent mistakes: a branch on an array, and NumPy."""
    text = f"{error} {first_error(error)}"
    if "not aligned" in text:  # NumPy's words
        return " For arrays of Dr.Jit use drjit.dot in place of numpy.dot."
    if "bool" in text:
        return (
            " All points are shaded at once: in place of `if` use drjit.select(condition, a, b),"
            " in place of `and`, `or` and `not` the operators &, | and ~, in place of max()"
            " drjit.maximum()."
        )
    return ""


def examine(heuristic: Heuristic) -> tuple[str, ...]:
    """Try a heuristic, and return what it reads.

    Inputs are those of :data:`fotismos.heuristic.heuristics.INPUTS`; the parts of the material are
    named, too, such as ``material.k_d``. InputError if it fails, or returns something that is not a
    colour, not finite or negative.
    """
    if mi.variant() is None:
        mi.set_variant(DEFAULT_VARIANT)
    point = _prepared(heuristic, trial_points(heuristic))
    colours = _colours(heuristic, point)
    is_finite = np.isfinite(colours)
    if not is_finite.all():
        _require_finite_powers(heuristic, point)
    _require(heuristic, is_finite, colours, "finite")
    _require(heuristic, colours >= -ROUNDING, colours, "0 or more")
    return tuple(sorted(point.read))


def powers_of_zero(heuristic: Heuristic) -> tuple[str, ...]:
    """Return a warning if a material with ``n = 0`` is NaN, as 0 to the power of 0 is in Dr.Jit."""
    point = _prepared(heuristic, trial_points(heuristic))
    flat = replace(point.arguments.material, n=mi.Float(np.zeros(POINTS)))
    point = replace(point, arguments=point.arguments._replace(material=flat))
    count = int(np.isnan(_colours(heuristic, point)).any(axis=0).sum())
    if not count:
        return ()
    return (
        f"{heuristic.label}: it is NaN at {count} of {POINTS} points of materials with n = 0, since"
        " Dr.Jit has NaN for 0 to the power of 0. Keep the bases of powers above 0, as by"
        " drjit.maximum(x, 1e-6).",
    )


def _prepared(heuristic: Heuristic, point: "TrialPoint") -> "TrialPoint":
    """Return points with what a heuristic prepares for the scene of a trial."""
    if heuristic.prepare is None:
        return point
    numbers = {one.name: one.default for one in heuristic.parameters if one.prepared}
    return replace(point, prepared=heuristic.prepared(trial_scene(0.5), numbers))


def _colours(heuristic: Heuristic, point: Point) -> np.ndarray:
    """Return the colours (components, points) of a heuristic."""
    value = shaded(heuristic.name, heuristic.shade, point)
    colours = np.array(value, float).reshape(dr.size_v(mi.Spectrum), -1)
    return np.broadcast_to(colours, (len(colours), POINTS))


def _require_finite_powers(heuristic: Heuristic, point: Point) -> None:
    """Say why a heuristic is not finite, if the lights' distance is why, or a large power."""

    def is_finite(kind: type) -> bool:
        """Whether it is finite under the lights of a kind, if the exponent is 1."""
        lights = [light for light in point.arguments.lights if isinstance(light, kind)]
        material = replace(point.arguments.material, n=mi.Float(1.0))
        arguments = point.arguments._replace(lights=lights, material=material)
        value = shaded(heuristic.name, heuristic.shade, replace(point, arguments=arguments))
        return bool(np.isfinite(np.array(value, float)).all())

    if not is_finite(PointLight):
        return
    reason = (
        "under a power: a cosine is above 1. Normalise every vector of it."
        if is_finite(DirectionalLight)
        else "under a parallel light, whose distance is infinite. Do not multiply by the distance:"
        " `toward` is a unit vector, and `intensity` has fallen off already."
    )
    raise InputError(
        f"{place_of(heuristic.shade)}: heuristic {heuristic.name} is not finite {reason}"
    )


@dataclass(frozen=True)  # hashable, like what it imitates
class _WatchedMaterial:
    """A material that notes which of its attributes are read."""

    _inner: Any
    _note: Callable[[str], Any]

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._inner, name)
        self._note(f"material.{name}")
        return value


@dataclass(frozen=True)
class TrialPoint(Point):
    """Points that note in ``read`` which of their inputs are read."""

    read: set[str] = field(default_factory=set)

    def require(self, name: str) -> None:
        super().require(name)
        self.read.add(name)

    @property
    def material(self) -> Any:
        return _WatchedMaterial(Point.material.func(self), self.read.add)


TrialPoint.__name__ = "Point"  # for users' AttributeErrors


def trial_points(heuristic: Heuristic) -> TrialPoint:
    """Return the points of a trial."""
    random = default_rng(8)

    def numbers(low: float, high: float) -> Any:
        return mi.Float(random.uniform(low, high, POINTS))

    def colour(high: float) -> Any:
        return mi.Spectrum(*(numbers(0, high) for _ in range(dr.size_v(mi.Spectrum))))

    # Unit vectors (256, 3), each view on the side of its normal.
    normal, view = random.normal(size=(2, POINTS, 3))
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    view *= np.sign(np.sum(normal * view, axis=1))[:, None]
    view[:8] = normal[:8]  # seen head on
    position = random.uniform(-1, 1, (POINTS, 3))
    position[8:16] = -4 * normal[8:16]  # the directional light is along the normal, or against it
    material = PairedMaterial(
        **{name: colour(1) for name in ("k_i", "k_a", "k_d", "k_s", "base_color")},
        n=numbers(1, 100),
        alpha=numbers(0.05, 1),
        ior=numbers(1, 2.5),
        metallic=mi.Float(np.resize([0.0, 0.0, 0.5, 1.0], POINTS)),
    )
    intensity = mi.Spectrum(mi.Float(np.full(POINTS, 0.8)))
    arguments = ShadingArguments(
        position=mi.Vector3f(position.T),
        normal=mi.Vector3f(normal.T),
        view=mi.Vector3f(view.T),
        material=material,
        lights=[
            PointLight((2.0, 1.0, 3.0), intensity, (0, 0, 1)),
            DirectionalLight((1.0, 2.0, -1.0), intensity),
        ],
        ambient=colour(0.5),
        visible=lambda toward, distance: numbers(0, 1) > 0.5,
    )
    uv = mi.Point2f(numbers(0, 1), numbers(0, 1))
    parameters = {parameter.name: mi.Float(parameter.default) for parameter in heuristic.parameters}
    return TrialPoint(
        needs=heuristic.needs,
        arguments=arguments,
        _uv=uv,
        parameters=SimpleNamespace(**parameters),
        _environment=lambda direction: mi.Spectrum(0.5) * (1 + 0 * mi.Vector3f(direction).x),
    )


def dark_scene() -> Any:
    """Return a scene without any light: a white square."""
    return mi.load_dict(_square(), optimize=False)


def trial_scene(radiance: float) -> Any:
    """Return the scene that is prepared on trial: a white square, one light, a background."""
    lights = {
        "light": {"type": "heuristic_directional", "direction": [0, 0, -1], "intensity": 1.0},
        "background": {"type": "constant", "radiance": radiance},
    }
    return mi.load_dict(_square() | lights, optimize=False)


def _square() -> dict[str, Any]:
    plugins.register()
    return {
        "type": "scene",
        "sensor": {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at((0, -2, 2), (0, 0, 0), (0, 0, 1)),
            "film": {"type": "hdrfilm", "width": 16, "height": 16},
        },
        "square": {"type": "rectangle", "bsdf": {"type": "phong", "k_a": 1.0, "k_d": 1.0}},
    }


def _require(
    heuristic: Heuristic, is_right: np.ndarray, colours: np.ndarray, expected: str
) -> None:
    """Reject wrong colours (components, points) on trial, naming one of them."""
    wrong = np.flatnonzero(~is_right.all(axis=0))
    if not wrong.size:
        return
    shown = ", ".join(f"{component:.3g}" for component in colours[:, wrong[0]])
    maximum = "max" if heuristic.name.endswith(".glsl") else "drjit.maximum"
    cure = f"Clamp what can be negative, such as a cosine: {maximum}(cosine, 0)."
    if expected == "finite":
        cure = (
            "Keep divisors, roots, logarithms and the bases of powers above 0, as by"
            f" {maximum}(x, 1e-6)."
        )
    raise InputError(
        f"{place_of(heuristic.shade)}: heuristic {heuristic.name} returned ({shown}) on trial, and"
        f" wrong values at {wrong.size} of {POINTS} points; components must be {expected}. {cure}"
    )
