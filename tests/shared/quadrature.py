"""Integrals over the hemisphere, in NumPy alone."""

import numpy as np


def dot(a, b):
    return (a * b).sum(axis=0)


def integral(f, degrees):
    """``int f(fixed, o) cos o do`` over the hemisphere: Gauss and Legendre, and trapezoids."""
    nodes, weights = np.polynomial.legendre.leggauss(192)
    z, weights = (nodes + 1) / 2, weights / 2
    azimuth = np.linspace(0, 2 * np.pi, 160, endpoint=False)
    z, azimuth = np.meshgrid(z, azimuth, indexing="ij")
    sine = np.sqrt(1 - z**2)
    over = np.stack([sine * np.cos(azimuth), sine * np.sin(azimuth), z])
    theta = np.deg2rad(degrees)
    fixed = np.broadcast_to(np.reshape([np.sin(theta), 0, np.cos(theta)], (3, 1, 1)), over.shape)
    half = fixed + over
    half = half / np.linalg.norm(half, axis=0)
    return (f(fixed, over, half) * z).mean(axis=1) @ weights * 2 * np.pi
