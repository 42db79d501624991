"""Allowed values of a scene's elements, checked before anything is made.

Mitsuba rejects some values that make no sense, and silently renders others: a sphere of radius NaN
is missing, an infinite index of refraction is black. Numbers are checked by :data:`RULES`,
transforms by ``_transform``, and every number must exist in single precision.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from numbers import Real
from typing import Any

import mitsuba as mi
import numpy as np

from heuristic.errors import InputError
from reference.scene.graph import Graph

LARGEST_ALPHA = 1000.0
"""Largest roughness: arithmetic overflows far above it, and all light is lost far below it."""

FILM = (768, 576)
"""Mitsuba's width and height for a film without its own."""

SMALLEST_RATIO = 1e-14
"""Ratio of singular values of a matrix with rows and columns of length 1; less is rounding."""

LARGEST = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Rule:
    """Allowed values of some parameters; ``allowed`` is the text after "give".

    ``is_met`` checks the parameter's numbers, (n,). It applies to ``plugins``, or to all if empty.
    """

    keys: tuple[str, ...]
    is_met: Callable[[np.ndarray], bool]
    allowed: str
    plugins: tuple[str, ...] = ()

    def holds_for(self, plugin: str, key: str) -> bool:
        """Return whether the rule applies to a parameter of a plugin."""
        return key in self.keys and plugin in (self.plugins or (plugin,))


def _above_zero(values: np.ndarray) -> bool:
    return bool((values > 0).all())


def _is_length(values: np.ndarray) -> bool:
    return bool(values.any())


PICTURES = ("filename", "bitmap", "data")
CHILDREN = {"blendbsdf": (mi.ObjectType.BSDF, 2), "volume": (mi.ObjectType.Volume, 1)}

CAMERAS = ("perspective", "thinlens", "orthographic")
FILMS = ("hdrfilm", "specfilm")

RULES = (
    Rule(("radius",), _is_length, "a radius other than 0", ("sphere", "cylinder")),
    Rule(
        ("fov",),
        lambda degrees: bool(((degrees > 0) & (degrees < 180)).all()),
        "an angle between 0 and 180 degrees, both excluded",
        ("perspective", "thinlens", "projector"),
    ),
    Rule(
        ("cutoff_angle",),
        lambda degrees: bool(((degrees > 0) & (degrees <= 180)).all()),
        "an angle above 0 and up to 180 degrees",
        ("spot",),
    ),
    Rule(("near_clip", "far_clip", "focus_distance"), _above_zero, "a distance above 0", CAMERAS),
    Rule(("int_ior", "ext_ior"), _above_zero, "an index of refraction above 0"),
    Rule(("eta",), _above_zero, "an index of refraction above 0", ("principled", "principledthin")),
    Rule(
        ("eta", "k"),
        lambda values: bool((values >= 0).all()),
        "values of 0 or more",
        ("conductor", "roughconductor"),
    ),
    Rule(
        ("alpha", "alpha_u", "alpha_v"),
        lambda values: bool((values <= LARGEST_ALPHA).all()),
        f"a roughness up to {LARGEST_ALPHA:g}",
    ),
    Rule(
        ("direction", "sun_direction"),
        _is_length,
        "a vector of any length but 0",
        ("directional", "distant", "sunsky", "timed_sunsky", "heuristic_directional"),
    ),
    Rule(("width", "height", "crop_width", "crop_height"), _above_zero, "1 or more pixels", FILMS),
    Rule(
        ("crop_offset_x", "crop_offset_y"),
        lambda values: bool((values >= 0).all()),
        "0 or more pixels",
        FILMS,
    ),
)


def check(graph: Graph) -> None:
    """Reject values that make no sense, in all elements in use.

    Raises
    ------
    InputError
        With the element, the parameter, its value, and what is allowed.
    """
    for index in graph.nodes_in_use():
        check_node(graph, index)


def check_node(graph: Graph, index: int) -> None:
    """Reject values of one element, like :func:`check`."""
    props, plugin = graph.props(index), graph.plugin(index)
    for key, value in props.items():
        for allowed in _objections(plugin, key, value):
            raise _refusal(graph, index, f"{key} = {_shown(value)} is not allowed: give {allowed}.")
    for objection in (*_between(plugin, props), *_missing(graph, index)):
        raise _refusal(graph, index, objection)


def _refusal(graph: Graph, index: int, objection: str) -> InputError:
    return InputError(f"{graph.name}: {graph.label(index)}: {objection}")


def _objections(plugin: str, key: str, value: Any) -> Iterator[str]:
    """Yield what would be allowed in place of a wrong value."""
    if isinstance(value, bool):
        return
    if _is_transform(value):
        yield from _transform(np.array(value.matrix, float), key == "to_uv")
        return
    values = _numbers(key, value)
    if values is None:
        return
    for rule in RULES:
        if rule.holds_for(plugin, key) and not rule.is_met(values):
            yield rule.allowed
    if not (np.abs(values) <= LARGEST).all():
        yield f"finite numbers of at most {LARGEST:.2g}"


def _numbers(key: str, value: Any) -> np.ndarray | None:
    """Return the numbers in a value, (n,); None if it has none."""
    if isinstance(value, Real):
        return np.array([float(value)])
    if hasattr(value, "wavelengths"):  # a spectrum, whose type Mitsuba does not name
        return np.array([*value.wavelengths, *value.values], float)
    if isinstance(value, str):
        return _table(value) if key in ("values", "wavelengths") else None
    try:
        values = np.ravel(np.asarray(value))
    except (TypeError, ValueError, RuntimeError):
        return None
    return values if values.dtype.kind in "iuf" else None


def _is_transform(value: Any) -> bool:
    """Return whether a value is a transform; vectors also have an attribute ``matrix``."""
    return "Transform" in type(value).__name__


def _table(text: str) -> np.ndarray | None:
    """Return the numbers of a text; None for one with other words, which Mitsuba rejects."""
    try:
        return np.array(text.replace(",", " ").split(), float)
    except ValueError:
        return None


def _transform(matrix: np.ndarray, of_texture: bool) -> Iterator[str]:
    """Yield the faults of a transform.

    A texture may be stretched without end, which makes stripes. Everything else uses the inverse,
    which must exist in single precision.
    """
    if not (np.abs(matrix) <= LARGEST).all():
        yield "finite numbers (a lookat has none where its target is its origin or lies along up)"
    elif not of_texture and not _is_invertible(matrix[:3, :3]):
        yield "one that can be inverted (in place of a scale by 0, a small one such as 1e-6)"


def _is_invertible(matrix: np.ndarray) -> bool:
    lengths = np.linalg.norm(matrix, axis=1, keepdims=True)
    if not lengths.all():
        return False
    even = matrix / lengths
    lengths = np.linalg.norm(even, axis=0)
    if not lengths.all():
        return False
    sizes = np.linalg.svd(even / lengths, compute_uv=False)
    if sizes[-1] < SMALLEST_RATIO * sizes[0]:
        return False
    return bool((np.abs(np.linalg.inv(matrix)) <= LARGEST).all())


def _missing(graph: Graph, index: int) -> Iterator[str]:
    """Yield what an element lacks, if Mitsuba would end the process instead of rejecting it."""
    plugin, props = graph.plugin(index), graph.props(index)
    if plugin == "bitmap" and not any(key in props for key in PICTURES):
        yield f"it has no picture: give one of {', '.join(PICTURES)}."
    if plugin in CHILDREN:
        kind, count = CHILDREN[plugin]
        found = len(graph.children(index, kind))
        if found != count:
            yield f"it needs {count} {kind.name} elements, and has {found}."


def _between(plugin: str, props: mi.Properties) -> Iterator[str]:
    """Yield conflicts between parameters that are allowed individually."""
    if plugin == "cylinder" and "p0" in props and "p1" in props:
        ends = [np.ravel(np.asarray(props[key], float)) for key in ("p0", "p1")]
        if (ends[0] == ends[1]).all():
            yield "p0 and p1 are the same point: give the two ends of the axis."
    if plugin in CAMERAS:
        near, far = props.get("near_clip", 0.01), props.get("far_clip", 10000.0)
        if isinstance(near, Real) and isinstance(far, Real) and near >= far:
            yield f"near_clip = {near:g} is not below far_clip = {far:g}: give a smaller one."
    if plugin in FILMS:
        yield from _crop(props)


def _crop(props: mi.Properties) -> Iterator[str]:
    for side, axis, usual in zip(("width", "height"), "xy", FILM, strict=True):
        size, begin = props.get(side, usual), props.get(f"crop_offset_{axis}", 0)
        count = props.get(f"crop_{side}", size)
        if all(isinstance(number, int) for number in (size, begin, count)) and begin + count > size:
            yield (
                f"crop_offset_{axis} = {begin} and crop_{side} = {count} reach beyond {side} ="
                f" {size}: give a crop within the film."
            )


def _shown(value: Any) -> str:
    if _is_transform(value):
        rows = np.array(value.matrix, float)
        return "[" + "; ".join(" ".join(f"{number:g}" for number in row) for row in rows) + "]"
    return f"{value:g}" if isinstance(value, float) else str(value)
