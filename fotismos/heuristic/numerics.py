"""Powers, lengths and sums that keep their digits where the textbook's formulas lose them.

All functions take floats of any type: Dr.Jit arrays of single or double precision, or plain
numbers. No function makes a NaN from finite values. Numbers below the type's smallest normal float
count as zero, as they do in Dr.Jit's threads.

The module rests on three ideas:

- A cosine near 1 travels with its *complement* ``1 - c``, which rounding would swallow. Then
  ``c^n = 2^(n log2(1 - (1 - c)))`` is as accurate as the complement is, for every ``n``.
- Vectors are scaled by a power of two before they are squared, which rounds nothing.
- A running sum carries what its last addition lost (Kahan 1965, as improved by Neumaier 1974), and
  so do vectors where double precision itself is not enough (Dekker 1971).
"""

import sys
from collections.abc import Sequence
from math import factorial, inf, log2, nan
from numbers import Integral, Real
from typing import Any, NamedTuple

import drjit as dr

from fotismos.heuristic.convention import Array, Cosines, Direction, Number, Vector

LARGEST_LITERAL_EXPONENT = 64
"""Up to here an integer exponent is multiplied out: at most 11 products and an error of ``n``
rounding steps, in place of the logarithm, exponential and branch of a general power."""

MODERATE_EXPONENTS = (2, 512)
"""Exponents for which unit vectors in the kernel's precision are enough. Rounding turns them by a
few steps of 2^-24. Where the highlight has fallen to 1e-3 of its peak, at ``sqrt(14 / n)`` from the
middle, that changes it by ``sqrt(14 n)`` times as much: within 4e-5 for these, and as much for the
products of a literal exponent, which multiply the rounding of the cosine by ``n``. For others, and
for exponents unknown when the kernel is traced, the vectors have double precision. Below 2 the
small cosines need it: ``c^n > 1e-3`` reaches down to ``c = 10^(-3/n)``."""


LARGEST_EXPONENT = 2.0**128 - 2.0**104
"""The largest number of single precision, 3.4e38: a larger exponent would round to infinity, which
is a mirror (:func:`fotismos.heuristic.terms.mirror`)."""


class Cosine(NamedTuple):
    """The cosine ``c`` of an angle, with ``1 - c`` and, if needed, ``1 + c``."""

    value: object
    complement: object
    supplement: object = None


def plain(value: Any) -> Any:
    """Return a number as a Python int or float, a Dr.Jit float unchanged, and otherwise None.

    NumPy's numbers and fractions count as numbers; those beyond all floats become NaN.
    """
    if dr.is_array_v(value):
        return value if dr.depth_v(value) == 1 and dr.is_jit_v(value) else None
    if isinstance(value, Integral):
        value = int(value)
        if abs(value) < 2**63:
            return value
        return float(value) if abs(value) <= sys.float_info.max else nan
    return float(value) if isinstance(value, Real) else None


def is_moderate(n: Number) -> bool:
    """Return whether an exponent is a plain number within :data:`MODERATE_EXPONENTS`."""
    return isinstance(n, Real) and MODERATE_EXPONENTS[0] <= float(n) <= MODERATE_EXPONENTS[1]


def cosine_of_degrees(angle: Number) -> Cosine:
    """Return the :class:`Cosine` of an angle in degrees, a plain number or a Dr.Jit float.

    ``1 - c = 2 sin^2(a / 2)`` and ``1 + c = 2 cos^2(a / 2)``, accurate near 0 and near 180 degrees.
    """
    sine, cosine = dr.sincos(dr.deg2rad(angle) * 0.5)
    return Cosine(1 - 2 * sine * sine, 2 * sine * sine, 2 * cosine * cosine)


def power(cosine: Cosines, n: Number) -> Number:
    """Return ``c ** n`` where the cosine is positive, and 0 elsewhere, also for ``n = 0``.

    The cosine is a float, or a :class:`Cosine` whose complement is more accurate than ``1 - c``.
    ``n`` is 0 or more: a plain number, compiled in, or a Dr.Jit float. A Python integer up to
    :data:`LARGEST_LITERAL_EXPONENT` becomes products, three times faster than the general power.
    """
    if not isinstance(cosine, Cosine):
        cosine = Cosine(cosine, 1 - cosine)
    value = cosine.value
    lobe = value >= smallest(value)
    if isinstance(n, int) and n <= LARGEST_LITERAL_EXPONENT:
        return dr.power(at_least(value, 0), n) if n > 0 else dr.select(lobe, 1.0, 0.0)
    value = at_least(value, smallest(value))  # nothing becomes infinite outside the lobe either
    complement = at_least(cosine.complement, 0)
    return dr.select(lobe, exp2(n * log2_of(value, complement)), 0)


def log2_of(value: Any, complement: Number) -> Number:
    """Return ``log2(c)`` of a cosine in (0, 1] from ``c`` and ``1 - c``, each accurate in itself.

    Within two rounding steps of the result. In single precision: ``c = 2^e m`` with ``m`` between
    the roots of 1/2 and 2, and a polynomial in ``m - 1``, which is ``-(1 - c)`` itself where ``e =
    0``. Otherwise ``log1p`` after Kahan: ``log(w) x / (w - 1)`` with ``w`` the rounded ``1 + x``.
    """
    if _is_single(value):
        # `e` and `2^-e` by integer arithmetic on the bits of the float.
        bits = dr.reinterpret_array(dr.int32_array_t(type(value)), dr.detach(value))
        exponent = (bits - _BITS_OF_ROOT_HALF) >> 23
        to_mantissa = dr.reinterpret_array(type(value), (127 - exponent) << 23)
        rest = dr.select(exponent == 0, -complement, dr.fma(value, to_mantissa, -1))
        return dr.fma(rest, _polynomial(rest, _LOG2), type(value)(exponent))
    # Any other type: Kahan's `log1p`.
    rounded = 1 - complement
    is_far = complement > 0.5
    is_same = rounded == 1
    # Where `w` is 1 the divisor is 1 too, only to avoid 0 / 0.
    quotient = dr.select(is_far | is_same, 1, complement / dr.select(is_same, 1, 1 - rounded))
    logarithm = dr.log2(dr.select(is_far, value, rounded)) * quotient
    return dr.select(is_same, -complement / _LN_2, logarithm)


def exp2(x: Number) -> Number:
    """Return ``2^x`` for ``x <= 0``, 0 where that is below the smallest normal float.

    Within two rounding steps. In single precision: ``2^i 2^f`` with a polynomial in
    ``|f| <= 1/2``; ``i`` is found by adding 1.5 * 2^23, which leaves it in the lowest bits.
    """
    if not _is_single(x):
        # Dr.Jit's own is -inf from -1024 to -1023.5.
        return dr.select(x >= -1022, dr.exp2(at_least(x, -1022)), 0)
    x = at_least(x, -127)
    # Derivatives come from the polynomial, so the bits are taken without any.
    shifted = dr.detach(x) + _ROUNDER
    bits = dr.reinterpret_array(dr.int32_array_t(type(x)), shifted)
    # `2^i` from its exponent's bits; for `i = -127` they are all 0, and so is the float.
    scale = dr.reinterpret_array(type(x), (bits + 127) << 23)
    return _polynomial(x - (shifted - _ROUNDER), _EXP2) * scale


def one_less_exp2(x: Number) -> Number:
    """Return ``1 - 2^-x`` for ``x >= 0``, accurate relative to the result where ``x`` is small.

    Below ``x = 1/2`` it is the series of the exponential function, within 1e-9.
    """
    y = x * _LN_2
    series = y * _polynomial(-y, [1 / factorial(k) for k in range(1, 9)])
    return dr.select(x < 0.5, series, 1 - exp2(-x))


def scaled(vector: Vector) -> tuple[Vector, Number, Number]:
    """Return a vector over a power of two near its length, that power's inverse, and its square.

    The returned square lies between 1/8 and 8, or well within the type's range for lengths at its
    ends; for the zero vector it is 0.
    """
    square = dr.squared_norm(vector)
    # The factor is piecewise constant, so it has no derivative.
    inverse = _inverse_root_power(dr.detach(square))
    vector = vector * inverse
    return vector, inverse, dr.squared_norm(vector)


def inverse_root(square: Number) -> Number:
    """Return ``1 / sqrt(square)``, finite where ``square`` is 0."""
    return dr.rsqrt(at_least(square, smallest(square)))


def inverse_length(square: Number) -> Number:
    """Return ``1 / sqrt(square)``, and 0 where ``square`` is 0.

    The derivative at the zero vector is zero, too; that of a large number times zero would overflow
    once light is added to it.
    """
    return dr.select(square >= smallest(square), inverse_root(square), 0)


def at_least(value: Any, low: Number) -> Number:
    """Return the larger of two, and NaN for NaN.

    This form is one instruction; ``dr.maximum`` is four, because it distinguishes -0 from 0.
    """
    return dr.select(value < low, low, value)


def at_most(value: Any, high: Number) -> Number:
    """Return the smaller of two, and NaN for NaN."""
    return dr.select(value > high, high, value)


def is_number(value: Any, number: float) -> bool:
    """Return whether a value is a plain number equal to ``number``; Dr.Jit arrays are not read."""
    return isinstance(value, Real) and value == number


def epsilon(value: Any) -> float:
    """Return the rounding step at 1 of a value's type."""
    return 2 * dr.epsilon(value) if dr.is_array_v(value) else sys.float_info.epsilon


def smallest(value: Any) -> float:
    """Return the smallest normal float of a value's type."""
    return dr.smallest(value) if dr.is_array_v(value) else sys.float_info.min


def largest(value: Any) -> float:
    """Return the largest float of a value's type."""
    return dr.largest(value) if dr.is_array_v(value) else sys.float_info.max


def wide(value: Any) -> Array:
    """Return a Dr.Jit array of single precision in double precision; anything else unchanged."""
    return dr.float64_array_t(type(value))(value) if dr.is_array_v(value) else value


def wide_unit(vector: Vector) -> Direction:
    """Return a vector in double precision with length 1 to 1e-13, and zero for zero."""
    scaled_vector, _, square = scaled(vector)
    root = inverse_length(square)
    if not _is_single(vector):
        return scaled_vector * root
    vector = wide(scaled_vector)
    return vector * refined_inverse(dr.squared_norm(vector), wide(root))


def refined_inverse(square: Number, estimate: Number) -> Number:
    """Return ``1 / sqrt(square)`` in double precision, from an estimate that is right to 1e-7.

    One step of Newton: half the time of a root in double precision, and wrong by 1e-13.
    """
    return estimate * dr.fma(-0.5 * square * estimate, estimate, 1.5)


Compensated = tuple[Array, Array]
"""A sum, and what its rounding lost."""


def add(total: Compensated, term: Array) -> Compensated:
    """Return ``total + term``, and what the sum's rounding took away besides what was lost before.

    The pair ``value, lost`` stands for ``value + lost`` (Neumaier). Start with ``0, 0``.
    """
    value, lost = total
    result = value + term
    back = result - value
    # Knuth's exact form does not need to know which of the two is larger.
    return result, lost + ((value - (result - back)) + (term - back))


def summed(total: Compensated) -> Array:
    """Return ``value + lost``; for a sum beyond the type's range ``lost`` is not a number."""
    value, lost = total
    if is_number(lost, 0):
        return value
    return value + dr.select(dr.isfinite(lost), lost, 0)


def exact_product(a: Array, b: Array) -> Compensated:
    """Return ``a b``, and what its rounding lost."""
    product = a * b
    return product, dr.fma(a, b, -product)


def exact_dot(a: Compensated, b: Compensated) -> Compensated:
    """Return the scalar product of two vectors with twice the digits of their type."""
    product, lost = exact_product(a[0], b[0])
    total: Compensated = product.x, lost.x
    for term, rest in ((product.y, lost.y), (product.z, lost.z)):
        value, error = add(total, term)
        total = value, error + rest
    value, error = total
    return value, error + dr.dot(a[0], b[1]) + dr.dot(a[1], b[0])


def exact_unit(vector: Compensated) -> Compensated:
    """Return a vector over its length with twice the digits of its type, and zero for zero."""
    scaled_vector, factor, estimate = scaled(vector[0])
    rest = vector[1] * factor
    root = inverse_length(estimate)
    square, lost = exact_dot((scaled_vector, rest), (scaled_vector, rest))
    # What the estimate lacks, `1 - root^2 square`: one step of Newton in the lost digits.
    power, power_lost = exact_product(root, root)
    product, product_lost = exact_product(power, square)
    lacks = (1 - product) - product_lost - power_lost * square - power * lost
    unit, unit_lost = exact_product(scaled_vector, root)
    return unit, unit_lost + rest * root + unit * (0.5 * lacks)


def inverse_of_power(power_of_two: Number) -> Number:
    """Return the inverse of a power of two, without a division."""
    if not _is_single(power_of_two):
        return 1 / power_of_two
    # The biased exponents of `2^e` and `2^-e` add up to 254, in the bits 0x7F000000.
    bits = dr.reinterpret_array(dr.uint32_array_t(type(power_of_two)), power_of_two)
    return dr.reinterpret_array(type(power_of_two), 0x7F000000 - bits)


def is_double(value: Any) -> bool:
    """Return whether a value is an array of the JIT in double precision."""
    return bool(dr.is_jit_v(value) and dr.itemsize_v(value) == 8)


def _is_single(value: Any) -> bool:
    return bool(dr.is_jit_v(value) and dr.itemsize_v(value) == 4)


def _inverse_root_power(square: Number) -> Number:
    """Return a power of two near ``1 / sqrt(square)``, by halving the bits of the exponent.

    Any power of two will do, so an overflowed or vanished square is not a special case.
    """
    if not dr.is_jit_v(square):
        usable = 0 < square < inf
        return 2.0 ** (-round(log2(square) / 2)) if usable else 2.0 ** (-513 if square else 511)
    # The constants of the fast inverse square root; the mask keeps the exponent alone.
    if _is_single(square):
        integer = dr.uint32_array_t(type(square))
        magic = 0x5F3759DF
        mask = 0x7F800000
    else:
        integer = dr.uint64_array_t(type(square))
        magic = 0x5FE6EB50C7B537A9
        mask = 0x7FF0000000000000
    bits = dr.reinterpret_array(integer, square)
    return dr.reinterpret_array(type(square), (integer(magic) - (bits >> 1)) & mask)


def _polynomial(x: Number, coefficients: Sequence[float]) -> Number:
    """Return ``c0 + c1 x + c2 x^2 + ...`` by Horner's scheme."""
    value = type(x)(coefficients[-1])
    for coefficient in reversed(coefficients[:-1]):
        value = dr.fma(value, x, coefficient)
    return value


_LN_2 = 0.6931471805599453
_BITS_OF_ROOT_HALF = 0x3F3504F3
_ROUNDER = 1.5 * 2**23
_LOG2 = (
    1.4426950035679829,
    -0.7213474682495625,
    0.48091075345941775,
    -0.3606932681354823,
    0.28790326092464336,
    -0.23916988139705947,
    0.21607822551507405,
    -0.20586188053941054,
    0.12310968473049777,
)
_EXP2 = (
    1.0,
    0.6931471880262287,
    0.24022650760568084,
    0.05550357114218973,
    0.009618082557286611,
    0.0013390863364733119,
    0.00015453162942006833,
)
"""Interpolations at Chebyshev's nodes: of ``log2(1 + f) / f`` between the root of 1/2 less 1 and
that of 2 less 1, within 3e-8, and of ``2^f`` on ``|f| <= 1/2``, within 6e-9."""
