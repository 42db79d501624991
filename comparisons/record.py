"""What a comparison returns, and how its record is made from a pair, a plan and times."""

from __future__ import annotations

import platform
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import drjit as dr
import numpy as np
from msgspec.structs import replace

from comparisons.comparison import (
    BsdfPair,
    ComparisonRecord,
    Decision,
    EmitterPair,
    GuardRecord,
    Missed,
    Override,
    Pairing,
    PlanRecord,
    RuleRecord,
    Times,
    Unrepresentable,
)
from comparisons.processes.pool import cores
from comparisons.records import Machine, Record
from comparisons.terms.term_grid import TermGrid
from heuristic import __version__
from heuristic.heuristics import named
from reference.pairing.halves import Pair
from reference.planning.light_by_light import SAMPLED_AS_HIT, loses_light
from reference.planning.plan import Plan
from reference.planning.premises import Ruling
from reference.rendering.guard import Guard, Verdict
from reference.rendering.renderer import PassTimes

if TYPE_CHECKING:
    from comparisons.compare import Prepared

Copied = TypeVar("Copied", bound=Record)

LIBRARIES = ("mitsuba", "drjit", "numpy", "colour-science", "flip-evaluator", "OpenEXR")


@dataclass(frozen=True)
class Images:
    """The images of a comparison; (H, W, 3) linear, or (H, W) for maps.

    ``maps`` holds the perceptual metrics by name, and ``log2_luminance``. ``objects`` and
    ``materials`` hold the index in the record of what each pixel sees, -1 for uncounted pixels.
    """

    heuristic: np.ndarray
    reference: np.ndarray
    reference_stderr: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    maps: dict[str, np.ndarray]
    significant: np.ndarray
    counted: np.ndarray
    objects: np.ndarray
    materials: np.ndarray


@dataclass(frozen=True)
class Comparison:
    """What a comparison returns: the content of ``comparison.json``, the images, and the terms.

    ``no_terms`` gives the reason if there are no terms.
    """

    record: ComparisonRecord
    images: Images
    terms: TermGrid | None = None
    no_terms: str = ""


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


def pairing(pair: Pair) -> Pairing:
    """Return how a pair was derived."""
    return Pairing(
        convention=pair.convention.value,
        bsdfs=tuple(
            BsdfPair(
                name=paired.name,
                given=paired.given,
                derived=paired.derived,
                parameters=_short(paired.parameters),
                note=paired.note,
            )
            for paired in pair.bsdfs
        ),
        emitters=tuple(copied(EmitterPair, paired) for paired in pair.emitters),
        misses=tuple(copied(Missed, miss) for miss in pair.misses),
    )


def unrepresentable(pair: Pair) -> tuple[Unrepresentable, ...]:
    """Return what the heuristic model cannot represent: where it is, and what replaces it."""
    found = [
        (paired.name, paired.given, lost, nearest)
        for paired in pair.bsdfs
        for lost, nearest in paired.lost
    ]
    found += [
        (paired.name, paired.given, paired.lost, paired.note)
        for paired in pair.emitters
        if paired.lost
    ]
    found += [(name, plugin, "participating medium", "left out") for name, plugin in pair.media]
    return tuple(
        Unrepresentable(name=name, plugin=plugin, lost=lost, nearest=nearest)
        for name, plugin, lost, nearest in dict.fromkeys(found)
    )


def overridden(pair: Pair, plan: Plan, spp: int) -> tuple[Override, ...]:
    """Return the settings of the scene that are not used, and what is used instead."""
    found = [copied(Override, entry) for entry in pair.overridden]
    used = f"{plan.sampler}, {spp} samples per pixel"
    found = [replace(entry, used=used) if entry.what == "sampler" else entry for entry in found]
    if pair.rr_depth is not None and pair.rr_depth != plan.rr_depth:
        depths = {"given": str(pair.rr_depth), "used": str(plan.rr_depth)}
        found.append(Override(what="rr_depth", **depths))
    return tuple(found)


def simulation(ready: Prepared, spp: int, passes: int) -> dict[str, Any]:
    """Return the fields on what is simulated, given the samples and passes rendered."""
    plan = ready.plan
    return {
        "kernel_terms": tuple(plan.kernel_terms),
        "heuristic_reads": named(ready.pair.shading).inputs,
        "integrator": plan.integrator,
        "max_depth": plan.max_depth,
        "shadows": plan.shadows,
        "tabulated_environment": plan.tabulate_environment,
        "light_samples": plan.light_samples,
        "spp": spp,
        "passes": passes,
        "sampler": plan.sampler,
        "rules": tuple(_ruling(ruling) for ruling in plan.rulings),
    }


def _ruling(ruling: Ruling) -> RuleRecord:
    return RuleRecord(
        name=ruling.rule.name,
        applies=ruling.holds,
        premise="" if ruling.failed is None else ruling.failed.sentence,
        evidence=ruling.words,
    )


def plan_record(ready: Prepared, passes: int) -> PlanRecord:
    """Return the record of a scene's plan, given the passes rendered."""
    plan = ready.plan
    effects = tuple(
        Decision(
            name=decision.effect.label,
            called_for=decision.called_for,
            rule=f"{decision.rule}: {decision.evidence}",
        )
        for decision in plan.decisions
    )
    samples = ready.reference.spp * passes
    guard = guard_record(ready.guard) if ready.guard else None
    return PlanRecord(effects=effects, guard=guard, **simulation(ready, samples, passes))


def guard_record(guard: Guard) -> GuardRecord:
    """Return the record of the probe of a plan."""
    return GuardRecord(
        state=guard.state.value,
        rays=guard.rays,
        departure=guard.departure,
        error=guard.error,
        seconds=guard.seconds,
    )


def guard_warnings(guard: Guard | None) -> Iterator[str]:
    """Yield a warning if the probe disagreed with the plan."""
    if guard and guard.state is Verdict.DISAGREED:
        yield (
            f"The plan changes the light: {guard.words}. So everything was simulated. A rule of"
            " pruning is wrong for this scene: please report it."
        )


def path_warnings(ready: Prepared) -> Iterator[str]:
    """Yield a warning if Mitsuba's ``path`` loses light."""
    if loses_light(ready.plan.integrator, ready.pair):
        yield (
            "Mitsuba's path returns black for rays that pass straight through masks into the"
            " background, and drops the light that the masks reflect: the reference is too dark"
            " there. The integrator volpath is right."
        )


def lamp_warnings(ready: Prepared) -> Iterator[str]:
    """Yield a warning for a lamp whose light Mitsuba finds in two ways that disagree."""
    for ruling in ready.plan.rulings:
        if ruling.failed is SAMPLED_AS_HIT:
            yield (
                f"{ruling.evidence}, so the reference depends on how Mitsuba weights the two. Give"
                " a cylinder that is round and not mirrored, or a mesh."
            )


def times(of_passes: PassTimes) -> Times:
    """Return the times of one half, in seconds."""
    return Times(
        median_s=of_passes.median,
        passes=of_passes.passes,
        first_s=of_passes.first,
        total_s=of_passes.total,
        compile_s=of_passes.compilation,
    )


def copied(kind: type[Copied], source: object) -> Copied:
    """Make a record from an object that has its fields."""
    return kind(**{name: getattr(source, name) for name in kind.__struct_fields__})


def _short(value: Any) -> Any:
    """Turn tuples of equal components into one number, for readability."""
    if isinstance(value, dict):
        return {key: _short(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return value[0] if len(set(value)) == 1 else list(value)
    return value
