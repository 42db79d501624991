"""Random scenes: the plan's reference has the mean of stock Mitsuba's own integrator.

A seed in a test's name can be examined alone:
``python -m tests.shared.random_scenes SEED 1 VARIANT``.
"""

import pytest

from tests.shared.misplanned import prune_blindly
from tests.shared.random_scenes import examine, run

RIGHT = ("right", "same")
FEW = 24
MANY = 2000


@pytest.mark.parametrize(
    "seed",
    [pytest.param(seed, marks=() if seed < 6 else pytest.mark.thorough) for seed in range(FEW)],
)
def test_the_plan_of_a_random_scene_is_right(rgb, tmp_path, seed):
    found = examine(seed, tmp_path)
    assert found.state in RIGHT, found


@pytest.mark.thorough
@pytest.mark.parametrize("variant", ["llvm_ad_spectral", "llvm_ad_mono"], indirect=True)
@pytest.mark.parametrize("seed", [0, 12, 28])
def test_it_is_in_other_variants(variant, tmp_path, seed):
    found = examine(seed, tmp_path)
    assert found.state in RIGHT, found


@pytest.mark.thorough
@pytest.mark.guarantee("plans", "A wrong plan among random scenes is detected.")
def test_wrong_plans_are_found(rgb, tmp_path, monkeypatch):
    """With every premise taken for true: some scenes have shadows, or light reflected twice."""
    prune_blindly(monkeypatch)
    states = [examine(seed, tmp_path).state for seed in range(FEW // 2)]
    assert states.count("wrong") >= 2


@pytest.mark.guarantee("plans", "No random scene of 2,000 is planned wrongly.")
@pytest.mark.slow
@pytest.mark.parametrize(
    ("count", "variant"),
    [(MANY, "llvm_ad_rgb"), (MANY // 20, "llvm_ad_spectral"), (MANY // 20, "llvm_ad_mono")],
)
def test_the_plans_of_many_random_scenes_are_right(count, variant, capsys):
    lines = list(run(0, count, variant))
    with capsys.disabled():
        print(f"\n{count} scenes in {variant}:")
        print(*(line for line in lines if line.split()[1] not in RIGHT), sep="\n")
    assert len(lines) == count
    assert [line for line in lines if line.split()[1] not in RIGHT] == []
