"""Each term of the model against its closed form, in single and double precision."""

import drjit as dr
import drjit.llvm.ad
import drjit.scalar
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from heuristic import terms, vectors

Single, Double = drjit.llvm.ad.Float, drjit.llvm.ad.Float64
Vector = drjit.scalar.Array3f64

FLOATS = pytest.mark.parametrize("float_type", [Single, Double], ids=["single", "double"])
COSINES = np.concatenate([np.linspace(-1, 1, 401), [1e-30, -1e-30, 1e-6, -1e-6]])

bounded = settings(max_examples=200, deadline=None)
components = st.floats(-10, 10, allow_nan=False)


def step(float_type):
    """One rounding step at 1."""
    return 2.0**-23 if float_type is Single else 2.0**-52


def require(found, expected, relative, absolute=0.0):
    np.testing.assert_allclose(np.array(found), expected, rtol=relative, atol=absolute)


@st.composite
def directions(draw):
    vector = np.array([draw(components) for _ in range(3)])
    length = np.linalg.norm(vector)
    assume(length > 1e-3)
    return Vector(*(vector / length))


# --- Specular light --------------------------------------------------------------------------


@FLOATS
@pytest.mark.parametrize("n", [0, 1, 2, 3, 9, 64, 65, 1000, 0.5, 37.25])
@pytest.mark.parametrize("opaque", [False, True], ids=["literal", "opaque"])
def test_specular_is_the_power_and_nothing_where_the_lobe_ends(float_type, n, opaque):
    """Within a few roundings of the base, which the power multiplies by ``n``."""
    base = np.array(float_type(COSINES), float)  # as rounded to the type
    exponent = dr.opaque(float_type, n) if opaque else n
    found = np.array(terms.specular(1.5, 0.5, float_type(COSINES), exponent), float)
    expected = np.zeros_like(base)
    expected[base > 0] = 0.75 * base[base > 0] ** n
    smallest = 1e-37 if float_type is Single else 1e-300  # below it, numbers lose digits
    big = expected > smallest
    tolerance = 8 * step(float_type) * max(n, 1)
    # exp2(n log2 c) has the rounding of its exponent: |n log2 c| steps, up to 127 or 1023.
    tolerance += 2 * step(float_type) * np.abs(np.log2(np.where(big, expected, 1)))
    assert np.all(np.abs(found - expected)[big] <= (tolerance * expected)[big])
    assert np.all(found[~big] <= 2 * smallest)
    assert not found[base <= 0].any()


# --- Vectors ---------------------------------------------------------------------------------


@bounded
@given(directions(), directions())
def test_the_mirror_vector_has_equal_angles_one_plane_and_unit_length(normal, toward):
    """The three demands from which 6.28-6.31 derive it."""
    mirrored = vectors.mirror_vector(normal, toward, dr.dot(normal, toward))
    assert abs(dr.dot(mirrored, normal) - dr.dot(toward, normal)) < 1e-14
    assert abs(dr.dot(dr.cross(toward, normal), mirrored)) < 1e-14
    assert abs(dr.norm(mirrored) - 1) < 1e-14
    # Of the two directions that satisfy them, it is the one on the other side of the normal.
    across = dr.cross(normal, toward)
    np.testing.assert_allclose(dr.cross(normal, mirrored), -np.array(across), atol=1e-14)


@FLOATS
def test_light_and_view_vectors_point_away_with_unit_length(float_type):
    vector_type = drjit.llvm.ad.Array3f if float_type is Single else drjit.llvm.ad.Array3f64
    rng = np.random.default_rng(2)
    position, light = (
        rng.normal(size=(3, 500)).astype(np.float32).astype(float) * scale for scale in (1, 8)
    )
    toward, distance = vectors.light_vector(vector_type(light), vector_type(position))
    length = np.linalg.norm(light - position, axis=0)
    tolerance = 8 * step(float_type)
    require(distance, length, tolerance)
    require(toward, (light - position) / length, tolerance, tolerance)
    require(
        vectors.view_vector(vector_type(light), vector_type(position)),
        (light - position) / length,
        tolerance,
        tolerance,
    )


def test_directions_that_do_not_exist_are_zero():
    here = drjit.llvm.ad.Array3f(1, 2, 3)
    toward, distance = vectors.light_vector(here, here)
    for vector in (toward, vectors.view_vector(here, here), vectors.normalise(here * 0)):
        np.testing.assert_array_equal(np.array(vector), np.zeros((3, 1)))
    assert dr.all(distance == 0)


# --- Attenuation and cone --------------------------------------------------------------------


@FLOATS
def test_attenuation_on_the_light_itself(float_type):
    """Where the polynomial is 0 the open form gives nothing, and the clamped one its limit 1."""
    assert dr.all(terms.attenuation(float_type(0), 0, 0, 1) == 0)
    assert dr.all(terms.clamped_attenuation(float_type(0), 0, 0, 1) == 1)
    require(terms.attenuation(float_type(0), 0.5, 0, 1), 2, 4 * step(float_type))


@bounded
@given(st.floats(0, 1e6), st.floats(0, 1e6), *[st.floats(0, 10)] * 3)
def test_clamped_attenuation_stays_within_0_and_1_and_never_rises(near, farther, c1, c2, c3):
    """The text at 8.6 wants ``0 <= f_att <= 1``."""
    assume(c1 + c2 + c3 > 0)
    first = terms.clamped_attenuation(near, c1, c2, c3)
    second = terms.clamped_attenuation(near + farther, c1, c2, c3)
    assert 0 <= second <= first <= 1


@FLOATS
def test_the_cone_holds_its_edge_and_nothing_beyond(float_type):
    """6.2 says ``>=``: a point at exactly the cutoff is lit."""
    edge = float_type(0.75)
    inside = np.array(terms.spot_cone(float_type([1, 0.7501, 0.75, 0.7499, 0, -1]), edge))
    np.testing.assert_array_equal(inside, [1, 1, 1, 0, 0, 0])
