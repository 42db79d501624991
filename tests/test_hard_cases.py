"""Every hard case breaks the naive formula and not ours; the exact values agree with mpmath."""

import mpmath
import numpy as np
import pytest

from comparisons.hard import catalogue
from comparisons.hard.cases import error, evaluate

CASES = {case.name: case for case in catalogue.CASES}
GROUPS = {"exponents", "geometry", "lights", "shading", "colour"}
ALL = pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())


@pytest.fixture(scope="module")
def outcomes():
    return {name: evaluate(case) for name, case in CASES.items()}


@ALL
def test_the_naive_formula_violates_the_bound(outcomes, case):
    """Which shows that the case is hard, and that the next test can fail."""
    assert outcomes[case.name].naive_error > case.bound


@ALL
def test_ours_keeps_the_bound(outcomes, case):
    assert outcomes[case.name].our_error <= case.bound


def test_the_cases_are_told_apart_and_explained():
    assert len(CASES) == len(catalogue.CASES)
    assert {case.group for case in CASES.values()} == GROUPS
    for case in CASES.values():
        assert case.hard.endswith(".")
        assert 0 < case.bound <= 1e-3


@pytest.mark.parametrize("found", [np.nan, np.inf, 1.0])
def test_light_where_there_is_none_is_an_infinite_error(found):
    nothing = np.zeros(3, np.longdouble)
    assert error([0, 0, found], nothing) == np.inf
    assert error([0, 0, 0], nothing) == 0
    assert error([2.0, 0, 0], np.array([1, 0, 0], np.longdouble)) == 1


# --- An oracle of 50 digits ------------------------------------------------------------------


def vector(value):
    return [mpmath.mpf(float(component)) for component in value]


def dot(a, b):
    return mpmath.fsum(x * y for x, y in zip(a, b, strict=True))


def unit(v):
    length = mpmath.sqrt(dot(v, v))
    return [x / length for x in v] if length else None


def with_50_digits(setting, row):
    """Equation 8.10 at one point of a setting; directions that do not exist receive no light."""

    def at(value, length):
        value = np.asarray(value)
        return value[row % len(value)] if value.ndim == length + 1 else value

    normal, view = (unit(vector(at(v, 1))) for v in (setting.normal, setting.view))
    offset = [
        a - b
        for a, b in zip(vector(at(setting.light, 1)), vector(at(setting.position, 1)), strict=True)
    ]
    toward = unit(offset)
    if None in (normal, view, toward):
        return mpmath.mpf(0)
    cosine = dot(normal, toward)
    if cosine <= 0:
        return mpmath.mpf(0)
    mirrored = [2 * cosine * n - t for n, t in zip(normal, toward, strict=True)]
    reflection = dot(mirrored, view)
    n = mpmath.mpf(float(at(setting.n, 0)))
    lobe = reflection**n if reflection > 0 else mpmath.mpf(0)
    distance = mpmath.sqrt(dot(offset, offset))
    k0, k1, k2 = vector(setting.attenuation)
    arriving = mpmath.mpf(float(at(setting.intensity, 0))) / (k0 + k1 * distance + k2 * distance**2)
    if setting.direction is not None:
        cos_axis = -dot(toward, unit(vector(setting.direction)))
        if cos_axis < mpmath.cos(mpmath.mpf(float(setting.cutoff)) * mpmath.pi / 180):
            return mpmath.mpf(0)
        arriving *= max(cos_axis, 0) ** mpmath.mpf(float(setting.m))
    return arriving * (float(setting.k_d) * cosine + float(setting.k_s) * lobe)


OF_THE_KERNEL = [case for case in CASES.values() if case.setting is not None]


@pytest.mark.parametrize("case", OF_THE_KERNEL, ids=lambda case: case.name)
def test_the_exact_values_are_those_of_50_digits(case):
    """Wherever a case says what is exact in extended precision, and for ours within its bound."""
    exact, ours = np.asarray(case.exact()), np.asarray(case.ours())
    if "on the cone" in case.name:  # with 50 digits rounding decides there too
        assert np.all(exact == 1)
        return
    largest = float(np.abs(exact).max())
    rows = np.unique(np.linspace(0, len(exact) - 1, 40).astype(int))
    with mpmath.workdps(50):
        for row in rows:
            expected = with_50_digits(case.setting, int(row))
            scale = max(abs(expected), 1e-3 * largest)
            assert abs(mpmath.mpf(str(exact[row])) - expected) <= 1e-9 * scale
            assert abs(float(ours[row]) - expected) <= case.bound * scale
