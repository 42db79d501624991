"""The cheapest method within an error: against an exhaustive search, and by the command."""

import json
from dataclasses import dataclass

import numpy as np
import pytest

from comparisons.cost import choice
from comparisons.cost.choice import Choice, Offer, choose
from comparisons.cost.front import cheapest
from comparisons.gallery.builtin import SCENES
from comparisons.options import Options
from heuristic.errors import InputError
from reports.terminal.choice_lines import lines
from tests.benchmarks.choice import searched
from tests.test_cost import TINY


@dataclass(frozen=True)
class Timed:
    median: float


@dataclass(frozen=True)
class Point:
    seconds: Timed
    error: float


def test_the_choice_is_that_of_an_exhaustive_search():
    rng = np.random.default_rng(8)
    found = []
    for _ in range(500):
        # Few values, so that times, errors and the tolerance itself are often equal.
        count = int(rng.integers(1, 9))
        times, errors = rng.integers(1, 5, (2, count)) / 2
        points = [Point(Timed(float(t)), float(e)) for t, e in zip(times, errors, strict=True)]
        within = float(rng.integers(1, 5)) / 2
        assert cheapest(points, within) == searched(points, within)
        found.append(cheapest(points, within))
    assert None in found
    assert len(set(found)) > 5


@pytest.fixture(scope="module")
def measured():
    """Choices on the Cornell box under several tolerances, of one measurement each."""
    from reference.scene.graph import set_variant

    set_variant("llvm_ad_rgb")
    source, few = SCENES["cornell-box"].source(), Options(resolution=(16, 16))
    climbed = choice.climb(source, few, TINY, lambda *_: None)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(choice, "climb", lambda *_: climbed)
        return [choose(source, within, few, TINY) for within in (1e-6, 100.0)]


def test_all_is_within_a_large_error_and_nothing_within_a_small_one(measured):
    none, any_one = measured
    assert none.chosen is None
    assert any_one.chosen is not None
    assert any_one.chosen.seconds <= any_one.full.seconds
    assert none.best.error > 0
    assert {one.name for one in any_one.left_out} == {"spherical harmonics"}
    for found in measured:
        assert found.best.error <= found.full.error


def test_another_metric_judges(rgb):
    source, few = SCENES["fig-8-9"].source(), Options(resolution=(12, 12))
    by_rmse = choose(source, 0.5, few, TINY, "rmse")
    assert by_rmse.chosen.error < 0.5
    assert by_rmse.full.error < 0.2 * choose(source, 50.0, few, TINY).full.error
    with pytest.raises(InputError, match=r"metric 'rms' is not known.*did you mean rmse"):
        choose(source, 0.5, few, TINY, "rms")


def offer(method, seconds, error, prepare_s=0.0):
    return Offer(
        method=method, spp=16, seconds=seconds, prepare_s=prepare_s, error=error, error_stderr=0.01
    )


def told(chosen, within=3.0):
    found = lines(
        Choice(
            scene="box",
            resolution=(8, 8),
            metric="dE2000",
            within=within,
            chosen=chosen,
            best=offer("path 5", 0.3, 2.5),
            full=offer("full plan", 0.21, 2.75),
        )
    )
    return " ".join(found)


def test_the_sentence_has_the_price_and_what_it_is_in_place_of():
    assert told(offer("constant ambient", 0.004, 2.1, 0.1)).startswith(
        "At 8x8: constant ambient with 16 samples per pixel: ΔE2000 2.10 at 4.00 ms and once 100"
        " ms to prepare, in place of full plan with 16 samples per pixel: ΔE2000 2.75 at 210 ms."
    )
    assert "Nothing cheaper stays within 3." in told(offer("full plan", 0.21, 2.75))
    none = "At 8x8 no measured method stays within ΔE2000 3. The nearest is path 5"
    assert told(None).startswith(none)


def test_the_methods_of_the_sentence_are_explained():
    said = told(offer("constant ambient", 0.004, 2.1, 0.1))
    assert "constant ambient: Ambient light" in said
    assert said.endswith("full plan: Everything that the scene calls for.")
    assert told(offer("full plan", 0.21, 2.75)).count("full plan: ") == 1


def test_the_command_answers_and_its_exit_code_tells_whether_there_is_one(run, monkeypatch):
    monkeypatch.setattr(choice, "Effort", lambda: TINY)
    words = "plan", "fig-8-9", "--resolution", "12x12"
    code, said, _ = run(*words, "--within", 90, "--json")
    assert code == 0
    assert json.loads(said)["chosen"]["error"] <= 90
    code, said, _ = run(*words, "--within", 1e-9)
    assert code == 1
    assert said.startswith("At 12x12 no measured method stays within")
    code, _, said = run(*words, "--within", 1, "--verify")
    assert code == 2
    assert "give one" in said
