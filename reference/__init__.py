"""The physical twin: pairing, integrators, and rendering with a standard error."""

if __name__ == "reference":
    raise ImportError("write `import fotismos.reference` in place of `import reference`")

from fotismos.heuristic import llvm  # isort: skip  it finds LLVM before Mitsuba loads Dr.Jit

import mitsuba as mi

if mi.variant() is None:
    llvm.check()
    mi.set_variant("llvm_ad_rgb")  # Mitsuba has no names before a variant is chosen

from fotismos.reference.pairing.factors import Convention
from fotismos.reference.pairing.halves import Pair, PairOptions, pair
from fotismos.reference.planning.plan import Plan, plan
from fotismos.reference.rendering.renderer import Times
from fotismos.reference.rendering.sums import Estimate
from fotismos.reference.scene.source import Source

__all__ = [
    "Convention", "Estimate", "Pair", "PairOptions", "Plan", "Source", "Times", "pair", "plan",
]  # fmt: skip
