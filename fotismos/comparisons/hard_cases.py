"""Hard cases: where the textbook's formulas break in single precision, and by how much.

A case has the exact value, the textbook's formula in single precision (*naive*), the kernel
(*ours*), and a bound on the error that ours keeps and the naive one does not. Tests demand both of
every case; the report prints them.
"""

from dataclasses import dataclass, replace
from typing import Any

import drjit as dr
import numpy as np
from drjit.llvm import Array3f, Float
from numpy.typing import ArrayLike, NDArray

from fotismos.comparisons import textbook
from fotismos.comparisons.textbook import NAIVE, Setting, unit
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.kernel import shade
from fotismos.heuristic.lights import PointLight, SpotLight
from fotismos.heuristic.materials import Material

ABSENT = 1e-3
"""Values below this share of the largest are judged by their absolute error."""


@dataclass(frozen=True)
class HardCase:
    """A case; ``exactly`` replaces the formula in extended precision.

    ``compiled`` exponents are plain numbers, for which the kernel may do without double precision.
    Errors are known once it is evaluated: infinite for a NaN, an infinity, or light where there is
    none.
    """

    name: str
    group: str
    bound: float
    setting: Setting
    difficulty: str
    exactly: Floats | None = None
    compiled: bool = False
    naive_error: float = np.inf
    our_error: float = np.inf

    @property
    def holds(self) -> bool:
        """Whether ours keeps the bound."""
        return self.our_error <= self.bound

    def exact(self) -> Floats:
        """Return the exact values, (N,)."""
        return textbook.shade_exactly(self.setting) if self.exactly is None else self.exactly


HardCases = dict[str, list[HardCase]]
"""Evaluated cases by group, in the order of the page."""


def collect() -> HardCases:
    """Evaluate all cases."""
    groups: HardCases = {}
    for case in CASES:
        groups.setdefault(case.group, []).append(evaluate(case))
    return groups


def evaluate(case: HardCase) -> HardCase:
    """Return a case with its errors."""
    with np.errstate(all="ignore"):  # cases provoke NaN and infinities
        exact = np.asarray(case.exact(), np.longdouble)
        naive = error(textbook.shade(case.setting, NAIVE), exact)
        ours = error(by_kernel(case.setting, case.compiled), exact)
    return replace(case, naive_error=naive, our_error=ours)


def error(values: ArrayLike, exact: np.ndarray) -> float:
    """Return the largest error, relative to the exact value or to a thousandth of the largest."""
    values = np.asarray(values, np.longdouble)
    if values.shape != exact.shape:
        raise ValueError(f"shapes {values.shape} and {exact.shape}")
    if not np.isfinite(values).all():
        return np.inf
    scale = np.maximum(np.abs(exact), ABSENT * np.abs(exact).max())
    difference = np.abs(values - exact)
    if not scale.all():
        return np.inf if difference.any() else 0.0
    return float((difference / scale).max())


POINTS = 2001


def by_kernel(setting: Setting, compiled: bool = False) -> NDArray[np.float32]:
    """Evaluate the kernel at a setting, in single precision: an array (N,).

    A ``compiled`` exponent is a plain number, as is that of a mirror.
    """
    s = setting.rounded()
    # Everything becomes (N, 3), then (3, N); of a number's three equal rows, one is read.
    vectors = (np.reshape(v, (-1, 3)) for v in (s.position, s.normal, s.view, s.light))
    numbers = (np.reshape(v, (-1, 1)) for v in (s.n, s.intensity))
    columns = [np.ascontiguousarray(v.T) for v in np.broadcast_arrays(*vectors, *numbers)]
    position, normal, view, light = map(Array3f, columns[:4])
    n = Float(columns[-2][0])
    intensity = Float(columns[-1][0])
    k0, k1, k2 = map(float, s.attenuation)
    lamp: PointLight | SpotLight
    if s.direction is None:
        lamp = PointLight(light, intensity, (k0, k1, k2))
    else:
        lamp = SpotLight(
            position=light,
            direction=tuple(map(float, s.direction)),
            intensity=intensity,
            cutoff=float(s.cutoff),
            exponent=float(s.m),
            attenuation=(k0, k1, k2),
        )
    exponent = float(s.n) if compiled or np.isinf(s.n).any() else n
    material = Material(k_d=float(s.k_d), k_s=float(s.k_s), n=exponent, form=s.form)
    dr.eval(position, normal, view, n, light, intensity)
    value = shade(position, normal, view, material, [lamp])
    return np.array(value + dr.zeros(Float, len(columns[0][0])))


LIGHT = (1.0, 2.0, 4.0)
NORMAL = (0.1, 0.2, 0.9)


def _about_mirror(angle: Floats) -> Floats:
    """Return views at angles from the mirror image of :data:`LIGHT` about :data:`NORMAL`."""
    light = unit(np.array(LIGHT, np.float32).astype(float))
    normal = unit(np.array(NORMAL, np.float32).astype(float))
    mirror = 2 * (light @ normal) * normal - light
    side = unit(np.cross(mirror, (0.3, 0.5, -0.8)))
    return np.cos(angle)[:, None] * mirror + np.sin(angle)[:, None] * side


def _highlight(n: float, **changes: Any) -> Setting:
    """Return a setting across a highlight, from its middle to a thousandth of its peak."""
    # `cos^n` is nearly `exp(−n angle² / 2)`.
    view = _about_mirror(np.linspace(0, np.sqrt(2 * np.log(1e3) / n), POINTS))
    return replace(Setting(normal=NORMAL, light=LIGHT, view=view, k_s=1.0, n=n), **changes)


def _mirror_directions(n: float) -> Setting:
    """Return views in the mirror direction of a light, to single precision."""
    normal = np.random.default_rng(2).normal(size=(POINTS, 3)).astype(np.float32).astype(float)
    normal[:, 2] = np.abs(normal[:, 2]) + 0.1
    up = unit(normal)
    return Setting(
        normal=normal, light=(0, 0, 1), view=2 * up[:, 2:] * up - (0, 0, 1), k_s=1.0, n=n
    )


def _grazing(low: float, high: float, **changes: Any) -> Setting:
    """Return lights and views a little above surfaces of all directions, facing each other.

    Their height is between powers of ten, of a distance of 1.
    """
    rng = np.random.default_rng(1)
    normal, other = rng.normal(size=(2, POINTS, 3)).astype(np.float32).astype(float)
    along = unit(np.cross(unit(normal), other))
    height = np.logspace(low, high, POINTS)[:, None] * unit(normal)
    light = along + height
    view = height - along
    return replace(Setting(normal=normal, light=light, view=view, k_s=1.0), **changes)


def _under_spot(angle: Floats, **changes: Any) -> Setting:
    """Return points of a plane at angles from the axis of a spot above it."""
    position = np.stack([2 * np.tan(angle), 0 * angle, 0 * angle], axis=1)
    return replace(_SPOT, position=position, normal=(0.0, 0.0, 1.0), **changes)


_FLAT = Setting(k_d=1.0)
_SPOT = Setting(k_d=1.0, light=(0.0, 0.0, 2.0), direction=(0.0, 0.0, -1.0))

_AGAINST = np.array([(3, 5, -4), (3, -5, -4), (7, 0, -1), (-1, 0, -7)])
_RAYS = (_AGAINST * np.arange(1, 51)[:, None, None]).reshape(-1, 3).astype(float)
_ON_CONE = Setting(k_d=1.0, cutoff=135.0, direction=(-3.0, 0.0, 4.0), light=-_RAYS, normal=-_RAYS)
"""Integers at exactly 135 degrees from an axis: as far against it as across it."""


# Rounded first: exact values are of the numbers that single precision holds.
CASES = tuple(replace(case, setting=case.setting.rounded()) for case in (
    HardCase(name="exponent 0 at the lobe's end", group="Exponents", bound=2e-4,
          setting=Setting(k_s=1.0, n=0.0, view=(1.0, 0.0, 0.0)),
          difficulty="R·V is 0, and so is n: a power gives 0⁰ = 1, where the lobe has ended."),
    HardCase(name="exponent 1/2, R·V just above 0", group="Exponents", bound=2e-4,
          setting=replace(_highlight(1e6), n=0.5,
                  view=_about_mirror(np.pi / 2 - np.logspace(-6.5, -2, POINTS))),
          difficulty="The scalar product cancels to a few digits, whose root is still visible."),
    HardCase(name="exponent 1e-3, R·V just above 0", group="Exponents", bound=2e-4,
          setting=replace(_highlight(1e6), n=1e-3,
                  view=_about_mirror(np.pi / 2 + np.linspace(-3e-7, 3e-7, POINTS))),
          difficulty="The lobe is almost even and ends abruptly; only the sign of R·V matters."),
    HardCase(name="exponent 500", group="Exponents", bound=5e-5, setting=_highlight(500),
          compiled=True,
          difficulty="A few rounding steps of R·V, 500 times: between round exponents, too."),
    HardCase(name="exponent 12345.6", group="Exponents", bound=2e-4, setting=_highlight(12345.6),
          difficulty="A few rounding steps of R·V, ten thousand times."),
    HardCase(name="Blinn's form, exponent 500", group="Exponents", bound=5e-5, compiled=True,
          setting=replace(_highlight(125), n=500.0, form="blinn"),
          difficulty="N·H is wrong by rounding, as R·V is; half the angle takes four times n."),
    HardCase(name="Blinn's form, exponent 1e6", group="Exponents", bound=2e-4,
          setting=replace(_highlight(2.5e5), n=1e6, form="blinn"),
          difficulty="The power multiplies the rounding of N·H near 1 by n."),
    HardCase(name="exponent 1e5", group="Exponents", bound=2e-4, setting=_highlight(1e5),
          difficulty="The power multiplies the rounding of R·V near 1 by n."),
    HardCase(name="exponent 1e6", group="Exponents", bound=2e-4, setting=_highlight(1e6),
          difficulty="The same; even rounding N, L and V turns the highlight visibly."),
    HardCase(name="exponent 123456.78", group="Exponents", bound=2e-4,
          setting=_highlight(123456.78),
          difficulty="A large exponent that is not an integer."),
    HardCase(name="exponent 1e7 in the mirror direction", group="Exponents", bound=2e-4,
          setting=_mirror_directions(1e7),
          difficulty="R·V rounds to just over 1 or just under, and the power makes it 3.3 or 0.3."),
    HardCase(name="exponent ∞, a mirror", group="Exponents", bound=0.0,
          setting=_mirror_directions(np.inf),
          difficulty="A light at a point is seen from one direction; R·V rounds to 1, or over it.",
          exactly=np.zeros(POINTS)),
    HardCase(name="a light on the surface", group="Geometry", bound=2e-4,
          setting=replace(_FLAT, light=(0.0, 0.0, 0.0)),
          difficulty="d = 0: no direction, and 0 / 0."),
    HardCase(name="a light at a distance of 1e-20", group="Geometry", bound=1e-6,
          setting=replace(_FLAT, light=(0.6e-20, 0.0, 0.8e-20)),
          difficulty="d² vanishes: 1e-40 is subnormal."),
    HardCase(name="a light at a distance of 1e20", group="Geometry", bound=1e-6,
          setting=replace(_FLAT, light=(0.6e20, 0.0, 0.8e20)),
          difficulty="d² is 1e40, beyond single precision."),
    HardCase(name="a viewer on the surface", group="Geometry", bound=2e-4,
          setting=Setting(k_s=1.0, n=9.5, view=(0.0, 0.0, 0.0)),
          difficulty="No view direction: 0 / 0."),
    HardCase(name="grazing light and view", group="Geometry", bound=2e-4,
          setting=_grazing(-8, -6, n=100.5),
          difficulty="Within 1e-8 to 1e-6 radians of the surface, rounding decides the side."),
    HardCase(name="Blinn's form, light opposite to view", group="Geometry", bound=3e-4,
          compiled=True,
          setting=_grazing(-6, -3, n=32.0, form="blinn"),
          difficulty="Near the horizon L + V nearly cancels, and H is made of what rounding left."),
    HardCase(name="normals of length 1e-30", group="Geometry", bound=1e-5,
          setting=replace(_FLAT, normal=(0.6e-30, 0.0, 0.8e-30)),
          difficulty="Their square vanishes."),
    HardCase(name="normals of length 1e30", group="Geometry", bound=1e-5,
          setting=replace(_FLAT, normal=(0.6e30, 0.0, 0.8e30)),
          difficulty="Their square is beyond single precision."),
    HardCase(name="a normal of zero", group="Geometry", bound=1e-5,
          setting=replace(_FLAT, normal=(0.0, 0.0, 0.0)),
          difficulty="Interpolated normals can cancel: 0 / 0."),
    HardCase(name="a scene of size 1e-6, n = 1e5", group="Geometry", bound=2e-4,
          setting=_highlight(1e5, light=(1e-6, 2e-6, 4e-6)),
          difficulty="A sharp highlight in a tiny scene."),
    HardCase(name="a scene of size 1e6, n = 1e5", group="Geometry", bound=2e-4,
          setting=_highlight(1e5, light=(1e6, 2e6, 4e6)),
          difficulty="A sharp highlight in a huge scene."),
    HardCase(name="far from the origin, n = 1e5", group="Geometry", bound=2e-4,
          setting=_highlight(1e5, position=(1e6, 1e6, 1e6), light=(1e6 + 1, 1e6 + 2, 1e6 + 4)),
          difficulty="Light and point 1e6 away: their difference is exact, all else rounds."),
    HardCase(name="intensity 1e-30 at a distance of 1e-20", group="Lights", bound=1e-6,
          setting=replace(_FLAT, light=(0.0, 0.0, 1e-20), intensity=1e-30,
                  attenuation=(0.0, 0.0, 1.0)),
          difficulty="1/d² overflows, and the intensity brings it back to 1e10."),
    HardCase(name="intensity 1e30 at a distance of 1e20", group="Lights", bound=1e-6,
          setting=replace(_FLAT, light=(0.0, 0.0, 1e20), intensity=1e30,
                  attenuation=(0.0, 0.0, 1.0)),
          difficulty="1/d² vanishes, and the intensity brings it back to 1e-10."),
    HardCase(name="a spot with m = 500", group="Lights", bound=2e-5,
          setting=_under_spot(np.linspace(0, 0.166, POINTS), m=500, cutoff=30.0),
          difficulty="A few rounding steps of the cosine, 500 times."),
    HardCase(name="a spot with m = 1e5", group="Lights", bound=1e-3,
          setting=_under_spot(np.linspace(0, 0.01, POINTS), m=1e5, cutoff=30.0),
          difficulty="The power multiplies the rounding of the cosine by m."),
    HardCase(name="a cutoff of 1e-4 degrees", group="Lights", bound=1e-5,
          setting=_under_spot(np.deg2rad(1e-4) * np.array([0, 0.2, 0.5, 0.8, 1.2, 2, 10, 50, 150]),
                      cutoff=1e-4),
          difficulty="The cosine of the cutoff rounds to 1, as do those of points far outside."),
    HardCase(name="a cutoff of 179.99 degrees", group="Lights", bound=1e-5,
          setting=replace(_SPOT, direction=(0.0, 0.0, 1.0), cutoff=179.99,
                  position=[(2 * np.deg2rad(0.01) * f, 0, 0) for f in (0, 0.3, 0.8, 1.2, 3)]),
          difficulty="The cosine rounds to -1, and the dark needle behind the light disappears."),
    HardCase(name="a point exactly on the cone", group="Lights", bound=1e-6, setting=_ON_CONE,
             difficulty="6.2 says ≥: coordinates on the cone are lit, however they round.",
             exactly=np.ones(len(_RAYS))),
))  # fmt: skip
