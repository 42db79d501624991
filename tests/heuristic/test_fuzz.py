"""Random inputs over the whole float range: a few million here, a hundred million where asked."""

import pytest
from drjit.llvm import Float

from fotismos.heuristic import numerics, terms, vectors
from tests.shared import fuzz

ROWS, LARGE = 1_000_000, 4_000_000
ROUNDS = 5
"""Of each of six checks: 120 million rows in the long form."""

CHECKS = pytest.mark.parametrize("check", fuzz.CHECKS.values(), ids=fuzz.CHECKS.keys())


@CHECKS
def test_no_input_gives_a_nan_an_infinity_or_a_large_error(check):
    tally = check(ROWS, seed=1)
    assert tally.judged > ROWS / 2, "too few rows were judged for the check to mean much"
    assert tally.worst <= 1


@pytest.mark.guarantee(
    "kernel", "No random input of a hundred million gives NaN, infinity or a large error."
)
@pytest.mark.slow
@CHECKS
def test_no_input_of_a_hundred_million_does(check, capsys):
    tallies = [check(LARGE, seed) for seed in range(100, 100 + ROUNDS)]
    with capsys.disabled():
        rows, judged = (sum(getattr(t, name) for t in tallies) for name in ("rows", "judged"))
        worst = max(tally.worst for tally in tallies)
        print(f"\n{rows:,} rows, {judged:,} judged, largest error {worst:.2g} of the bound")
    assert all(tally.worst <= 1 for tally in tallies)


def naive_normalise(vector):
    return vector / (vector.x * vector.x + vector.y * vector.y + vector.z * vector.z) ** 0.5


def naive_power(cosine, n):
    if isinstance(cosine, numerics.Cosine):
        cosine = cosine.value
    return cosine**n


def naive_attenuation(distance, k0, k1, k2, intensity=1, inverse=None):
    return intensity * (1 / (k0 + distance * (k1 + distance * k2)))


def naive_cone(cos_axis, cos_cutoff):
    return Float(cos_axis.value >= cos_cutoff.value)


@pytest.mark.parametrize(
    ("name", "module", "attribute", "naive"),
    [
        ("power", terms, "power", naive_power),
        ("normalise", vectors, "normalise", naive_normalise),
        ("attenuation", terms, "attenuation", naive_attenuation),
        ("cone", terms, "spot_cone", naive_cone),
        ("shade", terms, "power", naive_power),
        ("shade", vectors, "normalise", naive_normalise),
    ],
)
def test_the_naive_formulas_are_found_out(monkeypatch, name, module, attribute, naive):
    monkeypatch.setattr(module, attribute, naive)
    with pytest.raises(AssertionError, match="rows are wrong"):
        fuzz.CHECKS[name](100_000, seed=1)
