"""Quantiles of Student's t against SciPy's."""

import math

import pytest
from scipy.special import stdtrit

from fotismos.reference.student import quantile


@pytest.mark.parametrize("degrees", [1, 2, 3, 4, 7, 15, 31, 200])
def test_quantiles_are_those_of_scipy(degrees):
    for probability in (1e-4, 0.3, 0.6, 0.975, 1 - 1e-6, 1 - 1e-8):
        expected = float(stdtrit(degrees, probability))
        assert quantile(degrees, probability) == pytest.approx(expected, rel=1e-7)
    assert quantile(degrees, 0.5) == pytest.approx(0.0, abs=1e-12)


def test_without_freedom_there_is_no_quantile():
    assert math.isnan(quantile(0, 0.975))
