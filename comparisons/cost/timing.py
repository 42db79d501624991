"""Time the rungs in turn, so a drift of the machine affects all equally.

Each time is of one rendering of the whole image, evaluated and synchronised. The first run of a
rung traces and compiles, and is reported separately; the second warms caches; the rounds follow,
each with its own seed, so their errors are independent.
"""

from collections.abc import Mapping

import numpy as np
from numpy.typing import ArrayLike

from comparisons import intervals
from comparisons.cost.cost_record import Interval, Measured
from comparisons.cost.judging import Judge
from reference.rendering.passes import Progress, passes
from reference.rendering.renderer import Renderer

Key = tuple[str, int]
"""Name of a rung, and samples per pixel."""


def interval(values: ArrayLike) -> Interval:
    """Return the interval of at least two repeats."""
    ordered = np.sort(np.asarray(values, float))
    low, high, level = intervals.median_ranks(len(ordered))
    p25, median, p75 = np.percentile(ordered, (25, 50, 75))
    return Interval(
        median=float(median),
        p25=float(p25),
        p75=float(p75),
        low=float(ordered[low]),
        high=float(ordered[high]),
        level=level,
        repeats=len(ordered),
    )


def measure(
    renderers: Mapping[Key, Renderer],
    judge: Judge,
    rounds: int,
    seed: int,
    progress: Progress | None,
) -> tuple[tuple[Measured, ...], dict[Key, np.ndarray]]:
    """Time and judge renderers in turn.

    Parameters
    ----------
    renderers
        ``{(name, spp): renderer}``; see :class:`reference.rendering.renderer.Renderer`.
    judge
        Measures the errors.
    rounds
        Repeats, at least 2.
    seed
        Seed of the study; each round hashes its own from it.
    progress
        ``progress(stage, done, total)``.

    Returns
    -------
    measured, images
        One record per renderer, in order, and the last round's image (H, W, 3) of each key.
    """
    errors: dict[Key, list[tuple[float, float]]] = {key: [] for key in renderers}
    images: dict[Key, np.ndarray] = {}
    loop = passes([*renderers.values()], seed, rounds + 2, progress=progress, stage="timing")
    for one in loop:
        images = dict(zip(renderers, map(np.array, one.images), strict=True))
        if one.number > 1:
            for key, image in images.items():
                errors[key].append(judge.errors(image))
    measured = (_summarise(key, renderer, errors[key]) for key, renderer in renderers.items())
    return tuple(measured), images


def _summarise(key: Key, renderer: Renderer, errors: list[tuple[float, float]]) -> Measured:
    means = np.mean(errors, axis=0)
    stderrs = np.std(errors, axis=0, ddof=1) / np.sqrt(len(errors))
    return Measured(
        rung=key[0],
        spp=key[1],
        first_s=renderer.times[0],
        compile_s=renderer.compilation,
        prepare_s=getattr(renderer.integrator, "preparation", 0.0),
        seconds=interval(renderer.times[2:]),
        error=float(means[0]),
        error_stderr=float(stderrs[0]),
        mse=float(means[1]),
        mse_stderr=float(stderrs[1]),
    )
