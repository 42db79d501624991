"""What engines use in place of light transport, one heuristic in each module.

Their light is display-linear as the kernel's is (:mod:`heuristic.convention`). What they prepare
for a scene is gathered in its heuristic half alone, and is the same in every run. The records of it
are not frozen, since ``dr.freeze`` puts other arrays in their place.
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
