"""Which models keep energy, and which are reciprocal: known facts, found by the quadrature."""

import numpy as np
import pytest

from comparisons.hard import furnace


@pytest.fixture
def table(rgb):
    return {row.model: row for row in furnace.table()}


def test_the_facts_of_the_models(table):
    assert set(table) == set(furnace.MODELS)
    white = table["diffuse, ρ = 1"]
    assert white.albedo == pytest.approx((1, 1, 1), abs=1e-4)
    assert white.asymmetry < 1e-5
    # Phong's lobe sends back 2 k_s / (n + 2) from the normal; normalised, all of it.
    assert table["Phong, k_s = 1, n = 9"].albedo[0] == pytest.approx(2 / 11, rel=1e-3)
    assert table["Phong, k_s = 1, n = 1000"].albedo[0] == pytest.approx(2 / 1002, rel=2e-2)
    assert table["Phong normalised, n = 9"].albedo[0] == pytest.approx(1, rel=1e-3)
    assert table["Blinn–Phong normalised, n = 9"].albedo[0] == pytest.approx(1, rel=1e-3)


def test_phongs_lobe_creates_light_towards_grazing_and_is_not_reciprocal(table):
    """Without a cosine in it, ``f = k_s (R.V)^n / (N.L)`` grows without bound."""
    assert max(table["Phong normalised, n = 9"].albedo) > 1.3
    assert table["Phong normalised, n = 9"].asymmetry > 1
    assert table["Phong normalised, n = 1000"].asymmetry > 0.2
    assert max(table["Blinn–Phong normalised, n = 9"].albedo) > 1.05
    assert max(table["Phong, k_s = 1, n = 1000"].albedo) < 1


def test_roughplastic_loses_light_and_is_reciprocal(table):
    """At ρ = 1 a white surface would return all; one reflection alone is followed."""
    smooth, rough = (table[f"roughplastic, ρ = 1, α = {alpha}"] for alpha in (0.1, 0.5))
    assert smooth.albedo[0] == pytest.approx(0.97, abs=0.01)
    assert rough.albedo[0] == pytest.approx(0.74, abs=0.01)
    for row in (smooth, rough):
        assert max(row.albedo) < 1.01
        assert row.asymmetry < 1e-3


def test_a_wrong_albedo_would_be_found(rgb):
    import mitsuba as mi

    half = mi.load_dict({"type": "diffuse", "reflectance": 0.5})
    assert furnace.albedo(half, 45.0) == pytest.approx(0.5, abs=1e-4)
    np.testing.assert_allclose(furnace.asymmetry(half), 0, atol=1e-5)
