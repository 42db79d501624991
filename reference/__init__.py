"""The physical twin: pairing, integrators, and rendering with a standard error."""

from heuristic import llvm  # isort: skip  it finds LLVM before Mitsuba loads Dr.Jit

import mitsuba as mi

if mi.variant() is None:
    llvm.check()
    mi.set_variant("llvm_ad_rgb")  # Mitsuba has no names before a variant is chosen

from reference.pairing.factors import Convention
from reference.pairing.halves import Pair, pair
from reference.planning.plan import Plan, plan
from reference.rendering.renderer import Times
from reference.rendering.sums import Estimate
from reference.scene.source import Source

__all__ = ["Convention", "Estimate", "Pair", "Plan", "Source", "Times", "pair", "plan"]
