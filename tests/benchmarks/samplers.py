"""Samplers and samples per pass: efficiency, and what long paths make of the mean.

Efficiency is 1 / (variance × time): the variance of a pixel over passes, in the mean of the image,
and the median time of a pass. It says nothing of bias, which the second table does: inside a bright
sphere the mean is known.
"""

from dataclasses import dataclass, field
from statistics import median
from time import perf_counter

import numpy as np
from rich.console import Console
from rich.table import Table

from comparisons.case import Request, open_case  # isort: skip  it finds LLVM first

import drjit as dr
import mitsuba as mi

from comparisons.hard.samplers import sphere
from reference.planning.plan import plan
from reference.rendering.renderer import physical_integrator
from reference.scene.sampler import SAMPLER, with_sampler

SCENES = ("cornell-box", "plastic-spheres", "fig-8-9")
LAYOUTS = (
    ("multijitter", 16),
    ("multijitter", 64),
    ("independent", 64),
    ("orthogonal", 49),
    (SAMPLER, 16),
    (SAMPLER, 32),
    (SAMPLER, 64),
    (SAMPLER, 128),
)
WIDTH, SPHERE_WIDTH = 96, 64
REFLECTANCES = (0.5, 0.8, 0.9, 0.95)
OF_A_ROUND = 64
"""Samples per pixel of each layout and round."""


@dataclass
class Runs:
    """Passes of one layout: images (H, W, 3) and seconds."""

    scene: mi.Scene
    integrator: mi.Integrator
    spp: int
    images: list = field(default_factory=list)
    seconds: list = field(default_factory=list)

    def add(self, number):
        """Render a round."""
        for part in range(max(1, OF_A_ROUND // self.spp)):
            seed = dr.opaque(mi.UInt32, 7919 * (number * OF_A_ROUND + part) + 17)
            begin = perf_counter()
            image = mi.render(self.scene, integrator=self.integrator, spp=self.spp, seed=seed)
            self.images.append(np.array(image, float))
            self.seconds.append(perf_counter() - begin)

    def efficiency(self):
        """Return 1 / (variance × time), in 1/s."""
        variance = np.stack(self.images).var(axis=0, ddof=1).mean()
        return 1 / (variance * median(self.seconds[1:]))


def run(rounds):
    """Print both tables, and return their numbers."""
    efficiencies = {name: _efficiencies(name, rounds) for name in SCENES}
    biases = {f"{sampler} {spp}": _biases(sampler, spp, rounds) for sampler, spp in LAYOUTS}
    _print(efficiencies, biases)
    return {"efficiency": efficiencies, "bias": biases}


def _efficiencies(name, rounds):
    case = open_case(name, Request(resolution=(WIDTH, WIDTH)))
    pair = case.options.pair(case.source)
    runs = {}
    for sampler, spp in LAYOUTS:
        scene = with_sampler(pair.physical, sampler).instantiate()
        integrator = physical_integrator(plan(pair, scene), scene, pair.hide_emitters)
        runs[f"{sampler} {spp}"] = Runs(scene, integrator, spp)
    for number in range(max(3, rounds // 3)):
        for each in runs.values():
            each.add(number)
    return {layout: each.efficiency() for layout, each in runs.items()}


def _biases(sampler, spp, rounds):
    """Return ``{reflectance: (relative deviation, its standard error)}``."""
    found = {}
    for reflectance in REFLECTANCES:
        scene = sphere(reflectance, SPHERE_WIDTH, {"type": sampler, "sample_count": spp})
        integrator = mi.load_dict({"type": "path", "max_depth": -1})
        runs = Runs(mi.load_dict(scene), integrator, spp)
        for number in range(rounds):
            runs.add(number)
        means = np.array([image.mean() for image in runs.images])
        exact = reflectance / (np.pi * (1 - reflectance))
        error = means.std(ddof=1) / np.sqrt(len(means))
        found[reflectance] = (means.mean() / exact - 1, error / exact)
    return found


def _print(efficiencies, biases):
    table = Table("sampler and samples per pass", *SCENES, title="Efficiency over the first row's")
    first, *_ = next(iter(efficiencies.values()))
    for layout in biases:
        ratios = (efficiencies[name][layout] / efficiencies[name][first] for name in SCENES)
        table.add_row(layout, *(f"{ratio:.2f}" for ratio in ratios))
    Console().print(table)
    columns = (f"ρ = {reflectance}" for reflectance in REFLECTANCES)
    table = Table("sampler and samples per pass", *columns, title="Deviation inside a sphere")
    for layout, row in biases.items():
        table.add_row(layout, *(f"{off:+.2%} ± {error:.2%}" for off, error in row.values()))
    Console().print(table)
