"""Pairs of pictures of known difference, in sixteen kinds of noise: what estimates must hold in."""

import numpy as np
from scipy.ndimage import gaussian_filter

from fotismos.comparisons.departure.estimate import Replicates
from fotismos.comparisons.departure.metrics import LEADING

SIZE = 48
KINDS = (
    "coloured", "grey", "gamma", "lognormal", "fireflies", "rare fireflies", "caustic", "pareto",
    "denoised", "blotches", "adaptive", "common", "counts", "8 bits", "single", "equal",
)  # fmt: skip
SHARES = (0.0, 0.04, 0.1, 0.3)
COUNTS = (2, 4, 8, 16)


def truth(rng):
    """Blocks of hue and brightness (H, W, 3), with a ramp across."""
    blocks = SIZE // 8
    level = np.exp(0.6 * rng.normal(size=(blocks, blocks))) / 4
    hue = 0.3 + 0.7 * rng.random((blocks, blocks, 3))
    image = (level[..., None] * hue).repeat(8, 0).repeat(8, 1)
    y, x = np.mgrid[:SIZE, :SIZE] / SIZE
    return image * (0.8 + 0.4 * x * y)[..., None]


def noise(kind, count, rng):
    """Return relative noise (count, H, W, C) of mean 0 and deviation 1 or so."""
    shape = (count, SIZE, SIZE, 1)
    y, x = np.mgrid[:SIZE, :SIZE] - SIZE / 2
    normal = rng.normal(size=shape)
    pareto = (rng.pareto(2.2, size=shape) - 1 / 1.2) / 2
    chance = np.clip(0.5 + x / SIZE, 0.02, 0.98)[..., None]
    match kind:
        case "coloured" | "8 bits":
            return rng.normal(size=(*shape[:3], 3))
        case "gamma":
            return (rng.gamma(0.25, size=shape) - 0.25) / 0.5
        case "lognormal":
            return (np.exp(1.2 * normal - 0.72) - 1) / np.sqrt(np.exp(1.44) - 1)
        case "fireflies":
            return 0.3 * normal + 12 * (
                rng.gamma(2, size=shape) * (rng.random(shape) < 1e-3) - 2e-3
            )
        case "rare fireflies":
            return 0.3 * normal + 40 * (
                rng.gamma(2, size=shape) * (rng.random(shape) < 1e-4) - 2e-4
            )
        case "caustic":
            return np.where((x**2 + y**2 < (SIZE / 6) ** 2)[..., None], pareto, 0.1 * normal)
        case "pareto":
            return pareto
        case "denoised":
            return gaussian_filter(normal, (0, 1.5, 1.5, 0), mode="wrap") * 3 * np.sqrt(np.pi)
        case "blotches":
            coarse = rng.normal(size=(count, SIZE // 6, SIZE // 6, 1))
            return coarse.repeat(6, axis=1).repeat(6, axis=2)
        case "adaptive":
            return normal * np.exp(np.sin(y / 5) * np.cos(x / 7))[..., None]
        case "counts":
            return (rng.binomial(16, chance * np.ones(shape)) / 16 / chance - 1) * 4
        case "equal":
            return np.zeros(shape)
    return normal


def pair(kind, count, share, rng):
    """Return replicates of a pair that differs in a share of its pixels, and the true distances.

    Scattered, in one region, or in cells of 4 x 4; in half of the pairs all pixels differ a little.
    """
    reference = truth(rng)
    test = reference.copy()
    pixels = SIZE * SIZE
    y, x = np.mgrid[:SIZE, :SIZE]
    row, column = rng.random(2) * SIZE
    cells = rng.permutation((SIZE // 4) ** 2).reshape(SIZE // 4, -1).repeat(4, 0).repeat(4, 1)
    orders = (
        rng.random(pixels),
        ((y - row) ** 2 + (x - column) ** 2).ravel(),
        cells.ravel(),
    )
    order = np.argsort(orders[rng.integers(3)], kind="stable")
    inside = np.zeros(pixels, bool)
    inside[order[: round(share * pixels)]] = True
    size = np.exp(rng.uniform(np.log(0.12), np.log(0.8)))
    tint = 1 + size * (np.ones(3) if rng.random() < 0.6 else rng.random(3))
    test[inside.reshape(SIZE, SIZE)] *= tint if rng.random() < 0.5 else 1 / tint
    if rng.random() < 0.5:
        test *= 1 + rng.uniform(0, 0.03)
    spread = np.exp(rng.uniform(np.log(0.02), np.log(0.8)))
    count = 1 if kind == "single" else count
    relative = spread * noise(kind, count, rng)
    passes = reference * (1 + relative)
    if kind == "common":
        passes = test - (test - reference) * (1 + relative)
    if kind == "8 bits":
        passes = np.round(np.clip(passes, 0, 1) * 255) / 255
        # The mean of clipped noise, from many draws.
        draws = np.clip(reference * (1 + spread * rng.normal(size=(2000, 1, 1, 1))), 0, 1)
        reference = draws.mean(axis=0)
    shown = "none" if kind == "single" else "all"
    replicates = Replicates.of_images(test, passes, np.ones((SIZE, SIZE), bool), shown)
    return replicates, LEADING(test, reference)
