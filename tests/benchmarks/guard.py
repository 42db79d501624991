"""The guard of plans: its power, its false alarms, and what it costs.

*Power*: the share of runs in which the probe disagrees with plans that are wrong by a known share
of the light, by the noise of a ray's difference and the samples of the reference. *False alarms*:
right plans of random scenes at several seeds, and made-up noise whose rarest paths carry a third of
the light. *Cost*: its time beside that of the passes.
"""

import tempfile
from dataclasses import replace
from itertools import count

import numpy as np
from rich.console import Console
from rich.table import Table

DEPARTURES = (0.005, 0.01, 0.02, 0.05, 0.1, 0.2)
NOISES = (0.1, 1.0, 3.0, 10.0)
SAMPLES = (2**18, 2**22, 2**26)
RARE = (1e-2, 1e-3, 1e-4)
SCENES = 60
"""Random scenes, each at :data:`SEEDS` seeds."""

SEEDS = 5
MADE_UP = 100
"""Runs of each made-up case for a round: 3,000 with the 30 rounds that are usual."""


def run(rounds):
    """Measure, print a table each, and return the numbers."""
    import heuristic  # noqa: F401  first: it finds LLVM
    from reference.scene.graph import set_variant

    set_variant("llvm_ad_rgb")
    found = {
        "power": _power(rounds),
        "false_alarms_made_up": _made_up_alarms(rounds * MADE_UP),
        "false_alarms": _alarms(),
        "cost": _cost(),
    }
    for name, rows in found.items():
        _print(name, rows)
    return found


def _verdicts(draw, samples, repeats):
    """Return the probe's verdicts on rays that are drawn from a distribution."""
    from reference.rendering import guard
    from reference.rendering.guard import Verdict

    class Made:
        integrator, max_depth = "direct_all", 2

        def unpruned(self):
            other = Made()
            other.integrator = "path"
            return other

    rng = np.random.default_rng(1)
    before = guard._followed, guard.physical_integrator
    guard._followed = lambda scene, integrators, rays, seeds: np.array(draw(rng, rays))
    guard.physical_integrator = lambda *given: None
    try:
        found = [guard.examine_plan(Made(), None, False, samples, n) for n in range(repeats)]
    finally:
        guard._followed, guard.physical_integrator = before
    return float(np.mean([one.state is Verdict.DISAGREED for one in found]))


def _power(rounds):
    """Share of wrong plans that are caught: departure, noise of a ray's difference, samples."""
    return [
        {
            "departure": departure,
            "noise of a ray": noise,
            **{
                f"{samples:.0e} samples": _verdicts(
                    lambda rng, n, d=departure, s=noise: (
                        1 - d + s * rng.normal(size=n),
                        np.ones(n),
                    ),
                    samples,
                    rounds,
                )
                for samples in SAMPLES
            },
        }
        for noise in NOISES
        for departure in DEPARTURES
    ]


def _made_up_alarms(repeats):
    def rare(share):
        def draw(rng, rays):
            met = (rng.random(rays) < share) * (1 + rng.pareto(2.5, rays)) / (5 / 3)
            return np.ones(rays), 2 / 3 + met / share / 3

        return draw

    cases = {"normal": lambda rng, n: (1 + 3 * rng.normal(size=n), 1 + 3 * rng.normal(size=n))}
    cases |= {f"a third in {share:g} of the rays": rare(share) for share in RARE}
    return [
        {"noise": name, "runs": repeats, "alarms": _verdicts(draw, 2**20, repeats)}
        for name, draw in cases.items()
    ]


def _alarms():
    """Probe right plans of random scenes at several seeds."""
    from comparisons.compare import prepare
    from comparisons.options import Options
    from reference.planning.plan import Plan
    from reference.rendering.guard import Verdict, examine_plan
    from reference.scene.source import Source
    from tests.random_scenes import random_scene

    probed, alarms = 0, []
    with tempfile.TemporaryDirectory() as folder:
        for seed in count():
            if probed >= SCENES * SEEDS:
                break
            ready = prepare(Source(f"{seed}", random_scene(seed, folder)), Options(spp=64))
            plan: Plan = ready.plan
            for number in range(SEEDS):
                hidden = ready.pair.hide_emitters
                found = examine_plan(plan, ready.scene, hidden, 2**20, number)
                if found.state is Verdict.NOT_NEEDED:
                    break
                probed += 1
                alarms += [seed] if found.state is Verdict.DISAGREED else []
    return [{"probes of right plans": probed, "alarms": len(alarms), "seeds": str(alarms)}]


def _cost():
    """Time of the probe beside that of the passes, compiled, on pruned built-in scenes."""
    from comparisons.compare import compare
    from comparisons.gallery.builtin import SCENES as BUILT_IN
    from comparisons.options import Options

    rows = []
    for name in ("fig-8-9", "fig-6-14", "fig-8-5a"):
        options = Options(resolution=(256, 256))
        compare(BUILT_IN[name].source(), options)  # compiles
        record = compare(BUILT_IN[name].source(), replace(options, seed=1)).record
        rows.append(
            {
                "scene": name,
                "rays": record.plan.guard.rays,
                "probe_s": record.plan.guard.seconds,
                "passes_s": record.time.reference.total_s + record.time.heuristic.total_s,
            }
        )
    return rows


def _print(title, rows):
    table = Table(title=title)
    for key in rows[0]:
        table.add_column(key, justify="right")
    for row in rows:
        table.add_row(*(v if isinstance(v, str) else f"{v:.4g}" for v in row.values()))
    Console(width=120).print(table)
