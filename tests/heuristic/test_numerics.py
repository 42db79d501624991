"""Terms, powers and sums in single precision: their edges, gradients, and an oracle by mpmath."""

import math

import drjit as dr
import drjit.llvm.ad
import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import fotismos
from fotismos.heuristic import numerics, terms

Single, Double = drjit.llvm.ad.Float, drjit.llvm.ad.Float64
Array3f, Array3f64 = drjit.llvm.ad.Array3f, drjit.llvm.ad.Array3f64
FLOATS = pytest.mark.parametrize("float_type", [Single, Double], ids=["single", "double"])

COSINES = np.concatenate([np.linspace(-1, 1, 401), [1e-30, -1e-30, 1e-6, -1e-6]])


def step(float_type):
    """One rounding step at 1."""
    return 2.0**-23 if float_type is Single else 2.0**-52


@FLOATS
@pytest.mark.parametrize("opaque", [False, True], ids=["literal", "opaque"])
def test_specular_is_the_power_and_nothing_where_the_lobe_ends(float_type, opaque):
    """Within a few roundings of the base, which the power multiplies by ``n``."""
    base = np.array(float_type(COSINES), float)  # as rounded to the type
    for n in (0, 1, 2, 3, 9, 64, 65, 1000, 0.5, 37.25):
        exponent = dr.opaque(float_type, n) if opaque else n
        found = np.array(terms.specular(1.5, 0.5, float_type(COSINES), exponent), float)
        expected = np.where(base > 0, 0.75 * np.maximum(base, 0) ** n, 0)
        smallest = 1e-37 if float_type is Single else 1e-300  # below it, numbers lose digits
        big = expected > smallest
        tolerance = 8 * step(float_type) * max(n, 1)
        # exp2(n log2 c) has the rounding of its exponent: |n log2 c| steps, up to 127 or 1023.
        tolerance += 2 * step(float_type) * np.abs(np.log2(np.where(big, expected, 1)))
        assert np.all(np.abs(found - expected)[big] <= (tolerance * expected)[big])
        assert np.all(found[~big] <= 2 * smallest)
        assert not found[base <= 0].any()


@FLOATS
def test_attenuation_on_the_light_itself(float_type):
    """Where the polynomial is 0 the open form gives nothing, and the clamped one its limit 1."""
    assert dr.all(terms.attenuation(float_type(0), 0, 0, 1) == 0)
    assert dr.all(terms.clamped_attenuation(float_type(0), 0, 0, 1) == 1)
    assert terms.attenuation(float_type(0), 0.5, 0, 1)[0] == pytest.approx(2)


@FLOATS
def test_the_cone_holds_its_edge_and_nothing_beyond(float_type):
    """6.2 says ``>=``: a point at exactly the cutoff is lit."""
    edge = float_type(0.75)
    inside = np.array(terms.spot_cone(float_type([1, 0.7501, 0.75, 0.7499, 0, -1]), edge))
    np.testing.assert_array_equal(inside, [1, 1, 1, 0, 0, 0])


@FLOATS
def test_powers_below_the_smallest_float_are_zero_and_never_infinite(float_type):
    """Dr.Jit's own power of two is -inf at -1024, in double precision."""
    x = float_type(np.concatenate([np.linspace(-1030, 0, 20601), [-1e6, -1e30]]))
    dr.enable_grad(x)
    found = numerics.exp2(x)
    dr.backward(found)
    exact = 2.0 ** np.array(x, float)
    largest_lost = 2.0**-126 if float_type is Single else 2.0**-1022
    expected = np.where(exact >= largest_lost, exact, 0)
    np.testing.assert_allclose(np.array(found, float), expected, rtol=4 * step(float_type))
    assert np.isfinite(np.array(dr.grad(x))).all()


@settings(max_examples=150, deadline=None)
@given(st.lists(st.floats(-(2.0**90), 2.0**90, width=32), min_size=1, max_size=60))
def test_sums_lose_next_to_nothing(values):
    total = Single(0), Single(0)
    for value in values:
        total = numerics.add(total, Single(value))
    found = numerics.summed(total)[0]
    exact = math.fsum(values)
    size = float(np.abs(values).sum())
    assert abs(found - exact) <= 2.0**-23 * abs(exact) + 2.0**-40 * size + 2.0**-120


@pytest.mark.parametrize("n", [0.7, 9.0, 1e4, 1e6])
def test_derivatives_of_the_lobe_are_those_of_differences(n):
    """By the view, in a highlight, against the kernel in double precision."""
    view = np.array([0.6 / np.sqrt(n), 0.0, 1.0])
    light, step = [fotismos.PointLight((0, 0, 2), 1.0)], 1e-6 / np.sqrt(n)

    def at(vector_type, x):
        material = fotismos.Material(k_s=1, n=vector_type(n, n, n).x)
        return fotismos.shade(
            vector_type(0), vector_type(0, 0, 1), vector_type(x, 0, 1), material, light
        )

    expected = (
        at(Array3f64, float(view[0] + step))[0] - at(Array3f64, float(view[0] - step))[0]
    ) / (2 * step)
    x = Single(float(view[0]))
    dr.enable_grad(x)
    dr.backward(at(Array3f, x))
    assert dr.grad(x)[0] == pytest.approx(expected, rel=1e-3)


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
            expected = float(exact_cosine(form, normal, -toward, view) ** mpmath.mpf(n))
        sun = fotismos.DirectionalLight(tuple(toward), 1.0)
        material = fotismos.Material(k_s=1.0, n=n, form=form)
        place, *given = (Array3f(*map(float, each)) for each in ((0, 0, 0), normal, view))
        found = fotismos.shade(place, *given, material, [sun])
        assert abs(found[0] - expected) < 1e-4


def exact_cosine(form, *vectors):
    """The lobe's cosine of a normal, a light and a view, with mpmath's digits."""
    normal, light, view = (_exact_unit([mpmath.mpf(each) for each in vector]) for vector in vectors)
    if form == "phong":
        return 2 * _exact_dot(normal, light) * _exact_dot(normal, view) - _exact_dot(light, view)
    return _exact_dot(normal, _exact_unit([a + b for a, b in zip(light, view, strict=True)]))


def _exact_unit(vector):
    length = mpmath.sqrt(_exact_dot(vector, vector))
    return [each / length for each in vector]


def _exact_dot(a, b):
    return sum(x * y for x, y in zip(a, b, strict=True))


# --- Between the tested points ----------------------------------------------------------------

EXPONENTS = (1, 2, 2.5, 9, 33, 64, 65, 100.5, 128, 200, 333, 512, 513, 1e4, 1e6, 1e8, 1e10, 1e12)


def hostile_points(n, count, dtype):
    """Normals, lights and views: anywhere, near a highlight of ``n``, grazing, and opposed."""
    rng = np.random.default_rng(5)
    normal = rng.normal(size=(count, 3))
    up = _unit(normal)
    along = _unit(np.cross(up, rng.normal(size=(count, 3))))
    across = np.cross(up, along)

    def anywhere():
        height, turn = rng.uniform(0, 1, (count, 1)), rng.uniform(0, 2 * np.pi, (count, 1))
        flat = np.cos(turn) * along + np.sin(turn) * across
        return height * up + np.sqrt(1 - height**2) * flat

    low, other = 10.0 ** -rng.uniform(0, 6, (2, count, 1))
    other = np.where(rng.random((count, 1)) < 0.5, low, other)
    grazing = _unit(along + low * up)
    turn = rng.normal(size=(count, 1)) * low * rng.choice([0, 1, 10], (count, 1))
    kind = rng.integers(0, 4, (count, 1))
    light = np.where(kind >= 2, grazing, anywhere())
    mirrored = 2 * np.sum(up * light, axis=1, keepdims=True) * up - light
    width = min(np.sqrt(14 / n), 1) * np.where(kind == 3, low, 1)
    near = mirrored + width * rng.uniform(-1, 1, (count, 3))
    opposed = other * up - np.cos(turn) * along + np.sin(turn) * across
    view = np.select([kind == 0, kind == 2], [anywhere(), opposed], near)
    sizes = rng.uniform(0.1, 10, (3, count, 1))
    return [(v * s).astype(dtype) for v, s in zip((normal, light, view), sizes, strict=True)]


def lobe_exactly(normal, light, view, n, form):
    """The lobe, and ``N.L``, in extended precision."""
    normal, light, view = (_unit(each.astype(np.longdouble)) for each in (normal, light, view))
    incidence = np.sum(normal * light, axis=1)
    other, side = 2 * incidence[:, None] * normal - light, view
    if form == "blinn":
        other, side = _unit(light + view), normal
    chord = np.sum((other - side) ** 2, axis=1) / 2
    value = np.sum(other * side, axis=1)
    logarithm = np.where(chord < 0.5, np.log1p(-np.minimum(chord, 0.5)), np.log(value.clip(1e-99)))
    return np.where((value > 0) & (incidence > 0), np.exp(n * logarithm), 0), incidence


def _unit(vectors):
    return vectors / np.sqrt(np.sum(vectors**2, axis=1, keepdims=True))


def errors(n, form, count, vector_type):
    """The kernel's lobe, its relative errors where it exceeds 1e-3, 0 elsewhere; and the points."""
    dtype = np.float32 if vector_type is Array3f else np.float64
    points = hostile_points(n, count, dtype)
    exact, incidence = lobe_exactly(*points, np.longdouble(n), form)
    normal, light, view = (vector_type(*np.ascontiguousarray(each.T)) for each in points)
    material = fotismos.Material(k_s=1.0, n=n, form=form)
    lamp = fotismos.PointLight(light, 1.0)
    found = np.array(fotismos.shade(vector_type(0), normal, view, material, [lamp]), float)
    assert np.isfinite(found).all()
    # Closer to the horizon rounding decides the side.
    counts = (exact > 1e-3) & (incidence > 8 * np.finfo(dtype).eps)
    assert counts.sum() > count / 10
    return found, np.where(counts, np.abs(found - exact) / np.where(counts, exact, 1), 0), points


@pytest.mark.guarantee(
    "kernel", "Highlights are right to 1e-4 for any exponent, light and view; Blinn's to 3e-4."
)
@pytest.mark.parametrize("count", [40_000, pytest.param(400_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize(("form", "bound"), [("phong", 1e-4), ("blinn", 3e-4)])
def test_the_lobe_is_right_between_the_tested_points(form, bound, count):
    for n in EXPONENTS:
        assert errors(n, form, count, Array3f)[1].max() < bound, n


@pytest.mark.parametrize("count", [20_000, pytest.param(400_000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_in_double_precision_the_lobe_is_right_to_its_last_digits(form, count):
    """By 50 digits, where it is farthest from extended precision, which loses more than it."""
    for n in EXPONENTS:
        found, apart, points = errors(n, form, count, Array3f64)
        for row in np.argsort(apart)[-5:]:
            with mpmath.workdps(50):
                expected = exact_cosine(form, *(each[row] for each in points)) ** mpmath.mpf(n)
                assert abs(found[row] - expected) < 1e-12 * expected, (n, row)


@pytest.mark.parametrize("form", ["phong", "blinn"])
def test_the_way_to_the_light_keeps_its_digits_far_from_the_origin(form):
    """In double precision, by 50 digits: ``P_L - P`` has more than one double holds."""
    rng = np.random.default_rng(6)
    n = 1e12
    position, lamp, normal = 3 * rng.normal(size=(3, 40, 3))
    up, light = _unit(normal), _unit(lamp - position)
    normal = normal * np.sign(np.sum(up * light, axis=1, keepdims=True))
    view = 2 * np.sum(up * light, axis=1, keepdims=True) * up - light
    view = view + rng.uniform(-1, 1, (40, 3)) / np.sqrt(n)
    arrays = (Array3f64(*np.ascontiguousarray(each.T)) for each in (position, normal, view, lamp))
    *given, place = arrays
    material = fotismos.Material(k_s=1.0, n=n, form=form)
    found = np.array(fotismos.shade(*given, material, [fotismos.PointLight(place, 1.0)]))
    with mpmath.workdps(50):
        for row, value in enumerate(found):
            pairs = zip(lamp[row], position[row], strict=True)
            way = [mpmath.mpf(there) - mpmath.mpf(here) for there, here in pairs]
            expected = exact_cosine(form, normal[row], way, view[row]) ** mpmath.mpf(n)
            assert abs(value - expected) < 1e-12 * expected
