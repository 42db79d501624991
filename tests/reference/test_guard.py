"""The guard: wrong plans are caught at default settings, right ones are left alone."""

import numpy as np
import pytest

from fotismos.comparisons.compare import compare
from fotismos.comparisons.options import Options
from fotismos.comparisons.prepared import guarded
from fotismos.reference.planning import guard
from fotismos.reference.planning.plan_record import Guard
from fotismos.reference.scene.source import Source
from fotismos.reports import tables
from fotismos.reports.page import page
from fotismos.reports.page.scene_view import SceneView
from tests.shared.misplanned import SCENES, SKY, lamp, prune_blindly, scene, sphere

SLIGHTLY_WRONG = {"an anisotropic sphere"}
"""Off by a percent: below what the guard is for."""


@pytest.mark.guarantee(
    "plans", "The guard catches each known plan that is wrong by a fifth of the light."
)
@pytest.mark.parametrize("name", sorted(set(SCENES) - SLIGHTLY_WRONG))
def test_a_wrong_plan_is_caught(rgb, name, monkeypatch):
    prune_blindly(monkeypatch)
    found = guarded(Source("wrong", SCENES[name]()))
    assert found.guard.state == "disagreed"
    assert abs(found.guard.departure) > 0.2
    own = SCENES[name]()["integrator"]["type"]
    assert (found.plan.integrator, found.plan.sampler) == (own, "independent")
    assert all(decision.rule.startswith("guard: ") for decision in found.plan.effects)


@pytest.mark.parametrize(
    "name", ["a two-sided rectangle seen from behind", "an anisotropic sphere"]
)
def test_the_right_plan_of_such_a_scene_is_kept(rgb, name):
    ready = guarded(Source("right", SCENES[name]()))
    assert ready.guard.state != "disagreed"
    assert ready.plan.sampler != "independent"


@pytest.mark.thorough
def test_the_record_says_what_was_found_and_done(rgb, monkeypatch):
    source = Source("wrong", SCENES["a two-sided rectangle seen from behind"]())
    options = Options(resolution=(8, 8), spp=64)
    right = compare(source, options).record
    assert right.plan.guard.state == "agreed"
    assert right.plan.guard.rays > 0
    assert not any("report" in warning for warning in right.warnings)
    prune_blindly(monkeypatch)
    wrong = compare(source, options).record
    assert wrong.plan.guard.state == "disagreed"
    assert wrong.plan.integrator == "path"
    assert wrong.plan.guard.departure == pytest.approx(-1, abs=0.7)
    assert wrong.time.stages["guard"] > 0
    assert any("please report it" in warning for warning in wrong.warnings)
    assert any("Please report" in line for line in tables.summary([wrong]))
    assert not any("Please report" in line for line in tables.summary([right]))
    html = page.render([SceneView(record=wrong)])
    assert "Guard: disagreed" in html
    assert "So everything was simulated" in html
    assert wrong.metrics["rmse"].mean < 0.05


def test_nothing_is_probed_where_nothing_is_left_out(rgb):
    balls = {"one": sphere(), "two": {"type": "sphere", "center": (2, 1, 0)}}
    source = Source("whole", scene(**balls, light=lamp((0, -3, 3))))
    assert guarded(source).guard == Guard()
    assert guarded(source, Options(everything=True)).guard == Guard()


def pretending(monkeypatch, draw):
    """Let the probe's rays return what ``draw(rng, count)`` does: two arrays."""
    rng = np.random.default_rng(7)

    def followed(scene, integrators, count, seeds):
        return np.array(draw(rng, count))

    monkeypatch.setattr(guard, "radiances", followed)
    monkeypatch.setattr(guard, "physical_integrator", lambda *given: None)


def rate(ready, samples, repeats):
    """Share of repeats in which the probe disagrees."""
    plan = ready.plan
    found = [guard.examine_plan(plan, None, False, samples, seed) for seed in range(repeats)]
    return np.mean([each.state == "disagreed" for each in found])


@pytest.fixture
def pruned(rgb):
    return guarded(Source("pruned", scene(ball=sphere(), sky=SKY)))


def normal(rng, count):
    return 1 + rng.normal(size=count), 1 + rng.normal(size=count)


def fireflies(rng, count):
    """One ray of a thousand carries a third of the light, with no third moment."""
    rare = (rng.random(count) < 1e-3) * (1 + rng.pareto(2.5, count)) / (5 / 3)
    return np.ones(count), 2 / 3 + 1000 / 3 * rare


@pytest.mark.guarantee("plans", "Noise alone alarms the guard in at most one scene of a thousand.")
@pytest.mark.parametrize("repeats", [100, pytest.param(10_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("noise", [normal, fireflies])
def test_noise_alone_raises_one_alarm_in_a_thousand_at_most(pruned, monkeypatch, noise, repeats):
    pretending(monkeypatch, noise)
    assert rate(pruned, 2**20, repeats) <= 0.001


@pytest.mark.parametrize(("departure", "caught"), [(0.0, 0.0), (0.2, 1.0)])
def test_a_fifth_of_the_light_is_seen_through_noise(pruned, monkeypatch, departure, caught):
    """Noise of each ray as large as the light, at the fewest rays."""

    def draw(rng, count):
        return 1 - departure + rng.normal(size=count), 1 + rng.normal(size=count)

    pretending(monkeypatch, draw)
    assert rate(pruned, 1, 20) == caught
