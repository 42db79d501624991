"""A study of cost, and the causes of its scene, with made-up numbers, each of them different."""

from dataclasses import replace

import numpy as np
from msgspec import convert, structs

from fotismos.comparisons.attribution import Causes
from fotismos.comparisons.ladder.engine import Study
from fotismos.comparisons.records.comparison import Attribution
from fotismos.comparisons.records.cost import Cost
from fotismos.comparisons.records.engine import Engine
from fotismos.reference.records import VERSION
from tests.shared import records

WIDTH, HEIGHT = 12, 8
DETERMINISTIC = {"monte_carlo": False, "family": "kernel"}
RANDOM = {"monte_carlo": True, "family": "physical"}
EFFECTS = ("occlusion", "microfacets and Fresnel", "interreflection")
HYBRIDS = {
    (): 8.765,
    ("occlusion",): 5.432,
    ("interreflection",): 4.321,
    ("occlusion", "interreflection"): 0.271,
    EFFECTS: -0.0123,
}
"""Error of the hybrids that were rendered, by the effects that are simulated."""

CLOSURE = {"value": 0.0123, "low": -0.0145, "high": 0.0391}


def study(scene="fig-8-9"):
    """A study with an image of each method."""
    made, image = record(scene), np.random.default_rng(4).random((HEIGHT, WIDTH, 3))
    shown = {one.name: np.full_like(image, 0.2 + 0.2 * n) for n, one in enumerate(made.methods)}
    return Study(record=made, methods=shown, reference=image)


def with_engine(study, machine="RTX 3060", kernel_s=0.0021, names=("PCSS low", "PCSS high")):
    """The study with settings of an engine, the later ones slower and better."""
    settings = [
        {
            "method": name,
            "seconds": interval(0.0063 + 0.0028 * place, 0),
            "error": {"value": 4.567 - place, "low": 4.321 - place, "high": 4.765 - place},
            "front": True,
            "visible": [
                {"threshold": t, "value": 0.0421 / t, "low": 0.0311 / t, "high": 0.0987 / t}
                for t in (1.0, 2.0)
            ],
            "passes_at": 2.0 if place else None,
            "p95": 13.57 - place,
            "ratio": kernel_s and (0.0063 + 0.0028 * place) / kernel_s,
            "picture": {
                "files": [f"{place}.exr"],
                "transfer": None,
                "repeats": 1,
            },
            "agreement": {
                "shift": None,
                "edges": 0.5,
                "ratio": [1.0, 1.0, 1.0],
                "mistakes": ["The picture is misread."],
            },
        }
        for place, name in enumerate(names)
    ]
    engine = {"settings": settings, "machine": machine, "kernel_s": kernel_s}
    record = structs.replace(study.record, engine=convert(engine, Engine))
    return replace(study, record=record, settings=dict.fromkeys(names, study.reference))


def causes():
    """Causes whose left half is darkened by occlusion, and whose right half by interreflection."""
    left = np.arange(WIDTH)[None, :] < WIDTH // 2
    maps = {
        "occlusion": np.where(left, 6.0, 0.25) * np.ones((HEIGHT, 1)),
        "microfacets and Fresnel": np.full((HEIGHT, WIDTH), 0.5),
        "interreflection": np.where(left, 1.5, 4.0) * np.ones((HEIGHT, 1)),
    }
    maps["interreflection"][-1] = maps["occlusion"][-1] = 0.5
    counted = np.ones((HEIGHT, WIDTH), bool)
    counted[0] = False
    why = {
        "effects": [contribution(*each) for each in REMOVES],
        "departure": 8.765,
        "closure": CLOSURE,
        "implementation": 1.23e-5,
        "resolution": [WIDTH, HEIGHT],
        "spp": 16,
        "replicates": 4,
        "orders": 8,
        "hybrids": [{"effects": each, "error": error} for each, error in HYBRIDS.items()],
    }
    return Causes(
        record=convert(why, Attribution),
        maps=maps,
        departure=sum(maps.values()),
        left=np.zeros((HEIGHT, WIDTH)),
        counted=counted,
        visible={},
        previews={
            each: np.full((2 * HEIGHT, 2 * WIDTH, 3), 0.1 * (place + 1))
            for place, each in enumerate(HYBRIDS)
        },
    )


def explained(comparison):
    """A comparison with the causes."""
    found = causes()
    made = structs.replace(comparison.record, why=found.record)
    return replace(comparison, record=made, causes=found)


def record(scene="fig-8-9"):
    """The record of the study."""
    return convert(_record(scene), Cost)


REMOVES = tuple(zip(EFFECTS, (3.141, -0.271, 5.895), strict=True))


def _record(scene):
    adds = 0.0111, -0.0002, 0.0345
    return {
        "record_version": VERSION,
        "scene": scene,
        "variant": "llvm_ad_rgb",
        "heuristic_variant": "llvm_ad_rgb",
        "heuristic": "phong",
        "interpolation": "phong",
        "seed": 7,
        "resolution": [WIDTH, HEIGHT],
        "rounds": 3,
        "threads": 2,
        "processor_share": 0.96875,
        "reference": {
            "integrator": "path",
            "max_depth": -1,
            "spp": 1024,
            "passes": 16,
            "noise_floor": 0.1234,
        },
        "methods": [
            method("Phong kernel", 1.0, names=["Phong kernel"], **DETERMINISTIC),
            method("full plan", 22.25, names=["direct", "full plan"], **RANDOM),
        ],
        "points": [
            point("Phong kernel", 16, 0.00123, 8.765, front=True),
            point("full plan", 4, 0.0234, 2.345, front=True, ties=["direct <b>"]),
            point("full plan", 16, 0.0567, 1.234),
        ],
        "attribution": {
            "effects": [
                contribution(*removes) | {"adds_s": interval(seconds, 0.0017)}
                for removes, seconds in zip(REMOVES, adds, strict=True)
            ],
            "departure": 8.765,
            "size": [24, 16],
            "kernel_s": interval(0.0052, 0.0001),
            "plan_s": interval(0.0617, 0.0013),
            "renderer_s": interval(0.0111, 0.0014),
            "resolution": [WIDTH, HEIGHT],
            "spp": 64,
        },
        "closure": CLOSURE,
        "viewing": records.data()["viewing"],
        "pixels": {"counted": WIDTH * (HEIGHT - 1), "total": WIDTH * HEIGHT},
        "machine": {"processor": "a processor <b>", "cores": 2, "system": "Linux x86_64"},
        "versions": {"mitsuba": "3.9.1"},
        "command": "fotismos cost fig-8-9 --seed 7",
        "left_out": {"path 4": "the scene's own paths end at depth 3"},
    }


def interval(value, half):
    """A number and its interval."""
    return {"value": value, "low": value - half, "high": value + 1.1 * half}


def method(name, ratio, **more):
    """A method and its time."""
    return more | {
        "name": name,
        "overhead_s": interval(0.0051 + 0.0001 * ratio, 0.0003),
        "per_sample_s": interval(15.5e-9 * ratio, 0.3e-9 * ratio),
        "ratio": interval(ratio, 0.02 * ratio),
        "first_s": 0.313 * ratio,
    }


def point(method, spp, time, error, **more):
    """A method at one sample count."""
    return more | {
        "method": method,
        "spp": spp,
        "seconds": interval(time, 0.07 * time),
        "error": {"value": error, "low": 0.97 * error, "high": 1.03 * error},
        "tolerance": {"value": 2.9 * error, "low": 2.8 * error, "high": 3.1 * error},
    }


def contribution(effect, removes):
    """What an effect removes."""
    return {
        "effect": effect,
        "removes": {"value": removes, "low": removes - 0.17, "high": removes + 0.19},
        "alone": 0.83 * removes,
        "last": 1.21 * removes,
        "sampling_error": 0.0,
    }
