"""Every hard case breaks the naive formula and not ours; the exact values agree with mpmath."""

from dataclasses import replace

import mpmath
import numpy as np
import pytest
from markupsafe import escape

from fotismos.comparisons import hard_cases
from fotismos.comparisons.hard_cases import CASES, by_kernel, error
from fotismos.reports.page import page


@pytest.fixture(scope="module")
def record():
    """All outcomes."""
    return hard_cases.collect()


@pytest.mark.guarantee(
    "kernel", "Hard cases stay within an error bound that the printed formula breaks."
)
def test_ours_keeps_the_bound(record):
    """The naive formula violates it, which shows that the case is hard, and that this can fail."""
    outcomes = [outcome for rows in record.values() for outcome in rows]
    assert len({case.name for case in CASES}) == len(outcomes) == len(CASES)
    for outcome in outcomes:
        assert outcome.our_error <= outcome.bound <= 0.005, outcome.name
        assert outcome.naive_error > outcome.bound, outcome.name


def test_light_where_there_is_none_is_an_infinite_error():
    nothing = np.zeros(3, np.longdouble)
    for value in (np.nan, np.inf, 1.0):
        assert error([0, 0, value], nothing) == np.inf
    assert error([0, 0, 0], nothing) == 0
    assert error([2.0, 0, 0], np.array([1, 0, 0], np.longdouble)) == 1


# --- On the page ---------------------------------------------------------------------------------


def test_every_case_has_its_row_and_a_violated_bound_is_said(record):
    assert 'id="hard-cases"' not in page.details()
    lost = replace(CASES[0], name="lost <case>", naive_error=np.inf, our_error=0.5)
    text = page.details(hard_cases=record | {"Lost": [lost]})
    assert 'id="hard-cases"' in text
    assert text.count("beyond the limit") == 1
    assert "not finite" in text
    assert "lost &lt;case&gt;" in text
    assert all(str(escape(row.difficulty)) in text for rows in record.values() for row in rows)


# --- An oracle of 50 digits ------------------------------------------------------------------


def digits(value):
    """Return a number or a vector of 50 digits."""
    return np.vectorize(lambda one: mpmath.mpf(float(one)), otypes=[object])(value)[()]


def unit(v):
    length = mpmath.sqrt(v @ v)
    return v / length if length else None


def with_50_digits(setting, row):
    """Equation 8.10 at one point of a setting; directions that do not exist receive no light."""

    def at(value, length):
        value = np.asarray(value)
        return digits(value[row % len(value)] if value.ndim == length + 1 else value)

    offset = at(setting.light, 1) - at(setting.position, 1)
    normal, view, toward = map(unit, (at(setting.normal, 1), at(setting.view, 1), offset))
    if normal is None or view is None or toward is None or normal @ toward <= 0:
        return mpmath.mpf(0)
    cosine = normal @ toward
    if setting.form == "blinn":
        reflection = normal @ unit(toward + view)
    else:
        reflection = (2 * cosine * normal - toward) @ view
    lobe = reflection ** at(setting.n, 0) if reflection > 0 else 0
    distance = mpmath.sqrt(offset @ offset)
    arriving = at(setting.intensity, 0) / (digits(setting.attenuation) @ distance ** np.arange(3))
    if setting.direction is not None:
        cos_axis = -toward @ unit(digits(setting.direction))
        if cos_axis < mpmath.cos(digits(setting.cutoff) * mpmath.pi / 180):
            return mpmath.mpf(0)
        arriving *= max(cos_axis, 0) ** digits(setting.m)
    return arriving * (digits(setting.k_d) * cosine + digits(setting.k_s) * lobe)


def test_the_exact_values_are_those_of_50_digits():
    """Wherever a case says what is exact in extended precision, and for ours within its bound."""
    for case in CASES:
        exact, ours = np.asarray(case.exact()), by_kernel(case.setting, case.compiled)
        if "on the cone" in case.name:  # with 50 digits rounding decides there too
            assert np.all(exact == 1)
            continue
        largest = float(np.abs(exact).max())
        with mpmath.workdps(50):
            for row in np.unique(np.linspace(0, len(exact) - 1, 40).astype(int)):
                expected = with_50_digits(case.setting, int(row))
                scale = max(abs(expected), 1e-3 * largest)
                assert abs(mpmath.mpf(str(exact[row])) - expected) <= 1e-9 * scale, case.name
                assert abs(float(ours[row]) - expected) <= case.bound * scale, case.name
