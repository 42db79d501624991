"""Describe a shader's mistakes: probe it, and compare it with models and their usual mistakes.

The probes (:mod:`fotismos.comparisons.audit.probes`) know no model. The textbook's is a sum of
terms, each a coefficient times emission, ambient, diffuse or specular light. A shader that equals
this sum, with coefficients of 1, is right. One that equals the sum of a *changed* model
(:mod:`fotismos.comparisons.audit.textbook_mistakes`) has made that mistake, whatever its
coefficients; each coefficient that is not 1 is a further mistake. Microfacets
(:mod:`fotismos.comparisons.audit.microfacets`) are recognised alike. What explains all values is
the answer; only if nothing does, the probes' findings are told.
"""

import re
from collections.abc import Iterator
from dataclasses import replace

import mitsuba as mi
import numpy as np

from fotismos.comparisons.audit import microfacets, probes
from fotismos.comparisons.audit.subjects import shaded
from fotismos.comparisons.audit.textbook_mistakes import (
    BLINN,
    INTENSITIES,
    LAMPS,
    POINTS,
    Mistake,
    Model,
    mistakes,
    sample,
)
from fotismos.comparisons.departure.minimum import minimum
from fotismos.comparisons.picture_mistakes import factor_of_pi
from fotismos.comparisons.textbook import halfway, mirrored
from fotismos.heuristic import heuristics
from fotismos.heuristic.heuristics import Heuristic
from fotismos.heuristic.lights import INVERSE_SQUARE, PointLight
from fotismos.heuristic.user_shaders import DEFAULT_VARIANT

Array = np.ndarray

ALIKE = 1e-3
"""Relative RMS difference up to which two models count as equal."""

EXACT = 2e-5
"""Relative RMS difference that rounding leaves."""

TERMS = ("emission", "ambient", "diffuse", "specular")

LARGEST_LOG = 3.0
"""Numbers of mistakes are searched for between its exponential and its inverse, 20 and 1/20."""

ABSENT = 5e-5
"""Coefficient below which a term is absent."""

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
            return tuple(_mistakes(heuristic))
        except Exception:  # a user's code may raise anything where it was not tried
            return ()


def recognised() -> list[str]:
    """Return what is recognised, in words, with an ellipsis for what differs."""
    words = [mistake.words.replace("{}", "…") for mistake in mistakes()]
    words += microfacets.WORDS
    return list(dict.fromkeys(re.sub(r" \([-xyz, ]+\)$", " …", text) for text in words))


def _mistakes(heuristic: Heuristic) -> list[str]:
    findings = probes.findings(heuristic)
    # What it keeps of a scene may replace the textbook's ambient light.
    if heuristic.prepare is None:
        explained = _explained(heuristic)
        if explained is not None:
            # No value was so high that a shader may cut it.
            return [*explained, *(words for name, words in findings.items() if name == "cut")]
        # Of microfacets less was asked: what is right there may be wrong elsewhere.
        if facets := microfacets.explained(heuristic):
            return facets
    sure = [words for name, words in findings.items() if not probes.PROBES[name].vague]
    return sure or list(findings.values())


def _explained(heuristic: Heuristic) -> list[str] | None:
    """Return how a heuristic differs from the textbook's model, or None if it is another."""
    if heuristic.form == "blinn":
        bases = [sample(halfway)]
    else:
        blinn = sample(halfway)
        bases = [sample(mirrored), replace(blinn, n=BLINN * blinn.n)]
    seen = evaluate(heuristic, bases[0])
    explanations = [explanation for base in bases if (explanation := _explain(base, seen))]
    if not explanations:
        return None
    # Without a mistake first; then the one whose coefficients need the fewest sentences.
    sentences = [
        [*([f"A likely mistake: {words}."] if words else ()), *_factors(fit, len(LAMPS))]
        for words, fit in explanations
    ]
    return min(sentences, key=len)


def _explain(model: Model, seen: Array) -> tuple[str, TermFit] | None:
    """Return the mistake that explains the values seen, and its fit; no words if there is none."""
    form = "mirrored" if model.along is mirrored else "halfway"
    known = [mistake for mistake in mistakes() if mistake.form in (form, "either")]
    # No mistake, then changed models; several may give the same values, and are told together.
    right = _fit(model.terms(), seen)
    if right[1] < ALIKE:
        return "", right
    alike = [
        (mistake.words, fit)
        for mistake in known
        if not mistake.is_scaled
        if (fit := _fit(model.terms(**mistake.change(model)), seen))[1] < ALIKE
    ]
    # With a number to choose, more fits by chance: these are asked last.
    if all(_further(fit) for _, fit in alike):
        scaled = [_best(mistake, model, seen) for mistake in known if mistake.is_scaled]
        alike += [(words, fit) for words, fit in scaled if fit[1] < ALIKE]
    if not alike:
        return None
    # The nearest, and among these the one whose coefficients need the fewest sentences.
    nearest = min(fit[1] for _, fit in alike)
    near = [pair for pair in alike if pair[1][1] <= max(10 * nearest, EXACT)]
    fewest = min(_further(fit) for _, fit in near)
    likely = [pair for pair in near if _further(pair[1]) == fewest]
    return "; or: ".join(dict.fromkeys(words for words, _ in likely)), likely[0][1]


def _further(fit: TermFit) -> int:
    """Return how many sentences the coefficients of a fit need."""
    return len(list(_factors(fit, 0)))


def _best(mistake: Mistake, model: Model, seen: Array) -> tuple[str, TermFit]:
    """Return a mistake by some number, described with the one that fits best."""

    def fit(log: float) -> TermFit:
        return _fit(model.terms(**mistake.change(model, np.exp(log))), seen)

    # The remainder may have several minima: a grid finds the valley, a search its bottom.
    grid, step = np.linspace(-LARGEST_LOG, LARGEST_LOG, 32, retstep=True)
    start = grid[np.argmin([fit(log)[1] for log in grid])]
    best, _ = minimum(lambda log: fit(log)[1], start - step, start + step)
    return mistake.words.format(f"{np.exp(best):.3g}"), fit(best)


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
    """Describe the coefficients that are neither 1 nor 0, and ambient light that is missing."""
    coefficients, _ = fit
    means = coefficients.mean(axis=0)
    if (np.ptp(coefficients, axis=0) > 0.02 * np.abs(means) + 0.01).any():
        shown = ", ".join(f"{value:.3g}" for value in coefficients[:, 2])
        yield f"Its red, green and blue diffuse light is {shown} times the textbook's."
        return
    present = dict(zip(TERMS, np.abs(means) > ABSENT, strict=True))
    if present["diffuse"] and present["specular"] and not present["ambient"]:
        yield "Its ambient light is missing."
    # Terms with the same factor share a sentence.
    odd: dict[float, list[str]] = {}
    for name, value in zip(TERMS, means, strict=True):
        if present[name] and abs(value - 1) > 0.02:
            odd.setdefault(float(f"{value:.3g}"), []).append(name)
    for value, names in sorted(odd.items()):
        mistake = _reason(value, names[0] in TERMS[:2], lights)
        whose = "All its" if len(names) == len(TERMS) else f"Its {' and '.join(names)}"
        end = f": {mistake}?" if mistake else "."
        yield f"{whose} light is {value:.3g} times the textbook's{end}"


METRES = (1e-4, 1e4, 1e-6, 1e6)
"""Squares of centimetres, and of millimetres, over metres."""


def _reason(value: float, is_once: bool, lights: int) -> str:
    """Name what a coefficient may come from; ``is_once`` of terms outside the sum over lights."""
    if is_once and np.isclose(value, (lights, lights + 1), rtol=1e-3).any():
        return "is it added once for each light"
    if not is_once and np.isclose(value, METRES, rtol=0.02).any():
        return "is the fall-off in another unit of length"
    return factor_of_pi(value)


# --- Points ------------------------------------------------------------------------------------


def evaluate(heuristic: Heuristic, model: Model) -> Array:
    """Return a heuristic's values (P, 3) at a model's points."""
    colours = {name: getattr(model, name).T for name in ("k_i", "k_a", "k_d", "k_s")}
    colours["base_color"] = model.k_d.T
    lights = [
        PointLight(position, mi.Spectrum(*intensity), INVERSE_SQUARE)
        for position, intensity in zip(LAMPS, INTENSITIES, strict=True)
    ]
    values = shaded(
        heuristic, (model.position.T, model.normal.T, model.view.T),
        colours | {"n": model.n[:, 0], "alpha": 0.3, "ior": 1.5}, lights, model.ambient.tolist(),
    )  # fmt: skip
    return np.broadcast_to(np.array(values, float).reshape(3, -1).T, (POINTS, 3))
