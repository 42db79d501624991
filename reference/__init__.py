"""The physical twin: pairing, integrators, and rendering with a standard error."""

from reference.halves import Pair, pair
from reference.pairing import Convention
from reference.rendering import Estimate, PassTimes
from reference.scene import Source

__all__ = ["Convention", "Estimate", "Pair", "PassTimes", "Source", "pair"]
