"""Assertions on a scene: how far it departs from physics, and that nothing moved."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import total_ordering
from pathlib import Path
from typing import Any

from comparisons.case import Case, Request, Scene, open_case
from comparisons.check import check
from comparisons.check.measurement import PASSES
from comparisons.check.moved import LEVEL
from comparisons.intervals import student
from heuristic.errors import InputError, unknown
from heuristic.heuristics import in_file, known_as
from reports.ci import baselines, checks, lines


@total_ordering
@dataclass(frozen=True, eq=False)
class Departure:
    """A departure metric of a scene: it compares with numbers by its value.

    Attributes
    ----------
    scene, metric
        The names of the scene and the metric.
    value, error
        The metric, and its standard error over ``passes`` independent passes.
    noise_floor
        The value that noise alone would give; None for a metric without one.
    """

    scene: str
    metric: str
    value: float
    error: float
    noise_floor: float | None
    passes: int

    def __float__(self) -> float:
        return self.value

    def __eq__(self, other: Any) -> bool:
        return self.value == float(other)

    def __lt__(self, other: Any) -> bool:
        return self.value < float(other)

    def __repr__(self) -> str:
        return f"{self.metric} {self.value:.4g}"

    @property
    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval of Student's t."""
        amount = student(self.value, self.error, self.passes)
        return amount.low, amount.high

    def fotismos_explanation(self) -> list[str]:
        """Return the lines for the message of a failed assertion."""
        low, high = self.interval
        floor = "" if self.noise_floor is None else f"; noise alone: {self.noise_floor:.4g}"
        return [
            f"{self.scene}: mean {self.metric} {self.value:.6g}, standard error {self.error:.2g}",
            f"95 % interval: {low:.6g} to {high:.6g}{floor}",
        ]


@dataclass(frozen=True)
class Fotismos:
    """The fixture ``fotismos``.

    Attributes
    ----------
    folder
        The folder of the baselines.
    pictures
        Returns the folder for a failure's pictures.
    variant
        Mitsuba variant that replaces the scenes'.
    update
        Whether to write baselines.
    """

    folder: Path
    pictures: Callable[[], Path]
    variant: str | None = None
    update: bool = False

    def departure(self, scene: Scene, metric: str = "dE2000", **options: Any) -> Departure:
        """Measure how far textbook shading is from physics.

        Parameters
        ----------
        scene
            A built-in name, the path of a Mitsuba file (relative to the test's folder, else to the
            current one), a dictionary for ``mitsuba.load_dict``, or a function that returns one.
        metric
            ``dE2000``, ``dE_ITP``, ``dE_CAM16UCS``, ``rmse`` or ``log2_luminance``.
        options
            Those of the command line: ``resolution``, ``spp``, ``seed``, ``heuristic``, ... A
            heuristic may also be a function of a point; its file is found as a scene's is. Without
            a resolution, the longer side is 64 pixels.
        """
        case = check.made_small(
            _open(self._found(scene), self._given({}) | self._placed(options), "scene")
        )
        found = check.measure_scene(case.source, case.options).measurement
        if metric not in found.metrics:
            raise unknown("metric", metric, found.metrics)
        measured = found.metrics[metric]
        return Departure(
            case.name, metric, measured.value, measured.error, measured.noise_floor, PASSES
        )

    def unchanged(
        self,
        scene: Scene,
        name: str | None = None,
        significance: float = LEVEL,
        **options: Any,
    ) -> bool:
        """Return True; fail the test if a scene moved from its baseline.

        Parameters
        ----------
        scene
            See :meth:`departure`; or the path of an existing baseline (.json).
        name
            The baseline's name; if omitted, the scene's. A dictionary needs one.
        significance
            Chance of a failure though nothing changed.
        options
            See :meth:`departure`. An existing baseline has its own; if those given here differ, the
            test fails, or ``--fotismos-update`` writes them.

        Raises
        ------
        AssertionError
            With the table of what moved, or for a missing baseline.
        """
        scene = self._found(scene)
        given = self._given(options)
        path = self._path(scene, name)
        if not path.exists():
            if not self.update:
                raise AssertionError(
                    f"{path}: there is no such baseline. `pytest --fotismos-update` writes it."
                )
            case = _open(scene, given, name)
            named = case.word if _in_python(scene) else baselines.scene_for(str(scene), path)
            checks.create(path, named, case)
            return True
        file = baselines.read(path)
        if not _in_python(scene):
            scene = baselines.scene_from(file.baseline.scene, path)
        case = _open(scene, baselines.options_from(file.baseline.options, path) | given, name)
        others = _other_options(file.baseline.options, baselines.options_for(given, path))
        if others:
            if not self.update:
                raise AssertionError(
                    f"{path}: the options of the baseline and the test differ: {others}."
                    " `pytest --fotismos-update` writes it again."
                )
            checks.create(path, file.baseline.scene, case)
        elif self.update:
            checks.update(file, case, significance)
        else:
            _require_passed(checks.examine(file, case, significance, self.pictures() / path.stem))
        return True

    def _found(self, scene: Scene) -> Scene:
        """Return a scene; a path relative to the test's folder, if there is such a file."""
        if not isinstance(scene, (str, Path)):
            return scene
        place = self.folder.parent / scene
        return place if place.is_file() else scene

    def _path(self, scene: Scene, name: str | None) -> Path:
        if isinstance(scene, (str, Path)) and Path(scene).suffix == ".json":
            return Path(scene)
        suffix = f"-{self.variant}" if self.variant else ""
        return self.folder / f"{name or _name(scene)}{suffix}.json"

    def _given(self, options: dict[str, Any]) -> dict[str, Any]:
        return self._placed(options) | ({"variant": self.variant} if self.variant else {})

    def _placed(self, options: dict[str, Any]) -> dict[str, Any]:
        """Return options with a heuristic's file in the test's folder, if it is there."""
        if "heuristic" not in options:
            return options
        name = known_as(options["heuristic"])
        file, _ = in_file(name) or ("", "")
        is_beside = file and (self.folder.parent / file).is_file()
        return options | {"heuristic": str(self.folder.parent / name) if is_beside else name}


def _open(scene: Scene, options: Mapping[str, Any], name: str | None = None) -> Case:
    own = (name or _name(scene)) if _in_python(scene) else None
    return open_case(scene, Request.of(options), own)


def _in_python(scene: Scene) -> bool:
    return isinstance(scene, Mapping) or callable(scene)


def _other_options(
    recorded: Mapping[str, Any], given: Mapping[str, Any]
) -> dict[str, tuple[Any, Any]]:
    """Return ``{name: (baseline's, test's)}`` of the options in which they differ."""
    stated = Request.of(given).stated()
    return {
        name: (recorded.get(name), stated.get(name))
        for name in given
        if recorded.get(name) != stated.get(name)
    }


def _name(scene: Scene) -> str:
    if callable(scene):
        return scene.__name__
    if isinstance(scene, Mapping):
        raise InputError("a scene that is a dictionary needs a name: unchanged(scene, name=...).")
    return baselines.name_of(scene)


def _require_passed(result: checks.Result) -> None:
    if result.status == "passed":
        return
    assert result.check is not None, "a failure has a comparison"
    text = [f"{result.path}: {len(result.check.moved)} of {len(result.check.moves)} moved"]
    text += lines.moved_lines(result.check)
    text += [line for line in (lines.versions_line(result), f"pictures: {result.folder}") if line]
    raise AssertionError("\n".join(text))
