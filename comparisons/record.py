"""What stands in every record: versions and machine; and what a comparison says of its scene."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from importlib import metadata
from pathlib import Path

import drjit as dr
from msgspec.structs import replace

from comparisons.prepared import Prepared
from comparisons.processes.pool import cores
from heuristic import __version__
from heuristic.heuristics import named
from reference.pairing.halves import Pair
from reference.pairing.prepare import Override
from reference.planning.plan import Plan
from reference.planning.rules import SAMPLED_AS_HIT, loses_light
from reference.records import Machine

LIBRARIES = ("mitsuba", "drjit", "numpy", "colour-science", "OpenEXR")


def versions() -> dict[str, str]:
    """Return the versions that a result depends on."""
    found = {"fotismos": __version__, "python": platform.python_version()}
    found |= {library: metadata.version(library) for library in LIBRARIES}
    found["LLVM"] = ".".join(map(str, dr.detail.llvm_version()))
    return found


def machine() -> Machine:
    """Return what times depend on."""
    system = f"{platform.system()} {platform.machine()}"
    return Machine(processor=_processor(), cores=cores(), system=system)


def _processor() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def overridden(pair: Pair, plan: Plan, spp: int) -> tuple[Override, ...]:
    """Return the settings of the scene that are not used, and what is used instead."""
    used = f"{plan.sampler}, {spp} samples per pixel"
    found = [
        replace(entry, used=used) if entry.what == "sampler" else entry for entry in pair.overridden
    ]
    asks_for_volumes = pair.media or pair.integrator in ("volpath", "volpathmis")
    if plan.stock_integrator == "volpath" and not asks_for_volumes:
        used = "volpath: others err on curved shapes behind hidden lamps"
        found.append(Override(what="integrator", given=pair.integrator or "path", used=used))
    if pair.rr_depth is not None and pair.rr_depth != plan.rr_depth:
        depths = {"given": str(pair.rr_depth), "used": str(plan.rr_depth)}
        found.append(Override(what="rr_depth", **depths))
    return tuple(found)


def plan_record(ready: Prepared, spp: int, passes: int) -> Plan:
    """Return a scene's plan with the samples and passes that were rendered."""
    reads = named(ready.pair.shading).inputs
    return replace(ready.plan, spp=spp, passes=passes, heuristic_reads=reads, guard=ready.guard)


def warnings(ready: Prepared) -> Iterator[str]:
    """Yield what is odd about a scene: its pair, its plan, or how Mitsuba renders it."""
    yield from ready.pair.warnings
    if ready.guard and ready.guard.state == "disagreed":
        yield (
            f"The plan changes the light: {ready.guard.words}. So everything was simulated. A rule"
            " of pruning is wrong for this scene: please report it."
        )
    if loses_light(ready.plan.integrator, ready.pair):
        yield (
            "Mitsuba's path returns black for rays that pass straight through masks into the"
            " background, and drops the light that the masks reflect: the reference is too dark"
            " there. The integrator volpath is right."
        )
    for rule in ready.plan.rules:
        if rule.premise == SAMPLED_AS_HIT.sentence:
            yield (
                f"{rule.evidence}, so the reference depends on how Mitsuba weights the two. Give"
                " a mesh with face_normals, or a cylinder that is round and not mirrored."
            )
