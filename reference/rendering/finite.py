"""A NaN or an infinity in an image is an error that says where, never a silent pixel."""

import numpy as np

from heuristic.errors import NonFiniteError


def require_finite(image, layer):
    """Raise `NonFiniteError` if an image (H, W) or (H, W, C) holds a NaN or an infinity.

    The message names the layer, how many pixels are concerned and the first one as (x, y), counted
    from the top left in reading order.
    """
    finite = np.isfinite(image)
    if finite.all():
        return
    wrong = ~finite if finite.ndim == 2 else ~finite.all(axis=-1)
    place = np.unravel_index(np.argmax(wrong), wrong.shape)
    raise NonFiniteError(
        f"{layer}: {np.count_nonzero(wrong)} of {wrong.size} pixels are NaN or infinite, the first"
        f" at (x, y) = ({', '.join(str(index) for index in reversed(place))}):"
        f" {np.asarray(image)[place]}. Look at the surface and the lights seen there: an infinite"
        " light or a degenerate mesh is the usual cause."
    )
