"""How a change is shared among the shapes of a scene."""

from __future__ import annotations

from numpy.typing import NDArray

from reference.rendering.gbuffer import Owners


def carried(change: NDArray, owners: Owners) -> dict[str, float]:
    """Return each shape's share of a change (H, W) ≥ 0, the largest first.

    Pixels that see no shape are left out. Without change there are no shares.
    """
    total = change.sum()
    if not total > 0.0:
        return {}
    shares = {
        name: float(change[owners.places == place].sum() / total)
        for place, name in enumerate(owners.names)
    }
    ordered = sorted(shares.items(), key=lambda item: -item[1])
    return {name: share for name, share in ordered if name and share > 0.0}
