"""The physical twin: pairing, integrators, and rendering with a standard error."""

import mitsuba as mi

import heuristic  # noqa: F401  before anything compiles: it finds LLVM

if mi.variant() is None:
    mi.set_variant("llvm_ad_rgb")  # Mitsuba has no names at all before one is chosen

from reference.halves import Pair, pair
from reference.pairing import Convention
from reference.plan import Plan, plan
from reference.rendering import Estimate, PassTimes
from reference.scene import Source

__all__ = ["Convention", "Estimate", "Pair", "PassTimes", "Plan", "Source", "pair", "plan"]
