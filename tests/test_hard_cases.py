"""Every hard case breaks the naive formula and not ours; the exact values agree with mpmath."""

import mpmath
import numpy as np
import pytest

from comparisons.departure.limits import LOST
from comparisons.hard import collection, physical, terminators
from comparisons.hard.cases import Convention, error, evaluate
from tests import conftest

CASES = {case.name: case for case in collection.CASES}
GROUPS = {"exponents", "geometry", "lights", "shading", "reference", "colour"}
ALL = pytest.mark.parametrize("case", CASES.values(), ids=CASES.keys())


@pytest.fixture(scope="module")
def rgb_for_all():
    """The variant of all evaluations here, which are too long to be made for each test."""
    yield from conftest.in_variant("llvm_ad_rgb")


@pytest.fixture(scope="module")
def outcomes(rgb_for_all):
    return {name: evaluate(case) for name, case in CASES.items()}


@ALL
def test_the_naive_formula_violates_the_bound(outcomes, case):
    """Which shows that the case is hard, and that the next test can fail."""
    assert outcomes[case.name].naive_error > case.bound


@pytest.mark.guarantee(
    "kernel",
    "Hard cases stay within an error bound that the formula as printed breaks.",
)
@ALL
def test_ours_keeps_the_bound(outcomes, case):
    assert outcomes[case.name].our_error <= case.bound


def test_the_cases_are_told_apart_and_explained():
    assert len(CASES) == len(collection.CASES)
    assert {case.group for case in CASES.values()} == GROUPS
    for case in CASES.values():
        assert case.hard.endswith(".")
        assert 0 < case.bound <= (LOST if case.group == "reference" else 1e-3)


@pytest.mark.parametrize("convention", collection.CONVENTIONS, ids=lambda c: c.name)
def test_what_is_laid_down_is_done(rgb_for_all, convention):
    assert convention.holds()
    assert convention.text.endswith(".")


def test_a_convention_that_is_not_kept_is_seen():
    assert not Convention("a", "b.", 0.0, lambda: 1e-30).holds()
    assert not Convention("a", "b.", 1.0, lambda: np.nan).holds()


MEASURES = {
    "terminator": (terminators.lit, 1e-3),
    "silhouette": (terminators.seen, 1e-3),
    "energy": (lambda: physical.white(tuple((a, 1.5) for a in physical.ROUGH)), LOST),
    "fireflies": (physical.caustic, LOST),
    "roughness": (physical.too_sharp, 1e-5),
}


@pytest.mark.parametrize(("measure", "bound"), MEASURES.values(), ids=MEASURES)
def test_what_is_set_aside_is_at_fault_and_not_all(rgb_for_all, measure, bound):
    """All masked pixels are wrong, but for the one at the limit itself: alpha = 1e-4."""
    exact, reference, mask = measure()
    assert 0 < mask.sum() < mask.size or mask.all() == (measure is physical.too_sharp)
    wrong = np.abs(reference[mask] / exact[mask] - 1) > bound
    assert np.count_nonzero(~wrong) <= (measure is physical.too_sharp)


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
