"""Predicted against measured: time and error of each method, at a size and counts not fitted.

Predicted and measured in one run and in turns (``fotismos cost SCENE --at WxH --measure``). A scene
is within 20 % if each of its methods is, at both counts; for times the median of its methods is
told, too, since one burst of another program hits a single one.
"""

from statistics import median

from rich.console import Console
from rich.table import Table

from comparisons.case import Request, open_case  # isort: skip  it finds LLVM first

from comparisons.compare import guarded
from comparisons.cost.effort import Effort
from comparisons.cost.methods import Methods
from comparisons.cost.prediction.forecasting import predict
from comparisons.cost.prediction.target import sizes

SCENES = (
    "fig-8-7b",
    "fig-8-9",
    "fig-8-11-n9",
    "fig-6-5-m40",
    "fig-6-10",
    "fig-6-14",
    "lambert-sphere",
    "plastic-spheres",
    "metameric-pair",
    "cornell-box",
)
TARGET = 512, 384
BOUND = 0.2


def run(rounds):
    """Print a row per scene, and return the deviations."""
    table = Table("scene", "time: worst", "median", "error: worst", "in their intervals")
    found = {}
    for name in SCENES:
        found[name] = rows = _deviations(name, min(rounds, 7))
        time, error = ([abs(row[key]) for row in rows] for key in ("time", "error"))
        inside = sum(row["time_inside"] for row in rows), sum(row["error_inside"] for row in rows)
        table.add_row(
            name,
            f"{max(time):.0%}",
            f"{median(time):.0%}",
            f"{max(error):.0%}",
            f"{inside[0]}, {inside[1]} of {len(rows)}",
        )
        Console().print(name, *table.columns[1]._cells[-1:], highlight=False)
    Console().print(table)
    return found


def _deviations(name, rounds):
    shape = sizes(TARGET)[-1]
    case = open_case(name, Request(resolution=shape))
    methods = Methods(case.source, case.options, guarded(case.source, case.options))
    made = predict(methods, TARGET, Effort(rounds=rounds), seed=1, is_measured=True)
    rows = []
    for forecast in made.forecasts:
        if forecast.measured is None:
            continue
        seconds, error = forecast.measured.seconds.median, forecast.measured.error
        rows.append(
            {
                "method": forecast.method,
                "spp": forecast.spp,
                "time": forecast.seconds.value / seconds - 1,
                "error": forecast.error.value / error - 1 if error else 0.0,
                "measured": error,
                "time_inside": forecast.seconds.low <= seconds <= forecast.seconds.high,
                "error_inside": forecast.error.low <= error <= forecast.error.high,
            }
        )
    return rows
