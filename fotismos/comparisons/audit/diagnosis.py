"""Describe a shader's mistakes: probe it, and compare it with the textbook's model.

The probes (:mod:`fotismos.comparisons.audit.probes`) know no model. The textbook's is a sum of
terms, each a coefficient times emission, ambient, diffuse or specular light. A shader that equals
this sum, with coefficients of 1, is right. One that equals the sum of a *changed* model has made
that mistake, whatever its coefficients; each coefficient that is not 1 is a further mistake. A
shader that equals neither is another model, of which only the probes know.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import permutations, product
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.comparisons.audit import probes
from fotismos.comparisons.audit.subjects import shaded
from fotismos.comparisons.departure.colour import from_srgb, to_srgb
from fotismos.comparisons.departure.minimum import minimum
from fotismos.comparisons.picture_mistakes import factor_of_pi
from fotismos.comparisons.textbook import clamped, dot, halfway, lobe, mirrored, unit
from fotismos.heuristic import heuristics
from fotismos.heuristic.heuristics import Heuristic
from fotismos.heuristic.lights import INVERSE_SQUARE, PointLight
from fotismos.heuristic.user_shaders import DEFAULT_VARIANT

Array = np.ndarray

POINTS = 384

ALIKE = 1e-3
"""Relative RMS difference up to which two models count as equal."""

LAMPS = ((3.0, 1.0, 2.5), (-2.0, 2.5, 1.5), (1.0, -2.0, 3.0))
INTENSITIES = (1.25, 1.5, 1.75)
"""So low that no value is above 1, where a shader may cut it."""

TERMS = ("emission", "ambient", "diffuse", "specular")


@dataclass(frozen=True)
class Model:
    """The textbook's model at points: vectors and colours are (P, 3), numbers (P, 1).

    ``toward`` (L, P, 3) and ``intensity`` (L, P, 1) are of the lights. ``along`` and ``lobe`` are
    the lobe's cosine, and the lobe.
    """

    position: Array
    normal: Array
    view: Array
    n: Array
    k_i: Array
    k_d: Array
    k_s: Array
    ambient: Array
    toward: Array
    intensity: Array
    along: Callable[[Array, Array, Array], Array] = mirrored
    lobe: Callable[[Array, Array, Array], Array] = lobe

    def terms(self, **changes: Any) -> Array:
        """Return emission, ambient, diffuse and specular light (4, P, 3), the terms of 8.10.

        ``changes`` are other values of the model's fields.
        """
        m = replace(self, **changes)
        incidence = dot(m.normal, m.toward)
        along = m.along(m.normal, m.toward, m.view)
        diffuse = (m.intensity * clamped(incidence)).sum(axis=0)
        specular = (m.intensity * m.lobe(along, m.n, incidence)).sum(axis=0)
        return np.stack([m.k_i, m.ambient * m.k_d, m.k_d * diffuse, m.k_s * specular])


Mistake = tuple[str, Callable[..., dict[str, Any]]]
"""Its description, and the fields of a model that it changes."""

TermFit = tuple[Array, float]
"""Coefficients (3, 4) of the terms by channel, and the remaining relative RMS difference."""


def describe(name: str) -> tuple[str, ...]:
    """Return the mistakes of a heuristic, in words.

    There are none of a built-in one.
    """
    heuristic = heuristics.named(name)
    if heuristic.is_builtin:
        return ()
    with mi.scoped_set_variant(DEFAULT_VARIANT):
        heuristic = heuristics.named(name)
        try:
            found = probes.findings(heuristic)
            sure = [words for name, words in found.items() if not probes.PROBES[name].vague]
            if heuristic.prepare is None:  # what it keeps may replace the textbook's ambient light
                sure += _compared(heuristic)
        except Exception:  # a user's code may raise anything where it was not tried
            return ()
    return tuple(sure or found.values())


def _compared(heuristic: Heuristic) -> Iterator[str]:
    """Yield how a heuristic differs from the textbook's model, if some mistake explains it."""
    model = sample(halfway if heuristic.form == "blinn" else mirrored)
    explanation = _explain(model, evaluate(heuristic, model))
    if explanation is None:
        return
    description, fit = explanation
    if description:
        yield f"A likely mistake: {description}."
    yield from _factors(fit, len(model.toward))


def _explain(model: Model, seen: Array) -> tuple[str, TermFit] | None:
    """Return the mistake that explains the values seen, and its fit; no words if there is none."""
    # No mistake, then changed models: the first that fits is the answer.
    unchanged: Mistake = ("", lambda m: {})
    for description, change in (unchanged, *MISTAKES):
        fit = _fit(model.terms(**change(model)), seen)
        if fit[1] < ALIKE:
            return description, fit
    # With a number to choose, more fits by chance: these come last.
    scaled = [_best(mistake, model, seen) for mistake in SCALED]
    alike = [pair for pair in scaled if pair[1][1] < ALIKE]
    # Among several the one whose coefficients need the fewest sentences is the likeliest.
    return min(alike, key=lambda pair: len(list(_factors(pair[1], 0))), default=None)


def _best(mistake: Mistake, model: Model, seen: Array) -> tuple[str, TermFit]:
    """Return a mistake by some number, described with the one that fits best."""
    description, change = mistake

    def fit(log: float) -> TermFit:
        return _fit(model.terms(**change(model, np.exp(log))), seen)

    # The remainder may have several minima: a grid finds the valley, a search its bottom.
    grid, step = np.linspace(-LARGEST_LOG, LARGEST_LOG, 32, retstep=True)
    start = grid[np.argmin([fit(log)[1] for log in grid])]
    best, _ = minimum(lambda log: fit(log)[1], start - step, start + step)
    return description.format(f"{np.exp(best):.3g}"), fit(best)


def _fit(terms: Array, values: Array) -> TermFit:
    """Return the least-squares coefficients of terms (4, P, 3) by channel.

    Rows are weighted by the inverse of their size, or highlights alone would decide.
    """
    weights = 1 / (np.abs(values) + np.median(np.abs(values)) + 1e-9)
    coefficients = []
    left = []
    for channel in range(3):
        weight = weights[:, channel]
        matrix = (terms[:, :, channel] * weight).T
        target = values[:, channel] * weight
        # Columns of equal size, so that the cut at `rcond` does not depend on how bright a term is.
        size = np.sqrt((matrix**2).mean(axis=0)) + 1e-12
        solved = np.linalg.lstsq(matrix / size, target, rcond=1e-9)[0] / size
        coefficients.append(solved)
        left.append(np.mean((matrix @ solved - target) ** 2))
    return np.array(coefficients), float(np.sqrt(np.mean(left)))


def _factors(fit: TermFit, lights: int) -> Iterator[str]:
    """Describe the coefficients that are neither 1 nor 0."""
    coefficients, _ = fit
    means = coefficients.mean(axis=0)
    if (np.ptp(coefficients, axis=0) > 0.02 * np.abs(means) + 0.01).any():
        shown = ", ".join(f"{value:.3g}" for value in coefficients[:, 2])
        yield f"Its red, green and blue diffuse light is {shown} times the textbook's."
        return
    # Terms with the same factor share a sentence.
    odd: dict[float, list[str]] = {}
    for name, value in zip(TERMS, means, strict=True):
        if abs(value) > 0.01 and abs(value - 1) > 0.02:
            odd.setdefault(float(f"{value:.3g}"), []).append(name)
    for value, names in sorted(odd.items()):
        # Inside the loop over lights, emission and ambient light count once for each light.
        for_each = value == lights and names[0] in TERMS[:2]
        mistake = "is it added once for each light" if for_each else factor_of_pi(value)
        whose = "All its" if len(names) == len(TERMS) else f"Its {' and '.join(names)}"
        end = f": {mistake}?" if mistake else "."
        yield f"{whose} light is {value:.3g} times the textbook's{end}"


# --- Points ------------------------------------------------------------------------------------


def sample(along: Callable[[Array, Array, Array], Array]) -> Model:
    """Return random points under three lights, as inputs of the model."""
    random = np.random.default_rng(21)

    def colour() -> Array:
        return random.uniform(0.05, 0.95, (POINTS, 3)).astype(np.float32).astype(float)

    position = random.uniform(-1, 1, (POINTS, 3))
    normal = unit(random.normal(size=(POINTS, 3)))
    view = unit(random.normal(size=(POINTS, 3)))
    # Viewers are on the shaded side; lights may be behind it, where lost signs show.
    view *= np.sign(dot(normal, view))
    # From each point to each light, (L, P, 3).
    away = np.array(LAMPS)[:, None] - position
    distance = np.sqrt(dot(away, away))
    return Model(
        position=position,
        normal=normal,
        view=view,
        n=random.uniform(2, 24, (POINTS, 1)),
        k_i=0.05 * colour(),
        k_d=colour(),
        k_s=colour(),
        ambient=np.array([0.08, 0.05, 0.1]),
        toward=away / distance,
        intensity=np.array(INTENSITIES)[:, None, None] / distance**2,
        along=along,
    )


def evaluate(heuristic: Heuristic, model: Model) -> Array:
    """Return a heuristic's values (P, 3) at a model's points."""
    # One diffuse colour under three names: a shader may read any of them.
    names = {"k_i": "k_i", "k_a": "k_d", "k_d": "k_d", "k_s": "k_s", "base_color": "k_d"}
    colours = {name: getattr(model, field).T for name, field in names.items()}
    lights = [
        PointLight(position, mi.Spectrum(intensity), INVERSE_SQUARE)
        for position, intensity in zip(LAMPS, INTENSITIES, strict=True)
    ]
    values = shaded(
        heuristic, (model.position.T, model.normal.T, model.view.T),
        colours | {"n": model.n[:, 0], "alpha": 0.3, "ior": 1.5}, lights, model.ambient.tolist(),
    )  # fmt: skip
    return np.broadcast_to(np.array(values, float).reshape(3, -1).T, (POINTS, 3))


# --- Known mistakes ----------------------------------------------------------------------------


def _spaces() -> Iterator[Mistake]:
    """Yield a mistake for each other space whose axes are the world's, swapped or reversed."""
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        # Neither the world's, nor the same reversed, which the probes tell.
        if order != (0, 1, 2) or abs(sum(signs)) != 3:
            pairs = zip(order, signs, strict=True)
            axes = ", ".join(f"{'-' if sign < 0 else ''}{'xyz'[axis]}" for axis, sign in pairs)
            yield (
                f"the normal is in another space: it looks like ({axes})",
                lambda m, order=order, signs=signs: {"normal": m.normal[:, list(order)] * signs},
            )


MISTAKES: tuple[Mistake, ...] = (
    ("the lobe is about the half vector, with the exponent for the mirrored one: too wide",
     lambda m: {"along": halfway}),
    ("the view vector is the position reversed, which is right only in view space",
     lambda m: {"view": unit(-m.position)}),
    ("the view vector is the position reversed, and not normalised",
     lambda m: {"view": -m.position}),
    ("the normal is encoded as N / 2 + 1/2", lambda m: {"normal": 0.5 * m.normal + 0.5}),
    ("the normal is encoded as N / 2 + 1/2, and then normalised",
     lambda m: {"normal": unit(0.5 * m.normal + 0.5)}),
    ("the lobe is multiplied by N.L, as in a BRDF; the textbook's is not",
     lambda m: {"lobe": lambda *words: lobe(*words) * clamped(words[-1])}),
    # Constant factors are left out: the fitted coefficient takes them up.
    ("the lobe is normalised by n + 2, which the paired k_s already includes",
     lambda m: {"k_s": m.k_s * (m.n + 2)}),
    ("the lobe is normalised by n + 8, which the paired k_s already includes",
     lambda m: {"k_s": m.k_s * (m.n + 8)}),
    ("the material's colours are decoded, but are already linear",
     lambda m: {"k_d": from_srgb(m.k_d), "k_s": from_srgb(m.k_s)}),
    ("the material's colours are decoded by a power of 2.2, but are already linear",
     lambda m: {"k_d": m.k_d**2.2, "k_s": m.k_s**2.2}),
    ("the material's colours are sRGB-encoded",
     lambda m: {"k_d": to_srgb(m.k_d), "k_s": to_srgb(m.k_s)}),
    *_spaces(),
)  # fmt: skip

LARGEST_LOG = 3.0
"""Numbers of mistakes are searched for between its exponential and its inverse, 20 and 1/20."""

SCALED: tuple[Mistake, ...] = (
    ("the exponent is {} times the material's", lambda m, by: {"n": m.n * by}),
    ("the normal is not normalised: it has a length of {}",
     lambda m, by: {"normal": m.normal * by}),
    ("the light vector is not normalised: it has a length of {}",
     lambda m, by: {"toward": m.toward * by}),
    ("the view vector is not normalised: it has a length of {}",
     lambda m, by: {"view": m.view * by}),
)  # fmt: skip
"""Mistakes by some number, which their words show."""
