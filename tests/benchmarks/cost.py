"""Whether a study of cost repeats: two runs in fresh processes must order the rungs alike.

Two rungs are out of order where one run says that the first is faster, the other that the second
is, and each by more than its intervals: the upper end of one below the lower end of the other.
Errors are compared in the same way, with five standard errors.
"""

import json
import subprocess
import sys
import tempfile
from itertools import combinations
from pathlib import Path

import click

SCENES = ("fig-8-9", "plastic-spheres", "cornell-box")

ERRORS = 5.0
"""Standard errors on either side of a mean error."""


def run(rounds):
    """Study each scene twice, print the pairs that change places, and return them."""
    results = {}
    for scene in SCENES:
        first, second = (study(scene, min(rounds, 11)) for _ in range(2))
        results[scene] = {
            "rungs": len(first),
            "time": reordered(first, second, times),
            "error": reordered(first, second, errors),
        }
        for kind in ("time", "error"):
            violations = results[scene][kind]
            click.echo(f"{scene}, {kind}: {len(violations)} pairs of {len(first)} change places")
            for pair in violations:
                click.echo(f"  {' and '.join(pair)}")
    return results


def study(scene, rounds):
    """Return the points of ``cost.json`` by rung and samples, from a process of its own."""
    with tempfile.TemporaryDirectory() as folder:
        words = ["cost", scene, "--rounds", str(rounds), "-o", folder]
        subprocess.run(
            [sys.executable, "-m", "reports", *words], check=True, stdout=subprocess.DEVNULL
        )
        record = json.loads(
            (Path(folder) / "cost" / scene / "cost.json").read_text(encoding="utf-8")
        )
    return {f"{point['rung']}, {point['spp']} spp": point for point in record["points"]}


def times(point):
    """The interval of the median time."""
    return point["seconds"]["low"], point["seconds"]["high"]


def errors(point):
    """The interval of the mean error."""
    half = ERRORS * point["error_stderr"]
    return point["error"] - half, point["error"] + half


def reordered(first, second, interval):
    """Return the pairs of points that both runs tell apart, and order differently."""
    return [
        (one, other)
        for one, other in combinations(sorted(first.keys() & second.keys()), 2)
        if order(first, one, other, interval) * order(second, one, other, interval) < 0
    ]


def order(points, one, other, interval):
    """Return −1 where one point is certainly below the other, 1 above, 0 where they overlap."""
    (low, high), (other_low, other_high) = interval(points[one]), interval(points[other])
    return -1 if high < other_low else int(low > other_high)
