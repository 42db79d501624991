"""Pictures for tests of what two pictures say."""

import numpy as np


def patches(height, width, boxes, size, seed=0):
    """Return a picture of soft patches and hard boxes of a size in pixels, (H, W, 3)."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:height, 0:width] / height
    image = np.stack([0.3 + 0.2 * np.sin(k * x + y) for k in (3, 4, 5)], axis=-1)
    for _ in range(boxes):
        left, top = random.integers(0, height - size - 4, 2)
        image[top : top + size, left : left + size] = random.uniform(0.05, 0.9, 3)
    return image
