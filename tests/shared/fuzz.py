"""Random inputs from the whole range of single precision, for the kernel and its parts.

Numbers are drawn as random bits, so that all magnitudes from the smallest denormal to the largest
float are equally likely, and one in eight is a special value. Each check evaluates the parts in
single precision and again in double, whose range holds every square and product of single
precision, and raises AssertionError with the inputs of the first row that is wrong:

- a NaN;
- an infinity, where the value in double precision is a single-precision number;
- an error beyond the bound.

Inputs are evaluated before they are used: inside one kernel, LLVM may fuse the product and sum of
one use and not of another, and the two precisions would see different numbers. What counts as zero
is what :mod:`fotismos.heuristic.numerics` says: below the smallest normal float.
"""

from dataclasses import dataclass

import drjit as dr
import numpy as np
from drjit.llvm import PCG32, Array3f, Array3f64, Bool, Float, Float64, UInt32, UInt64

import fotismos
from fotismos.heuristic import numerics, terms, vectors

SMALLEST, LARGEST = 2.0**-126, float(np.finfo(np.float32).max)
STEP = 2.0**-23
SPECIAL = np.array(
    [0, 1, -1, 0.5, 2, 1e-45, -1e-40, SMALLEST, 1e-20, -1e20, 1 - 2**-24, 1 + STEP, 3, LARGEST,
     -LARGEST, 1e-30],
    np.float32,
)  # fmt: skip
"""Zero, ones and their neighbours, denormals, and the ends of the range."""


@dataclass(frozen=True)
class Tally:
    """How many rows a check looked at, how many counted for its bound, and the largest error."""

    rows: int
    judged: int
    worst: float


class Source:
    """Random numbers of single precision, some rows of each kind."""

    def __init__(self, rows, seed):
        self.rows = rows
        self._rng = PCG32(rows, initstate=seed, initseq=UInt64(dr.arange(UInt32, rows)) + 1)
        self._special = Float(SPECIAL)

    def bits(self):
        return self._rng.next_uint32()

    def uniform(self, low=0.0, high=1.0):
        return low + (high - low) * self._rng.next_float32()

    def anything(self):
        """Any finite float, all exponents alike; one in eight special."""
        bits = self.bits()
        is_finite = (bits & 0x7F800000) != 0x7F800000
        value = dr.reinterpret_array(Float, dr.select(is_finite, bits, bits & 0x3FFFFFFF))
        choice = self.bits()
        special = dr.gather(Float, self._special, (choice >> 8) & (len(SPECIAL) - 1))
        return dr.select((choice & 7) == 0, special, value)

    def magnitude(self, low, high):
        """Positive numbers with logarithms alike between those of ``low`` and ``high``."""
        return Float(dr.exp2(Float64(self.uniform(np.log2(low), np.log2(high)))))

    def direction(self):
        """Vectors of any direction and of lengths about 1."""
        return Array3f(*(self.uniform(-1, 1) for _ in range(3)))

    def vector(self):
        """Vectors of three kinds: each component anything; all of one scale; ordinary."""
        kind = self.bits() & 3
        wild = Array3f(*(self.anything() for _ in range(3)))
        even = self.direction() * self.magnitude(2.0**-124, 2.0**126)
        return dr.select(kind == 0, wild, dr.select(kind == 1, even, self.direction() * 4))


def check_power(rows, seed):
    """``c^n``: within 2e-4 where it exceeds 1e-3, for ``n`` up to 1e7 and every cosine."""
    draw = Source(rows, seed)
    kind = draw.bits() & 3
    cosine = dr.select(
        kind == 0,
        draw.anything(),
        dr.select(kind == 1, draw.uniform(-1.01, 1.01), 1 - draw.magnitude(2**-26, 1)),
    )
    cosine = dr.select(abs(cosine) > 1.01, 1, cosine)
    n = dr.select((draw.bits() & 7) == 0, 0, draw.magnitude(1e-3, 1e7))
    dr.eval(cosine, n)
    found = terms.power(cosine, n)
    complement = 1 - Float64(cosine)
    value = dr.minimum(Float64(cosine), 1)
    lobe = value >= SMALLEST
    exact = Float64(n) * dr.select(
        complement < 1e-4,
        -complement - complement * complement / 2 - complement**3 / 3 - complement**4 / 4,
        dr.log(dr.select(lobe, value, 1)),
    )
    expected = dr.select(lobe, dr.exp(dr.minimum(exact, 0)), 0)
    return _judge({"c": cosine, "n": n}, found, expected, 2e-4 * expected, expected > 1e-3)


def check_normalise(rows, seed):
    """``v / |v|``, within four rounding steps."""
    vector = Source(rows, seed).vector()
    dr.eval(vector)
    wide = Array3f64(vector)
    length = dr.norm(wide)
    found, expected = vectors.normalise(vector), wide / dr.select(length > 0, length, 1)
    return _of_components({"v": vector}, found, expected, 4 * STEP, length >= 4 * SMALLEST)


def check_attenuation(rows, seed, clamped=False):
    """``I_0 f_att``, within ten rounding steps, for every distance, intensity and coefficient."""
    draw = Source(rows, seed)
    distance, intensity = abs(draw.anything()), abs(draw.anything())
    k = [dr.select((draw.bits() & 3) == 0, 0, draw.magnitude(1e-6, 1e6)) for _ in range(3)]
    dr.eval(distance, intensity, k)
    law = terms.clamped_attenuation if clamped else terms.attenuation
    found = law(distance, *k, intensity)
    k0, k1, k2 = map(Float64, k)
    d = Float64(distance)
    denominator = k0 + d * (k1 + d * k2)
    factor = dr.select(denominator > 0, 1 / dr.select(denominator > 0, denominator, 1), 0)
    if clamped:
        factor = dr.select(denominator > 1, factor, 1)
    expected = dr.minimum(Float64(intensity) * factor, LARGEST)
    judged = (expected > 4 * SMALLEST) & (d > 1e-37) & (d < 8e37) & (intensity >= SMALLEST)
    judged &= (k1 == 0) | ((k1 * d > 4 * SMALLEST) & (k1 * d < LARGEST))
    inputs = {"d": distance, "I": intensity, "k0": k[0], "k1": k[1], "k2": k[2]}
    return _judge(inputs, found, expected, 10 * STEP * expected, judged)


def check_cone(rows, seed):
    """Inside or outside, but for a millionth of a radian; cutoffs from 1e-4 to 179.99 degrees."""
    draw = Source(rows, seed)
    cutoff = dr.select((draw.bits() & 1) == 0, draw.magnitude(1e-4, 179), draw.uniform(1, 179.99))
    axis, toward = (vectors.normalise(draw.direction()) for _ in range(2))
    nearby = vectors.normalise(axis + draw.direction() * draw.magnitude(1e-7, 1))
    nearby = dr.select((draw.bits() & 1) == 0, nearby, -nearby)
    toward = dr.select((draw.bits() & 3) == 0, toward, nearby)
    dr.eval(axis, toward, cutoff)
    found = terms.spot_cone(vectors.chord_cosine(axis, toward), numerics.cosine_of_degrees(cutoff))
    a, b = Array3f64(axis), Array3f64(toward)
    angle = dr.atan2(dr.norm(dr.cross(a, b)), dr.dot(a, b))
    edge = dr.deg2rad(Float64(cutoff))
    judged = abs(angle - edge) > 5e-7 + 1e-6 * edge
    expected = dr.select(angle < edge, Float64(1), 0)
    return _judge({"axis": axis, "toward": toward, "cutoff": cutoff}, found, expected, 0, judged)


def check_shade(rows, seed):
    """The kernel under a point light: terms of any size, exponents up to 1e6, any geometry.

    Within 2e-4 where the lobe exceeds 1e-3 of the light, plus four rounding steps of the light.
    Points whose light is on their horizon are not judged: there the highlight begins at once.
    """
    draw = Source(rows, seed)
    position, normal = draw.vector(), draw.vector()
    light = draw.vector()
    offset = vectors.normalise(light - position)
    normal = dr.select((draw.bits() & 7) == 0, normal, dr.mulsign(normal, dr.dot(normal, offset)))
    unit = vectors.normalise(normal)
    mirrored = vectors.mirror_vector(unit, offset, dr.dot(unit, offset))
    near_mirror = mirrored + draw.direction() * draw.magnitude(1e-5, 1)
    view = dr.select(
        (draw.bits() & 3) == 0, draw.vector(), near_mirror * draw.magnitude(1e-30, 1e30)
    )
    view = dr.select(dr.all(dr.isfinite(view)), view, 0)
    intensity = dr.select((draw.bits() & 1) == 0, draw.magnitude(1e-30, 1e30), draw.uniform())
    n = dr.select((draw.bits() & 7) == 0, 0, draw.magnitude(1e-3, 1e6))
    k0, k1, k2 = (dr.select((draw.bits() & 1) == 0, 0, draw.magnitude(1e-3, 1e3)) for _ in range(3))
    k0 = dr.select(k0 + k1 + k2 > 0, k0, 1)
    inputs = {
        "position": position, "normal": normal, "view": view, "light": light, "n": n,
        "I": intensity, "k0": k0, "k1": k1, "k2": k2,
    }  # fmt: skip
    dr.eval(inputs)
    found = _shaded(Array3f, Float, inputs)
    expected = _shaded(Array3f64, Float64, inputs)
    arriving = _arriving(inputs)
    lengths = [dr.norm(Array3f64(v)) for v in (normal, view)]
    offset = Array3f64(light) - Array3f64(position)
    lengths.append(dr.norm(offset))
    is_there = Bool(True)
    for length in lengths:
        is_there &= length >= 2**26 * SMALLEST
    is_there &= (lengths[2] < 8e37) & (Float64(inputs["k1"]) * lengths[2] < LARGEST)
    cosine = dr.dot(Array3f64(normal) / lengths[0], offset / lengths[2])
    judged = (
        is_there & (abs(cosine) > 1e-6) & (arriving < LARGEST / 4) & (expected > 1e8 * SMALLEST)
    )
    # R.V = 0 is an edge too, where n is small.
    mirrored = 2 * cosine * Array3f64(normal) / lengths[0] - offset / lengths[2]
    judged &= abs(dr.dot(mirrored, Array3f64(view) / lengths[1])) > 1e-6
    bound = 2e-4 * expected + 4 * STEP * arriving
    return _judge(inputs, found, expected, bound, judged)


CHECKS = {
    "power": check_power,
    "normalise": check_normalise,
    "attenuation": check_attenuation,
    "clamped attenuation": lambda rows, seed: check_attenuation(rows, seed, clamped=True),
    "cone": check_cone,
    "shade": check_shade,
}


def _shaded(vector, number, inputs):
    light = fotismos.PointLight(
        vector(inputs["light"]), number(inputs["I"]),
        tuple(number(inputs[k]) for k in ("k0", "k1", "k2")),
    )  # fmt: skip
    material = fotismos.Material(k_d=0.25, k_s=1.0, n=number(inputs["n"]))
    points = (vector(inputs[name]) for name in ("position", "normal", "view"))
    return fotismos.shade(*points, material, [light])


def _arriving(inputs):
    distance = dr.norm(Array3f64(inputs["light"]) - Array3f64(inputs["position"]))
    k0, k1, k2 = (Float64(inputs[k]) for k in ("k0", "k1", "k2"))
    denominator = k0 + distance * (k1 + distance * k2)
    return Float64(inputs["I"]) / dr.select(denominator > 0, denominator, 1)


def _of_components(inputs, found, expected, bound, judged):
    tallies = [_judge(inputs, found[i], expected[i], Float64(bound), judged) for i in range(3)]
    return Tally(tallies[0].rows, tallies[0].judged, max(tally.worst for tally in tallies))


def _judge(inputs, found, expected, bound, judged):
    """Compare rows; ``worst`` is the largest error in units of its bound."""
    found, bound = Float64(found) + dr.zeros(Float64, dr.width(expected)), Float64(bound)
    error = abs(found - expected)
    is_nan = dr.isnan(found)
    is_spurious = dr.isinf(found) & (abs(expected) < LARGEST)
    is_off = judged & ~(error <= bound)
    wrong = is_nan | is_spurious | is_off
    share = dr.select(judged & (bound > 0), error / dr.select(bound > 0, bound, 1), 0)
    dr.eval(wrong, share, judged)
    if dr.any(wrong):
        row = int(np.argmax(np.array(wrong)))
        what = "NaN" if bool(is_nan[row]) else "an infinity" if bool(is_spurious[row]) else "off"
        listing = ", ".join(f"{name} = {_at(value, row)}" for name, value in inputs.items())
        raise AssertionError(
            f"{int(dr.count(wrong)[0])} of {dr.width(wrong)} rows are wrong, the first is {what}:"
            f" {found[row]!r} instead of {expected[row]!r} for {listing}"
        )
    return Tally(dr.width(wrong), int(dr.count(judged)[0]), float(dr.max(share)[0]))


def _at(value, row):
    if dr.depth_v(value) > 1:
        return tuple(float(component[row % len(component)]) for component in value)
    return float(value[row % len(value)])
