"""Predict time and error of methods at a size too large to try them all.

The time of an image follows from its method's overhead and time per sample. Its error, against the
reference, is measured at three small sizes. At a width of ``w`` pixels and ``s`` samples each ::

    E²(w, s) = b + d / w + c / s + e / (w² s)

The share of pixels at edges is proportional to ``1 / w``, so edges cause the terms with ``w``;
``b`` is the method's bias, ``c`` its noise. All coefficients are at least 0 (but ``d``, since a
small image may also hide errors), fitted by least squares of relative misfits. An interval of 95 %
covers the misfits, also those of the largest size to a fit without it, and grows by as much with
each factor of 2 beyond the counts.
"""

from collections.abc import Mapping, Sequence
from math import sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from comparisons.cost.cost_record import Point, TimedMethod
from comparisons.cost.measure import (
    DETERMINISTIC_SPP,
    SURE,
    Key,
    Measurements,
    Size,
    converged,
    judge_by,
    point,
    rendered,
)
from comparisons.hybrids.why import MeanError
from heuristic.errors import InputError
from reference.records import Estimated
from reference.rendering.gbuffer import gbuffer
from reference.rendering.renderer import LARGEST_PASS, Progress, require_memory

FORECAST_SPP = tuple(4**power for power in range(7))

MEASURED_SPP, MEASURED_ROUNDS = 8, 3
"""Samples per pixel that are measured at the requested size; no error is fitted to them."""

UNSEEN, UNRESOLVED = 0.02, 0.04
"""Half an interval of an error, at least: in ΔE, and as a share of the error. Small sizes show no
less: all methods share the reference's chance of rare bright pixels."""

TINY = 1e-9
"""Stands for an error of 0, which has no logarithm."""

Places = NDArray[np.float64]
"""Width and samples per pixel of images, (n, 2)."""


def predict(
    found: Measurements, target: Size, is_measured: bool, progress: Progress
) -> tuple[tuple[Point, ...], tuple[Point, ...]]:
    """Return the points of each method at a size of the film's shape, and those measured there.

    It resizes the films of the ladder's scenes.
    """
    ready, options = found.ready, found.options
    known = {(one.method, one.spp, found.size): (one.error, one.tolerance) for one in found.points}
    counts = {
        size: [(one.name, spp) for one in found.methods for spp in found.effort.counts(one)]
        for size in sizes(found.size, target)
        if size != found.size
    }
    if is_measured:
        counts[target] = [(one.name, MEASURED_SPP) for one in found.methods]
    by_name = {method.name: method for method in found.methods}
    judges, renderers = {}, {}
    for size, own in counts.items():
        reference = converged(ready, options.seed, progress, size)
        judges[size] = judge_by(reference, gbuffer(ready.scene, *size).hit, options.viewing)
        for name, spp in own:
            renderers[name, spp, size] = found.ladder.renderer(by_name[name], spp, size)
    errors, _ = rendered(
        renderers,
        lambda key: judges[key[2]],
        renderers.keys(),
        MEASURED_ROUNDS,
        options.seed,
        progress,
        "predicting",
    )
    measured = tuple(
        Point(
            method=name,
            spp=spp,
            seconds=Estimated(min(took), min(took), max(took)),
            error=errors[name, spp, target][0],
            tolerance=errors[name, spp, target][1],
        )
        for (name, spp, size), renderer in renderers.items()
        if size == target and (took := renderer.times[-MEASURED_ROUNDS:])
    )
    fitted = known | {key: each for key, each in errors.items() if key[2] != target}
    return forecast(found.methods, fitted, target, (MEASURED_SPP,) * is_measured), measured


def forecast(
    methods: Sequence[TimedMethod],
    known: Mapping[Key, tuple[MeanError, MeanError]],
    target: Size,
    more: Sequence[int] = (),
) -> tuple[Point, ...]:
    """Return the points of methods at a size, at usual sample counts and ``more``.

    ``known`` are ``{(method, spp, size): (error, tolerance)}``.
    """
    found = []
    for one in methods:
        own = [key for key in known if key[0] == one.name]
        places = np.array([(size[0], spp) for _, spp, size in own], float)
        counts = sorted({*(FORECAST_SPP if one.monte_carlo else DETERMINISTIC_SPP), *more})
        targets = np.array([(target[0], spp) for spp in counts], float)
        errors = (
            errors_at(places, np.array([known[key][kind].mean for key in own]), targets)
            for kind in (0, 1)
        )
        found += [
            point(one, spp, target, *each) for spp, *each in zip(counts, *errors, strict=True)
        ]
    return tuple(found)


def errors_at(places: Places, errors: NDArray, targets: Places) -> tuple[MeanError, ...]:
    """Return the errors of a method at other places."""
    squares = np.maximum(np.square(errors), TINY)
    held = places[:, 0] == places[:, 0].max()
    every = np.ones(len(places), bool)
    fits = [
        nnls(_terms(places[rows]) / squares[rows, None], np.ones(rows.sum()))[0]
        for rows in (every, ~held)
    ]
    whole, small = np.maximum(np.stack(fits) @ _terms(places).T, TINY)
    missed = np.concatenate([np.log(whole / squares), np.log(small / squares)[held]]) / 2
    inside = np.clip(targets[:, 1], places[:, 1].min(), places[:, 1].max())
    beyond = np.abs(np.log2(targets[:, 1] / inside))
    values = np.sqrt(np.maximum(_terms(targets) @ fits[0], TINY))
    spread = max(SURE * sqrt(float(np.mean(missed**2))), UNRESOLVED)
    halves = np.hypot(values * spread * (1 + beyond), UNSEEN)
    return tuple(
        MeanError(mean=float(v), low=float(max(v - half, 0.0)), high=float(v + half))
        for v, half in zip(values, halves, strict=True)
    )


def _terms(places: Places) -> NDArray:
    width, spp = places.T
    edges = 1 / width
    return np.stack([edges**0, edges, -edges, 1 / spp, edges**2 / spp], axis=1)


def sizes(own: Size, target: Size) -> tuple[Size, Size, Size]:
    """Return the sizes at which errors are measured for another: small ones of its shape."""
    is_far = 4 * own[0] <= target[0]
    largest = (2 * own[0], 2 * own[1]) if is_far else min(own, target)
    smallest, middle = ((round(largest[0] / s), round(largest[1] / s)) for s in (4, 2))
    if min(smallest) < 4:
        raise InputError(
            f"{target[0]}x{target[1]} is too small for a prediction: measure it with --resolution."
        )
    return smallest, middle, largest


def require(name: str, target: Size, size: Size, is_measured: bool) -> None:
    """Reject sizes that cannot be predicted for a scene, or measured if that is requested.

    ``size`` is that of the study.
    """
    sizes(size, target)
    (width, height), (wide, high) = sorted([size, target])
    if abs(high * width / wide - height) > 1:  # a pixel of the smaller one is tolerated
        raise InputError(
            f"{width}x{height} and {wide}x{high} differ in shape: give --resolution the shape of"
            " --at, or omit it."
        )
    if is_measured:
        most = LARGEST_PASS // MEASURED_SPP
        if target[0] * target[1] > most:
            raise InputError(
                f"{target[0]}x{target[1]} is too large to measure: at most {most} pixels are"
                " allowed. Omit --measure to predict it."
            )
        require_memory(name, *target)
