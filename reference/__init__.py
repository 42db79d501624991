"""The physical twin: pairing, integrators, and rendering with a standard error."""

import mitsuba as mi

import heuristic  # noqa: F401  it finds LLVM, before anything compiles
from reference import switching  # noqa: F401  before a variant is chosen

if mi.variant() is None:
    mi.set_variant("llvm_ad_rgb")  # Mitsuba has no names before a variant is chosen

from reference.pairing.factors import Convention
from reference.pairing.halves import Pair, pair
from reference.planning.plan import Plan, plan
from reference.rendering.renderer import PassTimes
from reference.rendering.sums import Estimate
from reference.scene.source import Source

__all__ = ["Convention", "Estimate", "Pair", "PassTimes", "Plan", "Source", "pair", "plan"]
