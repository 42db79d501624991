"""What the charts of an audit show: lobes, setting lights, and a map of reciprocity."""

from collections.abc import Iterator

import numpy as np

from comparisons.audit import angles
from comparisons.audit.audit_record import Asymmetry, Lobe, Sunset
from comparisons.audit.subject import Subject, told
from comparisons.hard import furnace

LIGHTS = (0.0, 30.0, 60.0)
"""Degrees from the normal."""

VIEWS = tuple(np.arange(-88.0, 89.0, 2.0))
"""Degrees from the normal, in the plane of incidence; the light's side is negative."""

ELEVATIONS = tuple(sorted([*np.arange(-5.0, 10.1, 0.25), -1e-4, 1e-4]))
"""Degrees above the horizon, close together about 0."""

POLAR = tuple(np.arange(0.0, 81.0, 5.0))
AZIMUTHS = np.arange(0.0, 181.0, 15.0)

PICTURED = 0.3
"""Roughness of the lobes."""


def lobes(subject: Subject) -> tuple[Lobe, ...]:
    """Return the lobes of each kind of material under lights at several angles."""
    return tuple(
        Lobe(material=material, light=angle, values=_lobe(subject, material, angle))
        for material in _pictured(subject)
        for angle in LIGHTS
    )


def _lobe(subject: Subject, material: str, angle: float) -> tuple[float, ...]:
    light = furnace.direction(np.deg2rad(-angle), 0.0)
    view = furnace.direction(np.deg2rad(VIEWS), 0.0)
    return tuple((subject.response(material, light, view) / light[2]).max(axis=0).tolist())


def _pictured(subject: Subject) -> Iterator[str]:
    return (name for name, alpha in subject.materials.items() if alpha in (None, PICTURED))


def sunsets(subject: Subject) -> tuple[Sunset, ...]:
    """Return what the viewer sees for whom a kind of material jumps most."""
    found, views = angles.jumps(subject)
    largest = {name: jumps.max() for name, jumps in found.items()}
    worst: dict[str, str] = {}
    for name in found:
        kind = name.partition(",")[0]
        worst[kind] = max(name, worst.get(kind, name), key=lambda each: largest[each])
    return tuple(
        _sunset(subject, name, views[:, [found[name].max(axis=0).argmax()]])
        for name in worst.values()
    )


def _sunset(subject: Subject, material: str, view: np.ndarray) -> Sunset:
    light = furnace.direction(np.deg2rad(90 - np.array(ELEVATIONS)), 0.0)
    values = subject.response(material, light, view).max(axis=0)
    words = told(light[:, 0], view[:, 0]).partition(", ")[2]
    return Sunset(material=material, viewer=words, values=tuple(values.tolist()))


def asymmetry(subject: Subject) -> Asymmetry:
    """Return the map of the material that is the least reciprocal."""
    polar = np.deg2rad(POLAR)
    light, view, azimuth = np.meshgrid(polar, polar, np.deg2rad(AZIMUTHS), indexing="ij")
    a = furnace.direction(light.ravel(), 0.0)
    b = furnace.direction(view.ravel(), azimuth.ravel())
    found = {
        material: angles.asymmetries(subject, material, a, b).max(axis=0).reshape(light.shape)
        for material in subject.materials
    }
    material = max(found, key=lambda name: found[name].max())
    rows = found[material].max(axis=2).tolist()
    return Asymmetry(material=material, angles=POLAR, differences=tuple(map(tuple, rows)))
