"""The kernel `fotismos.heuristic.shade`: its values, what it compiles, and what it refuses."""

import drjit as dr
import drjit.llvm
import drjit.llvm.ad
import drjit.scalar
import numpy as np
import pytest

from fotismos.heuristic import DirectionalLight, Material, PointLight, shade
from tests.shared import checks

Float, Array3f = drjit.llvm.ad.Float, drjit.llvm.ad.Array3f

WHITE = PointLight((1, 2, 3), 1.0)


@pytest.fixture
def points():
    """Position, normal and view of 256 points, in memory."""
    points = checks.random_points(256)
    arrays = [Array3f(a.T) for a in (points.position, points.normal, points.view)]
    dr.eval(arrays)
    return arrays


@pytest.mark.parametrize("coefficients", checks.COEFFICIENTS)
@pytest.mark.parametrize("module", [drjit.llvm.ad, drjit.llvm, drjit.scalar])
def test_arrays_agree_with_the_oracle(module, coefficients):
    checks.check_kernel(module.Array3f, 1e-5, coefficients)
    checks.check_kernel(module.Array3f64, 1e-12, coefficients)


def test_single_numbers_give_a_float_and_colours_one_component_each(points):
    assert dr.depth_v(shade(*points, Material(k_d=0.5), [WHITE])) == 1
    assert len(shade(*points, Material(k_d=(0.5, 0.4, 0.3)), [WHITE])) == 3
    assert len(shade(*points, Material(k_d=0.5), [PointLight((1, 2, 3), (1,) * 7)])) == 7


@pytest.mark.parametrize("attenuation", [(1, 0, 0), (0, 0, 1)])
def test_a_point_on_the_light_itself_is_black_and_no_nan(attenuation):
    material = Material(k_d=1, k_s=1, n=0)
    light = PointLight((1, 2, 3), 1.0, attenuation)
    found = shade(Array3f(1, 2, 3), Array3f(0, 0, 1), Array3f(0, 0, 1), material, [light])
    assert dr.all(found == 0)


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


def test_what_lies_beyond_the_range_is_as_documented():
    """A NaN is passed on, and a sum of finite terms may be infinite."""
    place, up = Array3f(0), Array3f(0, 0, 1)
    assert np.isnan(shade(place, Array3f(np.nan, 0, 1), up, Material(k_d=1.0), [WHITE])[0])
    near = PointLight((0, 0, 1e-20), 1.0, (0, 0, 1))
    one, both = (shade(place, up, up, Material(k_d=1.0), [near] * count)[0] for count in (1, 2))
    assert np.isfinite(one)
    assert one > 1e38
    assert np.isinf(both)
