"""A comparison with made-up numbers in its record, each of them different."""

import msgspec
import numpy as np

from comparisons.comparison import Comparison, ComparisonRecord, Images
from comparisons.departure.colour import Viewing
from comparisons.departure.metrics import RATIO, THRESHOLDS, drawn
from comparisons.departure.noise import VisibleShare
from comparisons.departure.statistics import Summary
from reference.records import VERSION, plain
from reports.page.scene_view import SceneView


def summary(mean):
    """Return the summary of a metric."""
    return msgspec.convert(metric(mean), Summary)


def metric(mean, visible=THRESHOLDS):
    after = {"exposure": 1.25 + mean / 100, "mean": 0.71 * mean, "p50": 0.5 * mean}
    return {
        "mean": mean,
        "p50": 0.8 * mean,
        "p95": 2.1 * mean,
        "max": 3.3 * mean,
        "visible": [
            {
                "threshold": limit,
                "value": 0.0771 * mean / 13 / limit,
                "low": 0.0688 * mean / 13 / limit,
                "high": 0.0829 * mean / 13,
            }
            for limit in visible
        ],
        "debiased": 0.97 * mean,
        "low": 0.94 * mean,
        "high": 1.02 * mean,
        "noise_floor": 0.0123 * mean,
        "after_exposure": after | {"p95": 1.9 * mean, "max": 3.1 * mean},
    }


def visible(shares):
    """Return shares ``{threshold: share}`` without noise, as in a summary."""
    return tuple(
        VisibleShare(threshold=limit, value=share, low=share, high=share)
        for limit, share in shares.items()
    )


def of(content):
    """Return the record with such content."""
    return msgspec.convert(content, ComparisonRecord)


def record(**changes):
    """Return the made-up record, with other values of some of its fields."""
    return msgspec.structs.replace(of(data()), **changes)


def view(content, **shown):
    """Return the view of a record with such content."""
    return SceneView(record=of(content), **shown)


def images(height, width, maps=None, **changes):
    """Return random images of a comparison; maps are random from 0 to 20 where none are given."""
    rng = np.random.default_rng(0)
    vectors = dict.fromkeys(
        ("reference_stderr", "position", "normal"), np.zeros((height, width, 3))
    )
    random = {name: 20 * rng.random((height, width)) for name in (*drawn(), RATIO.name)}
    halves = {half: rng.random((height, width, 3)) for half in ("heuristic", "reference")}
    masks = {name: np.ones((height, width), bool) for name in ("significant", "counted")}
    owners = {name: np.zeros((height, width), int) for name in ("objects", "materials")}
    shown = {"maps": random | (maps or {})}
    return Images(**vectors | halves | masks | owners | shown | changes)


def comparison(height=4, width=6, **changes):
    """Return a comparison of random images, with the made-up record."""
    return Comparison(record(**changes), images(height, width))


def data():
    """Return the content of the made-up record."""
    side = {"median_s": 0.0042, "passes": 16, "first_s": 0.31, "total_s": 0.375, "compile_s": None}
    return {
        "scene": "fig-8-9",
        "variant": "llvm_ad_rgb",
        "heuristic_variant": "llvm_ad_rgb",
        "heuristic": "phong",
        "interpolation": "phong",
        "seed": 7,
        "resolution": [6, 4],
        "plan": {
            "effects": [
                {"name": "diffuse", "called_for": True, "rule": "k_d > 0"},
                {"name": "emission", "called_for": False, "rule": "no surface emits"},
            ],
            "kernel_terms": ["k_d"],
            "shadows": True,
            "tabulated_environment": False,
            "integrator": "path",
            "max_depth": -1,
            "stock_integrator": "path",
            "scene_depth": -1,
            "spp": 256,
            "passes": 16,
            "sampler": "multijitter",
            "rules": [
                {"name": "no shadow rays", "applies": True, "premise": "", "evidence": "one shape"}
            ],
            "guard": {
                "state": "agreed",
                "rays": 8192,
                "departure": 0.000213,
                "error": 0.000172,
                "seconds": 0.0456,
            },
        },
        "viewing": plain(Viewing(exposure=0.5)),
        "metrics": {
            "dE2000": metric(4.327),
            "dE_ITP": metric(12.91),
            "dE_CAM16UCS": metric(3.638),
            "rmse": metric(0.04871, ()),
            "ldr_flip": metric(0.1234, ()),
            "hdr_flip": metric(0.2345, ()),
        },
        "log2_luminance": {"mean": -0.133, "p05": -0.561, "p50": -0.0542, "p95": 0.321},
        "significant": {"fraction": 0.632, "undetermined": 0.171, "level": 0.05},
        "pixels": {"counted": 20, "total": 24},
        "regions": [
            {"x": 1, "y": 2, "width": 3, "height": 2, "share": 0.541, "mean_dE2000": 9.13},
            {
                "x": 4,
                "y": 0,
                "width": 2,
                "height": 1,
                "share": 0.123,
                "mean_dE2000": 6.02,
                "effect": "occlusion",
            },
        ],
        "pairing": {
            "convention": "matched",
            "bsdfs": [
                {
                    "name": "ball",
                    "given": "roughplastic",
                    "derived": "phong",
                    "parameters": {"k_d": [0.4, 0.3, 0.2]},
                }
            ],
            "emitters": [
                {
                    "name": "lamp",
                    "given": "point",
                    "derived": "heuristic_point",
                    "factor": 0.3183,
                    "exact": True,
                    "note": "",
                }
            ],
            "misses": [{"what": "specular albedo", "wanted": 0.238, "reached": 0.0562}],
        },
        "time": {
            "heuristic": side,
            "reference": {**side, "total_s": 2.79},
            "stages": {"page": 0.1},
        },
        "unrepresentable": [
            {
                "name": "pane",
                "plugin": "dielectric",
                "lost": "refraction",
                "nearest": "seen straight through",
            }
        ],
        "integrator_given": "path",
        "overridden": [{"what": "sampler", "given": "independent", "used": "multijitter"}],
        "warnings": ["material reflects more than it receives"],
        "versions": {"mitsuba": "3.9.1"},
        "command": "fotismos compare fig-8-9 --seed 7",
        "record_version": VERSION,
    }
