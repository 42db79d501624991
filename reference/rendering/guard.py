"""A probe of each pruned scene: the plan's light compared with everything simulated.

A rule of pruning holds under premises, and a list of premises may be incomplete. So some camera
rays are drawn at random and followed twice: by the plan's integrator, and by Mitsuba's default,
both with independent samples. Pixels and edges of equal rays cancel, so the difference ``d`` of a
ray has only the noise of the light.

*The test.* After ``n``, ``2 n``, ``4 n``, … rays, up to the budget, the mean of ``d`` is tested by
Student's t over :data:`BATCHES` batches, beyond a tolerance of :data:`TOLERANCE` of the mean
radiance; the level :data:`LOOKING` is divided equally among the looks. A look that shows agreement
ends the test. A look that finds a departure is not trusted: :data:`MOST` new rays decide, which
must find one of the same sign at the level :data:`DECIDING`.

*False alarms.* For nearly normal means a right plan is rejected with a chance of at most ``LOOKING
x DECIDING``, one in a million. The rest up to the stated one in a thousand is reserved for heavy
tails: a mean without its rarest paths looks too dark, with too small an error. A million rays must
miss them for an alarm.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
from time import perf_counter

import drjit as dr
import mitsuba as mi
import numpy as np

from reference.planning.plan import Plan
from reference.rendering.passes import Stream, pass_seed
from reference.rendering.renderer import physical_integrator

SHARE = 0.02
"""Share of the reference's samples that bounds the rays, within the next two limits."""

FEWEST, MOST = 2**13, 2**20
"""Rays of the first look, and of all looks at most; the latter also of a decision."""

TOLERANCE = 0.005
"""Share of the mean radiance; smaller departures are ignored."""

LOOKING, DECIDING = 0.01, 1e-4
"""Levels of the looks together, and of the decision; two-sided."""

BATCHES = 32
PIECE = 2**18
"""Rays followed at once."""


class Verdict(Enum):
    """The probe's verdict; ``NOT_NEEDED`` if nothing is left out."""

    AGREED = "agreed"
    DISAGREED = "disagreed"
    NOT_NEEDED = "not needed"


@dataclass(frozen=True)
class Guard:
    """The result of the probe of a plan.

    Attributes
    ----------
    state
        The verdict.
    rays
        Camera rays followed both ways.
    departure, error
        Mean of the plan minus the mean of everything, and its standard error, as shares of the
        larger mean radiance; from the rays that decided.
    seconds
        Time of the probe, with compilation.
    """

    state: Verdict
    rays: int = 0
    departure: float = 0.0
    error: float = 0.0
    seconds: float = 0.0

    @property
    def words(self) -> str:
        """The result as a sentence."""
        return (
            f"the plan's mean is {self.departure:+.2%} off the mean of everything simulated, with a"
            f" standard error of {self.error:.2%}, over {self.rays} camera rays"
        )


@dataclass(frozen=True)
class _Tally:
    """Means of batches of rays: the difference, and the two mean radiances."""

    batches: np.ndarray
    level: float

    @property
    def mean(self) -> float:
        return float(self.batches.mean())

    @property
    def error(self) -> float:
        return float(self.batches.std(ddof=1) / np.sqrt(len(self.batches)))

    def departs(self, level: float) -> bool:
        """Return whether the mean is off by more than tolerance and noise, at a level."""
        return abs(self.mean) > TOLERANCE * self.level + self._quantile(level) * self.error

    def agrees(self, level: float) -> bool:
        """Return whether the mean is within the tolerance, including noise, at a level."""
        return abs(self.mean) + self._quantile(level) * self.error <= TOLERANCE * self.level

    def _quantile(self, level: float) -> float:
        from scipy.special import stdtrit

        return float(-stdtrit(len(self.batches) - 1, level / 2))

    def guard(self, state: Verdict, rays: int, begin: float) -> Guard:
        scale = self.level or 1.0
        seconds = perf_counter() - begin
        return Guard(state, rays, self.mean / scale, self.error / scale, seconds)


def examine_plan(
    plan: Plan, scene: mi.Scene, hide_emitters: bool, samples: int, seed: int
) -> Guard:
    """Probe a plan in the current variant.

    Parameters
    ----------
    plan
        The plan.
    scene
        The physical half, instantiated.
    hide_emitters
        Of the pair.
    samples
        Samples of the reference, over all pixels.
    seed
        Seed of the run; the probe has its own stream.
    """
    whole = plan.unpruned()
    if (plan.integrator, plan.max_depth) == (whole.integrator, whole.max_depth):
        return Guard(Verdict.NOT_NEEDED)
    begin = perf_counter()
    integrators = [physical_integrator(p, scene, hide_emitters) for p in (plan, whole)]
    seeds = (pass_seed(seed, number, Stream.PROBE) for number in range(2**31))
    budget = int(min(max(FEWEST, SHARE * samples), MOST))
    sizes = list(_looks(budget))
    found: list[np.ndarray] = []
    for size in sizes:
        found.append(_followed(scene, integrators, size - sum(map(_width, found)), seeds))
        tally = _tally(found)
        if tally.agrees(LOOKING):
            break
        if tally.departs(LOOKING / len(sizes)):
            fresh = [_followed(scene, integrators, PIECE, seeds) for _ in range(MOST // PIECE)]
            decided, rays = _tally(fresh), sum(map(_width, found + fresh))
            confirmed = decided.departs(DECIDING) and decided.mean * tally.mean > 0
            state = Verdict.DISAGREED if confirmed else Verdict.AGREED
            return decided.guard(state, rays, begin)
    return tally.guard(Verdict.AGREED, sum(map(_width, found)), begin)


def _looks(budget: int) -> Iterator[int]:
    """Yield the numbers of rays after which the test looks: doubling, and the budget last."""
    size = FEWEST
    while 2 * size <= budget:
        yield size
        size *= 2
    yield max(size, budget // BATCHES * BATCHES)


def _width(rays: np.ndarray) -> int:
    return rays.shape[1]


def _tally(found: list[np.ndarray]) -> _Tally:
    """Sum up rays: (2, N) radiances by the plan and by everything, in pieces."""
    planned, whole = np.concatenate(found, axis=1)
    count = len(planned) // BATCHES * BATCHES
    batches = (planned - whole)[:count].reshape(BATCHES, -1).mean(axis=1)
    return _Tally(batches, float(max(planned.mean(), whole.mean())))


def _followed(scene: mi.Scene, integrators: list, count: int, seeds: Iterator[int]) -> np.ndarray:
    """Return the radiances of random camera rays by each integrator, (2, count), mean of channels.

    The rays come from everywhere on the film and lens, like those of a picture.
    """
    sensor, sampler = scene.sensors()[0], mi.load_dict({"type": "independent"})
    sampler.seed(dr.opaque(mi.UInt32, next(seeds)), count)
    wavelength = sampler.next_1d() if mi.is_spectral else mi.Float(0.5)
    film, lens = sampler.next_2d(), sampler.next_2d()
    ray, weight = sensor.sample_ray_differential(sensor.shutter_open(), wavelength, film, lens)
    found = []
    for integrator in integrators:
        sampler.seed(dr.opaque(mi.UInt32, next(seeds)), count)
        radiance, _, _ = integrator.sample(scene, sampler, ray)
        value = dr.mean(mi.unpolarized_spectrum(radiance * weight))
        found.append(dr.select(dr.isfinite(value), value, 0))
    dr.eval(found)
    # A camera with a single ray, and no other random number, gives one value for all.
    return np.array([np.broadcast_to(np.array(value, float), count) for value in found])
