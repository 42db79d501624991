"""The kernel `heuristic.shade`: its values, what it compiles, and what it refuses."""

import drjit as dr
import drjit.llvm
import drjit.llvm.ad
import drjit.scalar
import numpy as np
import pytest

from heuristic import DirectionalLight, Material, PointLight, SpotLight, shade, terms
from heuristic.errors import FotismosError, InputError
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


def test_a_light_on_the_horizon_gives_nothing():
    light = DirectionalLight((1, 0, 0), 1.0)
    material = Material(k_d=1, k_s=1, n=0)
    assert shade(Array3f(0), Array3f(0, 0, 1), Array3f(1, 0, 0), material, [light]) == 0


@pytest.mark.parametrize("attenuation", [(1, 0, 0), (0, 0, 1)])
def test_a_point_on_the_light_itself_is_black_and_no_nan(attenuation):
    material = Material(k_d=1, k_s=1, n=0)
    light = PointLight((1, 2, 3), 1.0, attenuation)
    found = shade(Array3f(1, 2, 3), Array3f(0, 0, 1), Array3f(0, 0, 1), material, [light])
    assert dr.all(found == 0)


def test_lengths_of_normal_and_view_do_not_matter(points):
    position, normal, view = points
    material = Material(k_d=0.5, k_s=0.7, n=9)
    short = shade(position, normal * 0.125, view * 8, material, [WHITE])
    np.testing.assert_allclose(short, shade(*points, material, [WHITE]), atol=2e-6)


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


@pytest.mark.parametrize(
    ("coefficient", "term"),
    [("k_i", "emission"), ("k_a", "ambient"), ("k_d", "diffuse"), ("k_s", "specular")],
)
def test_an_absent_term_is_not_even_traced(points, monkeypatch, coefficient, term):
    """Tracing takes time at every call, whatever Dr.Jit then makes of a product with 0."""

    def traced(*_):
        raise AssertionError(term)

    monkeypatch.setattr(terms, term, traced)
    values = {"k_i": 0.1, "k_a": 0.2, "k_d": 0.5, "k_s": 0.7}
    shade(*points, Material(**values | {coefficient: 0}), [WHITE], 0.5)
    with pytest.raises(AssertionError, match=term):
        shade(*points, Material(**values), [WHITE], 0.5)


def test_ambient_light_alone_computes_no_vector(points, kernel_history):
    ambient = dr.opaque(Float, 0.5)
    kernel = only(kernel_history(lambda: shade(*points, Material(k_a=0.3), [WHITE], ambient)))
    assert "sqrt" not in kernel["ir"].getvalue()
    assert kernel["input_count"] == 1
    lit = only(kernel_history(lambda: shade(*points, Material(k_d=0.3), [WHITE], ambient)))
    assert "sqrt" in lit["ir"].getvalue()


def test_ambient_light_of_plain_numbers_needs_no_kernel_at_all(points, kernel_history):
    assert kernel_history(lambda: shade(*points, Material(k_a=0.3), [WHITE], 0.5)) == []


def test_diffuse_light_does_not_read_the_view(points, kernel_history):
    position, normal, _ = points
    unread = dr.opaque(Array3f, (1, 2, 3), shape=256)
    kernel = only(kernel_history(lambda: shade(position, normal, unread, Material(k_d=1), [WHITE])))
    seen = only(kernel_history(lambda: shade(position, normal, unread, Material(k_s=1), [WHITE])))
    assert kernel["input_count"] == seen["input_count"] - 3


def test_an_unattenuated_light_computes_no_attenuation(points, kernel_history):
    material = Material(k_d=1)

    def size(attenuation):
        light = PointLight((1, 2, 3), 1.0, attenuation)
        return only(kernel_history(lambda: shade(*points, material, [light])))["operation_count"]

    assert size((1, 0, 0)) < size((1, 0, 1))


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


def test_attenuation_may_differ_from_point_to_point(points):
    k0 = dr.linspace(Float, 1, 4, 256)
    varying = shade(*points, Material(k_d=1), [PointLight((1, 2, 3), 1.0, (k0, 0, 0))])
    plain = shade(*points, Material(k_d=1), [PointLight((1, 2, 3), 1.0)])
    np.testing.assert_allclose(varying, np.array(plain) / np.array(k0), atol=1e-6)


# --- Bad input -------------------------------------------------------------------------------

BAD = [-0.1, float("nan"), float("inf"), (0.5, -1.0, 0.5), (0.5, float("nan"), 0.5)]


@pytest.mark.parametrize("value", BAD, ids=str)
@pytest.mark.parametrize("name", ["k_i", "k_a", "k_d", "k_s"])
def test_a_coefficient_that_is_negative_or_not_finite_is_refused(name, value):
    with pytest.raises(InputError, match=rf"^{name} = .*finite values of 0 or more"):
        Material(**{name: value})


@pytest.mark.parametrize("n", [-1, -0.5, float("nan"), float("inf")])
def test_an_exponent_that_is_negative_or_not_finite_is_refused(n):
    with pytest.raises(InputError, match=r"^n = .*finite and 0 or more"):
        Material(n=n)


@pytest.mark.parametrize("value", ["red", None, {"r": 1}], ids=str)
def test_a_coefficient_that_is_no_number_is_refused(value):
    with pytest.raises(InputError, match=r"^k_d = .*give"):
        Material(k_d=value)


@pytest.mark.parametrize("value", BAD, ids=str)
def test_an_intensity_that_is_negative_or_not_finite_is_refused(value):
    lights = [
        lambda: PointLight((0, 0, 0), value),
        lambda: DirectionalLight((0, 0, 1), value),
        lambda: SpotLight((0, 0, 0), (0, 0, 1), value, 30),
    ]
    for light in lights:
        with pytest.raises(InputError, match=r"^intensity = .*finite values of 0 or more"):
            light()


@pytest.mark.parametrize("direction", [(0, 0, 0), (0, 0), (0, float("nan"), 1), "down"], ids=str)
def test_a_direction_that_points_nowhere_is_refused(direction):
    for light in (
        lambda: DirectionalLight(direction, 1.0),
        lambda: SpotLight((0, 0, 0), direction, 1.0, 30),
    ):
        with pytest.raises(InputError, match=r"^direction = .*(any other length|three finite)"):
            light()


@pytest.mark.parametrize("cutoff", [0, -5, 180, 200, float("nan")])
def test_a_cutoff_outside_its_range_is_refused(cutoff):
    with pytest.raises(InputError, match=r"^cutoff = .*between 0 and 180"):
        SpotLight((0, 0, 0), (0, 0, 1), 1.0, cutoff)


@pytest.mark.parametrize("exponent", [-1, float("nan"), float("inf")])
def test_a_spot_exponent_outside_its_range_is_refused(exponent):
    with pytest.raises(InputError, match=r"^exponent = .*0 or more"):
        SpotLight((0, 0, 0), (0, 0, 1), 1.0, 30, exponent)


@pytest.mark.parametrize(
    "attenuation", [(0, 0, 0), (-1, 0, 1), (1, float("nan"), 0), (1, 0), (1, 0, 0, 0)], ids=str
)
def test_an_attenuation_that_is_no_three_allowed_numbers_is_refused(attenuation):
    with pytest.raises(InputError, match=r"^attenuation = .*k0, k1, k2"):
        PointLight((0, 0, 0), 1.0, attenuation)


def test_mixed_numbers_of_wavelengths_are_refused_by_name(points):
    material = Material(k_d=(0.5, 0.4, 0.3))
    light = PointLight((0, 0, 1), (1, 1, 1, 1, 1))
    with pytest.raises(InputError, match=r"k_d has 3, lights\[0\]\.intensity has 5"):
        shade(*points, material, [light])


def test_a_bad_ambient_intensity_is_refused(points):
    with pytest.raises(InputError, match=r"^ambient = -1"):
        shade(*points, Material(k_a=0.5), [], -1)


def test_errors_are_of_the_projects_own_kind():
    assert issubclass(InputError, FotismosError)
    assert InputError.exit_code == 2
