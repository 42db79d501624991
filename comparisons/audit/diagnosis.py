"""Describe a shader's mistakes: evaluate it at points, and compare it with known mistakes.

The textbook's model is a sum of terms, each a coefficient times emission, ambient, diffuse or
specular light. A shader that equals this sum, with coefficients of 1, is right. One that equals the
sum of a *changed* model has made that mistake, whatever its coefficients; each coefficient that is
not 1 is a further mistake. A shader that equals neither is another model, and nothing is reported.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.optimize import minimize_scalar

from comparisons.audit.mistakes import COLOURS, MISTAKES, Mistake, Textbook, halfway, mirrored
from comparisons.pictures.readings import factor_of_pi
from heuristic import heuristics
from heuristic.heuristics import Heuristic
from heuristic.lights import INVERSE_SQUARE, PointLight
from heuristic.materials import PairedMaterial
from heuristic.points import Given
from heuristic.trial import DEFAULT_VARIANT

POINTS = 384

ALIKE = 1e-3
"""Relative RMS difference up to which two models count as equal."""

LAMPS = ((3.0, 1.0, 2.5), (-2.0, 2.5, 1.5), (1.0, -2.0, 3.0))

TERMS = ("emission", "ambient", "diffuse", "specular")


@dataclass(frozen=True)
class Fit:
    """Coefficients (3, 4) of the terms by channel, and the remaining relative RMS difference."""

    coefficients: np.ndarray
    left: float


def told(name: str) -> tuple[str, ...]:
    """Return the mistakes of a heuristic; none for a built-in one, or one that prepares a scene.

    Parameters
    ----------
    name
        As ``compare --heuristic`` accepts it.
    """
    heuristic = heuristics.named(name)
    if heuristic.is_own or heuristic.prepare is not None:
        return ()
    with mi.scoped_set_variant(DEFAULT_VARIANT):
        return tuple(_told(heuristics.named(name)))


def _told(heuristic: Heuristic) -> Iterator[str]:
    along = halfway if heuristic.form == "blinn" else mirrored
    points = _points(along)
    seen = _asked(heuristic, points)
    is_cut = seen.max() == 1 and 3 < np.count_nonzero(seen == 1) < seen.size / 2
    counts = seen < 1 if is_cut else np.ones_like(seen, bool)
    found = _explained(points, seen, counts)
    if found is None:
        return
    words, fit = found
    if is_cut:
        yield "Its values end at 1: brighter light is cut off."
    if words:
        yield f"A likely mistake: {words}."
    yield from _factors(fit, len(points.lights))


def _explained(points: Textbook, seen: np.ndarray, counts: np.ndarray) -> tuple[str, Fit] | None:
    """Return the mistake that explains the values seen, and its fit; no words if there is none."""
    readings = [("", seen), *((f"its {each.told}", each.undo(seen)) for each in COLOURS)]
    fixed = [("", points.terms())]
    fixed += [(each.told, each.change(points).terms()) for each in MISTAKES if each.by is None]
    for words, terms in fixed:  # one mistake before two
        for read, values in readings if not words else readings[:1]:
            if (fit := _fit(terms, values, counts)).left < ALIKE:
                return words or read, fit
    scaled = [
        _best(each, each.by, points, seen, counts) for each in MISTAKES if each.by is not None
    ]
    if alike := [found for found in scaled if found[1].left < ALIKE]:
        return min(alike, key=lambda found: len(list(_factors(found[1], 0))))
    for read, values in readings[1:]:
        for words, terms in fixed[1:]:
            if (fit := _fit(terms, values, counts)).left < ALIKE:
                return f"{words}; and {read}", fit
    return None


def _best(
    each: Mistake, by: tuple[float, float], points: Textbook, seen: np.ndarray, counts: np.ndarray
) -> tuple[str, Fit]:
    """Return a mistake, described with the number that fits best."""

    def fit(log: float) -> Fit:
        return _fit(each.change(points, np.exp(log)).terms(), seen, counts)

    low, high = np.log(by)
    grid = np.linspace(low, high, 24)
    start = grid[np.argmin([fit(log).left for log in grid])]
    step = grid[1] - grid[0]
    bounds = start - step, start + step
    found = minimize_scalar(lambda log: fit(log).left, bounds=bounds, options={"xatol": 1e-5})
    return each.told.format(f"{np.exp(found.x):.3g}"), fit(found.x)


def _fit(terms: np.ndarray, values: np.ndarray, counts: np.ndarray) -> Fit:
    """Return the least-squares coefficients of terms (4, P, 3) by channel.

    Rows are weighted by the inverse of their size, or highlights alone would decide.
    """
    if not np.isfinite(values).all():
        return Fit(np.zeros((3, 4)), np.inf)
    weights = counts / (np.abs(values) + np.median(np.abs(values)) + 1e-9)
    found, left = [], []
    for channel in range(3):
        weight = weights[:, channel]
        matrix, target = (terms[:, :, channel] * weight).T, values[:, channel] * weight
        size = np.sqrt((matrix**2).mean(axis=0)) + 1e-12
        solved = np.linalg.lstsq(matrix / size, target, rcond=1e-9)[0] / size
        found.append(solved)
        left.append(np.mean((matrix @ solved - target) ** 2))
    return Fit(np.array(found), float(np.sqrt(np.mean(left))))


def _factors(fit: Fit, lights: int) -> Iterator[str]:
    """Describe the coefficients that are neither 1 nor 0."""
    means = fit.coefficients.mean(axis=0)
    if (np.ptp(fit.coefficients, axis=0) > 0.02 * np.abs(means) + 0.01).any():
        shown = ", ".join(f"{value:.3g}" for value in fit.coefficients[:, 2])
        yield f"Its red, green and blue diffuse light is {shown} times the textbook's."
        return
    odd = {
        name: value
        for name, value in zip(TERMS, means, strict=True)
        if abs(value) > 0.01 and abs(value - 1) > 0.02
    }
    for value in sorted(set(map(_rounded, odd.values()))):
        names = [name for name, own in odd.items() if _rounded(own) == value]
        each = value == lights and names[0] in TERMS[:2]
        mistake = "is it added once for each light" if each else factor_of_pi(value)
        yield (
            f"{_all(names)} is {value:.3g} times the textbook's"
            f"{mistake and f': {mistake}?'}{'' if mistake else '.'}"
        )


def _all(names: list[str]) -> str:
    return "All its light" if len(names) == len(TERMS) else f"Its {' and '.join(names)} light"


def _rounded(value: float) -> float:
    return float(f"{value:.3g}")


@cache
def _points(along: Callable) -> Textbook:
    """Return random points under three lights, as inputs of the textbook's model."""
    random = np.random.default_rng(21)

    def unit() -> np.ndarray:
        found = random.normal(size=(POINTS, 3))
        return found / np.linalg.norm(found, axis=1, keepdims=True)

    def colour() -> np.ndarray:
        return random.uniform(0.05, 0.95, (POINTS, 3)).astype(np.float32).astype(float)

    position, normal, view = random.uniform(-1, 1, (POINTS, 3)), unit(), unit()
    view *= np.sign(np.sum(normal * view, axis=1, keepdims=True))
    lights = []
    for number, place in enumerate(LAMPS):
        away = np.array(place) - position
        distance = np.linalg.norm(away, axis=1, keepdims=True)
        intensity = _intensity(number) / distance**2
        lights.append((away / distance, distance, np.broadcast_to(intensity, position.shape)))
    return Textbook(
        position=position,
        normal=normal,
        view=view,
        n=random.uniform(2, 24, (POINTS, 1)),
        k_i=0.2 * colour(),
        k_d=colour(),
        k_s=colour(),
        ambient=np.array([0.3, 0.2, 0.4]),
        lights=tuple(lights),
        along=along,
    )


def _intensity(number: int) -> float:
    return 5.0 + number


def _asked(heuristic: Heuristic, points: Textbook) -> np.ndarray:
    """Return a heuristic's values (P, 3) at points."""

    def vector(values: np.ndarray) -> mi.Vector3f:
        return mi.Vector3f(np.ascontiguousarray(values.T, np.float32))

    def spectrum(values: np.ndarray) -> mi.Spectrum:
        return mi.Spectrum(*(mi.Float(np.float32(each)) for each in values.T))

    base = spectrum(points.k_d)
    material = PairedMaterial(
        k_i=spectrum(points.k_i),
        k_a=base,
        k_d=base,
        k_s=spectrum(points.k_s),
        n=mi.Float(np.float32(points.n[:, 0])),
        form=heuristic.form or "phong",
        base_color=base,
        alpha=dr.opaque(mi.Float, 0.3),
        ior=dr.opaque(mi.Float, 1.5),
        metallic=dr.opaque(mi.Float, 0),
    )
    lights = [
        PointLight(place, mi.Spectrum(_intensity(number)), INVERSE_SQUARE)
        for number, place in enumerate(LAMPS)
    ]
    given = Given(
        vector(points.position), vector(points.normal), vector(points.view), material, lights,
        mi.Spectrum(points.ambient.tolist()),
        lambda toward, distance: dr.full(mi.Bool, True, POINTS),
    )  # fmt: skip
    parameters = {each.name: mi.Float(each.default) for each in heuristic.parameters}
    value = mi.Spectrum(heuristic.evaluate(given, mi.Point2f(0.5), parameters, None))
    seen = np.array(value, float).reshape(3, -1).T
    return np.broadcast_to(seen, (POINTS, 3))
