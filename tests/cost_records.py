"""A study of cost with made-up numbers, each of them different."""

from dataclasses import replace

import numpy as np
from msgspec import convert, structs

from comparisons.cost.cost import Study
from comparisons.cost.cost_record import Cost
from comparisons.hybrids.attribution import Causes
from reference.records import VERSION
from tests import records

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


def study(scene="fig-8-9"):
    """A study whose left half is darkened by occlusion, and whose right half by interreflection."""
    rng = np.random.default_rng(4)
    image = rng.random((HEIGHT, WIDTH, 3))
    left = np.arange(WIDTH)[None, :] < WIDTH // 2
    effects = {
        "occlusion": np.where(left, 6.0, 0.25) * np.ones((HEIGHT, 1)),
        "microfacets and Fresnel": np.full((HEIGHT, WIDTH), 0.5),
        "interreflection": np.where(left, 1.5, 4.0) * np.ones((HEIGHT, 1)),
    }
    effects["interreflection"][-1] = effects["occlusion"][-1] = 0.5
    counted = np.ones((HEIGHT, WIDTH), bool)
    counted[0] = False
    made = record(scene)
    return Study(
        record=made,
        methods={
            method.name: np.full_like(image, 0.2 * (place + 1))
            for place, method in enumerate(made.methods)
        },
        causes=Causes(
            record=made.attribution,
            maps=effects,
            departure=sum(effects.values()),
            left=np.zeros(image.shape[:2]),
            previews={
                each: np.full((2 * HEIGHT, 2 * WIDTH, 3), 0.1 * (place + 1))
                for place, each in enumerate(HYBRIDS)
            },
            counted=counted,
        ),
        reference=image,
        counted=counted,
    )


def explained(comparison):
    """A comparison with the causes of the study."""
    causes = study(comparison.record.scene).causes
    return replace(
        comparison, record=structs.replace(comparison.record, why=causes.record), causes=causes
    )


def record(scene="fig-8-9"):
    """The record of the study."""
    return convert(_record(scene), Cost)


def _record(scene):
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
        "level": 0.75,
        "reference": {
            "integrator": "path",
            "max_depth": -1,
            "spp": 1024,
            "passes": 16,
            "noise_floor": 0.1234,
            "mean_variance": 3.21e-6,
        },
        "methods": [
            {"name": "Phong kernel", "names": ["Phong kernel"]} | DETERMINISTIC,
            {"name": "full plan", "names": ["direct", "full plan"]} | RANDOM,
        ],
        "points": [
            point("Phong kernel", 16, 0.00123, 8.765, True),
            point("full plan", 4, 0.0234, 2.345, True),
            point("full plan", 16, 0.0567, 1.234, False),
        ],
        "equal_error": [
            reached("Phong kernel", 5.0, None),
            reached("Phong kernel", 2.0, None),
            reached("full plan", 5.0, 0.0235, True),
            reached("full plan", 2.0, 0.0321),
        ],
        "attribution": {
            "effects": [
                contribution("occlusion", 3.141),
                contribution("microfacets and Fresnel", -0.271),
                contribution("interreflection", 5.895),
            ],
            "departure": 8.765,
            "closure": {"mean": 0.0123, "low": -0.0145, "high": 0.0391},
            "implementation": 1.23e-5,
            "resolution": [WIDTH, HEIGHT],
            "spp": 16,
            "replicates": 4,
            "orders": 8,
            "hybrids": [{"effects": each, "error": error} for each, error in HYBRIDS.items()],
        },
        "closure": {"mean": 0.0123, "low": -0.0145, "high": 0.0391},
        "viewing": records.data()["viewing"],
        "pixels": {"counted": WIDTH * (HEIGHT - 1), "total": WIDTH * HEIGHT},
        "machine": {"processor": "a processor <b>", "cores": 2, "system": "Linux x86_64"},
        "versions": {"mitsuba": "3.9.1"},
        "command": "fotismos cost fig-8-9 --seed 7",
        "pictures": {"effect_limit": 6.0},
    }


def point(method, spp, time, error, pareto):
    """A method at one sample count."""
    return {
        "method": method,
        "spp": spp,
        "seconds": {"value": time, "low": 0.93 * time, "high": 1.09 * time},
        "error": {"mean": error, "low": 0.97 * error, "high": 1.03 * error},
        "mse": 0.0021 * error,
        "first_s": 11.1 * time,
        "compile_s": 7.7 * time,
        "pareto": pareto,
    }


def reached(method, error, seconds, at_most=False):
    """When a method reaches an error."""
    time = seconds and {"value": seconds, "low": 0.91 * seconds, "high": 1.13 * seconds}
    return {"method": method, "error": error, "seconds": time, "at_most": at_most}


def contribution(effect, removes):
    """What an effect removes."""
    return {
        "effect": effect,
        "removes": {"value": removes, "low": removes - 0.17, "high": removes + 0.19},
        "alone": 0.83 * removes,
        "last": 1.21 * removes,
        "sampling_error": 0.0,
    }
