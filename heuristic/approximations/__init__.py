"""What engines use in place of light transport: ambient light, and shadows from depth images.

Their light is display-linear, like the kernel's (:mod:`heuristic.convention`). They prepare for a
scene from its heuristic half alone, with the same result in every run. Its dataclasses are not
frozen, since ``dr.freeze`` replaces their arrays.
"""
