"""The unit vectors that the terms need (chapter 6, section 6.5).

Each function takes Dr.Jit arrays of three components, of any float type, and returns the same.
"""

import drjit as dr


def normalise(vector):
    """Return ``vector / |vector|``, and zero for the zero vector.

    A direction that does not exist then contributes nothing to a scalar product, instead of NaN.
    """
    squared_length = dr.squared_norm(vector)
    return vector * dr.select(squared_length > 0, dr.rsqrt(squared_length), 0)


def light_vector(light_position, position):
    """Equation 6.26: ``L = (P_L - P) / |P_L - P|``, with the distance ``d = |P_L - P|``.

    Returns ``(L, d)``. On the light itself (``d = 0``) the direction is undefined and ``L`` is
    zero, so that such a point receives no light.
    """
    offset = light_position - position
    squared_distance = dr.squared_norm(offset)
    inverse_distance = dr.select(squared_distance > 0, dr.rsqrt(squared_distance), 0)
    return offset * inverse_distance, squared_distance * inverse_distance


def view_vector(viewer_position, position):
    """Equation 6.27: ``V = (P_V - P) / |P_V - P|``, and zero on the viewer itself."""
    return normalise(viewer_position - position)


def half_vector(direction, view):
    """Return ``H = (L + V) / |L + V|`` (Blinn 1977), zero where ``L`` and ``V`` are opposite."""
    return normalise(direction + view)


def mirror_vector(normal, direction, cosine):
    """Equations 6.28-6.31: ``R = 2 (L.N) N - L``, the mirror image of ``L`` about ``N``.

    It follows from three demands on ``R``: equal angles (6.28, 6.29), one plane with ``L`` and
    ``N`` (6.30) and unit length. ``cosine`` is ``N.L``, which callers have at hand.
    """
    return dr.fma(2 * cosine, normal, -direction)
