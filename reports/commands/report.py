"""``fotismos report``: all built-in scenes in one report."""

import click

from reports import batch, jobs

VERIFIED_AT = (128, 128)
"""Resolution at which a report verifies its plans."""


@click.command()
@jobs.output_option("out/report")
@jobs.rendering_options
def report(output, **rendering):
    """Compare all built-in scenes, verify their plans, and write one report."""
    from comparisons.scenes import SCENES
    from heuristic import equations

    names = tuple(SCENES)
    jobs.check_installation()
    verifications = [] if rendering["everything"] else _verify(names, rendering)
    batch.run(names, output, rendering, equations.index(), verifications, with_hard_cases=True)


def _verify(names, rendering):
    """Hold the plan of each scene against everything simulated, at a small size."""
    from comparisons.verification import verify
    from reference.scene import set_variant
    from reports import progress

    with progress.shown() as bar:
        results = []
        for source, chosen in (jobs.job(name, rendering) for name in names):
            set_variant(chosen["variant"])
            options = jobs.options(chosen | {"resolution": VERIFIED_AT, "spp": None})
            results.append(verify(source, options, bar.of(source.name)).data())
    return results
