"""What methods cost at a size that is too large to try them all: predicted from smaller ones.

Each method is rendered at three smaller sizes of the same shape, in turns, and its curves
(:mod:`comparisons.cost.curves`) are fitted. Where asked to, it is rendered at the size itself, too,
in the same turns, with counts that were not fitted.
"""

from collections import defaultdict
from collections.abc import Sequence
from itertools import pairwise
from math import exp, log, sqrt
from statistics import NormalDist, median

import numpy as np

from comparisons.cost.cost_record import (
    Cheapest,
    Forecast,
    Prediction,
    Range,
    Seen,
    TimeLaw,
)
from comparisons.cost.curves import LEAST_DOUBT, LEVEL, ErrorCurve, TimeCurve, across_sizes
from comparisons.cost.effort import DETERMINISTIC_SPP, Effort
from comparisons.cost.front import ERRORS
from comparisons.cost.ladder import Distinct
from comparisons.cost.methods import Methods
from comparisons.cost.timing import Judge, interval
from heuristic.errors import InputError
from reference.rendering import memory
from reference.rendering.gbuffer import gbuffer
from reference.rendering.passes import Progress, Stream, passes
from reference.rendering.renderer import LARGEST_PASS, Renderer
from reference.rendering.sums import Accumulator, Estimate

LARGEST_FITTED = 256**2
"""Pixels of the largest size that is fitted, where the asked one is at least four times that."""

FITTED_SPP = {0: (4, 16, 64), 1: (4, 8, 16, 64), 2: (4, 16)}
"""Counts at each size, from the smallest; errors are drawn from the images of the middle one."""

SEEN_SPP = (6, 32)
"""Counts that are measured at the asked size: none of them is fitted."""

FORECAST_SPP = tuple(2**power for power in range(13))

Size = tuple[int, int]
Key = tuple[str, Size, int]


def sizes(target: Size) -> tuple[Size, Size, Size]:
    """Return the sizes that are fitted for another one: smaller ones of its shape.

    Raises
    ------
    InputError
        Where the asked size is too small for that.
    """
    area = target[0] * target[1]
    largest = min(LARGEST_FITTED, area / 4)
    scales = [sqrt(largest / area) * factor for factor in (1 / 4, 1 / 2, 1)]
    found = tuple((round(target[0] * s), round(target[1] * s)) for s in scales)
    if min(found[0]) < 4:
        raise InputError(
            f"{target[0]}x{target[1]} is too small to predict anything for: measure it itself with"
            " --resolution."
        )
    return found


def require_shape(measured: Size, target: Size) -> None:
    """Raise InputError where two sizes are not of one shape, to half a pixel of the smaller."""
    (width, height), (wide, high) = sorted([measured, target])
    if abs(high * width / wide - height) > 1:
        raise InputError(
            f"{measured[0]}x{measured[1]} and {target[0]}x{target[1]} are not of one shape: give"
            " --resolution the shape of --at, or leave it out."
        )


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
        The methods of a prepared comparison, whose film has the shape of the asked size.
    target
        The asked width and height.
    effort
        Rounds, and samples of the reference.
    seed
        Of the run.
    is_measured
        Whether to render at the asked size, too.
    progress
        ``progress(stage, done, total)``.

    Raises
    ------
    InputError
        For a size that is too small, or too large for the memory or one pass.
    """
    fitted = sizes(target)
    if is_measured:
        _require_room(methods.ready.pair.name, target)
    everywhere = (*fitted, target) if is_measured else fitted
    judges = {size: _judge(methods, size, effort, seed, progress) for size in everywhere}
    renderers = _renderers(methods, fitted, target if is_measured else None)
    seconds, errors, images = _measure(renderers, judges, fitted[1], effort.rounds, seed, progress)
    laws, forecasts = [], []
    for rung in methods.rungs:
        keys = [key for key in renderers if key[0] == rung.name and key[1] in fitted]
        law = TimeCurve.fit(
            [size[0] * size[1] for _, size, _ in keys],
            [spp for *_, spp in keys],
            [median(seconds[key]) for key in keys],
        )
        laws.append(TimeLaw(rung.name, *law.coefficients, law.scatter))
        kept = {key[2]: images[key] for key in keys if key[1] == fitted[1]}
        curve = ErrorCurve.measured(kept, judges[fitted[1]].distance)
        growth = _growth(rung.name, fitted, target, errors)
        for spp in _forecast_counts(rung, is_measured):
            key = rung.name, target, spp
            seen = _seen(seconds[key], errors[key]) if key in renderers else None
            forecasts.append(
                Forecast(
                    method=rung.name,
                    spp=spp,
                    seconds=Range(*law.at(target[0] * target[1], spp)),
                    error=_error(curve, growth, spp, rung.monte_carlo),
                    measured=seen,
                )
            )
    return Prediction(
        resolution=target,
        level=LEVEL,
        fitted=fitted,
        rounds=effort.rounds,
        laws=tuple(laws),
        forecasts=tuple(forecasts),
        cheapest=tuple(cheapest(forecasts, error) for error in ERRORS),
    )


def cheapest(forecasts: Sequence[Forecast], error: float) -> Cheapest:
    """Return the method that reaches an error in the least time, as far as is predicted."""
    ways = [_reached(forecasts, method, error) for method in _methods_of(forecasts)]
    found = [way for way in ways if way is not None]
    if not found:
        return Cheapest(error)
    method, spp, seconds = min(found, key=lambda way: way[2].value)
    return Cheapest(error, method, spp, seconds)


def _methods_of(forecasts):
    return list(dict.fromkeys(forecast.method for forecast in forecasts))


def _reached(forecasts, method, error):
    """Return the method, the samples and the seconds by which it reaches an error, or None."""
    own = [forecast for forecast in forecasts if forecast.method == method]
    if own[0].error.value <= error:
        return method, own[0].spp, own[0].seconds
    for before, after in pairwise(own):
        if after.error.value <= error < before.error.value:
            if after.error.value == 0:
                return method, after.spp, after.seconds
            share = log(before.error.value / error) / log(before.error.value / after.error.value)
            return (
                method,
                round(_mixed(before.spp, after.spp, share)),
                Range(
                    *(
                        _mixed(getattr(before.seconds, end), getattr(after.seconds, end), share)
                        for end in ("value", "low", "high")
                    )
                ),
            )
    return None


def _mixed(before, after, share):
    return exp(log(before) * (1 - share) + log(after) * share)


def _require_room(name, target):
    width, height = target
    most = LARGEST_PASS // max(*SEEN_SPP, DETERMINISTIC_SPP)
    if width * height > most:
        raise InputError(
            f"{width}x{height} is too large to be measured: {most} pixels are allowed. Leave out"
            " --measure to have it predicted."
        )
    memory.require(name, width, height)


def _forecast_counts(rung: Distinct, is_measured: bool) -> Sequence[int]:
    """Return the counts of a method; one without random numbers has one, and those measured."""
    seen = SEEN_SPP if is_measured else ()
    return sorted({*(FORECAST_SPP if rung.monte_carlo else (DETERMINISTIC_SPP,)), *seen})


def _renderers(methods, fitted, seen):
    """Return a renderer for each method, size and count; scenes are shared, and resized."""
    wanted = [(size, FITTED_SPP[place]) for place, size in enumerate(fitted)]
    if seen:
        wanted.append((seen, SEEN_SPP))
    return {
        (rung.name, size, spp): methods.renderer(rung.method, spp, size)
        for rung in methods.rungs
        for size, spps in wanted
        for spp in spps
    }


def _judge(methods, size, effort, seed, progress):
    """Return what tells errors at a size: a converged reference of it."""
    ready = methods.ready
    counted = gbuffer(ready.scene, *size).hit
    reference = Renderer(
        ready.scene, ready.reference.integrator, effort.reference_spp, "reference image", size
    )
    total = Accumulator()
    count, stream = max(ready.plan.passes, 2), Stream.OTHER_SIDE
    for one in passes(
        [reference], seed, count, stream=stream, progress=progress, stage="reference"
    ):
        total.add(one.images[0])
    estimate: Estimate = total.estimate()
    return Judge(estimate, counted, methods.viewing)


def _measure(renderers, judges, kept_size, rounds, seed, progress):
    """Render in turns; return seconds and errors of each key, and the images at one size."""
    errors, images = defaultdict(list), defaultdict(list)
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


def _growth(name, fitted, target, errors):
    """Return ``{count: (factor, relative doubt)}``: from the middle size's error to the asked."""
    found = {}
    for spp in FITTED_SPP[2]:
        own = [errors[name, size, spp] for size in fitted[1:]]
        means = [float(np.mean(each)) for each in own]
        stderrs = [float(np.std(each, ddof=1) / sqrt(len(each))) for each in own]
        error, doubt = across_sizes([size[0] for size in fitted[1:]], means, stderrs, target[0])
        if means[0] > 0 and error > 0:
            found[spp] = error / means[0], doubt / error
    return found or {DETERMINISTIC_SPP: (1.0, 0.0)}


def _error(curve, growth, spp, is_random):
    """Return the error at the asked size, and its interval."""
    value, stderr = curve.at(spp)
    factor, doubt = growth[min(growth, key=lambda count: abs(log(count / spp)))]
    value *= factor
    doubt = np.hypot(doubt, LEAST_DOUBT if is_random else 0.0)
    spread = float(np.hypot(factor * stderr, doubt * value))
    reach = NormalDist().inv_cdf((1 + LEVEL) / 2) * spread
    return Range(value, max(value - reach, 0.0), value + reach)


def _seen(seconds, errors):
    return Seen(interval(seconds), float(np.mean(errors)), float(np.std(errors, ddof=1)))
