"""What a program needs of fotismos: ``import fotismos``.

It comes before Mitsuba and Dr.Jit: it tells Dr.Jit where LLVM is. Each name is loaded when it is
first used.
"""

from fotismos import heuristic  # isort: skip  it finds LLVM before Dr.Jit is imported

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fotismos.comparisons.cost.cost_record import Method
    from fotismos.comparisons.departure.metrics import Metric
    from fotismos.heuristic.errors import FotismosError, InputError
    from fotismos.heuristic.heuristics import Heuristic, Parameter, Range
    from fotismos.heuristic.kernel import shade
    from fotismos.heuristic.lights import DirectionalLight, PointLight, SpotLight
    from fotismos.heuristic.materials import Material
    from fotismos.reports.notebook import audit, check, compare, cost, declare, fit, plan

__version__ = heuristic.__version__
register = heuristic.register

HOMES = heuristic.HOMES | {
    "FotismosError": "fotismos.heuristic.errors",
    "InputError": "fotismos.heuristic.errors",
    "Method": "fotismos.comparisons.cost.cost_record",
    "Metric": "fotismos.comparisons.departure.metrics",
    **dict.fromkeys(
        ("audit", "check", "compare", "cost", "declare", "fit", "plan"), "fotismos.reports.notebook"
    ),
}
"""Where names come from when they are first used."""

__all__ = [
    "DirectionalLight", "FotismosError", "Heuristic", "InputError", "Material", "Method", "Metric",
    "Parameter", "PointLight", "Range", "SpotLight", "audit", "check", "compare", "cost", "declare",
    "fit", "plan", "register", "shade",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
