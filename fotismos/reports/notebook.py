"""The commands in Python; a notebook shows a comparison as the page does.

::

    import fotismos

    fotismos.compare(mitsuba.cornell_box(), spp=64, resolution=(128, 128))

Programs use the same functions, which return records. One runs at a time, others wait in their
threads. Each leaves Mitsuba's variant as it was.
"""

import inspect
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import wraps
from html import escape
from pathlib import Path
from threading import RLock
from typing import Any, ParamSpec, TypeVar

import numpy as np

import fotismos.comparisons.compare
from fotismos.comparisons.audit.checks import Audit as AuditRecord
from fotismos.comparisons.audit.checks import Kind
from fotismos.comparisons.audit.checks import audit as examined
from fotismos.comparisons.case import RGB, open_case
from fotismos.comparisons.compare import compare_pictures
from fotismos.comparisons.departure.metrics import Metric
from fotismos.comparisons.departure.metrics import declare as declare_metric
from fotismos.comparisons.ladder.methods import declare as declare_method
from fotismos.comparisons.ladder.timed_pictures import TimedPicture
from fotismos.comparisons.names import as_files, with_files
from fotismos.comparisons.prepared import prepare
from fotismos.comparisons.records.check import CheckRecord
from fotismos.comparisons.records.cost import Cost as CostRecord
from fotismos.comparisons.records.cost import Method
from fotismos.comparisons.records.engine import EngineCost
from fotismos.comparisons.records.fit import FitRecord
from fotismos.comparisons.records.images import Comparison, PixelTerms
from fotismos.comparisons.steps import steps
from fotismos.heuristic import user_shaders
from fotismos.heuristic.errors import InputError
from fotismos.heuristic.heuristics import Heuristic
from fotismos.heuristic.heuristics import declare as declare_heuristic
from fotismos.heuristic.plugins import register
from fotismos.heuristic.user_code import same_variant
from fotismos.reference.records import Missing
from fotismos.reference.scene.graph import set_variant
from fotismos.reports import verdict
from fotismos.reports.charts import figures
from fotismos.reports.ci import baselines, checks
from fotismos.reports.command import OnScene
from fotismos.reports.commands.check import Baseline
from fotismos.reports.commands.compare import Compare
from fotismos.reports.commands.cost import Cost
from fotismos.reports.commands.fit import Fit
from fotismos.reports.page import page
from fotismos.reports.run.scene_files import view_of
from fotismos.reports.terminal.plan_lines import PlanReport, plan_report

HEIGHT = 900
"""Height of the frame in pixels: the viewer with its controls fits a wide notebook."""

PICTURED = ("image", "reference")
"""Options that take pictures."""

DENSITY = 130
"""Dots per inch of the picture for notebooks that cannot show the frame."""


# Reentrant, since a function that makes a scene may itself compare others.
_running = RLock()

Arguments = ParamSpec("Arguments")
Asked = TypeVar("Asked")
Result = TypeVar("Result")


def _alone(function: Callable[Arguments, Result]) -> Callable[Arguments, Result]:
    """Let a function run in one thread at a time, read shaders again, and keep the variant."""

    @wraps(function)
    def call(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
        with _running, same_variant():
            user_shaders.forget()
            return function(*arguments, **options)

    return call


def _asked_as(
    kind: Callable[Arguments, Asked],
) -> Callable[[Callable[[Asked], Result]], Callable[Arguments, Result]]:
    """Let a function of a command take what the command's declaration takes.

    Pictures may be arrays (H, W, 3) of linear colours, too.
    """
    declaration: Any = kind
    declared = inspect.signature(declaration)

    def decorated(function: Callable[[Asked], Result]) -> Callable[Arguments, Result]:
        def call(*arguments: Arguments.args, **options: Arguments.kwargs) -> Result:
            given = dict(declared.bind_partial(*arguments).arguments)
            values, arrays = _with_names(given | options, PICTURED)
            if isinstance(values.get("pictures"), Mapping):
                values["pictures"], more = _settings(values["pictures"])
                arrays |= more
            with as_files(arrays):
                return function(declaration.of(values))

        returned = inspect.signature(function).return_annotation
        shown: Any = wraps(function)(call)
        shown.__signature__ = declared.replace(return_annotation=returned)
        return _alone(shown)

    return decorated


@dataclass(frozen=True)
class Shown:
    """A comparison and the page that shows it.

    `comparison` has the record, ``comparison.record``, and the images, ``comparison.images``.
    """

    comparison: Comparison = field(repr=False)
    page: str = field(repr=False)

    def __repr__(self) -> str:
        """Return the finding, for consoles and notebooks that show text alone."""
        return verdict.about(self.comparison.record)

    def _repr_html_(self) -> str:
        """Show the page in a frame, which isolates its styles and scripts."""
        # In a frame with `srcdoc` the page's address begins with about:, by which its first script
        # knows where it is.
        return (
            f'<iframe sandbox="allow-scripts" style="width: 100%; height: {HEIGHT}px; border: 0"'
            f' title="Comparison" srcdoc="{escape(self.page)}"></iframe>'
        )

    def _repr_png_(self) -> bytes:
        """Show both halves and the map of the error where scripts do not run."""
        return figures.drawn(figures.strip(self.comparison), "png", DENSITY)

    def at(self, x: int, y: int) -> PixelTerms:
        """Return the terms of 8.10 at a column and row, or at the nearest that has them."""
        grid = self.comparison.terms
        if isinstance(grid, Missing):
            raise InputError(f"there are no terms. {grid.reason}")
        if (terms := grid.at(x, y)) is None:
            raise InputError(f"pixel {x}, {y} sees no surface. Give one that does.")
        return terms


@_asked_as(Compare)
def compare(asked: Compare) -> Shown:
    """Compare a scene as ``fotismos compare`` does.

    ``scene`` is a built-in name, the path of a file (.xml, .py), a dictionary for
    ``mitsuba.load_dict``, or a function that returns one; ``name`` replaces its name. ``options``
    are those of the command line, such as ``spp=64`` samples per pixel in all, or
    ``resolution=(128, 128)`` pixels. ``why`` finds causes, which takes some seconds. Pictures given
    as ``image`` and ``reference`` may replace the halves: files, or arrays (H, W, 3) of linear
    colours. With both, no scene is needed.

    Colours of the images are linear, in units of display white; times are in seconds. Raises
    `InputError` for a scene or an option that is not allowed, `NonFiniteError` for a NaN or an
    infinity in a rendering, and `InstallationError` if a library is missing.
    """
    chosen = with_files(asked.options)
    if asked.scene is None and chosen.image and chosen.reference:
        comparison = compare_pictures(chosen, asked.name or "picture")
    else:
        case = open_case(asked.scene, chosen, asked.name)
        comparison = fotismos.comparisons.compare.compare(
            case.source, case.options, command=case.command(), then=steps(why=asked.why)
        )
    return Shown(comparison, page.render([view_of(comparison)]))


def _with_names(
    given_values: Mapping[str, Any], pictured: Iterable[str]
) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return values in which arrays of the ``pictured`` have names, and the arrays by these."""
    values: dict[str, Any] = dict(given_values)
    arrays: dict[str, Any] = {}
    for half in pictured:
        given = values.get(half)
        several = [given] if isinstance(given, np.ndarray) else given
        if not isinstance(several, (list, tuple)):
            continue
        names = []
        for number, picture in enumerate(several, start=1):
            name = f"{half} {number}.npy" if isinstance(picture, np.ndarray) else str(picture)
            names.append(name)
            if isinstance(picture, np.ndarray):
                arrays[name] = picture
        values[half] = names
    return values, arrays


def _settings(words: Mapping[str, Any]) -> tuple[list[TimedPicture], dict[str, Any]]:
    """Return settings, ``NAME @ TIME`` with a picture or several, and the arrays by their names."""
    # Names of settings may be anything: arrays are called by their numbers.
    shots = {f"picture {number}": shot for number, shot in enumerate(words.values(), start=1)}
    shots, arrays = _with_names(shots, tuple(shots))
    settings = [_setting(word, shot) for word, shot in zip(words, shots.values(), strict=True)]
    return settings, arrays


def _setting(word: str, picture: str | Path | list[str]) -> TimedPicture:
    """Return a setting, ``NAME @ TIME``, of one picture or several."""
    names = picture if isinstance(picture, list) else [str(picture)]
    if not names:
        raise InputError(f"{word!r} has no picture: give a file, a pattern, an array, or several.")
    return replace(TimedPicture.of(f"{word}={names[0]}"), patterns=tuple(names))


@_asked_as(OnScene)
def plan(asked: OnScene) -> PlanReport:
    """Return which effects a scene needs, and what will be simulated.

    Arguments and errors are those of :func:`compare`; only the plan's probe is rendered.
    """
    case = open_case(asked.scene, asked.options, asked.name)
    return plan_report(case.name, prepare(case.source, case.options), case.variant)


@_asked_as(Cost)
def cost(asked: Cost) -> CostRecord | EngineCost:
    """Return what each step of accuracy costs: seconds and ΔE2000 by method and samples.

    ``at`` is a width and height in pixels to predict for. ``spp`` is the largest number of samples,
    ``rounds`` how often each method is timed. It takes about a minute. ``pictures`` are settings of
    another renderer, ``{"name @ 1.2ms": picture}``: a file, a pattern, an array (H, W, 3) of linear
    colours, or several of them. ``machine`` and ``kernel_time`` are what their times are of, as in
    the command. With a ``reference``, no scene is needed. Other arguments and errors are those of
    :func:`compare`.
    """
    if asked.scene is None and asked.reference and asked.engine:
        asked.require_no_scene()
        return asked.judge(asked.name or "pictures").record
    return asked.study(open_case(asked.scene, asked.options, asked.name)).record


@_asked_as(Fit)
def fit(asked: Fit) -> FitRecord:
    """Return the best heuristic parameters, and the error that remains.

    ``loss`` is ``perceptual``, the mean ΔE2000, or ``linear``, the squared difference of linear
    colours; ``form`` is that of the lobe. Other arguments and errors are those of :func:`compare`.
    """
    return asked.fit(asked.scene).record


@_asked_as(Baseline)
def check(asked: Baseline) -> CheckRecord:
    """Return whether the scene of a baseline's file moved from what was measured before.

    ``significance`` is the chance of a false alarm, above 0 and below 1. Raises `InputError` if the
    baseline or its scene cannot be read.
    """
    paths = baselines.find(asked.baseline)
    if len(paths) > 1:
        raise InputError(
            f"{asked.baseline}: this folder has {len(paths)} baselines. Give the file of one."
        )
    file = baselines.read(paths[0])
    now = file.rendered(file.open())
    result, _ = checks.examine(file, now, str(file.baseline.scene), asked.significance)
    return result


@_alone
def audit(
    heuristic: str | None = None,
    bsdf: str | None = None,
    like: str | None = None,
    **parameters: Any,
) -> AuditRecord:
    """Return the checks of a heuristic, or of a type of BSDF, by itself.

    ``parameters`` are its own; its lobe is compared with the closed form that it is ``like``, such
    as ``"ggx"``. Raises `InputError` for an unknown name or parameter.
    """
    if (heuristic is None) == (bsdf is None):
        raise InputError("audit needs one of heuristic and bsdf.")
    # In this order: plugins are registered for the current variant.
    set_variant(RGB)
    register()
    kind: Kind = "bsdf" if heuristic is None else "heuristic"
    return examined(kind, str(heuristic or bsdf), parameters, like=like)


def declare(entry: Heuristic | Metric | Method) -> Any:
    """Declare a heuristic, a metric or a method for this process, and return it."""
    registries: dict[type, Callable[[Any], Any]] = {
        Heuristic: declare_heuristic,
        Metric: declare_metric,
        Method: declare_method,
    }
    for kind, registry in registries.items():
        if isinstance(entry, kind):
            return registry(entry)
    raise InputError(
        f"{entry!r} of type {type(entry).__name__} cannot be declared. Give a Heuristic, a Metric"
        " or a Method."
    )
