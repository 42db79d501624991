"""Checks over directions: white furnace, energy, reciprocity, and what happens at the horizon.

Let ``s(l, v) = pi f cos(theta_l)`` be the value that a viewer sees under a light of intensity 1.
Under radiance 1 from all directions the viewer sees ``1/pi int s(l, v) dl``, which is 1 for a white
surface. The share of light from ``l`` that is returned is
``1/pi int s(l, v) cos(theta_v) / cos(theta_l) dv``.
"""

import numpy as np

from comparisons.audit.audit_record import Checked, Curve, Verdict
from comparisons.audit.subject import Subject, told
from comparisons.hard import furnace

ANGLES = (0.0, 15.0, 30.0, 45.0, 60.0, 70.0, 80.0, 85.0, 89.0)
"""Degrees from the normal."""

TOLERANCE = 0.01
"""Of albedos; the quadrature errs by a tenth of it for GGX of an alpha of 0.1, even at 89 degrees,
where its lobe is 0.2 degrees wide."""

RECIPROCAL = 1e-3
"""Largest relative difference of ``f(i, o)`` and ``f(o, i)`` in single precision."""

GRAZING = 1e-6
"""Sine of the light's elevation, so small that anything continuous has reached 0 there."""

JUMP = 0.01
"""In units of display white."""


def curve(subject: Subject, material: str) -> Curve:
    """Return the two albedos of a white material over :data:`ANGLES`."""
    return Curve(
        material=material,
        alpha=subject.materials[material],
        seen=tuple(_seen(subject, material, angle) for angle in ANGLES),
        returned=tuple(_returned(subject, material, angle) for angle in ANGLES),
    )


def hemisphere(azimuths: int, heights: int) -> tuple[np.ndarray, np.ndarray]:
    """Return directions (3, N) above a surface, and the solid angle (N,) of each.

    They are dense about the normal, ``cos(theta) = 1 - t^2``, and about an azimuth of 180 degrees,
    ``phi = pi (1 + u^3)``: opposite to the fixed direction, grazing lobes are narrow.
    """
    t = (np.arange(heights) + 0.5) / heights
    u = (2 * np.arange(azimuths) + 1) / azimuths - 1
    t, u = (grid.ravel() for grid in np.meshgrid(t, u))
    directions = furnace.direction(np.arccos(1 - t * t), np.pi * (1 + u**3))
    return directions, 2 * t * 3 * np.pi * u**2 * 2 / len(t)


def _seen(subject: Subject, material: str, degrees: float) -> float:
    above, solid_angle = hemisphere(*subject.grid)
    view = furnace.direction(np.deg2rad(degrees), 0.0)
    total = sum(
        (subject.response(material, light, view) * solid_angle).sum(axis=1)
        for light in (above, above * [[1], [1], [-1]])
    )
    return _farthest(total / np.pi)


def _returned(subject: Subject, material: str, degrees: float) -> float:
    view, solid_angle = hemisphere(*subject.grid)
    light = furnace.direction(np.deg2rad(degrees), 0.0)
    found = subject.response(material, light, view) / light[2, 0]
    return float((found * view[2] * solid_angle).sum(axis=1).max() / np.pi)


def _farthest(values: np.ndarray) -> float:
    """Return the number that is farthest from 1."""
    return float(values[np.abs(values - 1).argmax()])


def white_furnace(curves: tuple[Curve, ...]) -> Checked:
    """Check that a white surface is as bright as its surroundings at every angle."""
    value, worst = max(
        ((value, f"{each.material}, viewer at {angle:g}°")
         for each in curves for angle, value in zip(ANGLES, each.seen, strict=True)),
        key=lambda found: abs(found[0] - 1),
    )  # fmt: skip
    return checked("white furnace", abs(value - 1) <= TOLERANCE, value, f"1 ± {TOLERANCE}", worst)


def energy(curves: tuple[Curve, ...]) -> Checked:
    """Check that no more light is returned than arrives, at the worst angle."""
    value, worst = max(
        (value, f"{each.material}, light at {angle:g}°")
        for each in curves for angle, value in zip(ANGLES, each.returned, strict=True)
    )  # fmt: skip
    return checked("energy", value <= 1 + TOLERANCE, value, f"at most {1 + TOLERANCE}", worst)


def reciprocity(subject: Subject) -> Checked:
    """Check that ``f(i, o) = f(o, i)`` for random pairs of directions."""
    a, b = furnace.random_pairs(subject.pairs)
    found = {material: asymmetries(subject, material, a, b) for material in subject.materials}
    value, worst = _largest(found, a, b)
    expected = f"at most {RECIPROCAL} of the mean"
    return checked("reciprocity", value <= RECIPROCAL, value, expected, worst)


def asymmetries(subject: Subject, material: str, a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Return the relative differences (C, N) of ``f(a, b)`` and ``f(b, a)``."""
    there = subject.response(material, a, b) / a[2]
    back = subject.response(material, b, a) / b[2]
    return furnace.relative_differences(there, back)


def horizon(subject: Subject) -> Checked:
    """Check that no value jumps as a light sets."""
    found, view = jumps(subject)
    light = np.tile([[1.0], [0.0], [GRAZING]], view.shape[1])
    value, worst = _largest(found, light, view)
    return checked("horizon", value <= JUMP, value, f"a jump of at most {JUMP}", worst)


def jumps(subject: Subject) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return the jumps (C, N) of each material as a light along x sets, and the viewers (3, N)."""
    view = furnace.direction(*(_grid(np.linspace(0, 80, 33), np.linspace(0, 180, 61))))
    above, below = (np.tile([[1.0], [0.0], [z]], view.shape[1]) for z in (GRAZING, -GRAZING))
    found = {
        material: np.abs(
            subject.response(material, above, view) - subject.response(material, below, view)
        )
        for material in subject.materials
    }
    return found, view


def below(subject: Subject) -> Checked:
    """Check that light from behind the surface is not seen."""
    polar = np.deg2rad(np.linspace(91, 180, 90))
    azimuth = np.deg2rad(np.arange(0, 181, 20.0))
    seen = np.deg2rad(np.array([0.0, 30, 60, 80]))
    polar, azimuth, seen = (each.ravel() for each in np.meshgrid(polar, azimuth, seen))
    light, view = furnace.direction(polar, azimuth), furnace.direction(seen, 0 * seen)
    found = {material: subject.response(material, light, view) for material in subject.materials}
    value, worst = _largest(found, light, view)
    return checked("light from below", value <= 1e-5, value, "0", worst)


def checked(name: str, holds: bool, value: float, expected: str, worst: str) -> Checked:
    """Return the record of a check that was made."""
    verdict: Verdict = "holds" if holds else "does not hold"
    return Checked(name=name, verdict=verdict, value=value, expected=expected, worst=worst)


def _grid(polar: np.ndarray, azimuth: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    polar, azimuth = np.meshgrid(np.deg2rad(polar), np.deg2rad(azimuth))
    return polar.ravel(), azimuth.ravel()


def _largest(
    found: dict[str, np.ndarray], light: np.ndarray, view: np.ndarray
) -> tuple[float, str]:
    """Return the largest value (C, N) of any material, and describe its case."""
    material = max(found, key=lambda name: found[name].max())
    values = found[material].max(axis=0)
    place = values.argmax()
    return float(values[place]), f"{material}, {told(light[:, place], view[:, place])}"
