"""What a program needs of fotismos: ``import fotismos``.

It comes before Mitsuba and Dr.Jit: it tells Dr.Jit where LLVM is. Each name is loaded when it is
first used.
"""

import heuristic  # isort: skip  it finds LLVM before Dr.Jit is imported

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from comparisons.cost.cost_record import Method
    from comparisons.departure.metrics import Metric
    from heuristic.errors import FotismosError, InputError
    from heuristic.heuristics import Heuristic, Parameter, Range
    from heuristic.kernel import shade
    from heuristic.lights import DirectionalLight, PointLight, SpotLight
    from heuristic.materials import Material
    from reports.notebook import audit, check, compare, cost, declare, fit, plan

__version__ = heuristic.__version__
register = heuristic.register

HOMES = {
    "DirectionalLight": "heuristic.lights",
    "FotismosError": "heuristic.errors",
    "Heuristic": "heuristic.heuristics",
    "InputError": "heuristic.errors",
    "Material": "heuristic.materials",
    "Method": "comparisons.cost.cost_record",
    "Metric": "comparisons.departure.metrics",
    "Parameter": "heuristic.heuristics",
    "PointLight": "heuristic.lights",
    "Range": "heuristic.heuristics",
    "SpotLight": "heuristic.lights",
    "audit": "reports.notebook",
    "check": "reports.notebook",
    "compare": "reports.notebook",
    "cost": "reports.notebook",
    "declare": "reports.notebook",
    "fit": "reports.notebook",
    "plan": "reports.notebook",
    "shade": "heuristic.kernel",
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
