"""How time and memory grow with a scene: shapes, materials, lights, triangles, and the film.

Each size runs in a process of its own, with kernels that Dr.Jit has not seen before: what a user
waits for at the first look at a scene. An exponent is the slope of a straight line through the
logarithms, over the larger half of the sizes, where start-up no longer counts.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from statistics import median

import numpy as np
from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]

LOADS = {
    "shapes": (250, 500, 1_000, 2_000, 10_000),
    "shapes and lights": (125, 250, 500, 1_000),
    "materials": (62, 125, 250, 500),
    "lights": (250, 500, 1_000, 2_000, 10_000),
    "triangles": (65_000, 259_000, 1_000_000, 4_000_000),
    "pixels": (512**2, 1024**2, 2048**2, 4096**2),
}
"""Sizes of each load."""

SAYS = {
    "shapes": "planning: coplanar tiles under one lamp",
    "shapes and lights": "planning: as many tiles as lamps",
    "materials": "pairing: different roughplastic",
    "lights": "a comparison, 128 x 128, 4 samples per pixel",
    "triangles": "a comparison, 128 x 128, 4 samples per pixel",
    "pixels": "a comparison of the Cornell box, 4 samples per pixel",
}


def run(rounds):
    """Measure each load, print a table, and return the numbers."""
    found = {}
    for load, sizes in LOADS.items():
        found[load] = {size: _measured(load, size, min(rounds, 3)) for size in sizes}
        _print(load, found[load])
    return found


def _measured(load, size, rounds):
    """Return ``{"seconds", "bytes"}`` of one size: medians of processes without kernels."""
    rows = [_once(load, size) for _ in range(rounds if size < max(LOADS[load]) / 4 else 1)]
    return {key: median(row[key] for row in rows) for key in rows[0]}


def _once(load, size):
    with tempfile.TemporaryDirectory() as kernels:
        ended = subprocess.run(
            [sys.executable, "-P", "-m", "tests.benchmarks.growth", load, str(size)],
            cwd=ROOT,
            env=os.environ | {"DRJIT_CACHE_DIR": kernels, "PYTHONPATH": str(ROOT)},
            stdout=subprocess.PIPE,
            check=True,
            text=True,
        )
    return json.loads(ended.stdout.splitlines()[-1])


def _print(load, rows):
    table = Table(title=f"{load}: {SAYS[load]}", title_justify="left")
    for heading in (load, "time", "peak memory", "a pixel" if load == "pixels" else ""):
        table.add_column(heading, justify="right")
    for size, row in rows.items():
        each = f"{row['bytes'] / size:.0f} B" if load == "pixels" else ""
        table.add_row(
            f"{size:,}", f"{row['seconds']:.2f} s", f"{row['bytes'] / 2**20:.0f} MiB", each
        )
    Console().print(table)
    Console().print(f"time grows as {load} to the power of {exponent(rows):.2f}")


def exponent(rows):
    """Return the slope of log time over log size, for the larger half of the sizes."""
    sizes = sorted(rows)[len(rows) // 2 - 1 :]
    return float(np.polyfit(np.log(sizes), np.log([rows[s]["seconds"] for s in sizes]), 1)[0])


# --- One size, in a process of its own -------------------------------------------------------


def _one(load, size):
    import resource

    import heuristic  # noqa: F401  first: it finds LLVM
    from reference.scene.graph import set_variant

    set_variant("llvm_ad_rgb")
    seconds = SECONDS[load](size)
    unit = 1 if sys.platform == "darwin" else 1024
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit
    print(json.dumps({"seconds": seconds, "bytes": peak}))


def _planning(parts):
    """Return the seconds that planning of a scene takes, its pairing and loading apart."""
    from time import perf_counter

    from comparisons.options import Options
    from reference.planning.plan import plan, sampler
    from reference.scene.sampler import with_sampler
    from reference.scene.source import Source

    pair = Options().pair(Source("growth", lambda: parts))
    physical = with_sampler(pair.physical, sampler(False)).instantiate()
    begin = perf_counter()
    plan(pair, physical)
    return perf_counter() - begin


def _pairing(parts):
    """Return the seconds of pairing a scene, less those of the same with one material."""
    from time import perf_counter

    from comparisons.options import Options
    from reference.scene.source import Source

    seconds = []
    for bsdfs in ({"type": "diffuse"}, None):
        made = {
            name: part | {"bsdf": bsdfs} if bsdfs and "bsdf" in part else part
            for name, part in parts.items()
        } | {"type": "scene"}
        begin = perf_counter()
        Options().pair(Source("growth", lambda made=made: made))
        seconds.append(perf_counter() - begin)
    return seconds[1] - seconds[0]


def _comparing(source, resolution):
    from time import perf_counter

    from comparisons.compare import compare
    from comparisons.options import Options

    begin = perf_counter()
    compare(source, Options(resolution=resolution, spp=4))
    return perf_counter() - begin


def _scene(**parts):
    import mitsuba as mi

    return {
        "type": "scene",
        "integrator": {"type": "path"},
        "sensor": {
            "type": "perspective",
            "to_world": mi.ScalarTransform4f().look_at((0, 0, 4), (0, 0, 0), (0, 1, 0)),
            "film": {"type": "hdrfilm", "width": 128, "height": 128},
        },
        **parts,
    }


def _lamps(count):
    rng = np.random.default_rng(0)
    return {
        f"lamp {i}": {
            "type": "point",
            "position": [float(x) for x in (*rng.uniform(-1, 1, 2), rng.uniform(0.5, 2))],
            "intensity": float(rng.uniform(0.5, 1.5)) / count,
        }
        for i in range(count)
    }


def _tiles(count, bsdf):
    """Coplanar tiles; ``bsdf(i)`` is that of tile i."""
    import mitsuba as mi

    side = int(np.ceil(np.sqrt(count)))
    move = mi.ScalarTransform4f().translate
    return {
        f"tile {i}": {
            "type": "rectangle",
            "to_world": move(((2 * (i % side) + 1) / side - 1, (2 * (i // side) + 1) / side - 1, 0))
            @ mi.ScalarTransform4f().scale(1 / side),
            "bsdf": bsdf(i),
        }
        for i in range(count)
    }


def _grey(number):
    return {"type": "diffuse", "reflectance": 0.5}


def _plastic(count):
    def bsdf(number):
        share = number / count
        reflectance = {"type": "rgb", "value": [0.1 + 0.6 * share, 0.3, 0.5]}
        return {
            "type": "roughplastic",
            "alpha": 0.05 + 0.5 * share,
            "int_ior": 1.3 + 0.5 * share,
            "diffuse_reflectance": reflectance,
        }

    return bsdf


def _of(parts):
    from reference.scene.source import Source

    return Source("growth", lambda: parts)


def _bumps(triangles):
    """A floor of so many triangles, written to a file as users have them."""
    import mitsuba as mi

    side = int(np.sqrt(triangles / 2))
    x, y = np.meshgrid(*2 * [np.linspace(-1, 1, side + 1)])
    points = np.stack([x, y, 0.05 * np.sin(9 * x) * np.cos(7 * y)], axis=-1).reshape(-1, 3)
    first = (np.arange(side)[:, None] * (side + 1) + np.arange(side)).ravel()
    corners = np.stack(
        [first, first + 1, first + side + 2, first, first + side + 2, first + side + 1]
    )
    mesh = mi.Mesh("bumps", len(points), 2 * len(first))
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = mi.Float(points.ravel().astype(np.float32))
    parameters["faces"] = mi.UInt32(corners.T.reshape(-1).astype(np.uint32))
    parameters.update()
    path = Path(tempfile.mkdtemp(), "bumps.ply")
    mesh.write_ply(str(path))
    return {"type": "ply", "filename": str(path), "bsdf": _grey(0)}


def _cornell_box(pixels):
    from comparisons.gallery.builtin import SCENES

    side = int(np.sqrt(pixels))
    return _comparing(SCENES["cornell-box"].source(), (side, side))


SECONDS = {
    "shapes": lambda n: _planning(_scene(**_tiles(n, _grey), **_lamps(1))),
    "shapes and lights": lambda n: _planning(_scene(**_tiles(n, _grey), **_lamps(n))),
    "materials": lambda n: _pairing(_scene(**_tiles(n, _plastic(n)), **_lamps(1))),
    "lights": lambda n: _comparing(_of(_scene(**_tiles(1, _grey), **_lamps(n))), (128, 128)),
    "triangles": lambda n: _comparing(_of(_scene(bumps=_bumps(n), **_lamps(1))), (128, 128)),
    "pixels": _cornell_box,
}
"""What is measured for each load."""


if __name__ == "__main__":
    _one(sys.argv[1], int(sys.argv[2]))
