"""Share the departure among shapes, and among materials.

Every counted pixel belongs to the first surface that the ray through its centre hits, so the shares
of all shapes add up to 1, as do the shares of all materials.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from comparisons.departure.regions import Region, bounds
from comparisons.records import Size
from reference.rendering.gbuffer import Owners

MOST = 24
"""Rows; if there are more carriers, the last row holds all others."""


class Carrier(Region, kw_only=True):
    """A shape or a material: the box of its pixels, and its part of the departure.

    Attributes
    ----------
    name
        Its id in the scene.
    pixels
        Number of counted pixels that see it.
    material
        Id of a shape's material; empty for a material itself.
    """

    name: str
    pixels: Size
    material: str = ""


def find(
    error: NDArray, counted: NDArray, owners: Owners, materials: Owners | None = None
) -> tuple[tuple[Carrier, ...], NDArray]:
    """Return the carriers of a map of ΔE2000 (H, W), largest share first, and a map of them.

    The map (H, W) holds the index of each pixel's carrier, or -1 if the pixel does not count. If
    ``materials`` is given, the carriers are shapes with their materials.
    """
    places = np.where(counted, owners.places, -1)
    seen = np.unique(places[places >= 0])
    sums = np.bincount(places[places >= 0], error[places >= 0], len(owners.names))
    ranked = sorted(seen, key=lambda place: -sums[place])
    if len(ranked) > MOST:
        ranked = ranked[: MOST - 1]
    rows = np.full(len(owners.names) + 1, len(ranked))
    rows[ranked], rows[-1] = np.arange(len(ranked)), -1
    found = rows[places]
    names = [owners.names[place] for place in ranked]
    if len(seen) > len(names):
        names.append(f"{len(seen) - len(names)} others")
    total = error[counted].sum(dtype=np.float64)
    return tuple(
        _carrier(name, error, found == row, total, materials) for row, name in enumerate(names)
    ), found


def shares(change: NDArray, owners: Owners) -> dict[str, float]:
    """Return the share of each shape in a change (H, W) ≥ 0 of those seen, the largest first.

    Without change there are no shares.
    """
    found, _ = find(change, owners.places >= 0, owners)
    return {each.name: each.share for each in found if each.share > 0}


def means(values: NDArray, rows: NDArray, count: int) -> NDArray[np.float64]:
    """Return the means (..., count) of values (..., N) by carrier; ``rows`` (N,) names it."""
    sums = [np.bincount(rows, each, count) for each in values.reshape(-1, len(rows))]
    return np.reshape(sums, (*values.shape[:-1], count)) / np.bincount(rows, minlength=count)


def _carrier(
    name: str, error: NDArray, mask: NDArray, total: float, materials: Owners | None
) -> Carrier:
    held = error[mask].sum(dtype=np.float64)
    return Carrier(
        name=name,
        material=_material(mask, materials) if materials else "",
        pixels=int(mask.sum()),
        share=float(held / total) if total > 0 else 0.0,
        mean_dE2000=float(held / mask.sum()),
        **bounds(mask),
    )


def _material(mask: NDArray, materials: Owners) -> str:
    own = np.unique(materials.places[mask])
    return materials.names[own[0]] if len(own) == 1 else "several"
