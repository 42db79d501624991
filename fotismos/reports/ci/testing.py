"""Assertions on a scene: how far it departs from physics, and that nothing moved."""

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import mitsuba as mi
import numpy as np
from msgspec import structs

from fotismos.comparisons import atomic
from fotismos.comparisons import pictures as repeats
from fotismos.comparisons.case import Case, Scene, open_case
from fotismos.comparisons.check.measured import (
    Measured,
    made_small,
    measure_scene,
    picture,
    read_repeats,
)
from fotismos.comparisons.check.moved import LEVEL
from fotismos.comparisons.departure.criterion import LIMIT, TOLERANCE, checked_threshold
from fotismos.comparisons.departure.metrics import RATIO
from fotismos.comparisons.options import Options
from fotismos.comparisons.picture_files import require_linear
from fotismos.comparisons.pictures import require_one_size
from fotismos.comparisons.records.check import PICTURE, Tolerance
from fotismos.heuristic.errors import InputError, unknown
from fotismos.heuristic.heuristics import in_file, known_as
from fotismos.reference import records
from fotismos.reference.rendering.passes import require_finite
from fotismos.reference.scene.graph import set_variant
from fotismos.reports.ci import baselines, checks, summary
from fotismos.reports.files import results
from fotismos.reports.page.scene_view import Before
from fotismos.reports.terminal.parsing import share_of

UPDATE = "pytest --fotismos-update"

Pictures = np.ndarray | Sequence[np.ndarray] | str | Path
"""A linear picture (H, W, 3), several that differ by noise, a file, or a pattern of files."""


class Departure(float):
    """A departure metric of a scene: a number that explains itself where an assertion fails.

    ``interval`` is the 95 % interval of its value without noise, and ``noise_floor`` the value that
    noise alone would give; the signed ratio of luminances has neither.
    """

    scene: str
    metric: str
    interval: tuple[float, float] | None
    noise_floor: float | None

    def __new__(cls, value: float, **about: Any) -> "Departure":
        """Return the number with its attributes."""
        departure = super().__new__(cls, value)
        vars(departure).update(about)
        return departure

    def __repr__(self) -> str:
        return f"{self.metric} {float(self):.4g}"

    def fotismos_explanation(self) -> list[str]:
        """Return the lines for the message of a failed assertion."""
        lines = [f"{self.scene}: mean {self.metric} {float(self):.6g}"]
        if self.interval is not None and self.noise_floor is not None:
            low, high = self.interval
            lines.append(
                f"95 % interval: {low:.6g} to {high:.6g}; noise alone: {self.noise_floor:.4g}"
            )
        return lines


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
        if measured.caution:
            warnings.warn(f"{case.name}: {measured.caution}", stacklevel=2)
        record = measured.compared(case.name, case.options)
        about: dict[str, Any] = {"scene": case.name, "metric": metric}
        if metric == RATIO.name:
            value = record.log2_luminance.mean
            return Departure(value, **about, interval=None, noise_floor=None)
        if metric not in record.metrics:
            raise unknown("metric", metric, (*record.metrics, RATIO.name))
        values = record.metrics[metric]
        interval = (values.low, values.high)
        return Departure(values.mean, **about, interval=interval, noise_floor=values.noise_floor)

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
                raise _missing(path)
            case = _open(scene, given, name)
            named = case.word if _in_python(scene) else baselines.scene_for(str(scene), path)
            checks.update_scene(path, named, case)
            return True
        kept = self._kept(path)
        # The baseline's own scene and options; those of the test replace some.
        if not _in_python(scene):
            scene = baselines.scene_from(str(kept.scene), path)
        case = _open(scene, baselines.options_from(kept.options, path) | given, name)
        # Other options give other numbers: the baseline is written again, or the test fails.
        others = _other_options(kept.options, baselines.options_for(given, path))
        if self.update:
            file = None if others else kept.file
            checks.update_scene(path, str(kept.scene), case, level, file)
            return True
        if others:
            raise AssertionError(
                f"{path}: the options of the baseline and the test differ: {others}."
                f" `{UPDATE}` writes it again."
            )
        assert kept.file is not None, "one of 0.4 is refused"
        now = kept.file.rendered(case)
        folder = self.pictures() / path.stem / path.stem
        result, section = checks.examine(kept.file, now, str(kept.scene), level, folder)
        if section is not None:
            text = [
                f"{path}: {len(result.moved or ())} of {result.tested} moved. {result.headline}"
            ]
            text += [*summary.moved_lines(result), result.versions_line]
            section = structs.replace(section, approval=UPDATE)
            text += [f"page: {_page(folder.parent, section)}"]
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
        path = baselines.placed(self.folder / f"{atomic.file_name(name, 'a baseline')}.exr")
        after = self._repeats(image)
        level = self.significance if significance is None else significance
        tolerance = None if within is None else _tolerance(within, max_visible)
        if not (path.exists() or self.update):
            raise _missing(path)
        file = self._kept(path, name).file if path.exists() else None
        if self.update and file and file.halves[PICTURE].size != after.halves[PICTURE].size:
            file = None  # it cannot be compared, and is replaced
        section = None
        folder = self._report(name)
        if file is not None:
            report = None if self.update else folder
            _, section = checks.examine(file, after, name, level, report, tolerance)
        if self.update and (file is None or section is not None):
            checks.update(path, None, {}, _noiseless(after), name)
        elif section is not None:
            checked = section.check
            text = [f"{path}: {checked.headline}"]
            if tolerance is None:
                text += [f"{len(checked.moved)} means moved.", *checked.causes]
            page = _page(folder, structs.replace(section, approval=UPDATE))
            raise AssertionError(f"{' '.join(text)}\npage: {page}")
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
        file = baselines.BaselineFile.of(Path("same"), None, {}, before)
        after = self._repeats(image)
        tolerance = _tolerance(within, max_visible)
        result, section = checks.examine(
            file, after, "same", folder=self._report("same"), tolerance=tolerance
        )
        if section is not None:
            raise AssertionError(f"{result.headline}\npictures: {result.pictures}")
        return True

    def _repeats(self, image: Pictures) -> Measured:
        """Return pictures as repeats."""
        if isinstance(image, (str, Path)):
            return read_repeats(str(self.beside / image), Options())
        arrays = [image] if isinstance(image, np.ndarray) else list(image)
        for array in arrays:
            require_linear(np.asarray(array), "a picture")
            if np.ndim(array) != 3 or np.shape(array)[2] != 3:
                raise InputError(
                    f"a picture of shape {np.shape(array)} is not allowed: give linear RGB,"
                    " (height, width, 3)."
                )
            require_finite(np.asarray(array), "the picture")
        require_one_size(arrays)
        return picture(repeats.Pictures.of("the picture", arrays))

    def _kept(self, path: Path, name: str | None = None) -> baselines.Known:
        """Return what a baseline of a scene, or of the picture of a name, is of."""
        kept = baselines.known(path)
        baselines.require_kind(path, kept.scene, name)
        if kept.file is None and not self.update:
            raise AssertionError(
                f"{path}: this baseline is of fotismos 0.4, and cannot be compared. `{UPDATE}`"
                " makes it again of what there is today."
            )
        return kept

    def _report(self, name: str) -> Path:
        return self.pictures() / atomic.file_name(name, "a picture")

    def _scene(self, scene: Scene) -> Scene:
        """Return a scene; a path relative to the test's folder, if there is such a file."""
        if not isinstance(scene, (str, Path)):
            return scene
        beside = self.beside / scene
        return beside if beside.is_file() else scene

    def _path(self, scene: Scene, name: str | None) -> Path:
        suffixes = (baselines.SUFFIX, baselines.OLD_SUFFIX)
        if isinstance(scene, (str, Path)) and Path(scene).suffix in suffixes:
            return baselines.placed(Path(scene))
        suffix = f"-{self.variant}" if self.variant else ""
        stem = atomic.file_name(name or _name(scene), "a baseline")
        return baselines.placed(self.folder / f"{stem}{suffix}{baselines.SUFFIX}")

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


def _page(folder: Path, section: Before) -> Path:
    """Write the page of a failure into its folder, in place of that of an earlier one."""
    results.own(folder, results.PAGE)
    return checks.write_page(folder, [section])


def _missing(path: Path) -> AssertionError:
    return AssertionError(f"{path}: there is no such baseline. `{UPDATE}` writes it.")


def _noiseless(measured: Measured) -> Measured:
    """Return a single picture as two that are equal, for one that has no noise to show."""
    (half,) = measured.halves.values()
    if len(half.files) > 1:
        return measured
    return picture(replace(half, names=2 * half.names, files=2 * half.files))


def _tolerance(within: float, max_visible: float | str) -> Tolerance:
    """Return a tolerance; its share is from 0 to 1, or a text such as "5%"."""
    bound = share_of(max_visible) if isinstance(max_visible, str) else max_visible
    if not 0.0 <= bound <= 1.0:
        raise InputError(
            f"max_visible = {max_visible!r} is not a share of the pixels: give a number from 0 to"
            " 1, such as 0.05, or a text such as '5%'."
        )
    return Tolerance(within=checked_threshold(within), bound=bound)


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
