"""The record of a comparison: images, and the plain data that ``comparison.json`` holds."""

import os
import platform
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path

import drjit as dr
import numpy as np

from heuristic import __version__

LIBRARIES = ("mitsuba", "drjit", "numpy", "colour-science", "OpenEXR")


@dataclass(frozen=True)
class Images:
    """The images of a comparison; (H, W, 3) linear, or (H, W) for maps.

    ``maps`` holds the perceptual metrics by name and ``log2_luminance``.
    """

    heuristic: np.ndarray
    reference: np.ndarray
    reference_stderr: np.ndarray
    position: np.ndarray
    normal: np.ndarray
    maps: dict[str, np.ndarray]
    significant: np.ndarray
    counted: np.ndarray


@dataclass(frozen=True)
class Comparison:
    """What a comparison returns: the data of ``comparison.json``, and the images."""

    data: dict
    images: Images


def versions():
    """Return the versions that a result depends on."""
    found = {"fotismos": __version__, "python": platform.python_version()}
    found |= {library: metadata.version(library) for library in LIBRARIES}
    found["LLVM"] = ".".join(map(str, dr.detail.llvm_version()))
    return found


def machine():
    """Return what times depend on: processor, cores that may be used, system."""
    return {
        "processor": _processor(),
        "cores": len(os.sched_getaffinity(0))
        if hasattr(os, "sched_getaffinity")
        else os.cpu_count() or 1,
        "system": f"{platform.system()} {platform.machine()}",
    }


def _processor():
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()


def pairing_data(pair):
    """Return how a pair was derived, as plain data."""
    return {
        "convention": pair.convention.value,
        "bsdfs": [
            {
                "name": record.name,
                "given": record.given,
                "derived": record.derived,
                "parameters": _plain(record.parameters),
            }
            for record in pair.bsdfs
        ],
        "emitters": [
            {key: value for key, value in asdict(record).items() if key != "lost"}
            for record in pair.emitters
        ],
        "misses": [asdict(miss) for miss in pair.misses],
    }


def unrepresentable_data(pair):
    """Return what the heuristic model has no form for: where it is, and what is taken instead."""
    found = [
        (record.name, record.given, lost, nearest)
        for record in pair.bsdfs
        for lost, nearest in record.lost
    ]
    found += [
        (record.name, record.given, record.lost, record.note)
        for record in pair.emitters
        if record.lost
    ]
    found += [(name, plugin, "participating medium", "left out") for name, plugin in pair.media]
    names = ("name", "plugin", "lost", "nearest")
    return [dict(zip(names, entry, strict=True)) for entry in dict.fromkeys(found)]


def overridden_data(pair, plan, spp):
    """Return what the scene asks for and does not get, and what it gets instead."""
    found = [asdict(entry) for entry in pair.overridden]
    for entry in found:
        if entry["what"] == "sampler":
            entry["used"] = f"{plan.sampler}, {spp} samples a pixel"
    if pair.rr_depth is not None and pair.rr_depth != plan.rr_depth:
        found.append({"what": "rr_depth", "given": str(pair.rr_depth), "used": str(plan.rr_depth)})
    return found


def plan_data(plan, spp, passes):
    """Return a plan as plain data, with the samples and passes that were rendered."""
    return {
        "effects": [
            {
                "name": decision.effect.label,
                "called_for": decision.called_for,
                "rule": f"{decision.rule}: {decision.evidence}",
            }
            for decision in plan.decisions
        ],
        "kernel_terms": list(plan.kernel_terms),
        "integrator": plan.integrator,
        "max_depth": plan.max_depth,
        "shadows": plan.shadows,
        "tabulated_environment": plan.tabulate_environment,
        "spp": spp,
        "passes": passes,
        "sampler": plan.sampler,
    }


def times_data(times):
    """Return the times of one half, in seconds."""
    return {
        "median_s": times.median,
        "passes": times.passes,
        "first_s": times.first,
        "total_s": times.total,
        "compile_s": times.compilation,
    }


def _plain(value):
    """Turn tuples of equal components into one number, for reading."""
    if isinstance(value, dict):
        return {key: _plain(item) for key, item in value.items()}
    if isinstance(value, tuple):
        return value[0] if len(set(value)) == 1 else list(value)
    return value
