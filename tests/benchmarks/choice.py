"""What ``plan --within`` names, against an exhaustive search of a second measurement.

Each scene is measured twice, with different seeds. The choice of the first is looked up in the
second: but for noise it takes at most a tenth longer than what an exhaustive search finds there
among those that are surely within the error, and is within the error itself.
"""

from rich.console import Console
from rich.table import Table

from comparisons.case import open_case

from comparisons.options import Options  # isort: skip  it finds LLVM first

from comparisons.cost.front import cheapest
from comparisons.cost.measure import Effort, measure_ladder

SCENES = (
    "fig-8-7b",
    "fig-8-9",
    "fig-6-10",
    "fig-6-14",
    "lambert-sphere",
    "plastic-spheres",
    "narrow-band-lamp",
    "cornell-box",
)
TOLERANCES = 1.0, 2.0, 5.0
SLOWER = 1.1
SIZE = 256, 192


def run(rounds):
    """Print a row per scene and tolerance, and return them."""
    rows = [row for name in SCENES for row in _chosen(name, Effort(rounds=min(rounds, 7)))]
    table = Table("scene", "within", "chosen", "searched", "time, ratio", "right")
    for row in rows:
        table.add_row(*(f"{v:.3g}" if isinstance(v, float) else str(v) for v in row.values()))
    right = sum(row["right"] for row in rows)
    Console().print(table, f"Right: {right} of {len(rows)}.", highlight=False)
    return rows


def _chosen(name, effort):
    first, second = (_measured(name, effort, seed) for seed in (1, 2))
    for within in TOLERANCES:
        sure = [p for p in second if p.error.high <= within]
        found, best = cheapest(first, within), searched(sure, within)
        again = found and next(p for p in second if (p.method, p.spp) == (found.method, found.spp))
        ratio = again.seconds.value / best.seconds.value if found and best else 1.0
        yield {
            "scene": name,
            "within": within,
            "chosen": _named(found),
            "searched": _named(best),
            "time, ratio": ratio,
            "right": is_right(again, best, within),
        }


def searched(points, within):
    """Return what none of the others beats, by comparing each with each; None where none is."""
    allowed = [point for point in points if point.error.mean <= within]
    cost = {id(point): (point.seconds.value, point.error.mean) for point in allowed}
    for point in allowed:
        if all(cost[id(point)] <= cost[id(other)] for other in allowed):
            return point
    return None


def is_right(again, best, within):
    """Tell whether a choice, measured again, is as good as the best there."""
    if again is None:
        return best is None
    is_within = again.error.low <= within
    return is_within and (best is None or again.seconds.low <= SLOWER * best.seconds.high)


def _named(point):
    return f"{point.method}, {point.spp} spp" if point else "none"


def _measured(name, effort, seed):
    case = open_case(name, Options(resolution=SIZE, seed=seed))
    return measure_ladder(case.source, case.options, effort, lambda *_: None).points
