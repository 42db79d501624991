"""Hard cases: where the textbook's formulas, and samplers, break, and by how much.

A case has the exact value, a naive evaluation, ours, and a bound on the error that ours keeps and
the naive one does not. Tests demand both of every case; the report prints them.

The samplers are on long paths inside a bright sphere of radius 1 and diffuse reflectance ρ, with a
point light of intensity I at its centre. There the radiance is the same everywhere, because each
reflection sends the same irradiance to all of it ::

    L = ρ I / (π (1 − ρ))

A path takes about 1 / (1 − ρ) reflections, and as many pairs of random numbers. If those depend on
each other, the mean of an image is wrong, however many passes are taken: no standard error shows
it. Naively the sampler is Mitsuba's; ours is :mod:`reference.rendering.sampler`.
"""

from dataclasses import dataclass
from functools import cache

import mitsuba as mi
import numpy as np
from numpy.typing import ArrayLike

from comparisons.hard import kernel_cases
from comparisons.hard.textbook import HardCase
from reference.rendering.renderer import Renderer
from reference.rendering.sampler import SAMPLER, register

ABSENT = 1e-3
"""Values below this share of the largest are judged by their absolute error."""


@dataclass(frozen=True)
class HardOutcome:
    """The errors of a case; infinite for a NaN, an infinity, or light where there is none."""

    name: str
    group: str
    difficulty: str
    bound: float
    naive_error: float
    our_error: float

    @property
    def holds(self) -> bool:
        """Whether ours keeps the bound."""
        return self.our_error <= self.bound


HardCases = dict[str, list[HardOutcome]]
"""Outcomes by group, in the order of the page."""


def collect() -> HardCases:
    """Evaluate all cases, in the current Mitsuba variant; a few seconds."""
    groups: HardCases = {}
    for case in CASES:
        groups.setdefault(case.group, []).append(evaluate(case))
    return groups


def evaluate(case: HardCase) -> HardOutcome:
    """Return the errors of a case."""
    with np.errstate(all="ignore"):  # cases provoke NaN and infinities
        exact = np.asarray(case.exact(), np.longdouble)
        errors = error(case.naive(), exact), error(case.ours(), exact)
    return HardOutcome(case.name, case.group, case.difficulty, case.bound, *errors)


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


# --- Samplers ----------------------------------------------------------------------------------

REFLECTANCE = 0.9
RADIANCE = REFLECTANCE / (np.pi * (1 - REFLECTANCE))
SAMPLES, WIDTH = 256, 32

BOUND = 0.005
"""On the relative error: about four standard errors of :data:`SAMPLES`."""


def sphere(reflectance: float, width: int, sampler: dict | None = None) -> dict:
    """Return the scene as a dictionary, seen from inside, off its centre."""
    view = mi.ScalarTransform4f().look_at((0.3, 0.1, 0.2), (1, 0.2, 0), (0, 1, 0))
    film = {"type": "hdrfilm", "width": width, "height": width, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 60, "to_world": view, "film": film}
    if sampler:
        sensor["sampler"] = sampler
    inside = {"type": "diffuse", "reflectance": reflectance}
    return {
        "type": "scene",
        "integrator": {"type": "path"},
        "sphere": {"type": "sphere", "flip_normals": True, "bsdf": inside},
        "light": {"type": "point", "position": (0, 0, 0), "intensity": 1.0},
        "sensor": sensor,
    }


@cache
def mean(sampler: str, count: int) -> list[float]:
    """Return the mean radiance that a sampler gives, with ``count`` samples per pixel and pass."""
    register()
    scene = mi.load_dict(sphere(REFLECTANCE, WIDTH, {"type": sampler, "sample_count": count}))
    renderer = Renderer(scene, None, count, "image of the sphere")
    images = (renderer.render(7919 * number) for number in range(SAMPLES // count))
    return [float(np.mean([np.array(image).mean() for image in images]))]


def _sampler(name: str, count: int) -> HardCase:
    return HardCase(
        f"{name} at {count} samples per pass", "Samplers",
        f"Inside a sphere of ρ = {REFLECTANCE} a path takes about ten reflections, and its random"
        " numbers depend on each other.",
        BOUND, lambda: mean(name, count), lambda: mean(SAMPLER, count), lambda: [RADIANCE],
    )  # fmt: skip


CASES = (
    *kernel_cases.CASES,
    *(_sampler(*each) for each in (("multijitter", 4), ("multijitter", 16), ("ldsampler", 16))),
)
