"""From 1 to 10,000 lights: time for a light and a point, and what compiling costs.

One million points in memory, point lights without attenuation, RGB, ``n = 9``. Up to
`heuristic.shading.BLOCK` lights are one kernel; more are summed in blocks, by one kernel that all
blocks share. Compile times are of kernels that Dr.Jit has not seen before.
"""

from statistics import median
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from heuristic import Material, PointLight, shading, shade  # isort: skip  it finds LLVM first

import drjit as dr
from drjit.llvm import Array3f

POINTS = 1 << 20
COUNTS = (1, 10, 16, 17, 100, 1_000, 10_000)
UNROLLED = 8
"""Lights of the row that the others are compared with: a single kernel without blocks."""


def run(rounds):
    """Print a row for each number of lights, and return the numbers."""
    points = _points()
    rows = []
    for count in COUNTS:
        lights = _lights(count)
        repeats = max(2, min(rounds, 3000 // count))
        compile_time, kernels = _compilation(points, lights)
        times = [_time(points, lights) for _ in range(repeats)]
        baseline = [_time(points, _lights(UNROLLED)) for _ in range(min(repeats, 7))]
        each = median(times) / count / POINTS * 1e9
        unrolled = median(baseline) / UNROLLED / POINTS * 1e9
        rows.append(
            {
                "lights": count,
                "median_s": median(times),
                "ns_per_light_and_point": each,
                "unrolled_ns": unrolled,
                "compile_s": compile_time,
                "kernels": kernels,
                "repeats": repeats,
            }
        )
    _print(rows)
    return rows


def _points():
    rng = np.random.default_rng(0)
    arrays = [Array3f(rng.normal(size=(3, POINTS)).astype(np.float32)) for _ in range(3)]
    dr.eval(arrays)
    dr.sync_thread()
    return arrays


def _lights(count):
    rng = np.random.default_rng(1)
    return [
        PointLight(tuple(map(float, 4 * rng.normal(size=3))), tuple(map(float, rng.random(3))))
        for _ in range(count)
    ]


def _time(points, lights, n=9):
    material = Material(k_a=0.3, k_d=(0.5, 0.4, 0.3), k_s=0.7, n=n)
    begin = perf_counter()
    dr.eval(shade(*points, material, lights, 1.0))
    dr.sync_thread()
    return perf_counter() - begin


def _compilation(points, lights):
    """Return the time that LLVM takes for all kernels, and how many different ones there are.

    An exponent that no kernel had before keeps Dr.Jit from finding them in memory or on disk.
    """
    n = 9 + np.random.default_rng().random()
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        _time(points, lights, n)
        kernels = dr.kernel_history([dr.KernelType.JIT])
    return sum(kernel["backend_time"] for kernel in kernels) / 1000, len(
        {kernel["hash"] for kernel in kernels}
    )


def _print(rows):
    table = Table(title=f"{POINTS:,} points; blocks of {shading.BLOCK} lights")
    for heading in ("lights", "median", "a light and point", "unrolled", "compiling", "kernels"):
        table.add_column(heading, justify="right")
    for row in rows:
        table.add_row(
            f"{row['lights']:,}",
            f"{1e3 * row['median_s']:.1f} ms",
            f"{row['ns_per_light_and_point']:.2f} ns",
            f"{row['unrolled_ns']:.2f} ns",
            f"{1e3 * row['compile_s']:.0f} ms",
            f"{row['kernels']}",
        )
    Console().print(table)
