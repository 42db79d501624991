"""A comparison with made-up numbers in its record, each of them different."""

import json
from pathlib import Path

import msgspec
import numpy as np

from fotismos.comparisons.departure.metrics import METRICS, RATIO, THRESHOLDS, drawn
from fotismos.comparisons.records.comparison import ComparisonRecord
from fotismos.comparisons.records.departure import Summary, Viewing, VisibleShare
from fotismos.comparisons.records.images import Comparison, Images
from fotismos.reference.records import plain
from fotismos.reports.page.scene_view import SceneView

CONTENT = Path(__file__).with_name("record.json").read_text(encoding="utf-8")


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
    means = {"dE2000": 4.327, "dE_ITP": 12.91, "dE_CAM16UCS": 3.638}
    unseen = {"rmse": 0.04871, "ldr_flip": 0.1234, "hdr_flip": 0.2345}
    # Metrics that are declared later get a made-up mean, too.
    unseen |= dict.fromkeys(METRICS.keys() - means.keys() - unseen.keys(), 0.1)
    metrics = {name: metric(mean) for name, mean in means.items()}
    metrics |= {name: metric(mean, ()) for name, mean in unseen.items()}
    return json.loads(CONTENT) | {"viewing": plain(Viewing(exposure=0.5)), "metrics": metrics}
