"""Verifying that pruning is right, and what it saves: a planned scene against everything.

Both references are rendered in turn, pass by pass. The difference is compared with the noise of
both, and the times at equal noise: the variance of an independent mean falls with the time spent,
so a method costs ``variance x time``.
"""

import mitsuba as mi
import numpy as np

from comparisons.departure import marks
from comparisons.departure.metrics import leading_distance
from comparisons.options import Options
from comparisons.prepared import prepare
from reference.planning.plan import Plan
from reference.records import VERSION, Estimated, Record
from reference.rendering.gbuffer import gbuffer, image_size
from reference.rendering.renderer import Progress, Renderer, Stream, pass_seed, passes
from reference.rendering.sampler import with_sampler
from reference.rendering.sums import Accumulator, DifferenceSums
from reference.scene.source import Source

LEVEL = 0.01
"""Chance that any pixel is marked though nothing differs."""

PASSES_WITH_PATHS = 4
"""Factor on the passes if paths are sampled: few paths carry most of the variance, which is hard to
measure itself."""

RESAMPLES = 2000
"""Resamples of the bootstrap."""


class Verification(Record, kw_only=True):
    """A planned scene against everything simulated.

    ``significant`` of ``pixels`` that see a surface are shown to differ
    (:mod:`comparisons.departure.marks`). ``largest`` is the largest difference of the two means,
    linear, and ``heuristic_largest`` that of the two heuristic images, whose kernels differ in
    terms that are 0. Times are medians per pass, noise the root mean square over the pixels of the
    standard error of one pass. ``gain`` is ``everything_s everything_noise^2 / (planned_s
    planned_noise^2)``: how many times faster the planned reference reaches the same noise.
    ``planning_s`` is the time of planning, ``saved_s`` what the plan saves at the noise of all its
    passes.
    """

    scene: str
    planned: str
    everything: str
    resolution: tuple[int, int]
    significant: int
    pixels: int
    largest: float
    heuristic_largest: float
    planned_s: float
    everything_s: float
    planned_noise: float
    everything_noise: float
    gain: Estimated
    planning_s: float
    saved_s: float
    record_version: int = VERSION


def verify(
    source: Source,
    options: Options | None = None,
    progress: Progress | None = None,
    level: float = LEVEL,
) -> Verification:
    """Render a scene as planned and with everything, and compare both.

    Given samples apply to everything; if omitted, the plan's are used. ``level`` is the chance that
    any pixel is marked though nothing differs.
    """
    options = options or Options()
    planned, everything = sides = [
        prepare(source, options.changed(everything=choice)) for choice in (False, True)
    ]
    count = max(side.passes for side in sides)
    count = max(count, 2) * (1 if planned.plan.max_depth == 2 else PASSES_WITH_PATHS)
    width, height = image_size(planned.scene)
    counted = gbuffer(planned.scene, width, height).hit
    # The sides have different seeds: equal ones would hide shared noise.
    streams = (
        passes([planned.reference], options.seed, count, progress=progress, stage="verifying"),
        passes([everything.reference], options.seed, count, stream=Stream.OTHER_SIDE),
    )
    total, apart = Accumulator(), DifferenceSums(counted)
    images: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    variances: tuple[list[float], list[float]] = ([], [])
    for both in zip(*streams, strict=True):
        tensors = [mi.TensorXd(one.images[0]) for one in both]
        total.add(tensors[0])
        apart.add(tensors[1] - tensors[0])
        for tensor, before, own in zip(tensors, images, variances, strict=True):
            before.append(np.array(tensor)[counted])
            if len(before) == 2:  # each pair of passes gives an independent estimate
                own.append(_variance(*before))
                before.clear()
    difference = apart.estimate()
    distance = leading_distance(options.viewing)
    marked = marks.find(difference, total.mean(), counted, distance, level=level)
    seconds = [side.reference.pass_times().median_s for side in sides]
    gain = _gain(sides[0].reference, sides[1].reference, variances)
    return Verification(
        scene=source.name,
        planned=_words(planned.plan),
        everything=_words(everything.plan),
        resolution=(width, height),
        significant=int((marked == marks.MARKED).sum()),
        pixels=int(counted.sum()),
        largest=float(np.abs(difference.mean).max()),
        heuristic_largest=_kernel_difference(sides, options.seed),
        planned_s=seconds[0],
        everything_s=seconds[1],
        planned_noise=float(np.sqrt(np.mean(variances[0]))),
        everything_noise=float(np.sqrt(np.mean(variances[1]))),
        gain=gain,
        planning_s=planned.planning_seconds,
        saved_s=seconds[0] * planned.passes * (gain.value - 1),
    )


def _variance(one: np.ndarray, other: np.ndarray) -> float:
    """Return the variance of a pass, from two; a plan without noise would divide by zero."""
    return max(float(np.mean((one - other) ** 2) / 2 if one.size else 0.0), 1e-14)


def _gain(
    planned: Renderer, everything: Renderer, variances: tuple[list[float], list[float]]
) -> Estimated:
    """Return the ratio of costs, with a bootstrap over pairs of passes and over times."""
    rng = np.random.default_rng(0)
    costs, resampled = [], []
    for renderer, own in zip((planned, everything), variances, strict=True):
        times = np.array(renderer.times[1:] or renderer.times)
        costs.append(renderer.pass_times().median_s * np.mean(own))
        chosen = rng.choice(own, (RESAMPLES, len(own))).mean(axis=1)
        resampled.append(chosen * np.median(rng.choice(times, (RESAMPLES, len(times))), axis=1))
    low, high = np.quantile(resampled[1] / resampled[0], (0.025, 0.975))
    return Estimated(value=float(costs[1] / costs[0]), low=float(low), high=float(high))


def _kernel_difference(sides: list, seed: int) -> float:
    """Return the largest effect of the terms left out of the kernel, with equal rays."""
    sampler, spp = sides[0].plan.sampler, sides[0].heuristic.spp
    images = []
    for side in sides:
        scene = with_sampler(side.pair.heuristic, sampler).instantiate()
        renderer = Renderer(scene, None, spp, "heuristic image")
        images.append(np.array(renderer.render(pass_seed(seed, 0))))
    return float(np.abs(images[0] - images[1]).max())


def _words(plan: Plan) -> str:
    depth = "" if plan.max_depth == 2 else f" {plan.max_depth}"
    extra = "" if plan.shadows else ", no shadow rays"
    extra += ", tabulated environment" if plan.tabulated_environment else ""
    return f"{plan.integrator}{depth}{extra}, {plan.sampler}"
