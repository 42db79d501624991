"""Where the reference's variance comes from, by the length of paths.

Mitsuba's ``path`` with independent samples is rendered with growing limits of its depth. What the
variance of a pixel, times the samples, grows by from one limit to the next comes from paths of that
length. "in 1 %" is the share of the variance in a hundredth of the pixels. Direct light without any
noise would leave the rest: "gain" says by how much it could raise the efficiency, 1 / (variance ×
time), if it cost nothing more.

Pixels that see a lamp, or its edge, are left out.
"""

from statistics import median
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from comparisons.case import Request, open_case  # isort: skip  it finds LLVM first

import drjit as dr
import mitsuba as mi

from reference.scene.sampler import with_sampler

WIDTH, SPP = 96, 64
DEPTHS = (2, 3, 4, 8)


def glossy_room(alpha):
    """Return the Cornell box with roughplastic in place of each diffuse surface, as a dict."""
    scene = mi.cornell_box()
    for key, value in scene.items():
        if isinstance(value, dict) and value.get("type") == "diffuse":
            reflectance = value["reflectance"]
            scene[key] = {
                "type": "roughplastic",
                "alpha": alpha,
                "nonlinear": True,
                "diffuse_reflectance": reflectance,
            }
    return scene


def run(rounds):
    """Print the table, and return its numbers."""
    mi.set_variant("llvm_ad_rgb")
    table = Table(
        "scene",
        *(f"depth {depth}" for depth in DEPTHS),
        "in 1 %",
        "gain",
        title=f"Variance times samples by limit of depth, ms; {WIDTH} x {WIDTH}, {SPP} spp",
    )
    found = {name: _measured(scene, rounds) for name, scene in _scenes().items()}
    for name, (variances, times) in found.items():
        cells = [
            f"{variance.mean():.2g}, {1e3 * time:.0f}"
            for variance, time in zip(variances, times, strict=True)
        ]
        last = np.sort(variances[-1])
        share = last[-len(last) // 100 :].sum() / last.sum()
        gain = variances[-1].mean() / (variances[-1].mean() - variances[0].mean())
        table.add_row(name, *cells, f"{share:.0%}", f"{gain:.2f}")
    Console().print(table)
    return {name: [float(v.mean()) for v in variances] for name, (variances, _) in found.items()}


def _scenes():
    rooms = {f"glossy room, alpha {alpha}": glossy_room(alpha) for alpha in (0.1, 0.3)}
    for name, scene in rooms.items():
        scene["sensor"]["film"] |= {"width": WIDTH, "height": WIDTH}
        rooms[name] = mi.load_dict(scene)
    case = open_case("plastic-spheres", Request(resolution=(WIDTH, WIDTH)))
    pair = case.options.pair(case.source)
    return {"plastic-spheres": with_sampler(pair.physical, "independent").instantiate(), **rooms}


def _measured(scene, rounds):
    """Return, for each depth, the variances of the pixels that see no lamp, and the seconds."""
    integrators = [mi.load_dict({"type": "path", "max_depth": depth}) for depth in DEPTHS]
    images, seconds = [[] for _ in DEPTHS], [[] for _ in DEPTHS]
    for number in range(max(10, rounds)):
        for depth, integrator in enumerate(integrators):
            seed = dr.opaque(mi.UInt32, 7919 * number + 17)
            begin = perf_counter()
            image = mi.render(scene, integrator=integrator, spp=SPP, seed=seed)
            images[depth].append(np.array(image, float))
            seconds[depth].append(perf_counter() - begin)
    lamp = mi.render(scene, integrator=mi.load_dict({"type": "path", "max_depth": 1}), spp=256)
    away = np.array(lamp).max(axis=-1) == 0
    variances = [SPP * np.stack(some).var(axis=0, ddof=1).mean(axis=-1)[away] for some in images]
    return variances, [median(some[1:]) for some in seconds]
