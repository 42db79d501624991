"""Judge the rungs against a converged reference."""

import numpy as np

from comparisons.compare import Prepared
from comparisons.cost.effort import Effort
from comparisons.departure.metric import Metric
from comparisons.departure.metrics import LEADING
from comparisons.departure.spaces import Viewing
from reference.rendering.gbuffer import gbuffer
from reference.rendering.passes import Progress, Stream, passes
from reference.rendering.renderer import Renderer
from reference.rendering.sums import Accumulator, Estimate, Mean


def converged(
    ready: Prepared,
    effort: Effort,
    seed: int,
    progress: Progress | None,
    size: tuple[int, int] | None = None,
    groups: int = 1,
) -> tuple[Estimate, np.ndarray]:
    """Render the reference, with seeds that no rung has.

    Returns its estimate, and the means (``groups``, H, W, 3) of groups of its passes, with an even
    number of passes each.
    """
    integrator = ready.reference.integrator
    renderer = Renderer(ready.scene, integrator, effort.reference_spp, "reference image", size)
    total, means = Accumulator(), [Mean() for _ in range(groups)]
    count, stream = 2 * groups * -(-ready.plan.passes // (2 * groups)), Stream.OTHER_SIDE
    for one in passes([renderer], seed, count, stream=stream, progress=progress, stage="reference"):
        total.add(one.images[0])
        means[one.number % groups].add(one.images[0])
    return total.estimate(), np.stack([mean.mean() for mean in means])


def judged(
    ready: Prepared,
    viewing: Viewing,
    effort: Effort,
    seed: int,
    progress: Progress | None,
    size: tuple[int, int],
    groups: int = 1,
) -> tuple["Judge", np.ndarray]:
    """Return a judge at another size, and the means of :func:`converged`."""
    reference, means = converged(ready, effort, seed, progress, size, groups)
    return Judge(reference, gbuffer(ready.scene, *size).hit, viewing), means


class Judge:
    """Errors against a converged reference whose own noise is known.

    Parameters
    ----------
    reference
        The reference.
    counted
        (H, W): the pixels that count.
    viewing
        Viewing conditions.
    metric
        Its mean is the error; ΔE2000 if omitted.
    """

    def __init__(
        self,
        reference: Estimate,
        counted: np.ndarray,
        viewing: Viewing,
        metric: Metric = LEADING,
    ) -> None:
        self.metric = metric
        self.viewing = viewing
        self.counted = counted
        self.reference = reference.mean[counted]
        self._distances = metric.against(reference.mean, counted, viewing)
        self.variance = float(np.mean(reference.standard_error[counted] ** 2))
        """Mean variance of the reference, which adds to each mean squared error."""
        self.floor = metric.mean(self._distances(reference.mean + reference.noise))
        """Error from the reference's noise alone."""

    def errors(self, image: np.ndarray) -> tuple[float, float]:
        """Return the metric's mean, and the linear MSE less the reference's variance (may be < 0).

        ``image`` is (H, W, 3).
        """
        image = np.asarray(image, float)
        mse = float(np.mean((image[self.counted] - self.reference) ** 2)) - self.variance
        return self.metric.mean(self._distances(image)), mse

    def distance(self, pixels: np.ndarray) -> float:
        """Return the metric's mean over the counted pixels (N, 3), as if the others were black."""
        image = np.zeros((*self.counted.shape, 3))
        image[self.counted] = pixels
        return self.metric.mean(self._distances(image))
