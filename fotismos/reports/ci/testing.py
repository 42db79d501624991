"""Assertions on a scene: how far it departs from physics, and that nothing moved."""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from time import perf_counter
from typing import Any

import mitsuba as mi
import numpy as np
from msgspec import structs

from fotismos.comparisons import atomic
from fotismos.comparisons.case import Case, Scene, open_case
from fotismos.comparisons.check.measurement import PASSES, made_small, measure_scene
from fotismos.comparisons.check.moved import LEVEL
from fotismos.comparisons.check.pictures import (
    PictureCheck,
    Repeats,
    check_pictures,
    picture_gate,
)
from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE, checked_threshold
from fotismos.comparisons.departure.metrics import LEADING
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import require_linear
from fotismos.heuristic.errors import InputError, unknown
from fotismos.heuristic.heuristics import in_file, known_as
from fotismos.reference import records
from fotismos.reference.rendering.passes import require_finite
from fotismos.reference.rendering.sums import student
from fotismos.reference.scene.graph import set_variant
from fotismos.reports.ci import baselines, checks, summary
from fotismos.reports.files import images, results
from fotismos.reports.page.scene_view import Before, SceneView
from fotismos.reports.terminal.parsing import share_of

Pictures = np.ndarray | Sequence[np.ndarray] | str | Path
"""A linear picture (H, W, 3), several that differ by noise, a file, or a pattern of files."""


class Departure(float):
    """A departure metric of a scene: a number that explains itself where an assertion fails.

    ``error`` is its standard error over ``passes`` independent passes, ``noise_floor`` the value
    that noise alone would give.
    """

    scene: str
    metric: str
    error: float
    noise_floor: float | None
    passes: int

    def __new__(cls, value: float, **about: Any) -> "Departure":
        """Return the number with its attributes."""
        made = super().__new__(cls, value)
        vars(made).update(about)
        return made

    def __repr__(self) -> str:
        return f"{self.metric} {float(self):.4g}"

    @property
    def interval(self) -> tuple[float, float]:
        """Return the 95 % interval of Student's t."""
        amount = student(float(self), self.error, self.passes)
        return amount.low, amount.high

    def fotismos_explanation(self) -> list[str]:
        """Return the lines for the message of a failed assertion."""
        low, high = self.interval
        floor = "" if self.noise_floor is None else f"; noise alone: {self.noise_floor:.4g}"
        return [
            f"{self.scene}: mean {self.metric} {float(self):.6g}, standard error {self.error:.2g}",
            f"95 % interval: {low:.6g} to {high:.6g}{floor}",
        ]


@contextmanager
def rendering_in(variant: str | None) -> Iterator[None]:
    """Set a variant for a test, and the one before afterwards."""
    before = mi.variant()
    # A test may make a scene from Mitsuba's types, which needs a variant.
    set_variant(variant or before or "llvm_ad_rgb")
    yield
    if before is not None:
        mi.set_variant(before)


@dataclass(frozen=True)
class Fotismos:
    """The fixture ``fotismos``: baselines in a folder, which are written if ``update``.

    ``beside`` is the folder of the test's file, to which paths are relative. ``pictures`` returns
    the folder for what a failure leaves. ``significance`` is the chance of a failure though
    nothing changed, where a test states none; ``variant`` replaces the scenes'.
    """

    folder: Path
    beside: Path
    pictures: Callable[[], Path]
    significance: float = LEVEL
    variant: str | None = None
    update: bool = False

    def departure(self, scene: Scene, metric: str = "dE2000", **options: Any) -> Departure:
        """Measure how far textbook shading is from physics.

        A scene is a built-in name, the path of a Mitsuba file (relative to the test's folder, else
        to the current one), a dictionary for ``mitsuba.load_dict``, or a function that returns one.
        ``options`` are those of the command line; a heuristic may also be a function of a point.
        Without a resolution, the longer side is 64 pixels.
        """
        case = made_small(
            _open(self._scene(scene), self._options({}) | self._with_file(options), "scene")
        )
        measured = measure_scene(case.source, case.options)
        found = measured.measurement
        if measured.caution:
            warnings.warn(f"{case.name}: {measured.caution}", stacklevel=2)
        if metric not in found.metrics:
            raise unknown("metric", metric, found.metrics)
        amount = found.metrics[metric]
        return Departure(
            amount.value,
            scene=case.name,
            metric=metric,
            error=amount.error,
            noise_floor=amount.noise_floor,
            passes=PASSES,
        )

    def unchanged(
        self,
        scene: Scene,
        name: str | None = None,
        significance: float | None = None,
        **options: Any,
    ) -> bool:
        """Return True; fail the test if a scene moved from its baseline, or has none.

        For ``scene`` and ``options`` see :meth:`departure`; a scene may also be a baseline's path.
        ``name`` is the baseline's, if not the scene's. ``significance`` is the chance of a failure
        though nothing changed, the fixture's by default. If the options differ from the baseline's,
        the test fails, or ``--fotismos-update`` writes them.
        """
        __tracebackhide__ = True  # pytest shows the test, not this
        level = self.significance if significance is None else significance
        scene = self._scene(scene)
        given = self._options(options)
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
        # The baseline's own scene and options; those of the test replace some.
        if not _in_python(scene):
            scene = baselines.scene_from(file.baseline.scene, path)
        case = _open(scene, baselines.options_from(file.baseline.options, path) | given, name)
        # Other options give other numbers: the baseline is written again, or the test fails.
        others = _other_options(file.baseline.options, baselines.options_for(given, path))
        if others:
            if not self.update:
                raise AssertionError(
                    f"{path}: the options of the baseline and the test differ: {others}."
                    " `pytest --fotismos-update` writes it again."
                )
            checks.create(path, file.baseline.scene, case)
        elif self.update:
            checks.update(file, case, level)
        else:
            folder = self.pictures() / path.stem / path.stem
            result, view = checks.examine(file, case, level, folder)
            if result.status != "passed":
                text = [f"{path}: {len(result.moved or ())} of {result.tested} moved"]
                text += [*summary.moved_lines(result), result.versions_line]
                title = f"{path.stem} moved"
                views = [view] if view else []
                text += [f"page: {_page(folder.parent, title, views)}"]
                raise AssertionError("\n".join(filter(None, text)))
            if result.message:
                warnings.warn(f"{path}: {result.message}", stacklevel=2)
        return True

    def picture(
        self,
        name: str,
        image: Pictures,
        within: float | None = TOLERANCE,
        max_visible: float | str = LIMIT,
        significance: float | None = None,
    ) -> bool:
        """Return True; fail the test if a picture is not as its baseline, or has none.

        ``image`` is a linear array (H, W, 3), or several that differ by their noise alone, or a
        file, or a pattern of files, relative to the test's folder. It fails if more than
        ``max_visible`` of the pixels, a share from 0 to 1 or a text such as "5%", differ by more
        than the ΔE2000 ``within``. With ``within`` None any drift fails that is more than noise,
        with the chance ``significance`` of an alarm though nothing changed.
        """
        __tracebackhide__ = True  # pytest shows the test, not this
        path = self.folder / f"{atomic.file_name(name, 'a baseline')}.json"
        after = self._repeats(image)
        if not path.exists():
            if not self.update:
                raise AssertionError(
                    f"{path}: there is no such baseline. `pytest --fotismos-update` writes it."
                )
            baselines.write_pictures(path, _noiseless(after), None)
            return True
        _, before = baselines.read_pictures(path)
        begin = perf_counter()
        level = self.significance if significance is None else significance
        found = None
        if within is None:
            found = check_pictures(before, after, level)
            fault = _drift(found)
        else:
            fault = _visible(before, after, within, _share(max_visible))
        if fault and self.update:
            baselines.write_pictures(path, _noiseless(after), None)
        elif fault:
            folder = self._shown(name, before, after)
            found = found or check_pictures(before, after, level)
            made = checks.of_pictures(path, name, status="failed", found=found, begin=begin)
            _, section = checks.picture_section(made, before, found)
            section = structs.replace(section, fault=fault, approval="pytest --fotismos-update")
            page = _page(folder, f"{name} differs", moved=[section])
            raise AssertionError(f"{path}: {fault}\npage: {page}")
        return True

    def same(
        self,
        image: Pictures,
        reference: Pictures,
        within: float = TOLERANCE,
        max_visible: float | str = LIMIT,
    ) -> bool:
        """Return True; fail the test if two pictures differ visibly; see :meth:`picture`."""
        __tracebackhide__ = True  # pytest shows the test, not this
        before = _noiseless(self._repeats(reference))
        after = self._repeats(image)
        if fault := _visible(before, after, within, _share(max_visible)):
            raise AssertionError(f"{fault}\npictures: {self._shown('same', before, after)}")
        return True

    def _repeats(self, image: Pictures) -> Repeats:
        """Return pictures as repeats."""
        if isinstance(image, (str, Path)):
            beside = self.beside / image
            repeats, _ = baselines.read_repeats(str(beside), None)
            return repeats
        arrays = [image] if isinstance(image, np.ndarray) else list(image)
        for array in arrays:
            require_linear(np.asarray(array), "a picture")
            if np.ndim(array) != 3 or np.shape(array)[2] != 3:
                raise InputError(
                    f"a picture of shape {np.shape(array)} is not allowed: give linear RGB,"
                    " (height, width, 3)."
                )
            require_finite(np.asarray(array), "the picture")
        return Repeats.of(arrays)

    def _shown(self, name: str, before: Repeats, after: Repeats) -> Path:
        """Write both pictures and the map of their difference; return their folder."""
        folder = self.pictures() / atomic.file_name(name, "a picture")
        folder.mkdir(parents=True, exist_ok=True)
        error = images.error_map(LEADING(after.mean, before.mean), LEADING.map_range[1])
        panels = {
            "before": images.tonemap(before.mean),
            "now": images.tonemap(after.mean),
            LEADING.name: error,
        }
        for panel, shown in panels.items():
            (folder / f"{panel}.png").write_bytes(images.png(shown))
        return folder

    def _scene(self, scene: Scene) -> Scene:
        """Return a scene; a path relative to the test's folder, if there is such a file."""
        if not isinstance(scene, (str, Path)):
            return scene
        beside = self.beside / scene
        return beside if beside.is_file() else scene

    def _path(self, scene: Scene, name: str | None) -> Path:
        if isinstance(scene, (str, Path)) and Path(scene).suffix == ".json":
            return Path(scene)
        suffix = f"-{self.variant}" if self.variant else ""
        stem = atomic.file_name(name or _name(scene), "a baseline")
        return self.folder / f"{stem}{suffix}.json"

    def _options(self, options: dict[str, Any]) -> dict[str, Any]:
        return self._with_file(options) | ({"variant": self.variant} if self.variant else {})

    def _with_file(self, options: dict[str, Any]) -> dict[str, Any]:
        """Return options with a heuristic's file in the test's folder, if it is there."""
        if "heuristic" not in options:
            return options
        name = known_as(options["heuristic"])
        file, _ = in_file(name) or ("", "")
        is_beside = file and (self.beside / file).is_file()
        return options | {"heuristic": str(self.beside / name) if is_beside else name}


def _page(
    folder: Path, title: str, views: Sequence[SceneView] = (), moved: Sequence[Before] = ()
) -> Path:
    """Write the page of a failure into its folder, in place of that of an earlier one."""
    results.own(folder, results.PAGE, results.DETAILS)
    return checks.write_page(folder, title, views, moved)


def _noiseless(repeats: Repeats) -> Repeats:
    """Return a single picture as two that are equal, for one that has no noise to show."""
    return replace(repeats, count=2) if repeats.count == 1 else repeats


def _share(max_visible: float | str) -> float:
    """Return a share from 0 to 1, or that of a text such as "5%"; ``InputError`` for others."""
    share = share_of(max_visible) if isinstance(max_visible, str) else max_visible
    if not 0.0 <= share <= 1.0:
        raise InputError(
            f"max_visible = {max_visible!r} is not a share of the pixels: give a number from 0 to"
            " 1, such as 0.05, or a text such as '5%'."
        )
    return share


def _visible(before: Repeats, after: Repeats, within: float, max_visible: float) -> str:
    """Return what differs visibly, as a sentence; empty if a tolerance allows it."""
    gate = picture_gate(before, after, checked_threshold(within), max_visible)
    return "" if gate.state == "pass" else gate.sentence


def _drift(found: PictureCheck) -> str:
    """Return what moved by more than noise, as a sentence; empty for nothing."""
    return f"{len(found.moved)} means moved. {found.cause()}" if found.moved else ""


def _open(scene: Scene, options: Mapping[str, Any], name: str | None = None) -> Case:
    label = (name or _name(scene)) if _in_python(scene) else None
    return open_case(scene, Options.of(options), label)


def _in_python(scene: Scene) -> bool:
    return isinstance(scene, Mapping) or callable(scene)


def _other_options(
    recorded: Mapping[str, Any], given: Mapping[str, Any]
) -> dict[str, tuple[Any, Any]]:
    """Return ``{name: (baseline's, test's)}`` of the options in which they differ."""
    old = records.plain(Options.of(recorded))
    new = records.plain(Options.of(given))
    return {
        name: (old.get(name), new.get(name)) for name in given if old.get(name) != new.get(name)
    }


def _name(scene: Scene) -> str:
    if callable(scene):
        return scene.__name__
    if isinstance(scene, Mapping):
        raise InputError("a scene that is a dictionary needs a name: unchanged(scene, name=...).")
    return baselines.name_of(scene)
