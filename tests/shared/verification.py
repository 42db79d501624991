"""Plans against everything: a planned scene has the image of all simulated, and what that saves.

Both references are rendered in turn, pass by pass. The difference is compared with the noise of
both, and the times at equal noise: the variance of an independent mean falls with the time spent,
so a method costs ``variance x time``.
"""

from dataclasses import dataclass

import mitsuba as mi
import numpy as np

from fotismos.comparisons.departure import marks
from fotismos.comparisons.departure.metrics import leading_distance
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import prepare
from fotismos.reference.rendering.passes import Stream, pass_seed, passes
from fotismos.reference.rendering.renderer import Renderer
from fotismos.reference.rendering.sampler import with_sampler
from fotismos.reference.rendering.sums import DEVIATION, Accumulator, DifferenceSums, add_difference
from fotismos.reference.scene.source import Source

LEVEL = 0.01
"""Chance that any pixel is marked though nothing differs."""

PASSES_WITH_PATHS = 4
"""Factor on the passes if paths are sampled: few paths carry most of the variance, which is hard to
measure itself."""


@dataclass(frozen=True)
class Verification:
    """How many pixels are shown to differ, and how many times sooner the plan is as quiet.

    ``noise`` is the plan's per pass, over that with everything.
    """

    significant: int
    noise: float
    gain: float


def verify(source, options=None):
    """Render a scene as planned and with everything, and compare both.

    ``gain`` is ``everything_s everything_noise^2 / (planned_s planned_noise^2)``.
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
        passes([planned.reference], options.seed, count),
    )
    own, apart = (Accumulator(DEVIATION), Accumulator(DEVIATION)), DifferenceSums(counted)
    for both in zip(*streams, strict=True):
        add_difference((*own, apart), [one[0] for one in both])
    mean = sum(total.mean() for total in own) / 2
    distance = leading_distance(options.viewing)
    marked = marks.find(apart.estimate(), mean, counted, distance, level=LEVEL)
    seconds = [side.reference.pass_times().median_s for side in sides]
    # A plan without noise would divide by zero.
    noise = [
        max(np.sqrt(count * np.mean(total.standard_error()[counted] ** 2)), 1e-7) for total in own
    ]
    ratio = noise[1] / noise[0]
    gain = seconds[0] / (seconds[1] * ratio**2)
    return Verification(int((marked.image == marks.MARKED).sum()), float(ratio), float(gain))


def kernel_difference(source, options):
    """Return the largest effect of the terms left out of the kernel, with equal rays."""
    images = []
    everything, planned = (
        prepare(source, options.changed(everything=choice)) for choice in (True, False)
    )
    for side in (planned, everything):
        scene = with_sampler(side.pair.heuristic, planned.plan.sampler).instantiate()
        renderer = Renderer(scene, None, planned.heuristic.pass_spp, "heuristic image")
        images.append(np.array(renderer.render(pass_seed(options.seed, 0))))
    return float(np.abs(images[0] - images[1]).max())


def stock(description, spp=256):
    made = mi.load_dict(description, optimize=False)
    return estimate(lambda seed: mi.render(made, spp=spp, seed=seed))


def planned(description, spp=256, everything=False):
    """The plan of a scene, and the mean of its reference."""
    options = Options(spp=spp * PASSES, everything=everything)
    made = prepare(Source("a test", description), options)
    made.reference.pass_spp = spp
    return made, estimate(made.reference.render)


PASSES = 8


def estimate(render):
    """The mean of passes over all pixels, and its standard error."""
    passes = [float(np.mean(np.array(render(pass_seed(0, number))))) for number in range(PASSES)]
    return np.mean(passes), np.std(passes, ddof=1) / PASSES**0.5
