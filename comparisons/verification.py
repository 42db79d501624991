"""Verifying that pruning is right, and what it saves: a planned scene against everything.

Both references are rendered in turn, pass by pass. The difference is compared with the noise of
both, and the times at equal noise: the variance of an independent mean falls with the time spent,
so a method costs ``variance x time``.

Three steps lead from everything to the plan, each with its own factor: the plan's sampler, then its
integrator with nothing left out, then what it leaves out.
"""

from dataclasses import replace
from typing import Any

import mitsuba as mi
import numpy as np

from comparisons.compare import Prepared, leading_distance, prepare
from comparisons.departure import marks
from comparisons.options import Options
from comparisons.records import VERSION, Record
from heuristic.arrays import Array
from reference.planning.plan import Plan
from reference.rendering.gbuffer import gbuffer, image_size
from reference.rendering.moments import DifferenceSums
from reference.rendering.passes import Progress, Stream, pass_seed, passes
from reference.rendering.renderer import Renderer, physical_integrator
from reference.rendering.sums import Accumulator
from reference.scene.sampler import with_sampler
from reference.scene.source import Source

LEVEL = 0.01
"""Chance that any pixel is marked though nothing differs."""

PASSES_WITH_PATHS = 4
"""Factor on the passes if paths are sampled: few paths carry most of the variance, which is hard to
measure itself."""

FEWEST_PASSES = 32
"""Fewest passes of each side: intervals come from pairs of passes."""

RESAMPLES = 2000
"""Resamples of the bootstrap."""


class Factor(Record):
    """How many times sooner a step reaches the same noise, with a 95 % interval; 1 for no step."""

    name: str
    value: float
    low: float
    high: float


class Verification(Record, kw_only=True):
    """A planned scene against everything simulated.

    Attributes
    ----------
    scene, planned, everything
        Name, and a short description of each reference.
    resolution
        Width and height in pixels.
    significant
        Pixels that are shown to differ (:mod:`comparisons.departure.marks`).
    pixels
        Pixels compared: those whose centre sees a surface.
    largest
        Largest difference of the two means, linear.
    heuristic_largest
        Largest difference of the two heuristic images, whose kernels differ in terms that are 0.
    planned_s, everything_s
        Median time per pass.
    planned_noise, everything_noise
        Root mean square over the pixels of the standard error of one pass.
    gain
        ``everything_s everything_noise^2 / (planned_s planned_noise^2)``: how many times faster the
        planned reference reaches the same noise.
    factors
        The steps, whose product is the gain: sampler, integrator, pruning; and the gain itself,
        with its interval.
    planning_s
        Time of planning, tables included.
    saved_s
        Time that the plan saves at the noise of all its passes: the time of everything for that
        noise, less the plan's.
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
    factors: tuple[Factor, ...]
    planning_s: float
    saved_s: float
    record_version: int = VERSION


def verify(
    source: Source,
    options: Options | None = None,
    progress: Progress | None = None,
    level: float = LEVEL,
    steps: bool = True,
) -> Verification:
    """Render a scene as planned and with everything, and compare both.

    Parameters
    ----------
    source, options, progress
        See :func:`comparisons.compare.compare`. Given samples apply to everything; if omitted, the
        plan's are used.
    level
        Chance that any pixel is marked though nothing differs.
    steps
        Whether to measure each step; otherwise only the two ends are rendered.

    Returns
    -------
    Verification
    """
    options = options or Options()
    sides = [prepare(source, replace(options, everything=choice)) for choice in (False, True)]
    count = max(side.passes for side in sides)
    if sides[0].plan.max_depth != 2:
        count *= PASSES_WITH_PATHS
    count = max(count, FEWEST_PASSES if steps else 0)
    stages = _stages(*sides) if steps else [sides[1].reference, sides[0].reference]
    width, height = image_size(sides[0].scene)
    counted = gbuffer(sides[0].scene, width, height).hit
    measured = {renderer: _Measured(renderer, counted) for renderer in stages}
    # The other side has other seeds: equal ones would hide shared noise.
    others = passes(stages[:1], options.seed, count, stream=Stream.OTHER_SIDE)
    distinct, apart = list(measured), DifferenceSums(counted)
    own = passes(distinct[1:], options.seed, count, progress=progress, stage="verifying")
    for other, one in zip(others, own, strict=True):
        images = dict(zip(distinct, (*other.images, *one.images), strict=True))
        for renderer, image in images.items():
            measured[renderer].add(image)
        everything, planned = (mi.TensorXd(images[stages[place]]) for place in (0, -1))
        apart.add(planned - everything)
    found, difference = [measured[renderer] for renderer in stages], apart.estimate()
    distance = leading_distance(options.viewing)
    marked = marks.find(difference, found[-1].total.mean(), counted, distance, level=level)
    return _summarise(
        source.name,
        sides,
        found,
        counted,
        heuristic_largest=_kernel_difference(sides, options.seed),
        largest=float(np.abs(difference.mean).max()),
        significant=int((marked == marks.MARKED).sum()),
    )


def _stages(planned: Prepared, everything: Prepared) -> list[Renderer]:
    """Return the renderers from everything to the plan; equal ones are the same.

    The second has the plan's sampler, the third also its integrator, with nothing left out.
    """
    plan, scene, spp = planned.plan, planned.scene, planned.reference.spp
    whole = plan
    if plan.integrator == "direct_all":
        whole = replace(plan, shadows=True, max_depth=plan.scene_depth, tabulate_environment=False)
    found = [planned.reference]
    for before, after in ((whole, plan), (everything.plan, whole)):
        if before.simulated == after.simulated:
            found.append(found[-1])
            continue
        integrator = physical_integrator(before, scene, planned.pair.hide_emitters)
        found.append(Renderer(scene, integrator, spp, "image of a step"))
    return [everything.reference, *reversed(found)]


class _Measured:
    """The passes of one renderer: their sum, their times, and the variance of a pass.

    Each pair of passes gives an independent estimate of the variance.
    """

    def __init__(self, renderer: Renderer, counted: np.ndarray) -> None:
        self.renderer, self.counted, self.total = renderer, counted, Accumulator()
        self.variances: list[float] = []
        self._before: np.ndarray | None = None

    def add(self, image: Array) -> None:
        self.total.add(image)
        image = np.array(image, float)[self.counted]
        if self._before is None:
            self._before = image
            return
        spread = np.mean((image - self._before) ** 2) / 2 if image.size else 0.0
        # A plan without noise would divide by zero; noise below rounding does not matter.
        self.variances.append(max(float(spread), 1e-14))
        self._before = None

    def seconds(self) -> float:
        return self.renderer.pass_times().median

    def noise(self) -> float:
        return float(np.sqrt(np.mean(self.variances)))

    def cost(self) -> float:
        return self.seconds() * self.noise() ** 2

    def resampled(self, rng: np.random.Generator) -> np.ndarray:
        """Return costs resampled by a bootstrap over pairs, and over times."""
        times = np.array(self.renderer.times[1:] or self.renderer.times)
        shape = RESAMPLES, len(self.variances)
        variances = rng.choice(self.variances, shape).mean(axis=1)
        return variances * np.median(rng.choice(times, (RESAMPLES, len(times))), axis=1)


def _factor(name: str, slow: _Measured, fast: _Measured, rng: np.random.Generator) -> Factor:
    if slow is fast:
        return Factor(name=name, value=1.0, low=1.0, high=1.0)
    ratios = slow.resampled(rng) / fast.resampled(rng)
    low, high = np.quantile(ratios, (0.025, 0.975))
    return Factor(name=name, value=slow.cost() / fast.cost(), low=float(low), high=float(high))


def _factors(measured: list[_Measured]) -> tuple[Factor, ...]:
    """Return the factors of the three steps, if measured, and of all."""
    rng = np.random.default_rng(0)
    names = ("sampler", "integrator", "pruning") if len(measured) > 2 else ()
    steps = zip(names, measured, measured[1:], strict=False)
    found = [_factor(name, slow, fast, rng) for name, slow, fast in steps]
    return (*found, _factor("all", measured[0], measured[-1], rng))


def _kernel_difference(sides: list[Prepared], seed: int) -> float:
    """Return the largest effect of the terms left out of the kernel, with equal rays."""
    sampler, spp = sides[0].plan.sampler, sides[0].heuristic.spp
    images = []
    for side in sides:
        scene = with_sampler(side.pair.heuristic, sampler).instantiate()
        images.append(
            np.array(Renderer(scene, None, spp, "heuristic image").render(pass_seed(seed, 0)))
        )
    return float(np.abs(images[0] - images[1]).max())


def _summarise(
    name: str,
    sides: list[Prepared],
    measured: list[_Measured],
    counted: np.ndarray,
    **found: Any,
) -> Verification:
    everything, planned = measured[0], measured[-1]
    factors = _factors(measured)
    gain = factors[-1].value
    height, width = counted.shape
    return Verification(
        scene=name,
        planned=_word(sides[0].plan),
        everything=_word(sides[1].plan),
        resolution=(width, height),
        pixels=int(counted.sum()),
        planned_s=planned.seconds(),
        everything_s=everything.seconds(),
        planned_noise=planned.noise(),
        everything_noise=everything.noise(),
        gain=gain,
        factors=factors,
        planning_s=sides[0].planning_seconds,
        saved_s=planned.seconds() * sides[0].passes * (gain - 1),
        **found,
    )


def _word(plan: Plan) -> str:
    depth = "" if plan.max_depth == 2 else f" {plan.max_depth}"
    extra = "" if plan.shadows else ", no shadow rays"
    extra += ", tabulated environment" if plan.tabulate_environment else ""
    extra += f", {plan.light_samples} lights per sample" if plan.light_samples else ""
    return f"{plan.integrator}{depth}{extra}, {plan.sampler}"
