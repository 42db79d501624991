"""Predicted against measured: time and error of each method, at a size and counts not fitted.

Predicted and measured in one run and in turns (``fotismos cost SCENE --at WxH --measure``). A scene
is within 20 % if each of its methods is, at both counts, in error, where errors that differ by less
than anyone sees count as equal; in time if the median of its methods is, since a burst of another
program hits a single one.
"""

from statistics import median

from rich.console import Console
from rich.table import Table

from comparisons.case import Request, open_case  # isort: skip  it finds LLVM first

from comparisons.compare import guarded
from comparisons.cost.effort import Effort
from comparisons.cost.methods import Methods
from comparisons.cost.prediction.error_law import LEVEL
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
UNSEEN = 0.02
"""ΔE2000: errors that differ by less count as equal."""


def run(rounds):
    """Print a row per scene, and return the deviations."""
    table = Table("scene", "time: worst", "median", "error: worst", "time inside", "error inside")
    found = {}
    for name in SCENES:
        found[name] = rows = _deviations(name, min(rounds, 7))
        time, error = ([abs(row[key]) for row in rows] for key in ("time", "error"))
        inside = [f"{_share(rows, key):.0%}" for key in ("time_inside", "error_inside")]
        table.add_row(
            name,
            f"{max(time):.0%}",
            f"{median(time):.0%}",
            f"{max(error):.0%}",
            *inside,
        )
    Console().print(table, *_summary(found.values()), sep="\n", highlight=False)
    return found


def _summary(scenes):
    """Yield how many scenes are within the bound, and how much the intervals hold."""
    scenes, rows = list(scenes), [row for scene in scenes for row in scene]
    time = sum(median(abs(row["time"]) for row in scene) <= BOUND for scene in scenes)
    error = sum(all(abs(row["error"]) <= BOUND for row in scene) for scene in scenes)
    yield f"Within {BOUND:.0%}: time {time}, error {error} of {len(scenes)} scenes."
    for key in ("time_inside", "error_inside"):
        yield f"{key.replace('_', ' ')} its {LEVEL:.0%} interval: {_share(rows, key):.0%}."


def _share(rows, key):
    return sum(row[key] for row in rows) / len(rows)


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
                "error": _deviation(forecast.error.value, error),
                "measured": error,
                "time_inside": forecast.seconds.low <= seconds <= forecast.seconds.high,
                "error_inside": forecast.error.low <= error <= forecast.error.high,
            }
        )
    return rows


def _deviation(predicted, error):
    return 0.0 if abs(predicted - error) < UNSEEN else predicted / error - 1
