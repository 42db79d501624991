"""What each term adds to the compiled kernel: its operations and its time.

One million points in memory, three coloured point lights, RGB coefficients. Each row leaves one
term out of the whole model, or is one term alone. Operations are what Dr.Jit counts in the kernel's
code. The rows take turns.
"""

from statistics import median
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from heuristic import Material, PointLight, shade  # isort: skip  it finds LLVM first

import drjit as dr
from drjit.llvm import Array3f

POINTS = 1 << 20
WHOLE = {"k_i": 0.05, "k_a": 0.3, "k_d": (0.5, 0.4, 0.3), "k_s": 0.7}
NAMES = {"k_i": "emission", "k_a": "ambient", "k_d": "diffuse", "k_s": "specular"}
UNATTENUATED, ATTENUATED = (1, 0, 0), (1, 0.1, 0.01)


def run(rounds):
    """Print a row for each kernel, and return the numbers."""
    rng = np.random.default_rng(0)
    points = [Array3f(rng.normal(size=(3, POINTS)).astype(np.float32)) for _ in range(3)]
    dr.eval(points)
    kernels = dict(_kernels())
    times = {name: [] for name in kernels}
    for _ in range(rounds):
        for name, (material, attenuation) in kernels.items():
            times[name].append(_time(points, material, attenuation))
    rows = [
        {
            "kernel": name,
            "operations": _operations(points, material, attenuation),
            "median_s": median(times[name]),
        }
        for name, (material, attenuation) in kernels.items()
    ]
    _print(rows)
    return rows


def _kernels():
    yield "everything", (Material(**WHOLE, n=9), ATTENUATED)
    yield "without distance attenuation", (Material(**WHOLE, n=9), UNATTENUATED)
    for absent, label in NAMES.items():
        rest = {name: value for name, value in WHOLE.items() if name != absent}
        yield f"without {label}", (Material(**rest, n=9), ATTENUATED)
    for alone, label in NAMES.items():
        yield f"{label} alone", (Material(**{alone: WHOLE[alone]}, n=9), UNATTENUATED)


def _shaded(points, material, attenuation):
    lights = [
        PointLight((-4.24, 0, 0), (1, 0, 0), attenuation),
        PointLight((-3.5, -3.5, 0), (0, 1, 0), attenuation),
        PointLight((0, -4.24, 0), (0, 0, 1), attenuation),
    ]
    return shade(*points, material, lights, 1.0)


def _time(points, material, attenuation):
    value = _shaded(points, material, attenuation)
    begin = perf_counter()
    dr.eval(value)
    dr.sync_thread()
    return perf_counter() - begin


def _operations(points, material, attenuation):
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        _time(points, material, attenuation)
        # Emission and ambient light of plain numbers need no kernel at all.
        kernels = dr.kernel_history([dr.KernelType.JIT])
    return sum(kernel["operation_count"] for kernel in kernels)


def _print(rows):
    table = Table(title=f"{POINTS:,} points, three point lights, RGB, n = 9")
    for heading in ("kernel", "operations", "median"):
        table.add_column(heading, justify="left" if heading == "kernel" else "right")
    for row in rows:
        table.add_row(row["kernel"], str(row["operations"]), f"{1e3 * row['median_s']:.2f} ms")
    Console().print(table)
