"""Predict the cost of methods at a size too large to try them all, from three smaller sizes.

Time of one image of ``w × h`` pixels with ``s`` samples each, for later frames (the first also
traces and compiles), and error against the reference::

    T(w, h, s) = t0 + t1 w h + t2 w h s
    E²(w, s) = b + d / w + c / s + e / (w² s)

The share of pixels at edges is proportional to ``1 / w``, so edges cause the terms with ``w``;
``b`` is the method's bias, ``c`` its noise. All coefficients are at least 0 (but ``d``, since a
small image may also hide errors), fitted by least squares of relative misfits.

An interval covers the misfit of the measurements at the largest size to a fit without them, over
all methods of a run, with more weight on a method's own, and the jackknife over all measurements.
"""

from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from math import exp, hypot, inf, sqrt
from operator import attrgetter

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy import stats
from scipy.optimize import nnls

from comparisons.cost.cost_record import Forecast, Measured, Method, Prediction, Reached, Seconds
from comparisons.cost.front import ERRORS, at, reached
from comparisons.cost.measure import DETERMINISTIC_SPP, Effort, Size, measure, meter_at
from comparisons.cost.methods import Ladder
from comparisons.hybrids.why import MeanError
from heuristic.errors import InputError
from reference.rendering.renderer import LARGEST_PASS, Progress, require_memory

LARGEST_FITTED = 256**2
"""Pixels of the largest fitted size, if the requested one has at least four times as many."""

FITTED_SPP = (4, 16, 64), (4, 16, 64), (4, 16)
"""Counts at each size, from the smallest."""

MEASURED_SPP = (6, 32)
"""Counts measured at the requested size; none of them is fitted."""

FORECAST_SPP = tuple(2**power for power in range(13))

LEVEL = 0.9
"""Chance that an interval holds a later measurement."""

SHARED = 6
"""Weight of the misfits of all methods together, next to a method's own."""

LEAST_SPREAD = 0.01
"""Relative spread of times, at least: no clock or machine is better."""

UNSEEN, UNRESOLVED = 0.02, 0.015
"""Half an interval of an error, at least: in ΔE, and as a share of the error. Three small sizes
show no less: all methods share the reference's chance of rare bright pixels."""

Place = tuple[float, float, float]
"""Width, height and samples per pixel."""

Terms = Callable[[NDArray], NDArray]

TINY = 1e-9
"""Stands for an error of 0, which has no logarithm."""


class Curve:
    """A positive quantity over width, height and samples, ``places`` (n, 3).

    It is linear in ``terms`` of them, (n, 3) -> (n, k), with coefficients of at least 0. They are
    fitted to ``values`` (n,), of which the last ``held`` are of the largest size.
    """

    def __init__(self, terms: Terms, places: ArrayLike, values: ArrayLike, held: int) -> None:
        self._terms, known = terms, terms(np.asarray(places, float))
        measured = np.maximum(np.asarray(values, float), TINY)
        count = len(measured)

        def fitted(rows: NDArray) -> NDArray:
            relative = known[rows] / measured[rows, None]
            return np.asarray(nnls(relative, np.ones(len(relative)))[0])

        every = np.arange(count)
        found = known[-held:] @ fitted(every < count - held)
        self.missed = np.log(np.maximum(found, TINY) / measured[-held:])
        """Misfit in logarithms, to a fit without the largest size."""
        self._fits = np.stack([fitted(every != out) for out in (-1, *range(count))])

    def at(self, place: Place) -> tuple[float, float]:
        """Return the value at a place, and its uncertainty in logarithms by the jackknife."""
        (there,) = self._terms(np.array([place], float))
        value, *left_out = np.maximum(self._fits @ there, TINY)
        return float(value), sqrt((len(left_out) - 1) * float(np.var(np.log(left_out))))


def time_curve(places: ArrayLike, seconds: ArrayLike, held: int) -> Curve:
    """Return the curve of a method's time."""

    def terms(places: NDArray) -> NDArray:
        pixels = places[:, 0] * places[:, 1]
        return np.stack([np.ones(len(places)), pixels, pixels * places[:, 2]], axis=1)

    return Curve(terms, places, seconds, held)


def error_curve(places: ArrayLike, errors: ArrayLike, held: int) -> Curve:
    """Return the curve of a method's squared mean error."""

    def terms(places: NDArray) -> NDArray:
        width, _, spp = places.T
        edges = 1 / width
        return np.stack([edges**0, edges, -edges, 1 / spp, edges**2 / spp], axis=1)

    return Curve(terms, places, np.square(errors), held)


def spreads(curves: Sequence[Curve]) -> list[float]:
    """Return the spread of each curve's logarithm, from its own misfits and those of all."""
    shared = float(np.mean(np.concatenate([curve.missed for curve in curves]) ** 2))
    return [
        sqrt((float(np.sum(curve.missed**2)) + SHARED * shared) / (len(curve.missed) + SHARED))
        for curve in curves
    ]


def time_at(curve: Curve, place: Place, spread: float) -> Seconds:
    """Return seconds at a place, with their interval."""
    value, uncertainty = curve.at(place)
    factor = exp(_reach(curve) * hypot(uncertainty, spread, LEAST_SPREAD))
    return Seconds(value=value, low=value / factor, high=value * factor)


def error_at(curve: Curve, place: Place, spread: float) -> MeanError:
    """Return the mean error at a place, with its interval."""
    square, uncertainty = curve.at(place)
    value = sqrt(square)
    # Half of the square's, since it is of a logarithm.
    half = value * _reach(curve) * hypot(uncertainty, spread) / 2
    half = hypot(half, UNSEEN, UNRESOLVED * value)
    return MeanError(mean=value, low=max(value - half, 0.0), high=value + half)


def _reach(curve: Curve) -> float:
    return float(stats.t.ppf((1 + LEVEL) / 2, len(curve.missed) + SHARED - 1))


def predict(
    ladder: Ladder,
    target: Size,
    effort: Effort,
    seed: int,
    is_measured: bool,
    progress: Progress,
) -> Prediction:
    """Predict time and error of each method at a size of the film's shape, in pixels.

    On request, they are also measured there, in the same turns, with counts that are not fitted.
    It resizes the films of the ladder's scenes.
    """
    fitted = sizes(target)
    counts = dict(zip(fitted, FITTED_SPP, strict=True))
    if is_measured:
        counts[target] = MEASURED_SPP
    meters = {size: meter_at(ladder, effort, seed, progress, size) for size in counts}
    renderers = {}
    for method in ladder.methods:
        for size, (first, *others) in counts.items():  # what a kernel prepares may depend on it
            own = renderers[method.name, first, size] = ladder.renderer(method, first, size)
            renderers |= {(method.name, spp, size): own.sampled(spp) for spp in others}
    points, _ = measure(
        renderers, lambda key: meters[key[2]], effort.rounds, seed, progress, "predicting"
    )
    return predicted(ladder.methods, points, target, fitted, effort.rounds)


def predicted(
    methods: Sequence[Method],
    points: Mapping[tuple[str, int, Size], Measured],
    target: Size,
    fitted: tuple[Size, ...],
    rounds: int,
) -> Prediction:
    """Predict from points, those at ``target`` only to stand beside the forecasts."""
    times, errors = [], []
    for method in methods:
        own = [(k, p) for k, p in points.items() if k[0] == method.name and k[2] in fitted]
        places = [(*size, spp) for (_, spp, size), _ in own]
        held = len(FITTED_SPP[-1])
        times.append(time_curve(places, [p.seconds.value for _, p in own], held))
        errors.append(error_curve(places, [p.error.mean for _, p in own], held))
    forecasts = [
        Forecast(
            method=method.name,
            spp=spp,
            seconds=time_at(time, (*target, spp), time_spread),
            error=error_at(error, (*target, spp), error_spread),
            measured=points.get((method.name, spp, target)),
        )
        for method, time, error, time_spread, error_spread in zip(
            methods, times, errors, spreads(times), spreads(errors), strict=True
        )
        for spp in _counts(method, (method.name, MEASURED_SPP[0], target) in points)
    ]
    return Prediction(
        resolution=target,
        level=LEVEL,
        fitted=fitted,
        rounds=rounds,
        forecasts=tuple(forecasts),
        cheapest=tuple(cheapest(forecasts, error) for error in ERRORS),
    )


def cheapest(forecasts: Sequence[Forecast], error: float) -> Reached:
    """Return the method predicted to reach an error first; it has no name if none does."""
    found = [Reached(method="", error=error, seconds=None)]
    for method, group in groupby(forecasts, key=attrgetter("method")):
        own = list(group)
        place = reached([forecast.error.mean for forecast in own], error)
        if place is not None:
            ends = {
                end: at([getattr(forecast.seconds, end) for forecast in own], place)
                for end in ("value", "low", "high")
            }
            spp = round(at([forecast.spp for forecast in own], place))
            found.append(Reached(method=method, error=error, seconds=Seconds(**ends), spp=spp))
    return min(found, key=lambda one: one.seconds.value if one.seconds else inf)


def _counts(method: Method, is_measured: bool) -> Sequence[int]:
    """Return the counts of a method's forecasts; one without random numbers needs few."""
    measured = MEASURED_SPP if is_measured else ()
    return sorted({*(FORECAST_SPP if method.monte_carlo else DETERMINISTIC_SPP), *measured})


def sizes(target: Size) -> tuple[Size, Size, Size]:
    """Return the sizes fitted for another: smaller ones of its shape."""
    area = target[0] * target[1]
    largest = min(LARGEST_FITTED, area / 4)
    scales = [sqrt(largest / area) * factor for factor in (1 / 4, 1 / 2, 1)]
    smallest, middle, last = ((round(target[0] * s), round(target[1] * s)) for s in scales)
    if min(smallest) < 4:
        raise InputError(
            f"{target[0]}x{target[1]} is too small for a prediction: measure it with --resolution."
        )
    return smallest, middle, last


def require(name: str, target: Size, rendered: Size | None, is_measured: bool) -> None:
    """Reject sizes that cannot be predicted for a scene, or measured if that is requested.

    ``rendered`` is the size of the study itself; None if derived from ``target``.
    """
    sizes(target)
    (width, height), (wide, high) = sorted([rendered or target, target])
    if abs(high * width / wide - height) > 1:  # a pixel of the smaller one is tolerated
        raise InputError(
            f"{width}x{height} and {wide}x{high} differ in shape: give --resolution the shape of"
            " --at, or omit it."
        )
    if is_measured:
        width, height = target
        most = LARGEST_PASS // max(*MEASURED_SPP, *DETERMINISTIC_SPP)
        if width * height > most:
            raise InputError(
                f"{width}x{height} is too large to measure: at most {most} pixels are allowed. Omit"
                " --measure to predict it."
            )
        require_memory(name, width, height)
