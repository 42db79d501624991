"""The design of a study, as read from a TOML file: which points, of which scenes.

::

    title = "Roughness and incidence"

    [[part]]
    name = "lobe"
    scene = "lobe"                 # a study scene, a built-in scene, or a Mitsuba file
    design = "grid"                # or "sobol", with points = 256
    pairing = "matched"            # or "literal"
    heuristic = "phong"            # or another, "FILE.py:function" or "FILE.glsl"

    [part.parameters]
    alpha = { from = 0.05, to = 0.8, steps = 16, scale = "log" }
    light_angle = [0, 30, 60]
    int_ior = 1.5

    [[figure]]
    name = "departure"             # of the file
    title = "Error over roughness and incidence"
    part = "lobe"
    where = { int_ior = [1.5, 2] } # the points that are shown; all if omitted

    [figure.chart]                 # in Vega-Lite, over the columns of the dataset
    mark = "line"
    encoding.x = { field = "light_angle", type = "quantitative" }
    encoding.y = { field = "dE2000", aggregate = "mean", type = "quantitative" }
    encoding.color = { field = "alpha", type = "ordinal" }

Omitted keys have their defaults; ``heuristic.NAME`` is a parameter that the heuristic declares. A
part whose scene is rendered may also set ``resolution``, ``spp`` (over all passes) and ``seed``.
"""

import tomllib
from dataclasses import dataclass
from itertools import product
from pathlib import Path
from typing import Annotated, Any, Literal

import msgspec
import numpy as np
from scipy.stats import qmc

from fotismos.comparisons import atomic
from fotismos.comparisons.names import SUFFIXES
from fotismos.comparisons.options import Options
from fotismos.comparisons.study.scenes import (
    PHONG,
    RENDERED,
    ROUGHPLASTIC,
    SCENES,
    UNLIMITED,
    Point,
    StudyParameter,
)
from fotismos.heuristic import heuristics
from fotismos.heuristic.errors import InputError, unknown
from fotismos.reference.records import Count, Record

LARGEST = 1_000_000
"""Most points of a part."""

SETTABLE = ("pairing", "heuristic", "resolution", "spp", "seed")
"""The options of a comparison that a part may set."""

DEFAULTS = Options(resolution=(64, 64), spp=64)

OWN = "heuristic."
"""Prefix of the names of a heuristic's own parameters."""

Design = Literal["grid", "sobol"]

Steps = Annotated[int, msgspec.Meta(ge=2, le=LARGEST)]


@dataclass(frozen=True)
class Levels:
    """The values of one parameter: a list, or a range, of which drawn designs use all values."""

    values: tuple[float, ...]
    is_range: bool = False
    is_log: bool = False

    def at(self, u: np.ndarray) -> np.ndarray:
        """Return the values at ``u``, an array of numbers in [0, 1); listed ones equally often."""
        if not self.is_range:
            chosen: np.ndarray = np.array(self.values)[(u * len(self.values)).astype(int)]
            return chosen
        low = self.values[0]
        high = self.values[-1]
        return low * (high / low) ** u if self.is_log else low + (high - low) * u


@dataclass(frozen=True)
class StudyPart:
    """One design over one scene.

    ``grid`` has all combinations of the levels, the first varying slowest; ``sobol`` is the
    scrambled Sobol sequence, uniform (in the logarithm if the scale is ``log``).
    """

    name: str
    scene: str
    levels: dict[str, Levels]
    design: Design
    count: int
    options: Options

    def points(self) -> list[Point]:
        """Return the points in order."""
        levels = self.levels.values()
        if self.design == "grid":
            rows: Any = product(*(level.values for level in levels))
        else:
            rng = np.random.default_rng(self.options.seed)
            unit = qmc.Sobol(len(levels), rng=rng).random(self.count)
            # The last digits of a power depend on where an array begins in memory.
            drawn = np.stack([level.at(u) for level, u in zip(levels, unit.T, strict=True)], axis=1)
            rows = [[f"{value:.12g}" for value in row] for row in drawn]
        return [dict(zip(self.levels, map(float, row), strict=True)) for row in rows]

    @property
    def varying(self) -> tuple[str, ...]:
        """The parameters that take more than one value."""
        return tuple(name for name, level in self.levels.items() if len(level.values) > 1)


class StudyFigure(Record):
    """A figure of a study: a chart in Vega-Lite of a part's points, or of those of ``where``."""

    name: str
    title: str
    part: str
    chart: dict[str, Any]
    where: dict[str, float | list[float]] = msgspec.field(default_factory=dict)


@dataclass(frozen=True)
class StudyFile:
    """A study: its title, parts and figures, and the file's text."""

    name: str
    title: str
    parts: tuple[StudyPart, ...]
    text: str
    figures: tuple[StudyFigure, ...] = ()


class Range(Record):
    """The values of a parameter from one to another, evenly spread on a scale."""

    low: float = msgspec.field(name="from")
    high: float = msgspec.field(name="to")
    steps: Steps | None = None
    scale: Literal["linear", "log"] = "linear"


class PartTable(Record):
    """A part as written, without its options of the rendering."""

    scene: str
    parameters: dict[str, Any]
    name: str | None = None
    design: Design = "grid"
    points: Count = 0


def read(path: str | Path) -> StudyFile:
    """Read a study from a TOML file; ``InputError`` says what in it is not allowed."""
    path = Path(path)
    try:
        text = atomic.content(path).decode()
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: {reason}. Give the TOML file of a study.") from error
    try:
        return parse(text, path.stem, path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def parse(text: str, name: str = "study", folder: Path = Path()) -> StudyFile:
    """Make a study from the text of a TOML file; its files are relative to ``folder``."""
    try:
        content = tomllib.loads(text)
    # Numbers too long for Python and values nested too deeply raise other errors.
    except (ValueError, RecursionError) as error:
        raise InputError(f"this is not TOML: {error}.") from error
    for key in content:
        if key not in ("title", "part", "figure"):
            raise unknown("the study:", key, ("title", "part", "figure"))
    title = _converted(content.get("title", name), str, "title")
    figures = _converted(content.get("figure", []), tuple[StudyFigure, ...], "the figures")
    tables = _converted(content.get("part", []), list[dict[str, Any]], "the parts")
    parts = {}
    for number, raw in enumerate(tables, start=1):
        part = _part(raw, f"part {raw.get('name', number)!r}", folder)
        if part.name in parts:
            raise InputError(f"two parts have the name {part.name!r}: give each its own.")
        parts[part.name] = part
    if not parts:
        raise InputError("there are no parts: give at least one [[part]] table.")
    for figure in figures:
        _check_figure(figure, parts)
    return StudyFile(
        name=name, title=title, parts=tuple(parts.values()), text=text, figures=figures
    )


def _converted(content: Any, kind: Any, where: str) -> Any:
    try:
        return msgspec.convert(content, kind)
    except msgspec.ValidationError as error:
        raise InputError(f"{where}: {error}.") from error


def _part(raw: dict[str, Any], where: str, folder: Path) -> StudyPart:
    chosen = {name: value for name, value in raw.items() if name in SETTABLE}
    rest = {name: value for name, value in raw.items() if name not in SETTABLE}
    table = _converted(rest, PartTable, where)
    scene = table.scene
    is_file = Path(table.scene).suffix in SUFFIXES
    try:
        options = DEFAULTS.changed(**chosen)
    except InputError as error:
        raise InputError(f"{where}: {error}") from error
    name = options.heuristic
    if name != DEFAULTS.heuristic and scene in SCENES.keys() - RENDERED.keys():
        raise InputError(
            f"{where}: the scene {scene} is not rendered, and supports Phong's model alone. Study"
            f" {name} on {' or '.join(RENDERED)}, or on your own scene."
        )
    if in_file := heuristics.in_file(name):
        file, function = in_file
        # GLSL files have no function, and so no colon.
        options = options.changed(heuristic=f"{folder / file}:{function}".rstrip(":"))
    part = StudyPart(
        name=atomic.file_name(table.name or Path(scene).stem, "a part"),
        scene=str(folder / scene) if is_file else scene,
        levels=_all_levels(table, where),
        design=table.design,
        count=table.points,
        options=options,
    )
    _check_size(part, where)
    return part


def _all_levels(table: PartTable, where: str) -> dict[str, Levels]:
    """Return the values of all parameters of a part, the most structural first."""
    raw = dict(table.parameters)
    # TOML reads `heuristic.gloss` as a nested table.
    if isinstance(tuned := raw.get(OWN[:-1]), dict):
        del raw[OWN[:-1]]
        raw |= {f"{OWN}{name}": value for name, value in tuned.items()}
    if not raw:
        raise InputError(f"{where}: no parameters are given. Name some in [part.parameters].")
    known = {name: UNLIMITED for name in raw if name.startswith(OWN)}
    if table.scene in SCENES:
        phong = set(raw) & set(PHONG)
        plastic = set(raw) & set(ROUGHPLASTIC)
        if phong and plastic:
            raise InputError(
                f"{where}: {', '.join(sorted(phong | plastic))} belong to two materials. Give those"
                " of one; pairing derives the other."
            )
        known = (PHONG if phong else ROUGHPLASTIC) | SCENES[table.scene] | known
        for name in raw:
            if name not in known:
                raise unknown(f"{where}:", name, sorted(known))
    else:
        known = dict.fromkeys(raw, UNLIMITED)
    return {
        name: _levels(
            raw.get(name, parameter.default),
            parameter,
            is_grid=table.design == "grid",
            where=f"{where}: {name}",
        )
        for name, parameter in known.items()
    }


def _levels(raw: object, parameter: StudyParameter, is_grid: bool, where: str) -> Levels:
    """Read the values of a parameter; those of a range are rounded to six digits: 0.1 is 0.1."""
    if not isinstance(raw, dict):
        listed = _converted(raw if isinstance(raw, list) else [raw], tuple[float, ...], where)
        if not listed:
            raise InputError(f"{where} = []: give at least one value.")
        return Levels(tuple(parameter.checked(value, where) for value in listed))
    span = _converted(raw, Range, where)
    if is_grid == (span.steps is None):
        needed = "from, to and steps" if is_grid else "from and to, without steps"
        raise InputError(f"{where} has {', '.join(raw)}: give a range {needed}.")
    low = parameter.checked(span.low, f"{where}, from")
    high = parameter.checked(span.high, f"{where}, to")
    is_log = span.scale == "log"
    if not low < high or (is_log and low <= 0):
        least = "above 0 and " if is_log else ""
        raise InputError(f"{where} runs from {low:g} to {high:g}: begin {least}below the end.")
    if span.steps is None:
        return Levels((low, high), True, is_log)
    spaced = (np.geomspace if is_log else np.linspace)(low, high, span.steps)
    return Levels(tuple(float(f"{value:.6g}") for value in spaced), True, is_log)


def _check_size(part: StudyPart, where: str) -> None:
    """Reject a design with no points, too many points, or no range to draw from."""
    size = part.count
    if part.design == "grid":
        # In floats: a product of integers could overflow into the allowed range.
        size = int(np.prod([len(level.values) for level in part.levels.values()], dtype=float))
    if not 1 <= size <= LARGEST:
        raise InputError(
            f"{where}: the design {part.design!r} has {size} points: give 1 to {LARGEST}."
            " A Sobol design takes the number from `points`."
        )
    if part.design == "grid":
        return
    # Sobol's points are balanced at powers of 2 alone.
    if size & (size - 1):
        lower = 1 << (size.bit_length() - 1)
        raise InputError(
            f"{where}: points = {size}: give a Sobol design a power of 2, such as {lower}"
            f" or {2 * lower}."
        )
    if not any(level.is_range for level in part.levels.values()):
        raise InputError(f"{where}: no parameter has a range (from, to) to draw from.")


def _check_figure(figure: StudyFigure, parts: dict[str, StudyPart]) -> None:
    """Ensure that a figure has a name for files, a part, and data of that part alone."""
    where = f"figure {figure.name!r}"
    atomic.file_name(figure.name, "a figure")
    if figure.part not in parts:
        raise unknown(f"{where}: part =", figure.part, parts)
    levels = parts[figure.part].levels
    for name in figure.where:
        if name not in levels:
            raise unknown(f"{where}: parameter", name, levels)
    if addresses := stated(figure.chart, "url"):
        raise InputError(
            f"{where}: url = {addresses[0]!r}: a chart shows the points of its part. Omit it."
        )


def stated(content: Any, key: str) -> list[Any]:
    """Return what a key has as values anywhere in tables and lists."""
    if isinstance(content, list):
        return [value for item in content for value in stated(item, key)]
    if not isinstance(content, dict):
        return []
    own = content.get(key, [])
    inside = [value for item in content.values() for value in stated(item, key)]
    return [*(own if isinstance(own, list) else [own]), *inside]
