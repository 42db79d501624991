"""Predicted against measured: time and error of each method, at a size and counts not fitted.

Predicted and measured in one run and in turns (``fotismos cost SCENE --at WxH --measure``). A scene
is within 20 % if each of its methods is, at both counts, in error, where errors that differ by less
than anyone sees count as equal; in time if the median of its methods is, since a burst of another
program hits a single one.
"""

from statistics import median

from rich.console import Console
from rich.table import Table

from comparisons.case import open_case

from comparisons.options import Options  # isort: skip  it finds LLVM first

from comparisons.cost.measure import Effort
from comparisons.cost.methods import Ladder
from comparisons.cost.predict import LEVEL, UNSEEN, predict, sizes
from comparisons.prepared import guarded

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
INSIDE = "time_inside", "error_inside"


HEAD = "scene", "time: worst", "median", "error: worst", "time inside", "error inside"


def run(rounds):
    """Print a row per scene, and return the deviations."""
    found = {name: _deviations(name, min(rounds, 7)) for name in SCENES}
    table = Table(*HEAD)
    for row in rows(found):
        table.add_row(*row)
    Console().print(table, *summary(found), sep="\n", highlight=False)
    return found


def rows(found):
    """Yield the cells of each scene."""
    for name, own in found.items():
        time, error = ([abs(row[key]) for row in own] for key in ("time", "error"))
        shares = max(time), median(time), max(error), *(_share(own, key) for key in INSIDE)
        yield name, *(f"{share:.0%}" for share in shares)


def summary(found):
    """Yield how many scenes are within the bound, and how often the intervals hold."""
    scenes, everything = found.values(), [row for own in found.values() for row in own]
    time = sum(median(abs(row["time"]) for row in own) <= BOUND for own in scenes)
    error = sum(all(abs(row["error"]) <= BOUND for row in own) for own in scenes)
    yield f"Within {BOUND:.0%}: time {time}, error {error} of {len(scenes)} scenes."
    time, error = (_share(everything, key) for key in INSIDE)
    yield f"{LEVEL:.0%} intervals hold {time:.0%} of the times and {error:.0%} of the errors."


def _share(own, key):
    return sum(row[key] for row in own) / len(own)


def _deviations(name, rounds):
    shape = sizes(TARGET)[-1]
    case = open_case(name, Options(resolution=shape))
    ladder = Ladder(case.source, case.options, guarded(case.source, case.options))
    effort = Effort(rounds=rounds)
    made = predict(ladder, TARGET, effort, seed=1, is_measured=True, progress=lambda *_: None)
    found = []
    for forecast in made.forecasts:
        if forecast.measured is None:
            continue
        seconds, error = forecast.measured.seconds.value, forecast.measured.error.mean
        found.append(
            {
                "method": forecast.method,
                "spp": forecast.spp,
                "time": forecast.seconds.value / seconds - 1,
                "error": _deviation(forecast.error.mean, error),
                "measured": error,
                "time_inside": forecast.seconds.low <= seconds <= forecast.seconds.high,
                "error_inside": forecast.error.low <= error <= forecast.error.high,
            }
        )
    return found


def _deviation(predicted, error):
    return 0.0 if abs(predicted - error) < UNSEEN else predicted / error - 1
