"""Measurements for the documents: ``./run docs --all`` measures and writes them again.

Times belong to the machine; nothing else should run at the same time.
"""

import subprocess
import sys
from collections.abc import Iterator
from functools import partial
from pathlib import Path

import heuristic  # noqa: F401  isort: skip  it finds LLVM before Dr.Jit is imported

import numpy as np

from comparisons import atomic
from comparisons.case import Request, open_case
from comparisons.cost.cost import cost
from comparisons.cost.cost_record import Cost, Measured
from comparisons.verification import Factor, verify
from reports.charts import vega
from reports.charts.error_over_time import error_over_time
from reports.terminal.tables import markdown
from tests.benchmarks import kernel, lights

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
COST_SCENE = "cornell-box"
ROUNDS = 30
VERIFIED = ("fig-8-9", "fig-6-10", "cornell-box", "plastic-spheres", "narrow-band-lamp")
CHAPTER_8 = (
    *(f"fig-8-{number}{letter}" for number in (5, 6, 7, 8) for letter in "abc"),
    "fig-8-9",
    "fig-8-11-n9",
    "fig-8-11-n3",
)


def baselines() -> None:
    """Measure all baselines of the tests again, not only those that moved."""
    for file in (ROOT / "tests" / "baselines").glob("*.json"):
        file.unlink()
    _run("pytest", "-q", "tests/test_baselines.py", "--fotismos-update")


def fits() -> None:
    """Fit the figures of chapter 8."""
    _run("reports", "fit", *CHAPTER_8, "--markdown", "docs/fit-figures.md")


def findings() -> None:
    """Study Phong against roughplastic."""
    _run("reports", "study", "studies/phong-roughplastic.toml", "--findings", "docs/findings.md")


def prices() -> Iterator[str]:
    """Study the cost of accuracy, draw its chart, and yield the README's sentence."""
    case = open_case(COST_SCENE, Request())
    record = cost(case.source, case.options).record
    atomic.write(DOCS / "cost-cornell-box.svg", vega.paper(error_over_time(record)))
    rung = partial(_points, record)
    kernel_point, shadows = rung("Phong kernel")[-1], rung("kernel with shadows")[-1]
    first, *_, last = rung("full plan")
    worth = {price.effect: price.removes for price in record.prices.effects}
    by_worth = sorted(worth, key=lambda effect: -worth[effect].value)
    prices = ", ".join(
        f"{effect} {worth[effect].value:.3g} ({worth[effect].low:.3g} to {worth[effect].high:.3g})"
        for effect in by_worth
    )
    closure = record.closure
    yield (
        f"The textbook kernel is {kernel_point.error:.1f} away from the reference (mean ΔE2000)"
        f" after {_time(kernel_point)}, and more samples do not bring it nearer; the full plan is"
        f" {first.error:.1f} away after {_time(first)} and {last.error:.1f} after {_time(last)}."
        f" Adding shadows alone gives {shadows.error:.1f}, because the light between surfaces"
        " that would fill them is missing. Averaged over all orders of adding them, the effects"
        f" remove the following from {record.prices.departure:.1f} (95 % intervals): {prices}. With"
        f" all of them, {closure.mean:.2g} ({closure.low:.2g} to {closure.high:.2g}) remains."
    )


def gains() -> Iterator[str]:
    """Verify plans, and yield the table of their savings."""
    names = ("sampler", "integrator", "pruning", "all")
    rows = []
    for scene in VERIFIED:
        case = open_case(scene, Request())
        factors = {factor.name: factor for factor in verify(case.source, case.options).factors}
        rows.append((scene, *(_factor(factors[name]) for name in names)))
    yield from markdown([("Scene", *names), *rows], right=1)


def _factor(factor: Factor) -> str:
    if factor.low == factor.high:
        return "no change"
    return f"{factor.value:.3g} ({factor.low:.3g} to {factor.high:.3g})"


def speed() -> Iterator[str]:
    """Yield the table of the kernel's speed, and a sentence on many lights."""
    data, many = kernel.run(ROUNDS), lights.run(ROUNDS)
    times, ratios = data["times"], data["ratios"]

    def row(label: str, name: str, comment: str) -> tuple[str, str, str]:
        return label, f"{times[name]['median_ms']:.1f} ms", comment

    copies = [name for name in times if name.startswith("memory copy")]
    fastest = min(copies, key=lambda name: times[name]["median_ms"])
    yield from markdown(
        [
            ("", "Time", "The kernel is"),
            row("Dr.Jit kernel", "Dr.Jit", ""),
            row(
                "memory copy of the bytes that it reads and writes",
                fastest,
                f"{ratios['memory copy']:.1f} times that",
            ),
            row(
                "Numba, parallel, three lights unrolled",
                "Numba, three lights",
                f"{ratios['Numba, three lights']:.1f} times as fast",
            ),
            row(
                "Numba, parallel, any number of lights",
                "Numba",
                f"{ratios['Numba']:.0f} times as fast",
            ),
            row("NumPy", "NumPy", f"{ratios['NumPy']:.0f} times as fast"),
        ],
        right=1,
    )
    each = [row["ns_per_light_and_point"] for row in many if row["lights"] >= 1_000]
    unrolled = np.median([row["unrolled_ns"] for row in many])
    yield ""
    yield (
        f"With 1,000 to 10,000 lights it takes {min(each):.2f} to {max(each):.2f} ns per light and"
        f" point; eight unrolled lights take {unrolled:.2f} ns. Compile time stays under"
        f" {max(row['compile_s'] for row in many):.1g} s."
    )


def _points(record: Cost, name: str) -> tuple[Measured, ...]:
    """Return the points of a method, even if a scene has merged it with another."""
    (rung,) = [rung.name for rung in record.rungs if name in rung.names]
    return record.points_of(rung)


def _time(point: Measured) -> str:
    return f"{1e3 * point.seconds.median:.0f} ms"


def _run(module: str, *words: str) -> None:
    subprocess.run([sys.executable, "-P", "-m", module, *words], cwd=ROOT, check=True)
