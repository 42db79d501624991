"""The kernel `heuristic.shade`: its values, what it compiles, and what it refuses."""

import drjit as dr
import drjit.llvm
import drjit.llvm.ad
import drjit.scalar
import numpy as np
import pytest

from heuristic import DirectionalLight, Material, PointLight, shade
from tests import checks, oracle

Float, Array3f = drjit.llvm.ad.Float, drjit.llvm.ad.Array3f

SINGLE = [drjit.llvm.ad.Array3f, drjit.llvm.Array3f]
DOUBLE = [drjit.llvm.ad.Array3f64, drjit.llvm.Array3f64]
WHITE = PointLight((1, 2, 3), 1.0)


def name_of(vector_type):
    return f"{vector_type.__module__.removeprefix('drjit.')}.{vector_type.__name__}"


@pytest.fixture
def points():
    """Position, normal and view of 256 points, in memory."""
    points = checks.random_points(256)
    arrays = [Array3f(a.T) for a in (points.position, points.normal, points.view)]
    dr.eval(arrays)
    return arrays


# --- Values ----------------------------------------------------------------------------------


@pytest.mark.parametrize("coefficients", checks.COEFFICIENTS)
@pytest.mark.parametrize("vector_type", SINGLE, ids=name_of)
def test_single_precision_agrees_with_the_oracle(vector_type, coefficients):
    checks.check_kernel(vector_type, 1e-5, coefficients)


@pytest.mark.parametrize("coefficients", checks.COEFFICIENTS)
@pytest.mark.parametrize("vector_type", DOUBLE, ids=name_of)
def test_double_precision_agrees_with_the_oracle(vector_type, coefficients):
    checks.check_kernel(vector_type, 1e-12, coefficients)


@pytest.mark.parametrize("n", [0, 1, 3, 37.5, 64, 65])
@pytest.mark.parametrize("opaque", [False, True], ids=["literal", "opaque"])
def test_every_way_of_giving_the_exponent_agrees_with_the_oracle(n, opaque):
    """A power multiplies the rounding of its base by ``n``: two steps of 2^-23 in ``R.V``."""
    single = max(1e-5, n * 2.0**-22)
    checks.check_kernel(drjit.llvm.ad.Array3f, single, n=n, opaque_n=opaque)
    checks.check_kernel(drjit.llvm.ad.Array3f64, 1e-12, n=n, opaque_n=opaque)


@pytest.mark.parametrize("coefficients", checks.COEFFICIENTS)
@pytest.mark.parametrize(
    ("vector_type", "tolerance"),
    [(drjit.scalar.Array3f, 1e-5), (drjit.scalar.Array3f64, 1e-12)],
    ids=["single", "double"],
)
def test_scalar_arrays_agree_with_the_oracle(vector_type, tolerance, coefficients):
    points = checks.random_points(50)
    lights = checks.tinted(checks.LIGHTS, checks.TINTS[coefficients])
    values = checks.COEFFICIENTS[coefficients]
    found = [
        np.atleast_1d(
            shade(
                *map(vector_type, triple),
                Material(**values, n=9),
                [checks.kernel_light(light) for light in lights],
                0.5,
            )
        )
        for triple in zip(points.position, points.normal, points.view, strict=True)
    ]
    expected = oracle.shade(
        points.position,
        points.normal,
        points.view,
        oracle.Material(**values, n=9),
        lights,
        0.5,
    )
    oracle.require_close(found, expected, absolute=tolerance)


def test_single_numbers_give_a_float_and_colours_one_component_each(points):
    assert dr.depth_v(shade(*points, Material(k_d=0.5), [WHITE])) == 1
    assert len(shade(*points, Material(k_d=(0.5, 0.4, 0.3)), [WHITE])) == 3
    assert len(shade(*points, Material(k_d=0.5), [PointLight((1, 2, 3), (1,) * 7)])) == 7


def test_light_adds_up_over_the_lights(points):
    """The model is linear in the lights (8.10), and emission and ambient count once."""
    material = Material(k_i=0.1, k_a=0.2, k_d=0.5, k_s=0.7, n=5)
    lights = [WHITE, PointLight((-3, 0, 1), 0.5, (0, 0, 1)), DirectionalLight((0, 0, -1), 0.25)]
    dark = shade(*points, material, [], 0.5)
    single = [np.array(shade(*points, material, [light], 0.5) - dark) for light in lights]
    total = np.array(shade(*points, material, lights, 0.5) - dark)
    np.testing.assert_allclose(total, sum(single), atol=1e-6)


def test_a_light_below_the_horizon_gives_nothing():
    """With the viewer on the mirror direction, which without the horizon's test would be white."""
    normal, light = Array3f(0, 0, 1), DirectionalLight((-1, 0, 1), 1.0)  # from below
    mirrored = Array3f(-1, 0, 1)
    assert shade(Array3f(0), normal, mirrored, Material(k_d=1, k_s=1, n=3), [light]) == 0
    above = DirectionalLight((1, 0, -1), 1.0)
    seen = shade(Array3f(0), normal, Array3f(1, 0, 1), Material(k_d=1, k_s=1, n=3), [above])
    assert dr.allclose(seen, np.cos(np.pi / 4) + 1)


@pytest.mark.parametrize("attenuation", [(1, 0, 0), (0, 0, 1)])
def test_a_point_on_the_light_itself_is_black_and_no_nan(attenuation):
    material = Material(k_d=1, k_s=1, n=0)
    light = PointLight((1, 2, 3), 1.0, attenuation)
    found = shade(Array3f(1, 2, 3), Array3f(0, 0, 1), Array3f(0, 0, 1), material, [light])
    assert dr.all(found == 0)


def test_a_directional_light_is_the_limit_of_a_point_light_far_away(points):
    material = Material(k_d=0.5, k_s=0.7, n=9)
    far = PointLight((3e5, 4e5, 0), 1.0)
    parallel = DirectionalLight((-3, -4, 0), 1.0)
    differences = np.array(shade(*points, material, [far]) - shade(*points, material, [parallel]))
    assert np.percentile(np.abs(differences), 99) < 1e-4


# --- What is compiled ------------------------------------------------------------------------


def only(kernels):
    assert len(kernels) == 1, [kernel["operation_count"] for kernel in kernels]
    return kernels[0]


@pytest.mark.parametrize("term", ["k_i", "k_a", "k_d", "k_s"])
def test_an_absent_term_leaves_no_instruction(points, kernel_history, term):
    """A zero coefficient gives the kernel of a material without it, and a smaller one."""
    ambient = dr.opaque(Float, 0.5)
    full = {"k_i": 0.1, "k_a": 0.2, "k_d": 0.5, "k_s": 0.7}
    without = {name: value for name, value in full.items() if name != term}

    def kernel(values):
        return only(
            kernel_history(lambda: shade(*points, Material(**values, n=3), [WHITE], ambient))
        )

    zero, absent, whole = kernel(full | {term: 0}), kernel(without), kernel(full)
    assert zero["hash"] == absent["hash"]
    assert zero["operation_count"] < whole["operation_count"]


def test_ambient_light_alone_computes_no_vector(points, kernel_history):
    ambient = dr.opaque(Float, 0.5)
    kernel = only(kernel_history(lambda: shade(*points, Material(k_a=0.3), [WHITE], ambient)))
    assert "sqrt" not in kernel["ir"].getvalue()
    assert kernel["input_count"] == 1
    lit = only(kernel_history(lambda: shade(*points, Material(k_d=0.3), [WHITE], ambient)))
    assert "sqrt" in lit["ir"].getvalue()


def test_diffuse_light_does_not_read_the_view(points, kernel_history):
    position, normal, _ = points
    unread = dr.opaque(Array3f, (1, 2, 3), shape=256)
    kernel = only(kernel_history(lambda: shade(position, normal, unread, Material(k_d=1), [WHITE])))
    seen = only(kernel_history(lambda: shade(position, normal, unread, Material(k_s=1), [WHITE])))
    assert kernel["input_count"] == seen["input_count"] - 3


def test_changing_an_opaque_value_compiles_nothing(points, kernel_history):
    def kernel(value):
        material = Material(
            k_d=dr.opaque(Float, value),
            k_s=dr.opaque(Array3f, (value, value, 0.5)),
            n=dr.opaque(Float, 10 * value),
        )
        lights = [
            PointLight(
                dr.opaque(Array3f, (1, 2, 3 + value)),
                dr.opaque(Float, 2 * value),
                tuple(dr.opaque(Float, k) for k in (value, value, 1.0)),
            ),
            DirectionalLight(dr.opaque(Array3f, (0, value, -1)), dr.opaque(Float, value)),
        ]
        return only(
            kernel_history(lambda: shade(*points, material, lights, dr.opaque(Float, value)))
        )

    first, second = kernel(0.25), kernel(0.75)
    assert second["hash"] == first["hash"]
    assert second["cache_hit"]


def test_opaque_attenuation_is_the_same_kernel_whatever_its_value(points, kernel_history):
    """Also at (1, 0, 0), for which plain numbers leave the whole factor out."""

    def kernel(coefficients):
        light = PointLight((1, 2, 3), 1.0, tuple(dr.opaque(Float, k) for k in coefficients))
        return only(kernel_history(lambda: shade(*points, Material(k_d=1), [light])))

    assert kernel((1, 0, 0))["hash"] == kernel((0, 0, 1))["hash"]


# --- Bad input -------------------------------------------------------------------------------


def test_what_lies_beyond_the_range_is_as_documented():
    """A NaN is passed on, and a sum of finite terms may be infinite."""
    place, up = Array3f(0), Array3f(0, 0, 1)
    assert np.isnan(shade(place, Array3f(np.nan, 0, 1), up, Material(k_d=1.0), [WHITE])[0])
    near = PointLight((0, 0, 1e-20), 1.0, (0, 0, 1))
    one, both = (shade(place, up, up, Material(k_d=1.0), [near] * count)[0] for count in (1, 2))
    assert np.isfinite(one)
    assert one > 1e38
    assert np.isinf(both)
