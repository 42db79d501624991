"""Errors of the images between the halves, with noise removed.

A distance is never negative, so noise raises it, and most where the distance is small. Prices are
differences of such errors, and each would include the noise of its effect. So the noise of both
images is added once more, and the increase of each block is taken away, by the formula of
:mod:`comparisons.departure.debiasing`. Within a block each pixel keeps its share. Where a departure
is near the size of the noise, up to two fifths of the noise's part can remain.
"""

from functools import cached_property
from typing import cast

import numpy as np
from numpy.typing import NDArray

from comparisons.cost.judging import Judge
from comparisons.departure.blocks import ratio
from comparisons.departure.debiasing import contrasts, signed_root
from comparisons.departure.metric import Pixelwise
from reference.rendering.moments import block_numbers


class Noiseless:
    """Measures errors against a converged reference, without the noise of either image.

    Parameters
    ----------
    judge
        Which pixels count, the metric, and how images are viewed.
    groups
        (R, H, W, 3): means of groups of the reference's passes, one group per replicate of an
        image: the jackknife leaves out one of each.
    """

    def __init__(self, judge: Judge, groups: NDArray):
        self.judge = judge
        self._groups = np.asarray(groups)[:, judge.counted].astype(float)
        _, self._blocks = np.unique(block_numbers(judge.counted), return_inverse=True)

    def errors(self, images: NDArray) -> NDArray[np.float64]:
        """Return the error of each counted pixel, (R + 1, N).

        First for the mean of all replicates (R, H, W, 3), then leaving out each in turn.
        """
        images = np.asarray(images)[:, self.judge.counted].astype(float)
        metric = cast(Pixelwise, self.judge.metric)  # the leading one is
        found = []
        for chosen, references in self._references:
            plain, *noisy = (
                metric.difference(reference, shown)
                for reference, shown in zip(references, self._noisier(images[chosen]), strict=True)
            )
            found.append(self._without_noise(plain, np.mean(noisy, axis=0)))
        return np.stack(found)

    @cached_property
    def _references(self):
        """For each jackknifed set: which replicates it holds, and the reference's coordinates.

        The coordinates are without added noise first, then with noise added in each way.
        """
        count = len(self._groups)
        sets = [np.arange(count), *(np.delete(np.arange(count), out) for out in range(count))]
        # The opposite sign of an image's: the noise of both is independent.
        return [(chosen, self._noisier(self._groups[chosen], -1)) for chosen in sets]

    def _noisier(self, images, sign=1):
        """Return the coordinates of the mean of images (n, N, 3), and of it with added noise."""
        mean, noise = images.mean(axis=0), np.tensordot(contrasts(np.ones(len(images))), images, 1)
        shown = (mean, *(mean + sign * each for each in noise))
        return [self.judge.metric.coordinates(pixels, self.judge.viewing) for pixels in shown]

    def _without_noise(self, plain, noisy):
        """Return distances (N,) without noise, from the measured and the noisier ones."""
        before, after = (np.bincount(self._blocks, each) for each in (plain, noisy))
        clean = signed_root(2 * before**2 - after**2)
        return plain * ratio(clean, before)[self._blocks]
