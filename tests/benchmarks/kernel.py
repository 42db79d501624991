"""The kernel against the same model in NumPy and Numba, and against a memory copy.

One million points under the three lights of figure 8.11, positions, normals and views in memory.
All read nine floats of single precision for a point and write three. Before anything is timed, all
results are compared.

What is timed of Dr.Jit is evaluation and synchronisation of a kernel that is already compiled, by
the wall clock; the tracing of the Python code before it, and the execution alone as Dr.Jit counts
it, are given beside it. The contenders take turns, so that whatever else the machine does hits them
alike. At each turn a contender runs once untimed, so that it does not pay for the caches that its
predecessor filled, and then thrice timed.

Two more kernels are floors, not contenders: "floor" computes plain inverse roots in single
precision, so that lengths beyond 1e19 or below 1e-19, and large exponents, come out wrong. What the
kernel takes above them is the price of its accuracy; what they take above the copy no care saves.

Numba has two forms: a loop over any number of lights, and one over exactly three. LLVM turns the
second into vector instructions and the first not.
"""

import os
import platform
from statistics import median
from time import perf_counter
from unittest import mock

import numba
import numpy as np
from rich.console import Console
from rich.table import Table

from heuristic import Material, PointLight, backend, numerics, shade  # isort: skip  it finds LLVM first

import drjit as dr
from drjit.llvm import Array3f, Float

SIDE = 1024
POINTS = SIDE * SIDE
K_A, K_D, K_S, N = 0.3, 0.5, 0.7, 9
POSITIONS = ((-4.24, 0, 0), (-3.5, -3.5, 0), (0, -4.24, 0))
COLOURS = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
AGREEMENT = 2e-5

TIMED_A_TURN = 3
EXTRAS = ("tracing", "execution")
MEANINGS = {
    "NumPy": "times as fast as NumPy",
    "Numba": "times as fast as Numba",
    "Numba, three lights": "times as fast as Numba with three lights unrolled",
    "memory copy": "times the faster memory copy's time",
    "floor": "times, its floor",
    "exponent opaque": "times with an opaque exponent",
    "floor, exponent opaque": "times, the floor of that",
}


# --- The contenders --------------------------------------------------------------------------


class DrJit:
    """`heuristic.shade`, traced again and executed from the cache."""

    n_is_moderate = False

    def __init__(self, points, exponent):
        self.points = [Array3f(vectors) for vectors in points]
        self.exponent = exponent
        self.lights = list(map(PointLight, POSITIONS, COLOURS))
        dr.eval(self.points)
        dr.sync_thread()
        self.tracing, self.execution = [], []

    def __call__(self):
        begin = perf_counter()
        material = Material(
            k_a=K_A, k_d=K_D, k_s=K_S, n=self.exponent, n_is_moderate=self.n_is_moderate
        )
        result = shade(*self.points, material, self.lights, 1.0)
        self.tracing.append(perf_counter() - begin)
        return self.timed(result)

    def timed(self, result):
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            begin = perf_counter()
            dr.eval(result)
            dr.sync_thread()
            elapsed = perf_counter() - begin
            kernels = dr.kernel_history([dr.KernelType.JIT])
        self.execution.append(sum(kernel["execution_time"] for kernel in kernels) / 1000)
        return elapsed, result


class DrJitFloor(DrJit):
    """The same without what keeps digits: no scaling of vectors, no double precision."""

    n_is_moderate = True

    def __call__(self):
        with mock.patch.object(numerics, "scaled", _unscaled):
            return super().__call__()


def _unscaled(vector):
    square = dr.squared_norm(vector)
    return vector, type(square)(1), square


class DrJitCopy(DrJit):
    """The least that can be done with the same bytes: nine floats read, three written."""

    def __call__(self):
        return self.timed(self.points[0] + self.points[1] + self.points[2])


def in_numpy(position, normal, view):
    """The model in NumPy, single precision, one array operation after the other."""
    one = np.float32(1)
    total = np.full_like(position, np.float32(K_A))
    for light, colour in zip(POSITIONS, COLOURS, strict=True):
        toward = np.array(light, np.float32)[:, None] - position
        toward *= one / np.sqrt(np.einsum("ij,ij->j", toward, toward))
        cos_incidence = np.einsum("ij,ij->j", normal, toward)
        mirrored = normal * (2 * cos_incidence) - toward
        cos_reflection = np.einsum("ij,ij->j", mirrored, view)
        lit = cos_incidence > 0
        base = np.maximum(cos_reflection, 0) * lit
        square = base * base
        lobe = square * square
        lobe = lobe * lobe * base  # the ninth power, in products as the kernel has it
        value = np.maximum(cos_incidence, 0) * np.float32(K_D) + lobe * np.float32(K_S)
        for channel, intensity in enumerate(colour):
            if intensity:
                total[channel] += np.float32(intensity) * value
    return total


@numba.njit(fastmath=True, error_model="numpy", inline="always")
def one_light(position, normal, view, light):
    """Return the diffuse and specular light from one light at one point."""
    k_d, k_s = np.float32(K_D), np.float32(K_S)
    zero, one, two = np.float32(0), np.float32(1), np.float32(2)
    nx, ny, nz = normal
    lx, ly, lz = light[0] - position[0], light[1] - position[1], light[2] - position[2]
    scale = one / np.sqrt(lx * lx + ly * ly + lz * lz)
    lx, ly, lz = lx * scale, ly * scale, lz * scale
    cosine = nx * lx + ny * ly + nz * lz
    lobe = view[0] * (two * cosine * nx - lx)
    lobe += view[1] * (two * cosine * ny - ly) + view[2] * (two * cosine * nz - lz)
    lobe = max(lobe, zero) if cosine > zero else zero
    square = lobe * lobe
    fourth = square * square
    return k_d * max(cosine, zero) + k_s * fourth * fourth * lobe


@numba.njit(parallel=True, fastmath=True, error_model="numpy")
def in_numba(position, normal, view, lights, colours, out):
    """The model as one parallel loop over the points, for any number of lights."""
    for i in numba.prange(position.shape[1]):
        p = position[0, i], position[1, i], position[2, i]
        n = normal[0, i], normal[1, i], normal[2, i]
        v = view[0, i], view[1, i], view[2, i]
        r = g = b = np.float32(K_A)
        for k in range(lights.shape[0]):
            value = one_light(p, n, v, lights[k])
            r += colours[k, 0] * value
            g += colours[k, 1] * value
            b += colours[k, 2] * value
        out[0, i], out[1, i], out[2, i] = r, g, b


@numba.njit(parallel=True, fastmath=True, error_model="numpy")
def in_numba_unrolled(position, normal, view, lights, colours, out):
    """The same for exactly three lights."""
    for i in numba.prange(position.shape[1]):
        p = position[0, i], position[1, i], position[2, i]
        n = normal[0, i], normal[1, i], normal[2, i]
        v = view[0, i], view[1, i], view[2, i]
        r = g = b = np.float32(K_A)
        for k in range(3):
            value = one_light(p, n, v, lights[k])
            r += colours[k, 0] * value
            g += colours[k, 1] * value
            b += colours[k, 2] * value
        out[0, i], out[1, i], out[2, i] = r, g, b


def timed(function):
    """Return a contender that times a function's call."""

    def contender():
        begin = perf_counter()
        result = function()
        return perf_counter() - begin, result

    return contender


def contenders(points):
    """Return the contenders by name."""
    lights, colours = np.array(POSITIONS, np.float32), np.array(COLOURS, np.float32)
    out = np.empty_like(points[0])
    # Half of the twelve floats a point read and half of them written.
    source, target = np.ones((6, POINTS), np.float32), np.zeros((6, POINTS), np.float32)

    def numba_contender(loop):
        def call():
            loop(*points, lights, colours, out)
            return out

        return timed(call)

    return {
        "Dr.Jit": DrJit(points, N),
        "Dr.Jit, exponent opaque": DrJit(points, dr.opaque(Float, N)),
        "floor": DrJitFloor(points, N),
        "floor, exponent opaque": DrJitFloor(points, dr.opaque(Float, N)),
        "NumPy": timed(lambda: in_numpy(*points)),
        "Numba": numba_contender(in_numba),
        "Numba, three lights": numba_contender(in_numba_unrolled),
        "memory copy, Dr.Jit": DrJitCopy(points, N),
        "memory copy, NumPy": timed(lambda: np.copyto(target, source)),
    }


# --- The measurement -------------------------------------------------------------------------


def g_buffer():
    """Return positions, normals and views (3, N) over the half of the sphere that is seen."""
    rng = np.random.default_rng(0)
    viewer = np.array([-3.0, 0.0, 1.0])
    normal = rng.normal(size=(3, POINTS))
    normal /= np.linalg.norm(normal, axis=0)
    normal *= np.where(viewer @ normal > 0, 1, -1)
    view = viewer[:, None] - normal
    view /= np.linalg.norm(view, axis=0)
    return [np.ascontiguousarray(array, np.float32) for array in (normal, normal, view)]


def run(rounds):
    """Measure, print a table, and return the numbers."""
    backend.check()
    points = g_buffer()
    all_of_them = contenders(points)
    require_agreement(all_of_them)
    for contender in all_of_them.values():
        for attribute in EXTRAS:
            getattr(contender, attribute, []).clear()
    seconds = {name: [] for name in all_of_them}
    for _ in range(rounds):
        for name, contender in all_of_them.items():
            contender()
            for untimed in (getattr(contender, attribute, []) for attribute in EXTRAS):
                untimed[-1:] = []
            for _ in range(TIMED_A_TURN):
                seconds[name].append(contender()[0])
    data = summary(all_of_them, seconds)
    show(data, rounds)
    return data


def require_agreement(all_of_them):
    """Compile everything, and ensure that all compute the same."""
    expected = all_of_them["Numba"]()[1].copy()
    copies = ("memory copy, Dr.Jit", "memory copy, NumPy")
    for name in all_of_them.keys() - {"Numba", *copies}:
        worst = float(np.abs(np.array(all_of_them[name]()[1]) - expected).max())
        if not worst < AGREEMENT:
            raise AssertionError(f"{name} differs from Numba by up to {worst:.2g}")
    for name in copies:
        all_of_them[name]()


def summary(all_of_them, seconds):
    """Return medians and ranges in milliseconds, and the ratios to the kernel."""
    times = {}
    for name, values in seconds.items():
        times[name] = {
            "median_ms": 1e3 * median(values),
            "min_ms": 1e3 * min(values),
            "max_ms": 1e3 * max(values),
        }
        for attribute in EXTRAS:
            extra = getattr(all_of_them[name], attribute, None)
            if extra:
                times[name][f"{attribute}_ms"] = 1e3 * median(extra)
    kernel, opaque, floor, opaque_floor = (
        times[name]["median_ms"]
        for name in ("Dr.Jit", "Dr.Jit, exponent opaque", "floor", "floor, exponent opaque")
    )
    copy = min(times[name]["median_ms"] for name in times if name.startswith("memory copy"))
    return {
        "points": POINTS,
        "lights": len(POSITIONS),
        "machine": f"{platform.machine()}, {os.cpu_count()} CPUs",
        "threads": {"Dr.Jit": dr.thread_count(), "Numba": numba.get_num_threads()},
        "times": times,
        "ratios": {
            "NumPy": times["NumPy"]["median_ms"] / kernel,
            "Numba": times["Numba"]["median_ms"] / kernel,
            "Numba, three lights": times["Numba, three lights"]["median_ms"] / kernel,
            "memory copy": kernel / copy,
            "floor": floor / copy,
            "exponent opaque": opaque / copy,
            "floor, exponent opaque": opaque_floor / copy,
        },
    }


def show(data, rounds):
    """Print the numbers."""
    console = Console()
    table = Table(
        title=f"{data['points'] / 2**20:g} Mpx, {data['lights']} point lights, G-buffer in memory;"
        f" {rounds} turns; {data['machine']}; milliseconds",
        title_justify="left",
    )
    table.add_column("")
    for column in ("median", "min – max", "execution", "tracing"):
        table.add_column(column, justify="right", no_wrap=True)
    for name, row in data["times"].items():
        table.add_row(
            name,
            f"{row['median_ms']:.2f}",
            f"{row['min_ms']:.2f} – {row['max_ms']:.2f}",
            *(f"{row[key]:.2f}" if key in row else "" for key in ("execution_ms", "tracing_ms")),
        )
    console.print(table)
    for name, meaning in MEANINGS.items():
        console.print(f"the kernel: {data['ratios'][name]:.2f} {meaning}", highlight=False)
