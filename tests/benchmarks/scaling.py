"""Scaling of both halves: time against pixels, samples and lights, and peak memory of a comparison.

Times are medians of rounds in which all sizes take turns, after a first one that compiles. Memory
is the largest resident size of a process of its own for each image size, since it never shrinks.
"""

import json
import subprocess
import sys
from pathlib import Path
from statistics import median

from rich.console import Console
from rich.table import Table

ROOT = Path(__file__).parents[2]

SIDES = (128, 256, 512, 1024, 2048)
SAMPLES = (4, 16, 64, 256)
LIGHTS = (1, 4, 16, 64)
MEMORY_SIDES = (512, 1024, 2048, 4096)
SCENE = "cornell-box"
MEMORY_SPP = 4

MEMORY = """
import heuristic
import resource, sys
from comparisons.compare import compare
from comparisons.options import Options
from comparisons.gallery.builtin import SCENES
from reference.scene.graph import set_variant

name, side, spp = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
set_variant(SCENES[name].variant)
compare(SCENES[name].source(), Options(resolution=(side, side), spp=spp))
# Kilobytes on Linux, bytes on macOS.
unit = 1 if sys.platform == "darwin" else 1024
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * unit)
"""


def run(rounds):
    """Measure, print a table each, and return the numbers."""
    import heuristic  # noqa: F401  first: it finds LLVM
    from reference.scene.graph import set_variant

    set_variant("llvm_ad_rgb")
    rounds = min(rounds, 7)  # the largest sizes take seconds
    pixels = _times({side * side: _cornell_box(side, 4) for side in SIDES}, rounds)
    samples = _times({spp: _cornell_box(128, spp) for spp in SAMPLES}, rounds)
    lights = _times({count: _lit_floor(count) for count in LIGHTS}, rounds)
    memory = {side * side: _peak_memory(side) for side in MEMORY_SIDES}
    _print("pixels", pixels, f"{SCENE}, 4 samples a pixel")
    _print("samples", samples, f"{SCENE}, 128 x 128")
    _print("lights", lights, "a floor under point lights, 256 x 256, 4 samples a pixel")
    _print_memory(memory)
    return {"pixels": pixels, "samples": samples, "lights": lights, "peak_bytes": memory}


def _times(renderers, rounds):
    """Return ``{size: {half: seconds}}`` of pairs of renderers, measured in turn."""
    for number in range(rounds + 1):
        for halves in renderers.values():
            for half in halves.values():
                half.render(number)
    return {
        size: {name: median(half.times[1:]) for name, half in halves.items()}
        for size, halves in renderers.items()
    }


def _cornell_box(side, spp):
    from comparisons.gallery.builtin import SCENES

    return _halves(SCENES[SCENE].source(), (side, side), spp)


def _lit_floor(count):
    from reference.scene.source import Source

    return _halves(Source("lit floor", lambda: _floor(count)), (256, 256), 4)


def _floor(count):
    import mitsuba as mi

    scene = mi.cornell_box()
    transform = mi.ScalarTransform4f()
    parts = {key: scene[key] for key in ("type", "integrator", "sensor")}
    parts["floor"] = {
        "type": "rectangle",
        "to_world": transform.translate((0, 0, -1)),
        "bsdf": {"type": "diffuse", "reflectance": 0.5},
    }
    for number in range(count):
        place = (number % 8 / 4 - 1, number // 8 / 4 - 1, 1)
        parts[f"light-{number}"] = {"type": "point", "position": place, "intensity": 1.0 / count}
    return parts


def _halves(source, resolution, spp):
    """Return both halves of a scene, to be rendered in one pass of these samples."""
    from comparisons.compare import Options, prepare

    ready = prepare(source, Options(resolution=resolution))
    halves = {"heuristic": ready.heuristic, "reference": ready.reference}
    for half in halves.values():
        half.spp = spp
    return halves


def _peak_memory(side):
    ended = subprocess.run(
        [sys.executable, "-c", MEMORY, SCENE, str(side), str(MEMORY_SPP)],
        cwd=ROOT,
        capture_output=True,
        check=True,
        text=True,
    )
    return int(json.loads(ended.stdout.splitlines()[-1]))


def _print(size, times, title):
    table = Table(title=f"Time against {size}: {title}", title_justify="left")
    for heading in (size, "heuristic", f"a {size[:-1]}", "reference", f"a {size[:-1]}"):
        table.add_column(heading, justify="right")
    for count, halves in times.items():
        cells = []
        for seconds in halves.values():
            cells += [f"{seconds * 1e3:.3g} ms", f"{seconds / count * 1e9:.3g} ns"]
        table.add_row(f"{count}", *cells)
    Console().print(table)


def _print_memory(memory):
    table = Table(title=f"Peak memory of a comparison: {SCENE}, {MEMORY_SPP} samples a pixel")
    for heading in ("pixels", "peak", "a pixel"):
        table.add_column(heading, justify="right")
    for pixels, peak in memory.items():
        table.add_row(f"{pixels}", f"{peak / 2**30:.2f} GiB", f"{peak / pixels:.0f} B")
    Console().print(table)
