"""Predicted against measured: the time of each method at a larger size, and errors at both sizes.

One study of 128 pixels predicts, as ``fotismos cost SCENE --at WxH`` does, and one at that size
measures, on an idle machine. A scene is within the bound in time if the median of its methods is,
since a burst of another program hits a single one. Errors are not predicted: the table shows how
far they move with the size, where those that differ by less than anyone sees count as equal.
"""

from statistics import median

from rich.console import Console
from rich.table import Table

from fotismos.comparisons.case import open_case

from fotismos.comparisons.options import Options  # isort: skip  it finds LLVM first

from fotismos.comparisons.ladder.climb import Effort, climbed

SCENES = ("fig-8-9", "fig-6-10", "plastic-spheres", "cornell-box")
TARGET = 1280, 720
TIME = 0.15

UNSEEN = 0.02
"""ΔE2000: errors that differ by less count as equal."""

HEAD = "scene", "time: worst", "median", "error: worst"


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
        yield name, *(f"{share:.0%}" for share in (max(time), median(time), max(error)))


def summary(found):
    """Yield how many scenes are within the bounds."""
    scenes = found.values()
    time = sum(median(abs(row["time"]) for row in own) <= TIME for own in scenes)
    yield f"Times are within {100 * TIME:.0f} % in {time} of {len(scenes)} scenes."
    error = max(abs(row["error"]) for own in scenes for row in own)
    yield (
        f"Errors change by up to {100 * error:.0f} % from size to size, so they are not predicted."
    )


def _deviations(name, rounds, target=TARGET):
    """Compare the study's prediction with a study at the target, both with the fewest samples."""
    case = open_case(name, Options())
    effort = Effort(rounds=rounds, largest=4, is_short=True, goes_on=False)
    at_target = case.options.changed(resolution=target)
    small = climbed(case.source, case.options, effort, silent, at=target)
    whole = climbed(case.source, at_target, effort, silent)
    predicted = {point.method: point for point in small.points(target)}
    found = []
    for point in whole.points():
        said = predicted[point.method]
        found.append(
            {
                "method": point.method,
                "time": said.seconds.value / point.seconds.value - 1,
                "error": _deviation(said.error.value, point.error.value),
            }
        )
    return found


def silent(*_):
    """Report no progress."""


def _deviation(predicted, error):
    return 0.0 if abs(predicted - error) < UNSEEN else predicted / error - 1
