"""Pruning shown to be right, and what it saves: a scene as planned against everything simulated.

Both references are rendered in turn, pass by pass. The difference is held against the noise of both
sides, and the times are compared at equal noise: the variance of an independent mean falls with the
time spent, so that ``variance x time`` is what a method costs.
"""

from dataclasses import replace

import numpy as np

from comparisons.compare import leading_distance, prepare
from comparisons.departure import marks
from comparisons.options import Options
from comparisons.records import VERSION, Record
from reference.pairing import halves
from reference.rendering.gbuffer import gbuffer, image_size
from reference.rendering.moments import DifferenceSums
from reference.rendering.passes import Stream, pass_seed, passes
from reference.rendering.renderer import Accumulator, Renderer, add_difference

LEVEL = 0.01
"""Chance that any pixel is marked though nothing differs."""

PASSES_WITH_PATHS = 4
"""Times as many passes where paths are sampled: their variance is itself hard to measure, since few
paths carry most of it."""


class Verification(Record, kw_only=True):
    """A planned scene against everything simulated.

    Attributes
    ----------
    scene, planned, everything
        Name, and a word on each reference.
    resolution
        Width and height in pixels.
    significant
        Pixels that are shown to differ (:mod:`comparisons.departure.marks`).
    pixels
        Pixels compared: those whose centre sees a surface.
    largest
        Largest difference of the two means, linear.
    heuristic_largest
        Largest difference of the two heuristic images; the kernels differ in terms that are 0.
    planned_s, everything_s
        Time of a pass, median.
    planned_noise, everything_noise
        Root mean square standard error of one pass over the pixels.
    gain
        ``everything_s everything_noise^2 / (planned_s planned_noise^2)``: how many times faster the
        planned reference reaches the same noise.
    planning_s
        Time that planning took, tables included.
    saved_s
        Time that the plan saves at the noise of all its own passes: what everything would take for
        that noise, less what the plan takes.
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
    gain: float
    planning_s: float
    saved_s: float
    record_version: int = VERSION


def verify(source, options=None, progress=None, level=LEVEL):
    """Render a scene as planned and with everything, and compare.

    Parameters
    ----------
    source, options, progress
        As of :func:`comparisons.compare.compare`. Samples are those of the everything-on side where
        they are given; the plan's own otherwise.
    level
        Chance that any pixel is marked though nothing differs.

    Returns
    -------
    Verification
    """
    options = options or Options()
    sides = [prepare(source, replace(options, everything=choice)) for choice in (False, True)]
    count = max(side.passes for side in sides)
    if sides[0].plan.max_depth != 2:
        count *= PASSES_WITH_PATHS
    scene = sides[0].scene
    counted = gbuffer(scene, *image_size(scene)).hit
    sums = [Accumulator(), Accumulator(), DifferenceSums(counted)]
    # Other seeds for the other side: equal ones would hide noise that both share.
    streams = {Stream.COMPARED: progress, Stream.OTHER_SIDE: None}
    loops = [
        passes(
            [side.reference], options.seed, count, stream=stream, progress=told, stage="verifying"
        )
        for side, (stream, told) in zip(sides, streams.items(), strict=True)
    ]
    for both in zip(*loops, strict=True):
        add_difference(sums, [one.images[0] for one in both])
    *estimates, difference = (total.estimate() for total in sums)
    distance = leading_distance(options.viewing)
    marked = marks.find(difference, estimates[0].mean, counted, distance, level=level)
    return _summarise(
        source.name,
        sides,
        estimates,
        counted,
        heuristic_largest=_kernel_difference(sides, options.seed),
        largest=float(np.abs(difference.mean).max()),
        significant=int((marked == marks.MARKED).sum()),
    )


def _kernel_difference(sides, seed):
    """Return the largest difference that the terms left out of the kernel make, with equal rays."""
    sampler, spp = sides[0].plan.sampler, sides[0].heuristic.spp
    images = []
    for side in sides:
        scene = halves.with_sampler(side.pair.heuristic, sampler).instantiate()
        images.append(
            np.array(Renderer(scene, None, spp, "heuristic image").render(pass_seed(seed, 0)))
        )
    return float(np.abs(images[0] - images[1]).max())


def _summarise(name, sides, estimates, counted, **found):
    height, width = counted.shape
    times = [side.reference.pass_times().median for side in sides]
    noises = [
        float(np.sqrt(np.mean(estimate.standard_error[counted] ** 2) * estimate.passes))
        for estimate in estimates
    ]
    # A plan without any noise left would divide by zero; below rounding there is nothing to gain.
    costs = [time * max(noise, 1e-7) ** 2 for time, noise in zip(times, noises, strict=True)]
    gain = costs[1] / costs[0]
    planned_total = times[0] * sides[0].passes
    return Verification(
        scene=name,
        planned=_word(sides[0].plan),
        everything=_word(sides[1].plan),
        resolution=(width, height),
        pixels=int(counted.sum()),
        planned_s=times[0],
        everything_s=times[1],
        planned_noise=noises[0],
        everything_noise=noises[1],
        gain=gain,
        planning_s=sides[0].planning_seconds,
        saved_s=planned_total * (gain - 1),
        **found,
    )


def _word(plan):
    depth = "" if plan.max_depth == 2 else f" {plan.max_depth}"
    extra = "" if plan.shadows else ", no shadow rays"
    extra += ", tabulated environment" if plan.tabulate_environment else ""
    return f"{plan.integrator}{depth}{extra}, {plan.sampler}"
