"""The design of a study, as read from a TOML file: which points, of which scenes.

::

    title = "Roughness and incidence"

    [[part]]
    name = "lobe"
    scene = "lobe"                 # a study scene, a built-in scene, or a Mitsuba file
    design = "grid"                # or "random", or "sobol", with points = 256
    pairing = "matched"            # or "literal"
    heuristic = "phong"            # or another, "FILE.py:function" or "FILE.glsl"

    [part.parameters]
    alpha = { from = 0.05, to = 0.8, steps = 16, scale = "log" }
    light_angle = [0, 30, 60]
    int_ior = 1.5

Omitted keys have their defaults; ``heuristic.NAME`` is a parameter that the heuristic declares. A
part whose scene is rendered may also set ``resolution`` and ``spp``. The figures (``[[figure]]``)
are read by :mod:`reports.charts.study_charts`.
"""

import tomllib
from collections.abc import Collection, Iterable
from dataclasses import dataclass, field
from itertools import product
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
from scipy.stats import qmc

from comparisons.case import SUFFIXES
from comparisons.study.levels import Fixed, Listed, Span, values
from comparisons.study.scenes import PHONG, ROUGHPLASTIC, SCENES, UNLIMITED, Parameter, Point
from heuristic import heuristics
from heuristic.errors import InputError, unknown
from reference.pairing.factors import Convention

DESIGNS = ("grid", "random", "sobol")
LARGEST = 1_000_000
KEYS = {"name", "scene", "design", "points", "pairing", "heuristic", "resolution", "spp", "seed"}
KEYS |= {"parameters"}

Table: TypeAlias = dict[str, Any]
"""A table of TOML."""


@dataclass(frozen=True)
class Part:
    """One design over one scene.

    Attributes
    ----------
    name
        In the dataset's column ``part``.
    scene
        Name in :data:`comparisons.study.scenes.SCENES`, name of a built-in scene, or path of a
        file.
    design
        ``grid``: all combinations; ``random``: independent and uniform (in the logarithm if the
        scale is ``log``); ``sobol``: the scrambled Sobol sequence, with a power of 2 of points.
    spans
        The values of each parameter; in a grid, the first varies slowest.
    count
        Number of points of a random or Sobol design.
    heuristic
        Name of the heuristic; see :func:`heuristic.heuristics.named`.
    seed
        Seed of the design and of the renderings.
    resolution, spp
        For rendered scenes; ``spp`` is over all passes.
    """

    name: str
    scene: str
    spans: dict[str, Listed | Span]
    design: str = "grid"
    count: int = 0
    convention: Convention = Convention.MATCHED
    heuristic: str = heuristics.PHONG.name
    seed: int = 0
    resolution: tuple[int, int] = (64, 64)
    spp: int = 64

    def points(self) -> list[Point]:
        """Return the points in order."""
        names = list(self.spans)
        if self.design == "grid":
            table: Iterable[tuple[float, ...]] = product(
                *(span.values() for span in self.spans.values())
            )
        else:
            unit = _unit_points(self.design, len(names), self.count, self.seed)
            table = zip(
                *(span.at(u) for span, u in zip(self.spans.values(), unit.T, strict=True)),
                strict=True,
            )
        return [dict(zip(names, map(float, row), strict=True)) for row in table]

    @property
    def reads_files(self) -> bool:
        """Whether its points need the user's files."""
        return bool(Path(self.scene).suffix in SUFFIXES or heuristics.in_file(self.heuristic))

    @property
    def varying(self) -> tuple[str, ...]:
        """The parameters that take more than one value."""
        return tuple(name for name, span in self.spans.items() if not isinstance(span, Fixed))


@dataclass(frozen=True)
class Study:
    """A study: its title, parts, figures as written, and the file's text."""

    name: str
    title: str
    parts: tuple[Part, ...]
    text: str
    figures: tuple[dict[str, Any], ...] = field(default=())


def read(path: str | Path) -> Study:
    """Read a study from a TOML file.

    Raises
    ------
    InputError
        When there is no such file, it is not TOML, or something in it is not allowed.
    """
    path = Path(path)
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: {reason}. Give the TOML file of a study.") from error
    try:
        return parse(text, path.stem, path.parent)
    except InputError as error:
        raise InputError(f"{path}: {error}") from error


def parse(text: str, name: str = "study", folder: Path = Path()) -> Study:
    """Make a study from the text of a TOML file; scene files are relative to ``folder``.

    Raises
    ------
    InputError
        See :func:`read`.
    """
    try:
        table = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"this is not TOML: {error}.") from error
    _known(table, {"title", "part", "figure"}, "the study")
    found = table.get("part")
    if not isinstance(found, list) or not found:
        raise InputError("there are no parts: give at least one [[part]] table.")
    parts = tuple(_part(part, folder) for part in found)
    names = [part.name for part in parts]
    if len(set(names)) < len(names):
        raise InputError(f"parts are named {', '.join(names)}: give each its own name.")
    return Study(name, table.get("title", name), parts, text, tuple(table.get("figure", ())))


def _part(table: Table, folder: Path) -> Part:
    scene = table.get("scene")
    if not isinstance(scene, str):
        raise InputError(f"a part has no scene. Study scenes are {', '.join(SCENES)}.")
    name = table.get("name", scene)
    where = f"part {name!r}"
    _known(table, KEYS, where)
    design = _choice(table, "design", DESIGNS, where)
    given = table.get("parameters", {})
    if not isinstance(given, dict) or not given:
        raise InputError(f"{where}: no parameters are given. Name some in [part.parameters].")
    given = _flat(given)
    heuristic = table.get("heuristic", heuristics.PHONG.name)
    _check_heuristic(heuristic, scene, where)
    own = {name: UNLIMITED for name in given if name.startswith(OWN)}
    known = _parameters(scene, {k: v for k, v in given.items() if k not in own}, where) | own
    spans = {}
    for key, parameter in known.items():
        raw = given.get(key, parameter.default)
        spans[key] = values(raw, parameter, design == "grid", f"{where}: {key}")
    part = Part(
        name=name,
        scene=str(folder / scene) if Path(scene).suffix in SUFFIXES else scene,
        spans=spans,
        design=design,
        count=_whole(table, "points", 0, where),
        heuristic=_placed(heuristic, folder),
        convention=Convention(_choice(table, "pairing", ("matched", "literal"), where)),
        seed=_whole(table, "seed", 0, where),
        resolution=_resolution(table, where),
        spp=_whole(table, "spp", 64, where, least=4),
    )
    _check_size(part, where)
    return part


OWN = "heuristic."
"""Prefix of the names of a heuristic's own parameters."""


def _flat(given: Table) -> Table:
    """Return parameters by full name; TOML reads ``heuristic.gloss`` as a nested table."""
    own = given.get(OWN[:-1], {})
    if not isinstance(own, dict):
        return given
    others = {name: value for name, value in given.items() if name != OWN[:-1]}
    return others | {f"{OWN}{name}": value for name, value in own.items()}


def _check_heuristic(name: object, scene: str, where: str) -> None:
    if not isinstance(name, str):
        raise InputError(
            f"{where}: heuristic = {name!r}: give a name, FILE.py:FUNCTION or FILE.glsl."
        )
    if name != heuristics.PHONG.name and scene in SCENES and SCENES[scene].make is None:
        rendered = [each for each, one in SCENES.items() if one.make is not None]
        raise InputError(
            f"{where}: the scene {scene} is not rendered, and supports Phong's model alone. Study"
            f" {name} on {' or '.join(rendered)}, or on your own scene."
        )


def _placed(heuristic: str, folder: Path) -> str:
    file, function = heuristics.in_file(heuristic) or ("", "")
    return f"{folder / file}:{function}".rstrip(":") if file else heuristic


def _parameters(scene: str, given: Table, where: str) -> dict[str, Parameter]:
    """Return the parameters of a part's scene, the most structural first."""
    if scene not in SCENES:
        return dict.fromkeys(given, UNLIMITED)
    phong, plastic = (set(given) & set(material) for material in (PHONG, ROUGHPLASTIC))
    if phong and plastic:
        raise InputError(
            f"{where}: {', '.join(sorted(phong | plastic))} belong to two materials. Give those of"
            " one; pairing derives the other."
        )
    known = (PHONG if phong else ROUGHPLASTIC) | SCENES[scene].parameters
    _known(given, {*PHONG, *ROUGHPLASTIC, *SCENES[scene].parameters}, where)
    return known


def _known(table: Table, names: Collection[str], where: str) -> None:
    for key in table:
        if key not in names:
            raise unknown(f"{where}:", key, sorted(names))


def _choice(table: Table, key: str, choices: tuple[str, ...], where: str) -> str:
    chosen = table.get(key, choices[0])
    if chosen not in choices:
        raise unknown(f"{where}: {key} =", chosen, choices)
    return chosen


def _whole(table: Table, key: str, default: int, where: str, least: int = 0) -> int:
    value = table.get(key, default)
    if not isinstance(value, int) or isinstance(value, bool) or value < least:
        raise InputError(f"{where}: {key} = {value!r}: give an integer of at least {least}.")
    return value


def _resolution(table: Table, where: str) -> tuple[int, int]:
    value = table.get("resolution", [64, 64])
    fits = isinstance(value, list) and len(value) == 2
    if not fits or not all(isinstance(side, int) and 1 <= side <= 4096 for side in value):
        raise InputError(
            f"{where}: resolution = {value!r}: give [width, height], from 1 to 4096 each."
        )
    width, height = value
    return width, height


def _check_size(part: Part, where: str) -> None:
    """Reject a design with no points, too many points, or no range to draw from."""
    if part.design == "grid":
        size = int(np.prod([len(span.values()) for span in part.spans.values()], dtype=float))
    else:
        size = part.count
    if not 1 <= size <= LARGEST:
        raise InputError(
            f"{where}: the design {part.design!r} has {size} points: give 1 to {LARGEST}."
            " Random and Sobol designs take the number from `points`."
        )
    if part.design == "sobol" and size & (size - 1):
        lower = 1 << (size.bit_length() - 1)
        raise InputError(
            f"{where}: points = {size}: give a Sobol design a power of 2, such as {lower}"
            f" or {2 * lower}."
        )
    if part.design != "grid" and not any(isinstance(span, Span) for span in part.spans.values()):
        raise InputError(f"{where}: no parameter has a range (from, to) to draw from.")


def _unit_points(design: str, dimensions: int, count: int, seed: int) -> np.ndarray:
    """Return points of the unit cube, (count, dimensions)."""
    if design == "sobol":
        return qmc.Sobol(dimensions, rng=np.random.default_rng(seed)).random_base2(
            count.bit_length() - 1
        )
    return np.random.default_rng(seed).random((count, dimensions))
