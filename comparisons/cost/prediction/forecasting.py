"""Predict the cost of methods at a size too large to try them all, from smaller sizes.

Each method is rendered at three smaller sizes of the same shape, in turn, and curves are fitted to
its times (:mod:`comparisons.cost.prediction.time_curve`) and errors
(:mod:`comparisons.cost.prediction.error_curve`). On request, it is also rendered at the size
itself, in the same turns, with counts that were not fitted.
"""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from itertools import groupby
from math import inf
from operator import attrgetter
from statistics import median

import numpy as np

from comparisons.cost.cost_record import (
    Cheapest,
    Forecast,
    Prediction,
    Range,
    Seen,
    TimeLaw,
)
from comparisons.cost.effort import DETERMINISTIC_SPP, Effort
from comparisons.cost.front import ERRORS, reached
from comparisons.cost.judging import Judge, judged
from comparisons.cost.ladder import Distinct
from comparisons.cost.methods import Methods
from comparisons.cost.prediction.error_curve import ErrorCurve
from comparisons.cost.prediction.error_law import LEVEL, ErrorLaw, intervals
from comparisons.cost.prediction.target import SEEN_SPP, Size, sizes
from comparisons.cost.prediction.time_curve import TimeCurve
from comparisons.cost.timing import interval
from reference.rendering.passes import Progress, passes
from reference.rendering.renderer import Renderer

FITTED_SPP = (4, 16, 64), (4, 8, 16, 64), (4, 16)
"""Counts at each size, from the smallest; errors are drawn from the images of the middle one."""

FORECAST_SPP = tuple(2**power for power in range(13))

Key = tuple[str, Size, int]


def predict(
    methods: Methods,
    target: Size,
    effort: Effort,
    seed: int,
    is_measured: bool = False,
    progress: Progress | None = None,
) -> Prediction:
    """Predict time and error of each method at a size.

    Parameters
    ----------
    methods
        The methods of a prepared comparison, whose film has the shape of the requested size.
    target
        The requested width and height.
    effort
        Rounds, and samples of the reference.
    seed
        Seed of the run.
    is_measured
        Whether to render at the requested size, too.
    progress
        ``progress(stage, done, total)``.

    Raises
    ------
    InputError
        For a size that is too small.
    """
    fitted = sizes(target)
    everywhere = (*fitted, target) if is_measured else fitted
    given = methods.ready, methods.viewing, effort, seed, progress
    judges = {size: judged(*given, size)[0] for size in everywhere}
    renderers = _renderers(methods, fitted, target if is_measured else None)
    seconds, errors, images = _measure(renderers, judges, fitted[1], effort.rounds, seed, progress)
    times = {rung.name: _time_curve(rung.name, seconds, target) for rung in methods.rungs}
    laws = {
        rung.name: _error_law(rung.name, fitted, errors, images, judges[fitted[1]])
        for rung in methods.rungs
    }
    scatter = {name: curve.scatter([*times.values()]) for name, curve in times.items()}
    error = intervals([*laws.values()], target[0])
    forecasts = [
        Forecast(
            method=rung.name,
            spp=spp,
            seconds=Range(*times[rung.name].at(target[0] * target[1], spp, scatter[rung.name])),
            error=Range(*map(float, error(laws[rung.name], spp))),
            measured=_seen((rung.name, target, spp), seconds, errors),
        )
        for rung in methods.rungs
        for spp in _forecast_counts(rung, is_measured)
    ]
    return Prediction(
        resolution=target,
        level=LEVEL,
        fitted=fitted,
        rounds=effort.rounds,
        laws=tuple(
            TimeLaw(name, *curve.coefficients, scatter[name]) for name, curve in times.items()
        ),
        forecasts=tuple(forecasts),
        cheapest=tuple(cheapest(forecasts, error) for error in ERRORS),
    )


def cheapest(forecasts: Sequence[Forecast], error: float) -> Cheapest:
    """Return the method predicted to reach an error in the shortest time."""
    by_method = groupby(forecasts, key=attrgetter("method"))
    found = (_way(list(own), error) for _, own in by_method)
    return min(found, key=_seconds, default=Cheapest(error))


def _seconds(way: Cheapest) -> float:
    return way.seconds.value if way.seconds else inf


def _way(own: Sequence[Forecast], error: float) -> Cheapest:
    """Return when a method reaches an error."""
    place = reached([forecast.error.value for forecast in own], error)
    if place is None:
        return Cheapest(error)
    spp = round(place.of([forecast.spp for forecast in own]))
    ends = ([getattr(f.seconds, end) for f in own] for end in ("value", "low", "high"))
    return Cheapest(error, own[0].method, spp, Range(*map(place.of, ends)))


def _forecast_counts(rung: Distinct, is_measured: bool) -> Sequence[int]:
    """Return the counts of a method; one without random numbers needs few."""
    seen = SEEN_SPP if is_measured else ()
    return sorted({*(FORECAST_SPP if rung.monte_carlo else DETERMINISTIC_SPP), *seen})


def _renderers(methods: Methods, fitted: Sequence[Size], seen: Size | None) -> dict[Key, Renderer]:
    """Return a renderer for each method, size and count; scenes are shared and resized."""
    jobs = [*zip(fitted, FITTED_SPP, strict=True), *([(seen, SEEN_SPP)] if seen else [])]
    made: dict[Key, Renderer] = {}
    for rung in methods.rungs:
        for size, (first, *others) in jobs:  # what a kernel prepares may depend on the film's size
            own = made[rung.name, size, first] = methods.renderer(rung.method, first, size)
            made |= {(rung.name, size, spp): own.sampled(spp) for spp in others}
    return made


def _measure(
    renderers: Mapping[Key, Renderer],
    judges: Mapping[Size, Judge],
    kept_size: Size,
    rounds: int,
    seed: int,
    progress: Progress | None,
) -> tuple[dict[Key, list[float]], dict[Key, list[float]], dict[Key, np.ndarray]]:
    """Render in turn; return seconds and errors of each key, and the images at one size."""
    errors: dict[Key, list[float]] = defaultdict(list)
    images: dict[Key, list[np.ndarray]] = defaultdict(list)
    loop = passes([*renderers.values()], seed, rounds + 2, progress=progress, stage="predicting")
    for one in loop:
        if one.number < 2:  # tracing, compilation and cold caches
            continue
        for key, image in zip(renderers, one.images, strict=True):
            judge, pixels = judges[key[1]], np.array(image)
            errors[key].append(judge.errors(pixels)[0])
            if key[1] == kept_size:
                images[key].append(pixels[judge.counted])
    seconds = {key: renderer.times[2:] for key, renderer in renderers.items()}
    return seconds, errors, {key: np.stack(found) for key, found in images.items()}


def _time_curve(name: str, seconds: Mapping[Key, list[float]], target: Size) -> TimeCurve:
    """Fit the times of a method, except at the requested size."""
    keys = [key for key in seconds if key[0] == name and key[1] != target]
    return TimeCurve.fit(
        [width * height for _, (width, height), _ in keys],
        [spp for *_, spp in keys],
        [median(seconds[key]) for key in keys],
    )


def _error_law(
    name: str,
    fitted: Sequence[Size],
    errors: Mapping[Key, list[float]],
    images: Mapping[Key, np.ndarray],
    judge: Judge,
) -> ErrorLaw:
    """Return the law of a method's errors, with its images at the middle size."""
    own = {
        (size[0], spp): found
        for (method, size, spp), found in errors.items()
        if method == name and size in fitted
    }
    kept = {spp: images[name, size, spp] for method, size, spp in images if method == name}
    (first, _), (middle, _), (last, _) = fitted
    return ErrorLaw((first, middle, last), own, ErrorCurve.measured(kept, judge.distance))


def _seen(
    key: Key, seconds: Mapping[Key, list[float]], errors: Mapping[Key, list[float]]
) -> Seen | None:
    """Return the measurements at the requested size, None if there are none."""
    if key not in seconds:
        return None
    found = errors[key]
    return Seen(interval(seconds[key]), float(np.mean(found)), float(np.std(found, ddof=1)))
