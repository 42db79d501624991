"""Powers, lengths and sums in single precision: properties, gradients, and an oracle by mpmath."""

import drjit as dr
import drjit.llvm.ad
import drjit.scalar
import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import heuristic
from heuristic import numerics, terms, vectors

Single, Double = drjit.llvm.ad.Float, drjit.llvm.ad.Float64
Array3f, Array3f64 = drjit.llvm.ad.Array3f, drjit.llvm.ad.Array3f64
FLOATS = pytest.mark.parametrize("float_type", [Single, Double], ids=["single", "double"])

bounded = settings(max_examples=150, deadline=None)
singles = st.floats(width=32, allow_nan=False, allow_infinity=False)
cosines = st.one_of(
    st.floats(-1, 1, width=32), st.floats(0.9375, 1, width=32), st.floats(0, 2**-20, width=32)
)
exponents = st.one_of(st.floats(1e-3, 1e7), st.sampled_from([0.0, 1.0, 2.0, 1e5, 1e6]))
vectors_of_any_size = st.tuples(singles, singles, singles)
SMALLEST = 2.0**-126


@bounded
@given(cosines, exponents)
def test_powers_are_those_of_50_digits(cosine, n):
    found = terms.power(Single(cosine), Single(n))[0]
    if cosine < SMALLEST:
        assert found == 0
        return
    with mpmath.workdps(50):
        expected = mpmath.mpf(cosine) ** mpmath.mpf(float(np.float32(n)))
    if expected > 1e-3:
        assert abs(found - expected) <= 2e-4 * expected
    assert 0 <= found <= 1


@FLOATS
@pytest.mark.parametrize("n", [1e3, 1e5, 1e6, 1e7])
def test_the_complement_carries_what_the_cosine_rounds_away(float_type, n):
    """Angles of a highlight, whose cosines all round to 1 in the end."""
    angle = np.linspace(0, np.sqrt(2 * np.log(1e3) / n), 200)
    complement = 2 * np.sin(angle / 2) ** 2
    cosine = numerics.Cosine(float_type(1 - complement), float_type(complement))
    found = np.array(terms.power(cosine, dr.opaque(float_type, n)), float)
    expected = np.exp(n * np.log1p(-complement))
    np.testing.assert_allclose(found, expected, rtol=5e-6 if float_type is Single else 1e-12)
    rounded = np.float32(1 - complement).astype(float) ** n
    if n >= 1e5:
        assert np.abs(rounded / expected - 1).max() > 1e-3, "without it the highlight is wrong"


@bounded
@given(vectors_of_any_size)
def test_unit_vectors_have_unit_length_or_none(components):
    components = tuple(float(np.float32(c)) for c in components)
    length = np.sqrt(np.sum(np.square(components)))
    found = np.array(vectors.normalise(Array3f(*components)), float)[:, 0]
    wide = np.array(numerics.wide_unit(Array3f(*components)), float)[:, 0]
    assume(length == 0 or length > 16 * SMALLEST)
    if length == 0:
        assert not found.any()
        assert not wide.any()
        return
    np.testing.assert_allclose(found, np.array(components) / length, atol=4e-7)
    assert abs(np.linalg.norm(wide) - 1) < 1e-12


@bounded
@given(st.lists(st.floats(-(2.0**90), 2.0**90, width=32), min_size=1, max_size=60))
def test_sums_lose_next_to_nothing(values):
    total, lost = Single(0), Single(0)
    for value in values:
        total, lost = numerics.add(total, lost, Single(value))
    found = numerics.summed(total, lost)[0]
    exact = float(mpmath.fsum(map(mpmath.mpf, values)))
    size = float(np.abs(values).sum())
    assert abs(found - exact) <= 2.0**-23 * abs(exact) + 2.0**-40 * size + 2.0**-120


# --- Gradients -------------------------------------------------------------------------------


@pytest.mark.parametrize("n", [0.7, 9.0, 1e4, 1e6])
def test_derivatives_of_the_lobe_are_those_of_differences(n):
    """By the view, in a highlight, against the kernel in double precision."""
    view = np.array([0.6 / np.sqrt(n), 0.0, 1.0])
    light, step = [heuristic.PointLight((0, 0, 2), 1.0)], 1e-6 / np.sqrt(n)

    def at(vector_type, x):
        material = heuristic.Material(k_s=1, n=vector_type(n, n, n).x)
        return heuristic.shade(
            vector_type(0), vector_type(0, 0, 1), vector_type(x, 0, 1), material, light
        )

    expected = (
        at(Array3f64, float(view[0] + step))[0] - at(Array3f64, float(view[0] - step))[0]
    ) / (2 * step)
    x = Single(float(view[0]))
    dr.enable_grad(x)
    dr.backward(at(Array3f, x))
    assert dr.grad(x)[0] == pytest.approx(expected, rel=1e-3)


def test_moderate_exponents_are_those_whose_error_stays_within_the_bound():
    low, high = numerics.MODERATE_EXPONENTS
    assert 3 * high * 2.0**-24 < 2e-4
    assert [numerics.is_moderate(n) for n in (low, high, low - 1, high + 1, 9.5)] == [
        True, True, False, False, True
    ]  # fmt: skip
    assert not numerics.is_moderate(Single(9))
    assert heuristic.Material(n=9).n_is_moderate
    assert not heuristic.Material(n=1e6).n_is_moderate


@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_a_highlight_keeps_its_digits_at_any_exponent(form):
    """Rounding the cosine even to 1e-13 would cost a tenth of it at n = 1e12."""
    random = np.random.default_rng(3)
    for n in (1e9, 1e12, 1e14):
        normal = np.float32(random.normal(size=3)).astype(float)
        unit = normal / np.linalg.norm(normal)
        toward = -np.float32(unit + 0.3 * random.normal(size=3)).astype(float)
        mirrored = -toward + 2 * unit * (toward @ unit)
        view = np.float32(-mirrored + random.normal(size=3) / n**0.5).astype(float)
        with mpmath.workdps(40):
            n_, l_, v_ = (_exact_unit(each) for each in (normal, -toward, view))
            if form == "phong":
                cosine = 2 * _exact_dot(n_, l_) * _exact_dot(n_, v_) - _exact_dot(l_, v_)
            else:
                cosine = _exact_dot(n_, _exact_unit([a + b for a, b in zip(l_, v_, strict=True)]))
            expected = float(cosine ** mpmath.mpf(n))
        sun = heuristic.DirectionalLight(tuple(toward), 1.0)
        material = heuristic.Material(k_s=1.0, n=n, form=form)
        place, *given = (Array3f(*map(float, each)) for each in ((0, 0, 0), normal, view))
        found = heuristic.shade(place, *given, material, [sun])
        assert abs(found[0] - expected) < 1e-4


def _exact_unit(vector):
    length = mpmath.sqrt(sum(mpmath.mpf(float(each)) ** 2 for each in vector))
    return [mpmath.mpf(float(each)) / length for each in vector]


def _exact_dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))
