"""Errors of the images between the halves, with the part of noise taken out.

A distance is never negative, so that noise raises it, and raises it more where less is left to see.
Prices are differences of such errors: each would be charged with the noise that its effect brings.
So the noise is added once more, and what it adds is taken away. Over a block of pixels let ``f0``
be the mean distance as measured, and ``f1`` that after noise of the same distribution was added to
both images; then ::

    f² (without noise) = f0² − (f1² − f0²)

Of noise alone ``f1 = √2 f0``, and nothing is left; far from it the squares grow with the variance.
A negative square counts as a negative root, so that the mean of many blocks is not biased. Within a
block each pixel keeps its share.

Source of the method: J. R. Cook and L. A. Stefanski, *Simulation-extrapolation estimation in
parametric measurement error models*, J. Am. Stat. Assoc. 89, 1994.
"""

from functools import cached_property

import numpy as np

BLOCK = 8
"""Pixels along each side of a block."""

CONTRASTS = 2
"""Ways in which noise is added, whose mean counts."""


def contrasts(count: int) -> np.ndarray:
    """Return weights (m, count) that make noise of independent images, as large as their mean's.

    Each row adds up to 0, and its squares to ``1 / count``; rows are orthogonal. Images with these
    weights keep no signal, and have the variance of their mean.
    """
    rows = np.arange(1, 1 + min(CONTRASTS, count - 1))[:, None]
    waves = np.cos(np.pi * rows * (np.arange(count) + 0.5) / count)
    return waves * np.sqrt(2) / count


class Noiseless:
    """Tells errors against a converged reference, without the noise of either image.

    Parameters
    ----------
    judge : comparisons.cost.timing.Judge
        What counts, and how it is looked at.
    groups
        (R, H, W, 3): means of as many passes of the reference as there are replicates of each
        image, so that the jackknife leaves out one of each.
    """

    def __init__(self, judge, groups):
        self.judge = judge
        self._groups = np.asarray(groups)[:, judge.counted].astype(float)
        rows, columns = np.nonzero(judge.counted)
        _, width = judge.counted.shape
        _, self._blocks = np.unique(rows // BLOCK * width + columns // BLOCK, return_inverse=True)

    def errors(self, images):
        """Return the error of each counted pixel, (R + 1, N).

        First of the mean of all replicates (R, H, W, 3), then leaving out each in turn.
        """
        images = np.asarray(images)[:, self.judge.counted].astype(float)
        found = []
        for chosen, references in self._references:
            some = images[chosen]
            weights = contrasts(len(some))
            noise = np.tensordot(weights, some, 1)
            shown = (some.mean(axis=0), *(some.mean(axis=0) + each for each in noise))
            plain, *noisy = (
                self.judge.metric.difference(reference, self._coordinates(image))
                for reference, image in zip(references, shown, strict=True)
            )
            found.append(self._without_noise(plain, np.mean(noisy, axis=0)))
        return np.stack(found)

    @cached_property
    def _references(self):
        """For each jackknifed set: which replicates it holds, and the reference's coordinates.

        Of the reference as it is, and with noise added in each way.
        """
        count = len(self._groups)
        sets = [np.arange(count), *(np.delete(np.arange(count), out) for out in range(count))]
        found = []
        for chosen in sets:
            mean = self._groups[chosen].mean(axis=0)
            noise = np.tensordot(contrasts(len(chosen)), self._groups[chosen], 1)
            # The other sign than an image's: the noise of both is independent.
            images = (mean, *(mean - each for each in noise))
            found.append((chosen, [self._coordinates(image) for image in images]))
        return found

    def _coordinates(self, pixels):
        return self.judge.metric.coordinates(pixels, self.judge.viewing)

    def _without_noise(self, plain, noisy):
        """Return distances (N,) without noise, from those measured and those with more of it."""
        before, after = (np.bincount(self._blocks, each) for each in (plain, noisy))
        square = 2 * before**2 - after**2
        clean = np.sign(square) * np.sqrt(np.abs(square))
        share = np.divide(clean, before, out=np.zeros_like(clean), where=before > 0)
        return plain * share[self._blocks]
