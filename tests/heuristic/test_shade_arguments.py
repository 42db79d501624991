"""What `fotismos.shade` takes, what it refuses in words, and that its gradients are finite."""

from itertools import product

import drjit as dr
import drjit.scalar
import numpy as np
import pytest
from drjit.llvm.ad import Array2f, Array3f, Array3f16, Array3f64, Array3i, Array4f, Float, TensorXf

from fotismos.heuristic import DirectionalLight, Material, PointLight, SpotLight, shade
from fotismos.heuristic.errors import InputError

UP = (0.0, 0.0, 1.0)
LAMP = PointLight((0, 0, 3), 1.0)
GREY = Material(k_a=0.1, k_d=0.5, k_s=0.3, n=8)


def points(count=3):
    return Array3f(np.linspace(0, 1, count), 0, 0)


def shaded(position=None, normal=UP, view=UP, material=GREY, lights=(LAMP,), **more):
    position = points() if position is None else position
    return shade(position, normal, view, material, lights, **more)


ACCEPTED = {
    "a tuple": UP,
    "a list": list(UP),
    "a NumPy array": np.array(UP),
    "integers": (0, 0, 1),
    "one point": Array3f(UP),
    "half precision": Array3f16(UP),
    "whole numbers": Array3i(0, 0, 1),
    "scalars": drjit.scalar.Array3f(UP),
    "double precision": Array3f64(UP),
}


def test_a_vector_may_be_given_in_any_of_these_forms():
    expected = np.array(shaded(normal=Array3f(UP), view=Array3f(UP)))
    for name in ("normal", "view"):
        for form, given in ACCEPTED.items():
            value = np.array(shaded(**{name: given}))
            np.testing.assert_allclose(value, expected, rtol=1e-6, err_msg=form)
    for narrow in (Array3f16, Array3i):  # are computed in single precision
        value = shaded(narrow(0, 0, 0), narrow(0, 0, 1), narrow(0, 0, 1))
        assert type(value) is Float
        assert value[0] == pytest.approx(0.8)
    number = np.float32(2)
    spot, same = (SpotLight((0, 0, 3), (0, 0, -1), n, 20 * n, n) for n in (number, 2))
    value = shaded(material=Material(k_d=0.1 * number, n=number), lights=[spot])
    other = shaded(material=Material(k_d=0.2, n=2), lights=[same])
    np.testing.assert_allclose(np.array(value), np.array(other), rtol=1e-6)


REFUSED_VECTORS = [
    None, "up", 1.0, np.zeros((5, 3)), np.zeros((3, 5)), [[0, 0, 1]] * 3, (0, 1), ["0", "0", "1"],
    Array2f(0, 1), Array4f(0, 0, 1, 0), Float(1), TensorXf(np.zeros((3, 4))), object(), points(4),
    dr.zeros(Array3f, 0),
]  # fmt: skip
REFUSED_REST = [
    ({"material": None}, "material"),
    ({"material": {"k_d": 1}}, "material"),
    ({"lights": LAMP}, "lights is .*give a list"),
    ({"lights": "sun"}, "lights"),
    ({"lights": [LAMP, [LAMP]]}, r"lights\[1\]"),
    ({"lights": [PointLight]}, r"lights\[0\]"),
    ({"lights": [PointLight((0, 0, 3), Float([1, 2]))]}, r"position has 3, lights\[0\].intensity"),
    ({"lights": [PointLight(UP, (1,) * 5)], "material": Material(k_d=(0.5, 0.4, 0.3))},
     r"k_d has 3, lights\[0\]\.intensity has 5"),
    ({"lights": [PointLight(UP, (1,) * 3, specular_intensity=(1,) * 5)]},
     r"lights\[0\]\.intensity has 3, lights\[0\]\.specular_intensity has 5"),
    ({"material": Material(k_d=Float([1, 2]))}, "position has 3, k_d has 2"),
    ({"ambient": Float([1, 2, 3, 4])}, "ambient has 4"),
    ({"ambient": -1}, "^ambient = -1"),
    ({"ambient": ["a", "b"]}, "ambient"),
]  # fmt: skip


def test_any_other_argument_is_refused_by_name():
    for name in ("position", "normal", "view"):
        for given in REFUSED_VECTORS:
            words = {"position": points(), "normal": points(), "view": points()} | {name: given}
            with pytest.raises(InputError, match=name):
                shade(**words, material=GREY, lights=[LAMP])
    with pytest.raises(InputError, match="none of them"):
        shade(UP, UP, UP, GREY, [LAMP])
    for words, message in REFUSED_REST:
        with pytest.raises(InputError, match=message):
            shaded(**words)


NAN, INFINITY = float("nan"), float("inf")
ODD = [None, "x", object(), [1, [2]], ["a"], 1j, {1: 2}, 10**400, NAN, -1, (), Array2f(1)]
BAD = [-0.1, NAN, INFINITY, (0.5, -1.0, 0.5), (0.5, NAN, 0.5)]
MADE = {
    "n = .*finite and 0 or more": (lambda odd: Material(n=odd), [*ODD, -INFINITY, 1e39, 10**39]),
    "form = ": (lambda odd: Material(form=odd), ODD),
    "normalised = ": (lambda odd: Material(normalised=odd), ODD),
    "k_d = ": (lambda odd: Material(k_d=odd), [*ODD[:-1], *BAD, "red"]),
    "k_i = .*finite values of 0 or more": (lambda odd: Material(k_i=odd), BAD),
    "k_a = .*finite values of 0 or more": (lambda odd: Material(k_a=odd), BAD),
    "k_s = .*finite values of 0 or more": (lambda odd: Material(k_s=odd), BAD),
    "intensity = ": (lambda odd: PointLight(UP, odd), [*ODD[:-1], *BAD]),
    "diffuse_intensity = ": (
        lambda odd: DirectionalLight(UP, 1, diffuse_intensity=odd), [*ODD[1:-1], *BAD],
    ),
    "specular_intensity = ": (lambda odd: SpotLight(UP, UP, 1, 30, specular_intensity=odd), BAD),
    "position": (lambda odd: PointLight(odd, 1), ODD),
    "attenuation = .*k0, k1, k2": (
        lambda odd: PointLight(UP, 1, odd),
        [*ODD, (0, 0, 0), (-1, 0, 1), (1, NAN, 0), (1, 0), (1, 0, 0, 0)],
    ),
    "clamped = ": (lambda odd: PointLight(UP, 1, clamped=odd), ODD),
    "direction": (lambda odd: DirectionalLight(odd, 1), [*ODD, (0, 0, 0), (0, 0), (0, NAN, 1)]),
    "cutoff = .*between 0 and 180": (
        lambda odd: SpotLight(UP, UP, 1, odd), [*ODD, 0, -5, 180, 200, INFINITY],
    ),
    "exponent = .*0 or more": (lambda odd: SpotLight(UP, UP, 1, 30, odd), [*ODD, INFINITY, 1e39]),
}  # fmt: skip


def test_odd_values_are_refused_where_a_material_or_light_is_made():
    for message, (make, values) in MADE.items():
        for odd in values:
            with pytest.raises(InputError, match=f"^{message}"):
                make(odd)


WHERE = {
    "a zero normal": {"normal": (0, 0, 0)},
    "a zero view": {"view": (0, 0, 0)},
    "at the light": {"lamp": (0, 0, 0)},
    "all of them": {"normal": (0, 0, 0), "view": (0, 0, 0), "lamp": (0, 0, 0)},
    "the mirror direction": {"view": UP},
    "a light behind": {"lamp": (0, 0, -2)},
    "a light on the horizon": {"lamp": (2, 0, 0)},
}
LIGHTS = {
    "even": lambda place, axis, power: PointLight(place, power),
    "inverse square": lambda place, axis, power: PointLight(place, power, (0, 0, 1)),
    "clamped": lambda place, axis, power: PointLight(place, power, (0, 0, 1), clamped=True),
    "spot": lambda place, axis, power: SpotLight(place, axis, power, 40, 2.5, (0, 0, 1)),
    "parallel": lambda place, axis, power: DirectionalLight(axis, power),
}


@pytest.mark.guarantee(
    "kernel", "Gradients are finite for zero vectors and for a point on a light."
)
@pytest.mark.parametrize("where", WHERE.values(), ids=WHERE.keys())
@pytest.mark.parametrize("make", LIGHTS.values(), ids=LIGHTS.keys())
def test_gradients_are_finite_wherever_a_direction_is_missing(where, make):
    for vector, n, form, is_plain in product(
        (Array3f, Array3f64), (0, 2, 0.5, 1e5), ("phong", "blinn"), (True, False)
    ):
        number = dr.value_t(vector)
        given = {"normal": UP, "view": (0, 0.3, 1), "lamp": (0, 0, 2)} | where
        leaves = {name: vector(*value) for name, value in given.items()}
        leaves |= {"position": vector(0, 0, 0), "axis": vector(0, 0, -1)}
        leaves |= {"power": number(9), "k_d": number(0.5), "k_s": number(0.4)}
        leaves |= {"n": number(n)}
        dr.enable_grad(leaves)
        given = {name: leaves[name] for name in ("k_d", "k_s", "n")}
        material = Material(**given | ({"n": n} if is_plain else {}), form=form)
        light = make(leaves["lamp"], leaves["axis"], leaves["power"])
        value = shade(leaves["position"], leaves["normal"], leaves["view"], material, [light])
        dr.backward(value, flags=dr.ADFlag.Default | dr.ADFlag.AllowNoGrad)
        assert np.isfinite(np.array(value)).all()
        for name, leaf in leaves.items():
            assert np.abs(np.array(dr.grad(leaf))).max() < 1e4, (name, vector, n, form)


def test_the_largest_exponent_is_an_ordinary_one_and_none_is_a_mirror_by_rounding():
    """A larger one would be infinite in single precision; the message says what `inf` is."""
    message = r"^n = 3\.5e\+38 is not allowed: .*at most 3\.4e\+38; inf makes a mirror\.$"
    with pytest.raises(InputError, match=message):
        Material(n=3.5e38)
    assert Material(n=10**20).n == 1e20
    for vector, form in product((Array3f, Array3f64), ("phong", "blinn")):
        given = vector(0), vector(0, 0, 1), vector(0, [0, 1e-3], 1)
        material = Material(k_s=1, n=3.4e38, form=form)
        value = shade(*given, material, [PointLight((0, 0, 2), 1)])
        assert np.array(value).tolist() == [1, 0]


@pytest.mark.guarantee("kernel", "Gradients are finite at any distance from a light.")
@pytest.mark.parametrize("make", LIGHTS.values(), ids=LIGHTS.keys())
@pytest.mark.parametrize("vector", [Array3f, Array3f64], ids=["single", "double"])
def test_gradients_are_finite_at_any_distance(vector, make):
    """The derivative of ``1 / d^2`` exceeds all floats long before the value does."""
    exponents = range(-36, 13) if vector is Array3f else range(-300, 101, 4)
    scale = dr.value_t(vector)(10.0 ** np.array(exponents))
    for n, form in product((2, 0.5, 1e5), ("phong", "blinn")):
        leaves = {"lamp": vector(0.6, 0, 0.8) * scale, "position": vector(0)}
        leaves |= {"normal": vector(0, 0, 1), "view": vector(-0.6, 0.1, 0.8)}
        leaves |= {"axis": vector(0, 0, -1), "power": dr.value_t(vector)(9)}
        leaves = {name: leaf + 0 * scale for name, leaf in leaves.items()}
        dr.enable_grad(leaves)
        material = Material(k_d=0.5, k_s=0.4, n=n, form=form)
        light = make(leaves["lamp"], leaves["axis"], leaves["power"])
        value = shade(leaves["position"], leaves["normal"], leaves["view"], material, [light])
        dr.backward(value, flags=dr.ADFlag.Default | dr.ADFlag.AllowNoGrad)
        for name, leaf in leaves.items():
            assert np.isfinite(np.array(dr.grad(leaf))).all(), (name, n, form)
        if make in (LIGHTS["inverse square"], LIGHTS["spot"]):
            # `1 / d^2` falls with the square, its derivative with the cube, unless it is left out.
            steep = 5e-11 if vector is Array3f else 1e-100
            found = np.array(dr.grad(leaves["lamp"]).z, float)[np.array(exponents) < 11]
            near = 10.0 ** np.array(exponents)[np.array(exponents) < 11]
            assert not found[near < steep].any()
            near, found = near[near > steep], found[near > steep]
            np.testing.assert_allclose(
                near * (near * (near * found)), found[near == 1][0], rtol=1e-3
            )
