"""The kernel against the same model in NumPy and Numba, against a memory copy, and by its lights.

One million points under the three lights of figure 8.11, positions, normals and views in memory.
All read nine floats of single precision for a point and write three. Before anything is timed, all
results are compared. What is timed of Dr.Jit is evaluation and synchronisation of a kernel that is
already compiled, by the wall clock. The contenders take turns, so that whatever else the machine
does hits them alike. At each turn a contender runs once untimed, so that it does not pay for the
caches that its predecessor filled, and then thrice timed.

Numba has two forms: a loop over any number of lights, and one over exactly three. LLVM turns the
second into vector instructions and the first not.
"""

from statistics import median
from time import perf_counter

import numba
import numpy as np
from rich.console import Console
from rich.table import Table

from fotismos.heuristic import Material, PointLight, llvm, shade  # isort: skip  it finds LLVM first

import drjit as dr
from drjit.llvm import Array3f

POINTS = 1 << 20
K_A, K_D, K_S, N = 0.3, 0.5, 0.7, 9
POSITIONS = ((-4.24, 0, 0), (-3.5, -3.5, 0), (0, -4.24, 0))
COLOURS = ((1, 0, 0), (0, 1, 0), (0, 0, 1))
AGREEMENT = 2e-5
TIMED_A_TURN = 3
COUNTS = (1, 10, 100, 1_000, 10_000)
UNROLLED = 8
"""Lights of a single kernel, with which more lights are compared."""


def run(rounds):
    """Measure, print two tables, and return the numbers."""
    llvm.check()
    points = g_buffer()
    found = contenders(points)
    require_agreement(found)
    seconds = {name: [] for name in found}
    for _ in range(rounds):
        for name, contender in found.items():
            contender()
            seconds[name] += [_timed(contender) for _ in range(TIMED_A_TURN)]
    times = {name: 1e3 * median(values) for name, values in seconds.items()}
    copy = min(times[name] for name in times if name.startswith("memory copy"))
    ratios = {name: times[name] / times["Dr.Jit"] for name in times} | {
        "memory copy": times["Dr.Jit"] / copy
    }
    _print("ms, medians", times.items())
    lights = many_lights(points, rounds)
    _print("ns per light and point", ((row["lights"], row["ns"]) for row in lights))
    return {"times": times, "ratios": ratios, "lights": lights}


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


def contenders(points):
    """Return the contenders and their names; each returns its result."""
    lights, colours = np.array(POSITIONS, np.float32), np.array(COLOURS, np.float32)
    out = np.empty_like(points[0])
    # Half of the twelve floats a point read and half of them written.
    source, target = np.ones((6, POINTS), np.float32), np.zeros((6, POINTS), np.float32)
    arrays = [Array3f(vectors) for vectors in points]
    dr.eval(arrays)
    lamps = list(map(PointLight, POSITIONS, COLOURS))
    material = Material(k_a=K_A, k_d=K_D, k_s=K_S, n=N)

    def by(loop):
        def call():
            loop(*points, lights, colours, out)
            return out

        return call

    return {
        "Dr.Jit": lambda: _evaluated(shade(*arrays, material, lamps, 1.0)),
        "NumPy": lambda: in_numpy(*points),
        "Numba": by(in_numba),
        "Numba, three lights": by(in_numba_unrolled),
        "memory copy, Dr.Jit": lambda: _evaluated(sum(arrays)),
        "memory copy, NumPy": lambda: np.copyto(target, source),
    }


def require_agreement(found):
    """Compile everything, and ensure that all compute the same."""
    expected = found["Numba"]().copy()
    for name, contender in found.items():
        result = contender()
        if "copy" not in name:
            worst = float(np.abs(np.array(result) - expected).max())
            assert worst < AGREEMENT, f"{name} differs from Numba by up to {worst:.2g}"


def many_lights(points, rounds):
    """Return the time of each number of lights, and LLVM's for kernels that are new to Dr.Jit."""
    arrays = [Array3f(vectors) for vectors in points]
    dr.eval(arrays)
    rng = np.random.default_rng(1)
    all_lights = [
        PointLight(tuple(map(float, 4 * rng.normal(size=3))), tuple(map(float, rng.random(3))))
        for _ in range(max(COUNTS))
    ]

    def seconds(count, n=N):
        material = Material(k_a=K_A, k_d=(0.5, 0.4, 0.3), k_s=K_S, n=n)
        return _timed(lambda: _evaluated(shade(*arrays, material, all_lights[:count], 1.0)))

    rows = []
    for count in COUNTS:
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
            dr.kernel_history_clear()
            seconds(count, 9 + rng.random())  # an exponent that no kernel had before
            kernels = dr.kernel_history([dr.KernelType.JIT])
        repeats = max(2, min(rounds, 3000 // count))
        each, unrolled = (
            median(seconds(lights) for _ in range(repeats)) / lights / POINTS * 1e9
            for lights in (count, UNROLLED)
        )
        compile_s = sum(kernel["backend_time"] for kernel in kernels) / 1000
        rows.append({"lights": count, "ns": each, "unrolled_ns": unrolled, "compile_s": compile_s})
    return rows


def _evaluated(value):
    dr.eval(value)
    dr.sync_thread()
    return value


def _timed(function):
    begin = perf_counter()
    function()
    return perf_counter() - begin


def _print(title, rows):
    table = Table("", title, title=f"{POINTS:,} points")
    for name, value in rows:
        table.add_row(str(name), f"{value:.2f}")
    Console().print(table)


# --- The model in NumPy and Numba ------------------------------------------------------------


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
        base = np.maximum(cos_reflection, 0) * (cos_incidence > 0)
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


def _loop(count):
    """Return a parallel loop over the points, for any number of lights or a fixed one."""

    @numba.njit(parallel=True, fastmath=True, error_model="numpy")
    def shaded(position, normal, view, lights, colours, out):
        for i in numba.prange(position.shape[1]):
            p = position[0, i], position[1, i], position[2, i]
            n = normal[0, i], normal[1, i], normal[2, i]
            v = view[0, i], view[1, i], view[2, i]
            r = g = b = np.float32(K_A)
            for k in range(lights.shape[0] if count is None else count):
                value = one_light(p, n, v, lights[k])
                r += colours[k, 0] * value
                g += colours[k, 1] * value
                b += colours[k, 2] * value
            out[0, i], out[1, i], out[2, i] = r, g, b

    return shaded


in_numba, in_numba_unrolled = _loop(None), _loop(3)
