"""Calling users' heuristics: on trial before any scene, with clear messages for mistakes.

The trial shades :data:`POINTS` points under two lights, seen from many sides. It finds code that
fails or gives infinite or negative values in most scenes, and what the code reads.
"""

from collections.abc import Callable
from dataclasses import dataclass
from numbers import Real
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import drjit as dr
import numpy as np

from heuristic.errors import FotismosError, InputError
from heuristic.materials import PairedMaterial
from heuristic.points import Given, Point
from heuristic.user_code import defined, told

if TYPE_CHECKING:
    from heuristic.heuristics import Heuristic

POINTS = 256
"""Points of a trial: normals towards the viewer, lights on both sides, all kinds of materials."""

DEFAULT_VARIANT = "llvm_ad_rgb"

ROUNDING = 1e-5
"""A value below 0 by less than this, in units of display white, is a rounding error."""


def shaded(heuristic: "Heuristic", point: Point) -> Any:
    """Return the colour that a heuristic gives at points, as a spectrum of the current variant.

    Raises
    ------
    InputError
        If it fails or does not return a colour; the message names file and line.
    """
    try:
        value = heuristic.shade(point)
    except FotismosError as error:
        where, line, _ = told(error).partition(f"{type(error).__name__}: ")
        raise type(error)(f"{where if line else ''}{error}") from error
    except (Exception, SystemExit) as error:  # a user's code may raise anything
        raise InputError(f"{told(error)} (heuristic {heuristic.name}).{_advice(error)}") from error
    _require_colour(heuristic, value, point)
    import mitsuba as mi

    return mi.Spectrum(value)


def examine(heuristic: "Heuristic") -> tuple[str, ...]:
    """Try a heuristic, and return what it reads.

    Inputs have the names of :data:`heuristic.points.INPUTS`; the parts of the material are named
    too, such as ``material.k_d``.

    Raises
    ------
    InputError
        If it fails, or returns something that is not a colour, not finite or negative.
    """
    import mitsuba as mi

    if mi.variant() is None:
        mi.set_variant(DEFAULT_VARIANT)
    read: dict[str, None] = {}
    point, described = _points(heuristic, read)
    value = shaded(heuristic, point)
    colours = np.array(mi.Spectrum(value), float).reshape(dr.size_v(mi.Spectrum), -1)
    colours = np.broadcast_to(colours, (len(colours), POINTS))
    _require(heuristic, np.isfinite(colours), colours, described, "finite")
    _require(heuristic, colours >= -ROUNDING, colours, described, "0 or more")
    return tuple(sorted(read))


@dataclass(frozen=True)  # hashable, like what it imitates
class _Watched:
    """Notes which attributes of an object are read."""

    _inner: Any
    _note: Callable[[str], None]

    def __getattr__(self, name: str) -> Any:
        value = getattr(self._inner, name)
        self._note(f"material.{name}")
        return value


class _Trial(Point):
    """Points that note which of their inputs are read, of those that the heuristic declares."""

    def require(self, name: str) -> None:
        super().require(name)
        self.prepared[name] = None

    @property
    def material(self) -> Any:
        found = Point.material.func(self)
        return _Watched(found, lambda name: self.prepared.setdefault(name))


_Trial.__name__ = "Point"  # for users' AttributeErrors


def _points(heuristic: "Heuristic", read: dict[str, None]) -> tuple[Point, Callable[[int], str]]:
    """Return the points of a trial, and a function that describes one of them."""
    import mitsuba as mi

    from heuristic.lights import DirectionalLight, PointLight

    random = np.random.default_rng(8)

    def numbers(low: float, high: float) -> Any:
        return mi.Float(random.uniform(low, high, POINTS))

    def colour(high: float) -> Any:
        return mi.Spectrum(*(numbers(0, high) for _ in range(dr.size_v(mi.Spectrum))))

    def directions(count: int) -> np.ndarray:
        found = random.normal(size=(count, 3))
        return found / np.linalg.norm(found, axis=1, keepdims=True)

    normal, view = directions(POINTS), directions(POINTS)
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
    lights = [
        PointLight((2.0, 1.0, 3.0), intensity, (0, 0, 1)),
        DirectionalLight((1.0, 2.0, -1.0), intensity),
    ]
    position_, normal_, view_ = (mi.Vector3f(values.T) for values in (position, normal, view))
    given = Given(
        position_, normal_, view_, material, lights, colour(0.5),
        lambda toward, distance: numbers(0, 1) > 0.5,
    )  # fmt: skip
    uv = mi.Point2f(numbers(0, 1), numbers(0, 1))
    parameters = {each.name: mi.Float(each.default) for each in heuristic.parameters}
    point = _Trial(heuristic.needs, given, uv, SimpleNamespace(**parameters), read)

    def described(number: int) -> str:
        cosines = [
            f"N.L = {np.array(dr.dot(normal_, light.illuminate(position_).toward))[number]:.3g}"
            for light in lights
        ]
        facing = np.sum(normal[number] * view[number])
        rough = np.array(material.alpha)[number], np.array(material.n)[number]
        return (
            f"N.V = {facing:.3g}, {' and '.join(cosines)} for its two lights, alpha ="
            f" {rough[0]:.3g}, n = {rough[1]:.3g}"
        )

    return point, described


def _require(
    heuristic: "Heuristic",
    is_right: np.ndarray,
    colours: np.ndarray,
    described: Callable[[int], str],
    expected: str,
) -> None:
    """Reject wrong colours (components, points) on trial, naming one of them."""
    wrong = np.flatnonzero(~is_right.all(axis=0))
    if not wrong.size:
        return
    shown = ", ".join(f"{component:.3g}" for component in colours[:, wrong[0]])
    raise InputError(
        f"{defined(heuristic.shade)}: heuristic {heuristic.name} returned ({shown}) on trial, and"
        f" wrong values at {wrong.size} of {POINTS} points; components"
        f" must be {expected}. One of the points: {described(wrong[0])}."
        f" {_cure(heuristic, expected)}"
    )


def _cure(heuristic: "Heuristic", expected: str) -> str:
    maximum = "max" if heuristic.name.endswith(".glsl") else "drjit.maximum"
    if expected == "finite":
        return f"Keep divisors, roots and logarithms above 0, as by {maximum}(x, 1e-6)."
    return f"Clamp what can be negative, such as a cosine: {maximum}(cosine, 0)."


def _require_colour(heuristic: "Heuristic", value: Any, point: Point) -> None:
    """Reject anything but one number or colour per point."""
    import mitsuba as mi

    components = dr.size_v(mi.Spectrum)
    expected = (
        f"return one colour per point, as a Dr.Jit array: a mitsuba.Spectrum of {components}"
        " components, or a mitsuba.Float"
    )
    if isinstance(value, Real) and not isinstance(value, bool):
        return
    is_array = dr.is_array_v(value) and dr.is_jit_v(value) and dr.is_float_v(value)
    shape = dr.depth_v(value) if is_array else 0
    if not (shape == 1 or (shape == 2 and dr.size_v(value) == components)):
        raise InputError(
            f"{defined(heuristic.shade)}: heuristic {heuristic.name} returned {_kind(value)};"
            f" {expected}."
        )
    if dr.flag(dr.JitFlag.SymbolicScope):
        return
    width, points = dr.width(value), dr.width(point.given.position)
    if width not in (1, points):
        raise InputError(
            f"{defined(heuristic.shade)}: heuristic {heuristic.name} returned {width} values for"
            f" {points} points; {expected}."
        )


def _kind(value: Any) -> str:
    kind = f"{type(value).__module__}.{type(value).__qualname__}".replace("builtins.", "")
    if isinstance(value, (list, tuple)):
        return f"a {kind} of {len(value)}"
    if isinstance(value, np.ndarray):
        return f"a {kind} of shape {value.shape}"
    return "None" if value is None else f"a {kind}"


def _advice(error: BaseException) -> str:
    """Return advice for the most frequent mistakes: a branch on an array, and NumPy."""
    text = str(error)
    while error.__cause__ is not None:
        error = error.__cause__
        text += str(error)
    if "not aligned" in text:  # NumPy's words
        return " For arrays of Dr.Jit use drjit.dot in place of numpy.dot."
    if "bool" in text:
        return (
            " All points are shaded at once: in place of `if` use drjit.select(condition, a, b),"
            " in place of `and`, `or` and `not` the operators &, | and ~, in place of max()"
            " drjit.maximum()."
        )
    return ""
