"""Rendering both halves of a comparison pass by pass, until the result is good enough.

Passes are bounded in two ways. A wavefront, the samples in flight at once, stays under
:data:`WAVEFRONT`, which bounds the memory of large images. With a noise target, passes continue
until the noise reaches it, or a limit on samples stops them.

The state after each pass can be kept, and an interrupted run resumes from it. The seed of pass
``i`` is hashed from the run's seed and ``i``, and passes are added to the same sums in the same
order, interrupted or not: the result is the same bit for bit.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, Protocol, TypeAlias

import numpy as np

from comparisons.comparison import NoiseTarget
from comparisons.departure.blocks import bands
from comparisons.departure.metric import Pixelwise
from comparisons.departure.metrics import LEADING
from comparisons.departure.spaces import Viewing
from comparisons.options import Options
from comparisons.store import Lazy
from reference.planning.plan import Plan
from reference.rendering.moments import DifferenceEstimate, SumsOfHalves
from reference.rendering.passes import Progress, passes
from reference.rendering.renderer import Renderer
from reference.rendering.sums import Deviations, Mean, add_difference

if TYPE_CHECKING:
    from comparisons.compare import Prepared

WAVEFRONT = 2**24
"""Most samples of one pass, unless the image has more pixels: then one sample per pixel."""

LIMIT_SPP = 4096
"""Samples per pixel at which a run with a noise target stops, unless another limit is given."""

PERCENTILE = 95
"""The target is for this percentile of the noise over the counted pixels."""


Sums: TypeAlias = tuple[Mean, Deviations, SumsOfHalves]
"""Sums of the heuristic half, of the reference, and of their difference."""


@dataclass(frozen=True)
class Schedule:
    """Samples per pixel and pass, and the number of passes, which is even and at least 2."""

    spp: int
    passes: int

    @classmethod
    def of(cls, spp: int, passes: int) -> "Schedule":
        """Split ``spp`` samples per pixel into ``passes`` passes."""
        return cls(max(1, spp // passes), passes)


def schedule(
    plan: Plan, pixels: int, spp: int | None = None, noise: float | None = None
) -> Schedule:
    """Return the :class:`Schedule` of a plan.

    Parameters
    ----------
    plan
        Its samples and passes are the defaults.
    pixels
        Number of pixels of the image.
    spp
        Total samples per pixel; with a noise target, their limit.
    noise
        The noise target, if any.
    """
    largest = max(1, WAVEFRONT // pixels)
    if noise is not None:
        each = min(max(1, plan.spp // plan.passes), largest)
        each = max(1, min(each, (spp or LIMIT_SPP) // 2))
        return Schedule(each, max(2, (spp or LIMIT_SPP) // each // 2 * 2))
    spp = spp or plan.spp
    passes = max(2, min(plan.passes, spp // 4 // 2 * 2))
    each = max(1, spp // passes)
    if each > largest:
        each, passes = largest, max(2, -(-spp // largest // 2) * 2)
    return Schedule(each, passes)


@dataclass(frozen=True)
class Rendered:
    """The passes of both halves and of their difference, and where they stopped (or None).

    The halves have only means (H, W, 3) and the reference's standard error: the relevant
    uncertainty is the difference's. ``passes`` counts all passes, ``new`` those of this run.
    """

    heuristic: np.ndarray
    reference: np.ndarray
    standard_error: np.ndarray
    difference: DifferenceEstimate
    passes: int
    new: int
    stop: NoiseTarget | None


class Kept(Protocol):
    """Holds the state of an interrupted run."""

    def load(self) -> dict[str, Any] | None:
        """Return the state as arrays by name, None if there is none."""

    def offer(self, count: int, state: Callable[[], Mapping[str, Any]]) -> None:
        """Take the state after ``count`` passes, which ``state()`` returns."""


def render(
    ready: "Prepared",
    options: Options,
    counted: np.ndarray,
    progress: Progress | None,
    kept: Kept | None = None,
) -> Rendered:
    """Render the passes of both halves in turn: a drift of the machine then affects both.

    Parameters
    ----------
    ready
        Both halves and their schedule.
    options
        Seed, noise target and viewing.
    counted
        (H, W): the pixels whose noise counts.
    progress
        ``progress(stage, done, total)``; with a noise target, ``total`` is the limit.
    kept
        Holds the state of an interrupted run, and is offered the new one after each pass.

    Returns
    -------
    Rendered
    """
    halves = (ready.heuristic, ready.reference)
    test, truth = Mean(), Deviations(compact=True)
    sums = test, truth, SumsOfHalves(counted, (test, truth), compact=True)
    state = kept.load() if kept else None
    if not _fits(state or {}, sums, halves, counted.shape, ready.passes):
        state = None
    done = before = _restore(state, sums, halves)
    reached = None
    loop = passes(halves, options.seed, ready.passes, first=before, progress=progress)
    for one in loop:
        add_difference(sums, one.images)
        done = one.number + 1
        del one
        if kept:
            kept.offer(done, lambda: _state(sums, halves))
        if options.noise is not None and is_checked(done, ready.passes):
            reached = noise_percentile(sums, counted, options.viewing)
            if reached <= options.noise:
                break
    loop.close()
    stop = None
    if options.noise is not None:
        if reached is None:
            reached = noise_percentile(sums, counted, options.viewing)
        stop = NoiseTarget(
            target=options.noise,
            reached=reached,
            stopped_by="target" if reached <= options.noise else "samples",
            limit_spp=ready.passes * ready.reference.spp,
        )
    # From here on images have single precision, like the files. Each sum is freed as it is read.
    difference = sums[2].estimate(np.float32, last=True)
    error = sums[1].standard_error(np.float32, last=True)
    heuristic, reference = (total.mean(np.float32, last=True) for total in sums[:2])
    return Rendered(heuristic, reference, error, difference, done, done - before, stop)


def is_checked(done: int, passes: int) -> bool:
    """Return whether the noise is checked after ``done`` passes: 4, 6, 8, 12, 16, 24, …, and last.

    A check takes as long as a pass or two; the steps cost at most half as many passes again as are
    needed. They do not depend on the images, so resuming changes nothing.
    """
    power = 1 << (done.bit_length() - 1)
    return done >= passes or (done >= 4 and done in (power, power + power // 2))


def noise_percentile(sums: Sums, counted: np.ndarray, viewing: Viewing) -> float:
    """Predict the noise: 95th percentile of ΔE2000 between the reference and itself with noise.

    The noise is that of the difference of the halves, in which shared noise cancels.
    """
    metric = LEADING
    assert isinstance(metric, Pixelwise)
    reference, noise = sums[1].mean(np.float32), sums[2].noise(np.float32)
    if not noise[counted].any():
        return 0.0
    distances = []
    for rows in bands(len(counted)):
        truth = reference[rows][counted[rows]].astype(np.float64)
        images = truth, truth + noise[rows][counted[rows]]
        distances.append(metric.difference(*(metric.coordinates(each, viewing) for each in images)))
    return float(np.percentile(np.concatenate(distances), PERCENTILE))


def _state(sums: Sums, halves: Sequence[Renderer]) -> Lazy:
    """Return all that later passes need, as arrays that are made one at a time."""
    state: dict[str, Callable[[], Any]] = {}
    for number, total in enumerate(sums):
        state |= {f"sum{number}_{name}": made for name, made in total.state().items()}
    for number, half in enumerate(halves):
        state[f"times{number}"] = partial(np.array, half.times)
        state[f"compilation{number}"] = partial(np.array, half.compilation)
    return Lazy(state)


def _fits(
    state: Mapping[str, Any],
    sums: Sums,
    halves: Sequence[Renderer],
    size: tuple[int, int],
    passes: int,
) -> bool:
    """Return whether a state is of these sums of images (H, W), with at most ``passes`` passes."""
    count = state.get("sum0_count")
    if count is None or count.shape or count.dtype.kind != "i" or not 1 <= count <= passes:
        return False
    shapes: dict[str, tuple[int, ...]] = {}
    for number, total in enumerate(sums):
        shapes |= {f"sum{number}_{name}": shape for name, shape in total.shapes(size).items()}
    for number in range(len(halves)):
        shapes |= {f"times{number}": (int(count),), f"compilation{number}": ()}
    if {name: array.shape for name, array in state.items()} != shapes:
        return False
    counts = {name for name in shapes if name.endswith("_count")}
    if any(state[name].dtype != count.dtype or state[name] != count for name in counts):
        return False
    doubles = [array for name, array in state.items() if name not in counts]
    return all(array.dtype == float and np.isfinite(array).all() for array in doubles)


def _restore(state: dict[str, Any] | None, sums: Sums, halves: Sequence[Renderer]) -> int:
    """Restore a state; return the number of passes that it holds."""
    if state is None:
        return 0
    for number, total in enumerate(sums):
        prefix = f"sum{number}_"
        total.restore(
            {
                name.removeprefix(prefix): state.pop(name)
                for name in list(state)
                if name.startswith(prefix)
            }
        )
    for number, half in enumerate(halves):
        half.times = state[f"times{number}"].tolist()
        half.compilation = float(state[f"compilation{number}"])
    return sums[0].count
