"""What a program needs of fotismos: ``import fotismos``.

It comes before Mitsuba and Dr.Jit: it tells Dr.Jit where LLVM is. Each name is loaded when it is
first used.
"""

from fotismos import heuristic  # isort: skip  it finds LLVM before Dr.Jit is imported

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from fotismos.comparisons.audit.checks import Audit
    from fotismos.comparisons.case import Scene
    from fotismos.comparisons.departure.metrics import Metric, Pixelwise
    from fotismos.comparisons.options import Options
    from fotismos.comparisons.records.check import CheckRecord
    from fotismos.comparisons.records.comparison import ComparisonRecord
    from fotismos.comparisons.records.cost import Cost, Method
    from fotismos.comparisons.records.engine import EngineCost
    from fotismos.comparisons.records.fit import FitRecord
    from fotismos.comparisons.records.images import Comparison, PixelTerms
    from fotismos.heuristic.background import environment
    from fotismos.heuristic.errors import (
        FotismosError,
        InputError,
        InstallationError,
        LostProcessError,
        NonFiniteError,
        OutputError,
    )
    from fotismos.heuristic.heuristics import Heuristic, Parameter, Range
    from fotismos.heuristic.kernel import shade
    from fotismos.heuristic.lights import DirectionalLight, PointLight, SpotLight
    from fotismos.heuristic.materials import Material
    from fotismos.heuristic.plugins import register
    from fotismos.reports.notebook import Shown, audit, check, compare, cost, declare, fit, plan
    from fotismos.reports.terminal.plan_lines import PlanReport

__version__ = heuristic.__version__

NAMES = {
    "comparisons.audit.checks": ("Audit",),
    "comparisons.case": ("Scene",),
    "comparisons.departure.metrics": ("Metric", "Pixelwise"),
    "comparisons.options": ("Options",),
    "comparisons.records.check": ("CheckRecord",),
    "comparisons.records.comparison": ("ComparisonRecord",),
    "comparisons.records.cost": ("Cost", "Method"),
    "comparisons.records.engine": ("EngineCost",),
    "comparisons.records.fit": ("FitRecord",),
    "comparisons.records.images": ("Comparison", "PixelTerms"),
    "heuristic.errors": (
        "FotismosError",
        "InputError",
        "InstallationError",
        "LostProcessError",
        "NonFiniteError",
        "OutputError",
    ),
    "reports.notebook": (
        "Shown",
        "audit",
        "check",
        "compare",
        "cost",
        "declare",
        "fit",
        "plan",
    ),
    "reports.terminal.plan_lines": ("PlanReport",),
}

HOMES = heuristic.HOMES | {
    name: f"fotismos.{module}" for module, names in NAMES.items() for name in names
}
"""Where names come from when they are first used."""

__all__ = [
    "Audit", "CheckRecord", "Comparison", "ComparisonRecord", "Cost", "DirectionalLight",
    "EngineCost", "FitRecord", "FotismosError", "Heuristic", "InputError", "InstallationError",
    "LostProcessError", "Material", "Method", "Metric", "NonFiniteError", "Options", "OutputError",
    "Parameter", "PixelTerms", "Pixelwise", "PlanReport", "PointLight", "Range", "Scene", "Shown",
    "SpotLight", "audit", "check", "compare", "cost", "declare", "environment", "fit", "plan",
    "register", "shade",
]  # fmt: skip


def __getattr__(name: str) -> object:
    if name not in HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(HOMES[name]), name)


def __dir__() -> list[str]:
    return __all__
