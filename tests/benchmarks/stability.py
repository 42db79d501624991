"""What stability costs: the kernel against the naive formulas, rendering common scenes.

Each scene is rendered by the integrator ``heuristic``, once with the kernel as it is and once with
its vectors, powers, lobes, attenuations and cones replaced by the formulas as printed. The two take
turns, each rendering once untimed and then thrice timed, evaluated and synchronised. Below, the
kernel alone: a million points in memory under three lights whose numbers are compiled in, by its
own time on the device and by the number of operations in it, which no other work disturbs.
"""

from contextlib import contextmanager
from statistics import median
from time import perf_counter
from unittest import mock

from rich.console import Console
from rich.table import Table

import heuristic

from heuristic import backend  # isort: skip  it finds LLVM first

import drjit as dr
import mitsuba as mi
import numpy as np
from drjit.llvm import Array3f, Float

from comparisons.gallery.builtin import SCENES
from heuristic import lobes, numerics, terms, vectors

SIDE, SPP = 512, 4
TIMED_A_TURN = 3
WANTED = 1.3

NAMES = ("fig-8-6a", "fig-8-9", "fig-8-11-n9")
SPOT = {
    "type": "heuristic_spot", "position": (-4.24, 0, 0), "direction": (1, 0, 0), "cutoff": 12.0,
    "exponent": 5.0,
}  # fmt: skip
LAMP = {"type": "heuristic_point", "position": (-4.24, 0, 0), "k0": 0.25, "k1": 0.5, "k2": 0.125}
SQUARE = {"type": "heuristic_point", "position": (-4.24, 0, 0), "k0": 0.0, "k2": 1.0}


POINTS = 1 << 20
PLACES = ((0, 3, 4), (3, 0, 4), (-3, -1, 4))
KERNELS = {
    "n = 9": ({}, 9),
    "n opaque": ({}, None),
    "k0, k1, k2": ({"attenuation": (0.25, 0.5, 0.125)}, 9),
    "inverse square": ({"attenuation": (0, 0, 1)}, 9),
    "spots, m = 5": ({"cutoff": 30.0, "exponent": 5}, 9),
}
"""By title: what the lights have beside place and intensity, and the exponent, or None."""


def run(rounds):
    """Measure, print a table, and return the numbers."""
    backend.check()
    mi.set_variant("llvm_ad_rgb")
    heuristic.register()
    rows = []
    for name, description in _descriptions().items():
        scene = mi.load_dict(description)
        times = {"naive": [], "stable": []}
        for _ in range(rounds):
            for kind, values in times.items():
                with _naive() if kind == "naive" else _as_it_is():
                    _time(scene)
                    values += [_time(scene) for _ in range(TIMED_A_TURN)]
        naive, stable = (1e3 * median(values) for values in times.values())
        rows.append(
            {"scene": name, "naive_ms": naive, "stable_ms": stable, "ratio": stable / naive}
        )
    _print(rows, rounds)
    kernels = _alone(rounds)
    _print_kernels(kernels)
    return {"side": SIDE, "spp": SPP, "rows": rows, "kernels": kernels, "wanted": WANTED}


def _alone(rounds):
    """Measure the kernels without a renderer; operations and milliseconds of both forms."""
    rng = np.random.default_rng(0)
    points = tuple(Array3f(rng.normal(size=(3, POINTS)).astype(np.float32)) for _ in range(3))
    dr.eval(points)
    rows = []
    for title, (extra, n) in KERNELS.items():
        kinds = {"naive": _naive, "stable": _as_it_is}
        found = {kind: [] for kind in kinds}
        for _ in range(rounds):
            for kind, formulas in kinds.items():
                with formulas():
                    runs = [_kernel(points, extra, n) for _ in range(TIMED_A_TURN + 1)]
                found[kind] += runs[1:]
        row = {"kernel": title}
        for kind, runs in found.items():
            row[f"{kind}_operations"] = runs[0]["operation_count"]
            row[f"{kind}_ms"] = median(kernel["execution_time"] for kernel in runs)
        rows.append(row | {"ratio": row["stable_ms"] / row["naive_ms"]})
    return rows


def _kernel(points, extra, n):
    """Shade once and return what Dr.Jit's history says of the kernel."""
    if "cutoff" in extra:
        lights = [heuristic.SpotLight(p, tuple(-c for c in p), 1.0, **extra) for p in PLACES]
    else:
        lights = [heuristic.PointLight(p, 1.0, **extra) for p in PLACES]
    n = dr.opaque(Float, 9.0) if n is None else n
    with dr.scoped_set_flag(dr.JitFlag.KernelHistory, True):
        dr.kernel_history_clear()
        dr.eval(heuristic.shade(*points, heuristic.Material(k_d=0.5, k_s=0.5, n=n), lights))
        dr.sync_thread()
        (kernel,) = [k for k in dr.kernel_history([dr.KernelType.JIT]) if k["size"] == POINTS]
    return kernel


def _descriptions():
    found = {}
    for name in NAMES:
        found[name] = SCENES[name].make()
    for title, light in (
        ("a spot, m = 5", SPOT), ("inverse square", SQUARE), ("k0, k1, k2", LAMP)
    ):  # fmt: skip
        found[f"fig-8-9, {title}"] = SCENES["fig-8-9"].make() | {"light 1": light}
    sharp = SCENES["fig-8-9"].make()
    sharp["sphere"] = {**sharp["sphere"], "bsdf": {**sharp["sphere"]["bsdf"], "n": 1e5}}
    found["fig-8-9, n = 1e5"] = sharp
    for description in found.values():
        sensor = dict(description["sensor"])
        sensor["film"] = {**sensor["film"], "width": SIDE, "height": SIDE}
        description["sensor"] = sensor
    return found


def _time(scene):
    begin = perf_counter()
    dr.eval(mi.render(scene, spp=SPP, seed=dr.opaque(mi.UInt32, 0)))
    dr.sync_thread()
    return perf_counter() - begin


@contextmanager
def _as_it_is():
    yield


@contextmanager
def _naive():
    """Put the formulas as printed in the place of the stable ones."""
    with (
        mock.patch.object(vectors, "normalise", _normalise),
        mock.patch.object(vectors, "light_vector", _light_vector),
        mock.patch.object(lobes, "lobe", _lobe),
        mock.patch.object(terms, "power", _power),
        mock.patch.object(terms, "attenuation", _attenuation),
        mock.patch.object(terms, "spot_cone", _cone),
    ):
        yield


def _normalise(vector):
    square = dr.squared_norm(vector)
    return vector * dr.select(square > 0, dr.rsqrt(square), 0)


def _light_vector(light_position, position):
    offset = light_position - position
    square = dr.squared_norm(offset)
    inverse = dr.select(square > 0, dr.rsqrt(square), 0)
    return offset * inverse, square * inverse


def _lobe(material, normal, view):
    normal, view = _normalise(normal), _normalise(view)

    def cosine(light, position, toward, cos_incidence):
        mirrored = vectors.mirror_vector(normal, toward, cos_incidence)
        return dr.select(cos_incidence > 0, dr.dot(mirrored, view), 0)

    return cosine


def _power(cosine, n):
    if isinstance(cosine, numerics.Cosine):
        cosine = cosine.value
    if isinstance(n, int):
        return dr.power(dr.select(cosine > 0, cosine, 0), n)
    lobe = cosine > 0
    return dr.select(lobe, dr.exp2(n * dr.log2(dr.select(lobe, cosine, 1))), 0)


def _attenuation(distance, k0, k1, k2, intensity=1, inverse=None):
    denominator = k0 + distance * (k1 + distance * k2)
    return intensity * dr.select(denominator > 0, dr.rcp(denominator), 0)


def _cone(cos_axis, cos_cutoff):
    return dr.select(cos_axis.value >= cos_cutoff.value, 1.0, 0.0)


def _print(rows, rounds):
    table = Table(title=f"{SIDE} x {SIDE}, {SPP} samples a pixel, {rounds} turns; medians")
    for heading in ("scene", "naive", "stable", "ratio"):
        table.add_column(heading, justify="left" if heading == "scene" else "right")
    for row in rows:
        table.add_row(
            row["scene"], f"{row['naive_ms']:.1f} ms", f"{row['stable_ms']:.1f} ms",
            f"{row['ratio']:.2f}",
        )  # fmt: skip
    console = Console()
    console.print(table)
    worst = max(rows, key=lambda row: row["ratio"])
    console.print(
        f"at most {worst['ratio']:.2f} times the naive time, at {worst['scene']!r}"
        f" (wanted: at most {WANTED})",
        highlight=False,
    )


def _print_kernels(rows):
    table = Table(title="the kernel alone: operations, and medians of its own time")
    for heading in ("kernel", "naive", "stable", "naive", "stable", "ratio"):
        table.add_column(heading, justify="left" if heading == "kernel" else "right")
    for row in rows:
        table.add_row(
            row["kernel"], str(row["naive_operations"]), str(row["stable_operations"]),
            f"{row['naive_ms']:.2f} ms", f"{row['stable_ms']:.2f} ms", f"{row['ratio']:.2f}",
        )  # fmt: skip
    Console().print(table)
