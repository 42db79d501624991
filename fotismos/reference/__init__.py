"""The physical twin: pairing, integrators, and rendering with a standard error."""

if __name__ == "reference":
    raise ImportError("write `import fotismos.reference` in place of `import reference`")

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fotismos.reference.pairing.factors import Convention
    from fotismos.reference.pairing.halves import Pair, PairOptions, pair
    from fotismos.reference.planning.plan import plan
    from fotismos.reference.planning.plan_record import Plan
    from fotismos.reference.records import Times
    from fotismos.reference.rendering.sums import Estimate
    from fotismos.reference.scene.source import Source

HOMES = {
    "Convention": "fotismos.reference.pairing.factors",
    "Estimate": "fotismos.reference.rendering.sums",
    "Pair": "fotismos.reference.pairing.halves",
    "PairOptions": "fotismos.reference.pairing.halves",
    "Plan": "fotismos.reference.planning.plan_record",
    "Source": "fotismos.reference.scene.source",
    "Times": "fotismos.reference.records",
    "pair": "fotismos.reference.pairing.halves",
    "plan": "fotismos.reference.planning.plan",
}
"""The module of each name, imported at its first use: records load without Mitsuba."""

__all__ = [
    "Convention", "Estimate", "Pair", "PairOptions", "Plan", "Source", "Times", "pair", "plan",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(HOMES[name]), name)
