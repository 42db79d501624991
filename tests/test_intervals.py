"""Standard errors and intervals, by closed forms."""

import numpy as np
import pytest

from reference.records import Estimated
from reference.rendering import sums


def test_the_jackknife_of_a_mean_is_its_standard_error():
    values = np.random.default_rng(2).normal(size=(9, 3))
    left_out = [np.delete(values, place, axis=0).mean(axis=0) for place in range(9)]
    expected = values.std(axis=0, ddof=1) / 3
    np.testing.assert_allclose(sums.jackknife_error(left_out), expected, rtol=1e-12)


def test_the_interval_of_a_mean_is_that_of_students_table():
    error = np.std([1, 2, 3, 4], ddof=1) / 2
    found, half = sums.student(2.5, error, 4), 3.182446 * error  # t(0.975, 3) = 3.182446
    assert (found.value, found.low) == (2.5, pytest.approx(2.5 - half, rel=1e-6))
    assert found.high - 2.5 == 2.5 - found.low
    assert sums.student(0.25, 0.0, 16) == Estimated(0.25, 0.25, 0.25)
