"""A probe of each pruned scene: the plan's light compared with everything simulated.

A rule of pruning holds under premises, and a list of premises may be incomplete. So some camera
rays are drawn at random and followed twice: by the plan's integrator, and by Mitsuba's default,
both with independent samples. Pixels and edges of equal rays cancel, so the difference ``d`` of a
ray has only the noise of the light.

After ``n``, ``2 n``, ``4 n``, … rays, up to the budget, the mean of ``d`` is tested by Student's t
over :data:`BATCHES` batches, beyond :data:`TOLERANCE` of the mean radiance; the level
:data:`LOOKING` is divided equally among the looks. Agreement ends the test. A departure is not
trusted: :data:`MOST` new rays must find one of the same sign at the level :data:`DECIDING`.

For nearly normal means a right plan is rejected with a chance of at most ``LOOKING x DECIDING``,
one in a million. The rest up to the stated one in a thousand is reserved for heavy tails.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter

import drjit as dr
import mitsuba as mi
import numpy as np

from fotismos.reference.planning.plan import physical_integrator
from fotismos.reference.planning.plan_record import Guard, Plan
from fotismos.reference.rendering.passes import Stream, pass_seed
from fotismos.reference.student import quantile

SHARE = 0.02
"""Share of the reference's samples that bounds the rays, within the next two limits."""

FEWEST = 2**13
MOST = 2**20
"""Rays of the first look, and of all looks at most; the latter also of a decision."""

TOLERANCE = 0.005
"""Share of the mean radiance; smaller departures are ignored."""

LOOKING = 0.01
DECIDING = 1e-4
"""Levels of the looks together, and of the decision; two-sided."""

BATCHES = 32
PIECE = 2**18
"""Rays followed at once by a decision; a look may follow twice as many."""


@dataclass(frozen=True)
class Tally:
    """Means of batches of rays: the difference; and the larger of the two mean radiances."""

    batches: np.ndarray
    level: float
    rays: int

    @classmethod
    def of(cls, pieces: Sequence[np.ndarray]) -> "Tally":
        """Sum up rays: (2, N) radiances by the plan and by everything, in pieces."""
        planned, whole = np.concatenate(pieces, axis=1)
        # Rays that do not fill a batch are left out.
        count = len(planned) // BATCHES * BATCHES
        batches = (planned - whole)[:count].reshape(BATCHES, -1).mean(axis=1)
        return cls(batches, float(max(planned.mean(), whole.mean())), len(planned))

    @property
    def mean(self) -> float:
        """Mean of the difference."""
        return float(self.batches.mean())

    @property
    def error(self) -> float:
        """Its standard error."""
        return float(self.batches.std(ddof=1) / np.sqrt(len(self.batches)))

    def departs(self, level: float) -> bool:
        """Return whether the mean is off by more than tolerance and noise, at a level."""
        return abs(self.mean) > TOLERANCE * self.level + _quantile(level) * self.error

    def agrees(self, level: float) -> bool:
        """Return whether the mean is within the tolerance, including noise, at a level."""
        return abs(self.mean) + _quantile(level) * self.error <= TOLERANCE * self.level

    def guard(self, disagrees: bool, rays: int, begin: float) -> Guard:
        """Return the result of the probe, by these rays."""
        scale = self.level or 1.0
        return Guard(
            state="disagreed" if disagrees else "agreed",
            rays=rays,
            departure=self.mean / scale,
            error=self.error / scale,
            seconds=perf_counter() - begin,
        )


def _quantile(level: float) -> float:
    return quantile(BATCHES - 1, 1 - level / 2)


def examine_plan(
    plan: Plan, scene: mi.Scene, hide_emitters: bool, samples: int, seed: int
) -> Guard:
    """Probe a plan in the current variant, given the physical half's scene.

    ``samples`` are the reference's, over all pixels; the probe has its own stream of ``seed``.
    """
    whole = plan.unpruned()
    if (plan.integrator, plan.max_depth) == (whole.integrator, whole.max_depth):
        return Guard()
    begin = perf_counter()
    integrators = [physical_integrator(p, scene, hide_emitters) for p in (plan, whole)]
    # A seed for each use, so that no two pieces share random numbers.
    seeds = (pass_seed(seed, number, Stream.PROBE) for number in range(2**31))
    sizes = _looks(int(min(max(FEWEST, SHARE * samples), MOST)))
    pieces = []
    rays = 0
    for size in sizes:
        pieces.append(radiances(scene, integrators, count=size - rays, seeds=seeds))
        tally = Tally.of(pieces)
        rays = size
        if tally.agrees(LOOKING):
            break
        # A departure must be found again by new rays alone.
        if tally.departs(LOOKING / len(sizes)):
            fresh = [
                radiances(scene, integrators, count=PIECE, seeds=seeds)
                for _ in range(MOST // PIECE)
            ]
            decided = Tally.of(fresh)
            confirmed = decided.departs(DECIDING) and decided.mean * tally.mean > 0
            return decided.guard(confirmed, rays + decided.rays, begin)
    return tally.guard(False, rays, begin)


def _looks(budget: int) -> list[int]:
    """Return the numbers of rays after which the test looks: doubling, and the budget last."""
    sizes = [FEWEST]
    while 4 * sizes[-1] <= budget:
        sizes.append(2 * sizes[-1])
    last = max(FEWEST, budget // BATCHES * BATCHES)
    return [*sizes, last] if last > sizes[-1] else sizes


def radiances(
    scene: mi.Scene, integrators: Sequence[mi.Integrator], count: int, seeds: Iterator[int]
) -> np.ndarray:
    """Return the radiances of random camera rays by each integrator, (2, count), mean of channels.

    The rays come from everywhere on the film and lens, like those of a picture.
    """
    sensor = scene.sensors()[0]
    sampler = mi.load_dict({"type": "independent"})
    sampler.seed(dr.opaque(mi.UInt32, next(seeds)), count)
    wavelength = sampler.next_1d() if mi.is_spectral else mi.Float(0.5)
    film = sampler.next_2d()
    lens = sampler.next_2d()
    ray, weight = sensor.sample_ray_differential(sensor.shutter_open(), wavelength, film, lens)
    values = []
    for integrator in integrators:
        sampler.seed(dr.opaque(mi.UInt32, next(seeds)), count)
        radiance, _, _ = integrator.sample(scene, sampler, ray)
        value = dr.mean(mi.unpolarized_spectrum(radiance * weight))
        values.append(dr.select(dr.isfinite(value), value, 0))
    dr.eval(values)
    # A camera with a single ray, and no other random number, gives one value for all.
    return np.array([np.broadcast_to(np.array(value, float), count) for value in values])
