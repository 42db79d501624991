"""What engines use in place of light transport, one heuristic per module.

Their light is display-linear, like the kernel's (:mod:`heuristic.convention`). They prepare for a
scene from its heuristic half alone, with the same result in every run. Its dataclasses are not
frozen, since ``dr.freeze`` replaces their arrays.
"""

from heuristic.stand_ins import (
    depth_image,
    harmonics,
    hemisphere,
    mean_ambient,
    openness,
    shadow_maps,
)

__all__ = [
    "depth_image",
    "harmonics",
    "hemisphere",
    "mean_ambient",
    "openness",
    "shadow_maps",
]
