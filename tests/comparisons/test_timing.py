"""Ratios of times: alternating order, intervals, and the refusal to name one."""

import numpy as np
import pytest
from msgspec import structs

from fotismos.comparisons import timing
from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.reference.records import plain
from fotismos.reference.rendering import renderer
from fotismos.reference.rendering.renderer import passes
from fotismos.reference.scene.source import Source
from fotismos.reports.run.scene import _stages
from fotismos.reports.terminal import tables
from tests.shared.misplanned import DIFFUSE, lamp, scene
from tests.shared.parts import moved


class Half:
    """A renderer that notes when it was called."""

    def __init__(self, calls, name):
        self.calls = calls
        self.name = name
        self.variant = "llvm_ad_rgb"

    def render(self, seed):
        self.calls.append(self.name)


def test_the_halves_of_a_pass_alternate(rgb):
    calls = []
    halves = (Half(calls, "textbook"), Half(calls, "physical"))
    for _ in passes(halves, 0, 4):
        pass
    assert calls == ["textbook", "physical", "physical", "textbook"] * 2


@pytest.mark.guarantee(
    "attribution", "Ratios of a comparison's times are within their interval of 30 %, or absent."
)
@pytest.mark.parametrize("busy", [0.0, 0.2, 0.5])
def test_a_ratio_is_the_true_one_or_absent(busy):
    """Other work adds up to twice the time to a share of the passes; the truth is 7."""
    rng = np.random.default_rng(0)
    ratios = []
    for _ in range(200):
        added = (rng.random((2, 48)) < busy) * rng.uniform(0, 2, (2, 48))
        heuristic = 1e-3 * rng.normal(1, 0.02, 48) * (1 + added[0])
        reference = 7e-3 * rng.normal(1, 0.02, 48) * (1 + added[1])
        ratio = timing.ratio(heuristic, reference)
        ratios += [ratio] if ratio != timing.TOO_WIDE else []
    assert len(ratios) > (150 if busy < 0.5 else 50)
    assert all(ratio.high - ratio.low <= timing.WIDEST * ratio.value for ratio in ratios)
    assert np.mean([ratio.low < 7 < ratio.high for ratio in ratios]) > 0.9


def test_two_passes_have_no_ratio():
    assert timing.ratio([1.0, 1.0], [2.0, 2.0]) == timing.TOO_FEW


def comparison(spp=64):
    floor = {"type": "rectangle", "to_world": moved((0, 0, -1), 4), "bsdf": DIFFUSE}
    described = scene(floor=floor, lamp=lamp((0, -3, 0)))
    return compare(Source("a test", described), Options(spp=spp)).record


def test_the_record_has_the_ratio_that_is_shown(rgb):
    record = comparison()
    time = plain(record)["time"]
    assert time["no_ratio"] == ("" if time["ratio"] else timing.TOO_WIDE.reason)
    printed = "\n".join(tables.summary([record]))
    if time["ratio"]:
        assert f"x {time['ratio']:g}" in printed
        assert time["ratio_low"] <= time["ratio"] <= time["ratio_high"]


def test_the_stages_of_a_run_hold_all_stages_of_a_comparison(rgb):
    record = comparison()
    stages = dict.fromkeys(record.time.stages, 1.0) | {"terms": 1.0, "causes": 1.0}
    total = sum(stages.values()) + record.time.heuristic.total_s + record.time.reference.total_s
    timed = structs.replace(record, time=structs.replace(record.time, stages=stages))
    spent = _stages(timed, total)
    assert spent["metrics"] == pytest.approx(stages["metrics"])
    assert spent["scenes and plans"] == 3.0
    assert sum(spent.values()) == pytest.approx(total)


def test_a_table_without_a_ratio_says_why(rgb, monkeypatch):
    """A machine so busy that a pass takes a tenth of a second, or ten."""
    ticks = iter(np.cumsum(np.random.default_rng(0).lognormal(0, 1.5, 10_000)).tolist())
    monkeypatch.setattr(renderer, "perf_counter", lambda: next(ticks))
    monkeypatch.setattr(timing, "BUDGET_S", 0.0)
    record = comparison(spp=512)
    assert plain(record)["time"]["ratio"] is None
    *_, last = tables.summary([record])
    assert last == f"time ?: {timing.TOO_WIDE.reason}"
