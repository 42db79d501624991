"""Verifying that pruning is right, and what it saves: a planned scene against everything.

Both references are rendered in turn, pass by pass. The difference is compared with the noise of
both, and the times at equal noise: the variance of an independent mean falls with the time spent,
so a method costs ``variance x time``.
"""

import numpy as np

from comparisons.departure import marks
from comparisons.departure.metrics import leading_distance
from comparisons.options import Options
from comparisons.prepared import Prepared, prepare
from reference.records import VERSION, Record
from reference.rendering.renderer import Progress, Renderer, Stream, pass_seed, passes
from reference.rendering.sampler import with_sampler
from reference.rendering.sums import DEVIATION, Accumulator, DifferenceSums, add_difference
from reference.scene.source import Source

LEVEL = 0.01
"""Chance that any pixel is marked though nothing differs."""

PASSES_WITH_PATHS = 4
"""Factor on the passes if paths are sampled: few paths carry most of the variance, which is hard to
measure itself."""


class Verification(Record, kw_only=True):
    """A planned scene against everything simulated.

    ``significant`` of ``pixels`` that see a surface are shown to differ
    (:mod:`comparisons.departure.marks`). ``heuristic_largest`` is the largest difference of the two
    heuristic images, linear, whose kernels differ in terms that are 0. Times are medians per pass,
    noise the root mean square over the pixels of the standard error of one pass. ``gain`` is
    ``everything_s everything_noise^2 / (planned_s planned_noise^2)``: how many times faster the
    planned reference reaches the same noise.
    """

    scene: str
    planned: str
    resolution: tuple[int, int]
    significant: int
    pixels: int
    heuristic_largest: float
    planned_s: float
    everything_s: float
    planned_noise: float
    everything_noise: float
    gain: float
    record_version: int = VERSION


def verify(
    source: Source, options: Options | None = None, progress: Progress | None = None
) -> Verification:
    """Render a scene as planned and with everything, and compare both.

    Given samples apply to everything; if omitted, the plan's are used.
    """
    options = options or Options()
    everything, planned = sides = [
        prepare(source, options.changed(everything=choice)) for choice in (True, False)
    ]
    count = max(side.passes for side in sides)
    count = max(count, 2) * (1 if planned.plan.max_depth == 2 else PASSES_WITH_PATHS)
    counted = planned.counted
    # The sides have different seeds: equal ones would hide shared noise.
    streams = (
        passes([everything.reference], options.seed, count, stream=Stream.OTHER_SIDE),
        passes([planned.reference], options.seed, count, progress=progress, stage="verifying"),
    )
    own, apart = (Accumulator(DEVIATION), Accumulator(DEVIATION)), DifferenceSums(counted)
    for both in zip(*streams, strict=True):
        add_difference((*own, apart), [one.images[0] for one in both])
    mean = sum(total.mean() for total in own) / 2
    distance = leading_distance(options.viewing)
    marked = marks.find(apart.estimate(), mean, counted, distance, level=LEVEL)
    seconds = [side.reference.pass_times().median_s for side in sides]
    depth = "" if planned.plan.max_depth == 2 else f", depth {planned.plan.max_depth}"
    # A plan without noise would divide by zero.
    noise = [
        max(np.sqrt(count * np.mean(total.standard_error()[counted] ** 2)), 1e-7) for total in own
    ]
    return Verification(
        scene=source.name,
        planned=f"{planned.plan.simulation}{depth}, {planned.plan.sampler}",
        resolution=counted.shape[::-1],
        significant=int((marked == marks.MARKED).sum()),
        pixels=int(counted.sum()),
        heuristic_largest=_kernel_difference(planned, everything, options.seed),
        planned_s=seconds[1],
        everything_s=seconds[0],
        planned_noise=float(noise[1]),
        everything_noise=float(noise[0]),
        gain=float(seconds[0] * noise[0] ** 2 / (seconds[1] * noise[1] ** 2)),
    )


def _kernel_difference(planned: Prepared, everything: Prepared, seed: int) -> float:
    """Return the largest effect of the terms left out of the kernel, with equal rays."""
    images = []
    for side in (planned, everything):
        scene = with_sampler(side.pair.heuristic, planned.plan.sampler).instantiate()
        renderer = Renderer(scene, None, planned.heuristic.spp, "heuristic image")
        images.append(np.array(renderer.render(pass_seed(seed, 0))))
    return float(np.abs(images[0] - images[1]).max())
