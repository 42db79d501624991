"""A record as in ``comparison.json``, with made-up numbers, each of them different."""

from comparisons.departure.metrics import Viewing


def metric(mean):
    after = {"exposure": 1.25 + mean / 100, "mean": 0.71 * mean, "p50": 0.5 * mean}
    return {
        "mean": mean,
        "p50": 0.8 * mean,
        "p95": 2.1 * mean,
        "max": 3.3 * mean,
        "noise_floor": 0.0123 * mean,
        "after_exposure": after | {"p95": 1.9 * mean, "max": 3.1 * mean},
    }


def histogram(counts):
    return {"low": 0.01, "high": 1000.0, "counts": counts, "below": 2, "above": 0}


def record():
    side = {"median_s": 0.0042, "passes": 16, "first_s": 0.31, "total_s": 0.375, "compile_s": None}
    return {
        "scene": "fig-8-9",
        "variant": "llvm_ad_rgb",
        "seed": 7,
        "resolution": [6, 4],
        "plan": {
            "effects": [
                {"name": "diffuse", "called_for": True, "rule": "k_d > 0"},
                {"name": "emission", "called_for": False, "rule": "no surface emits"},
            ],
            "integrator": "path",
            "max_depth": -1,
            "spp": 256,
            "passes": 16,
            "sampler": "multijitter",
        },
        "viewing": Viewing(exposure=0.5).record(),
        "metrics": {
            "dE2000": metric(4.327),
            "dE_ITP": metric(12.91),
            "dE_CAM16UCS": metric(3.638),
            "rmse": {
                "value": 0.04871,
                "noise_floor": 0.000812,
                "after_exposure": {"exposure": 1.31, "value": 0.0312},
            },
            "log2_luminance": {"mean": -0.133, "p05": -0.561, "p50": -0.0542, "p95": 0.321},
            "significant": {"fraction": 0.632, "level": 0.01},
        },
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
        "histograms": {"dE2000": histogram([0] * 20 + [5, 9, 4] + [0] * 37)},
        "pairing": {
            "convention": "matched",
            "bsdfs": [{"id": "ball", "physical": "roughplastic", "k_d": [0.4, 0.3, 0.2]}],
            "emitters": [{"physical": "point", "intensity": 12.566}],
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
    }
