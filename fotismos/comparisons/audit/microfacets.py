"""Microfacet shaders: which model a shader's highlights are, and by what usual mistake they differ.

The value of a light of intensity I is ``pi f I (N.L)``, with

    f = D G F / (4 (N.L) (N.V)) + diffuse

after Cook and Torrance (SIGGRAPH 1981) and Walter et al. (EGSR 2007). Each factor has several right
forms, and wrong ones that people write; a candidate has at most one wrong. Black surfaces show the
highlight alone, coloured ones add the diffuse base, and metals tell F0.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cache, reduce
from itertools import product

import mitsuba as mi
import numpy as np

from fotismos.comparisons.audit.subjects import shaded
from fotismos.comparisons.audit.textbook_mistakes import (
    COSINE_OF_HALF,
    COSINE_OF_VIEWER,
    HALVED,
    NO_COSINE,
    OF_REVERSED_VIEW,
    SQUARED_COSINE,
    SUMMED,
)
from fotismos.comparisons.picture_mistakes import factor_of_pi
from fotismos.comparisons.textbook import dot, unit
from fotismos.heuristic.convention import Floats
from fotismos.heuristic.heuristics import Heuristic
from fotismos.heuristic.lights import INVERSE_SQUARE, PointLight

Array = Floats

POINTS = 200

LAMP = (3.0, 1.0, 2.5)
INTENSITY = (9.0, 11.0, 7.0)

ALIKE = 1e-3
"""Relative RMS difference up to which values count as equal."""

UNSCALED = 0.02
"""Relative difference of a factor from 1, or from a known one."""

LEAST_COSINE = 0.15
"""Of light and viewer: shaders keep divisors above some smaller number."""


@dataclass(frozen=True)
class Facets:
    """Cosines, roughness and reflectance at points, (P, 1) or (P, 3)."""

    normal: Array
    toward: Array
    view: Array
    half: Array
    alpha: Array
    ior: Array
    f0: Array

    @property
    def nl(self) -> Array:
        """N.L."""
        return dot(self.normal, self.toward)

    @property
    def nv(self) -> Array:
        """N.V."""
        return dot(self.normal, self.view)

    @property
    def nh(self) -> Array:
        """N.H."""
        return np.maximum(dot(self.normal, self.half), 0)

    @property
    def vh(self) -> Array:
        """V.H."""
        return np.maximum(dot(self.view, self.half), 0)


Factor = Callable[[Facets], Array]


@cache  # so that equal factors are evaluated once
def _changed(factor: Factor, change: Callable[[Facets], Facets]) -> Factor:
    return lambda p: factor(change(p))


@dataclass(frozen=True)
class Form:
    """A form of a factor: its name, or words on what is wrong with it."""

    words: str
    value: Factor


@dataclass(frozen=True)
class Slot:
    """A factor of the highlight, in its right forms and its wrong ones."""

    right: tuple[Form, ...]
    wrong: tuple[Form, ...]


def ggx(p: Facets) -> Array:
    """``pi D`` of Trowbridge and Reitz (1975)."""
    square = p.alpha**2
    return square / (p.nh**2 * (square - 1) + 1) ** 2


def beckmann(p: Facets) -> Array:
    """``pi D`` of Beckmann and Spizzichino (1963)."""
    cosine = np.maximum(p.nh, 1e-3)
    slopes = np.exp((cosine**2 - 1) / (p.alpha * cosine) ** 2)
    density: Array = slopes / (p.alpha**2 * cosine**4)
    return density


def blinn(p: Facets) -> Array:
    """``pi D`` of Blinn (1977), with the exponent ``2 / alpha^2 - 2``, normalised."""
    return p.nh ** (2 / p.alpha**2 - 2) / p.alpha**2


def _schlick(k: Array, cosine: Array) -> Array:
    return cosine / (cosine * (1 - k) + k)


def _smith(p: Facets, cosine: Array) -> Array:
    """Smith's masking for GGX, of Walter et al. (34)."""
    square = p.alpha**2
    masking: Array = 2 * cosine / (cosine + np.sqrt(square + (1 - square) * cosine**2))
    return masking


def _correlated(p: Facets) -> Array:
    """Smith's masking and shadowing for GGX, correlated by height: Heitz (2014), (99)."""
    square = p.alpha**2
    light = p.nv * np.sqrt(square + (1 - square) * p.nl**2)
    viewer = p.nl * np.sqrt(square + (1 - square) * p.nv**2)
    return 2 * p.nl * p.nv / (light + viewer)


def _fresnel(p: Facets, cosine: Array) -> Array:
    """Schlick's approximation (1994)."""
    return p.f0 + (1 - p.f0) * (1 - np.clip(cosine, 0, 1)) ** 5


def _dielectric(p: Facets) -> Array:
    """Fresnel's equations for an interface."""
    cosine = np.clip(p.vh, 0, 1)
    below = np.sqrt(1 - (1 - cosine**2) / p.ior**2)
    s = (cosine - p.ior * below) / (cosine + p.ior * below)
    p_polarised = (p.ior * cosine - below) / (p.ior * cosine + below)
    return (s**2 + p_polarised**2) / 2


Mask = Callable[[Facets, Array], Array]
"""Masking of one direction, of its cosine; the shadowing of a pair is the product."""

MASKS: dict[str, Mask] = {
    "Smith": _smith,
    "Schlick, alpha / 2": lambda p, cosine: _schlick(p.alpha / 2, cosine),
    "Schlick, sqrt(alpha) / 2": lambda p, cosine: _schlick(np.sqrt(p.alpha) / 2, cosine),
    "Schlick, alpha^2 / 2": lambda p, cosine: _schlick(p.alpha**2 / 2, cosine),
    "Schlick, (sqrt(alpha) + 1)^2 / 8": lambda p, cosine: _schlick(
        (np.sqrt(p.alpha) + 1) ** 2 / 8, cosine
    ),
    "Schlick, (alpha + 1)^2 / 8": lambda p, cosine: _schlick((p.alpha + 1) ** 2 / 8, cosine),
    "Schlick, alpha sqrt(2 / pi)": lambda p, cosine: _schlick(p.alpha * np.sqrt(2 / np.pi), cosine),
}


def _ones(p: Facets) -> Array:
    return np.ones_like(p.nl)


DISTRIBUTION = Slot(
    right=(Form("GGX", ggx), Form("Beckmann", beckmann), Form("Blinn", blinn)),
    wrong=(
        Form(
            "the square of D's denominator is missing",
            lambda p: p.alpha**2 / (p.nh**2 * (p.alpha**2 - 1) + 1),
        ),
        Form("D's denominator is missing", lambda p: p.alpha**2 * np.ones_like(p.nh)),
        Form(
            "D has N.H in place of its square",
            lambda p: p.alpha**2 / (p.nh * (p.alpha**2 - 1) + 1) ** 2,
        ),
        Form(
            "D's bracket has 1 - alpha^2 in place of alpha^2 - 1",
            lambda p: p.alpha**2 / (p.nh**2 * (1 - p.alpha**2) + 1) ** 2,
        ),
        Form(
            "D's bracket is misplaced, (N.H)^2 alpha^2 - 1 + 1",
            lambda p: p.alpha**2 / (p.nh * p.alpha) ** 4,
        ),
        Form(
            "D's numerator, alpha^2, is missing",
            lambda p: 1 / (p.nh**2 * (p.alpha**2 - 1) + 1) ** 2,
        ),
        Form("D is missing", _ones),
    ),
)


def _pair_forms() -> Iterator[Form]:
    """Yield the products of masking and shadowing."""

    def product_of(mask: Mask) -> Factor:
        return lambda p: mask(p, p.nl) * mask(p, p.nv)

    for name, mask in MASKS.items():
        yield Form(name, product_of(mask))


def _lone_forms() -> Iterator[Form]:
    """Yield the masking of one direction, without the other's."""

    def of_light(mask: Mask) -> Factor:
        return lambda p: mask(p, p.nl)

    def of_viewer(mask: Mask) -> Factor:
        return lambda p: mask(p, p.nv)

    for mask in MASKS.values():
        light = "G is that of the light alone: multiply by that of the viewer"
        viewer = "G is that of the viewer alone: multiply by that of the light"
        yield Form(light, of_light(mask))
        yield Form(viewer, of_viewer(mask))


GEOMETRY = Slot(
    right=(
        *_pair_forms(),
        Form("Smith, correlated", _correlated),
        Form(
            "Cook and Torrance",
            lambda p: np.minimum(1, 2 * p.nh / np.maximum(p.vh, 1e-4) * np.minimum(p.nl, p.nv)),
        ),
        Form("implicit", lambda p: p.nl * p.nv),
        Form("Kelemen", lambda p: p.nl * p.nv / np.maximum(p.vh, 1e-4) ** 2),
    ),
    wrong=(Form("G is missing: multiply by masking and shadowing", _ones), *_lone_forms()),
)

GLASS_F0 = 0.04
"""F0 of an index of refraction of 1.5, which engines give all that is no metal."""


def dielectric_f0(ior: Array) -> Array:
    """Return the reflectance at normal incidence of an interface."""
    return ((ior - 1) / (ior + 1)) ** 2


def _as_glass(p: Facets) -> Facets:
    """Return the facets with F0 of glass, unless they are a metal's."""
    return replace(p, f0=np.where(p.f0 == dielectric_f0(p.ior), GLASS_F0, p.f0))


WRONG_FRESNEL = (
    Form("F is of N.V in place of V.H", lambda p: _fresnel(p, p.nv)),
    Form("F is of N.L in place of V.H", lambda p: _fresnel(p, p.nl)),
    Form("F is of N.H in place of V.H", lambda p: _fresnel(p, p.nh)),
    Form("F lacks the factor 1 - F0 of its rise", lambda p: p.f0 + (1 - p.vh) ** 5),
    Form("F rises with the power 4 in place of 5", lambda p: p.f0 + (1 - p.f0) * (1 - p.vh) ** 4),
)

FRESNEL = Slot(
    right=(
        Form("Schlick", lambda p: _fresnel(p, p.vh)),
        Form("Schlick, constant F0", lambda p: _fresnel(_as_glass(p), p.vh)),
        Form("of an interface", _dielectric),
        Form("F0 alone", lambda p: p.f0 + 0 * p.vh),
    ),
    wrong=(
        *WRONG_FRESNEL,
        *(Form(form.words, _changed(form.value, _as_glass)) for form in WRONG_FRESNEL),
        Form("F is missing: multiply by Fresnel's reflectance", _ones),
    ),
)

DIVISOR = Slot(
    right=(Form("right", lambda p: 1 / (4 * p.nl * p.nv)),),
    wrong=(
        Form("the divisor 4 (N.L) (N.V) is missing", _ones),
        Form("N.V is missing in the divisor 4 (N.L) (N.V)", lambda p: 1 / (4 * p.nl)),
        Form("N.L is missing in the divisor 4 (N.L) (N.V)", lambda p: 1 / (4 * p.nv)),
    ),
)

LIGHT = Slot(
    right=(Form("right", lambda p: p.nl),),
    wrong=(
        Form("its light goes with (N.L)^0, missing cosine: multiply it by N.L", _ones),
        Form(
            "its light goes with (N.L)^2, squared cosine: multiply it by N.L once",
            lambda p: p.nl**2,
        ),
    ),
)

SLOTS = (DISTRIBUTION, GEOMETRY, FRESNEL, DIVISOR, LIGHT)


@dataclass(frozen=True)
class Change:
    """A mistake in what factors read, in words, and the facets as it leaves them."""

    words: str
    of: Callable[[Facets], Facets]


CHANGES = (
    Change(
        HALVED,
        lambda p: replace(p, half=0.5 * (p.toward + p.view)),
    ),
    Change(
        SUMMED,
        lambda p: replace(p, half=p.toward + p.view),
    ),
    Change(
        OF_REVERSED_VIEW,
        lambda p: replace(p, half=unit(p.toward - p.view)),
    ),
)
"""Mistakes in what all factors read."""

ROUGHNESS = (
    Change("alpha stands where alpha^2 is meant", lambda p: replace(p, alpha=np.sqrt(p.alpha))),
    Change(
        "alpha is squared once more: it is the square of an engine's roughness already",
        lambda p: replace(p, alpha=p.alpha**2),
    ),
)
"""Mistakes in the roughness of D, or of D and G."""


def multiplied(values: Iterable[Array]) -> Array:
    """Return the product of factors at points."""
    return reduce(np.multiply, values)


@dataclass(frozen=True)
class Candidate:
    """A model of the highlight, with the words on its mistake, or none."""

    words: str
    factors: tuple[Factor, ...]

    def value(self, p: Facets) -> Array:
        """Return ``pi f (N.L)`` at points."""
        return multiplied(form(p) for form in self.factors)


def candidates() -> Iterator[Candidate]:
    """Yield the right models, and each with one mistake."""
    combinations: list[tuple[Factor, ...]] = [()]
    for slot in SLOTS:
        combinations = [(*head, form.value) for head in combinations for form in slot.right]
    for factors in combinations:
        yield Candidate("", factors)
    for factors in combinations:
        for change in CHANGES:
            changed = tuple(_changed(factor, change.of) for factor in factors)
            yield Candidate(change.words, changed)
        for change in ROUGHNESS:
            distribution = _changed(factors[0], change.of)
            geometry = _changed(factors[1], change.of)
            yield Candidate(change.words, (distribution, *factors[1:]))
            yield Candidate(change.words, (distribution, geometry, *factors[2:]))
    for i, slot in enumerate(SLOTS):
        # What stands for a right factor does not depend on which right one it replaces.
        others = dict.fromkeys((*factors[:i], *factors[i + 1 :]) for factors in combinations)
        for factors in others:
            for form in slot.wrong:
                yield Candidate(form.words, (*factors[:i], form.value, *factors[i:]))


CANDIDATES = tuple(candidates())

DIFFUSE = (
    Form(NO_COSINE, _ones),
    Form(SQUARED_COSINE, lambda p: p.nl**2),
    Form(COSINE_OF_VIEWER, lambda p: p.nv),
    Form(
        COSINE_OF_HALF,
        lambda p: p.nh,
    ),
)

METAL_F0 = "F0 of metals is that of glass; it is their base color"
METAL_BASE = "metals have a diffuse base; multiply it by 1 - metallic"
METALLIC = "metals are shaded as glass: `metallic` is not read"

WORDS = (
    *(change.words for change in (*CHANGES, *ROUGHNESS)),
    *(form.words for slot in SLOTS for form in slot.wrong),
    *(form.words for form in DIFFUSE),
    METAL_F0,
    METAL_BASE,
    METALLIC,
)
"""All mistakes that are recognised."""


def explained(heuristic: Heuristic) -> list[str] | None:
    """Return the mistakes of a microfacet shader, or None if it is none that is known."""
    p = sample()
    colour = np.random.default_rng(5).uniform(0.1, 0.9, (POINTS, 3)).astype(np.float32)
    # The highlight: what black surfaces show, alike in all channels and never negative.
    black = evaluate(heuristic, p, 0 * colour, metallic=0.0)
    highlight = black.mean(axis=1, keepdims=True)
    if (
        not ((highlight >= 0).all() and highlight.any())
        or np.ptp(black, axis=1).max() > ALIKE * highlight.max()
    ):
        return None
    fits = [(candidate, *_fit(candidate.value(p), highlight)) for candidate in _near(p, highlight)]
    alike = [(candidate, factor) for candidate, factor, left in fits if left < ALIKE]
    if not alike:
        return None
    # Without a mistake first: several models may agree at these points.
    fewest = min(bool(candidate.words) for candidate, _ in alike)
    likely = [pair for pair in alike if bool(pair[0].words) == fewest]
    unscaled = [pair for pair in likely if abs(pair[1] - 1) < UNSCALED]
    model, factor = (unscaled or likely)[0]
    words = dict.fromkeys(candidate.words for candidate, _ in unscaled or likely)
    said = [f"A likely mistake: {'; or: '.join(words)}."] if fewest else []
    # Then what lies below it, and what metals show in its place.
    below, level = _diffuse(heuristic, p, model, factor, colour)
    # What is wrong with the light's cosine is so in both parts, and one sentence tells.
    is_told = bool(set(words) & {form.words for form in LIGHT.wrong})
    said += [f"A likely mistake: {below}."] if below and not is_told else []
    if abs(level / factor - 1) < UNSCALED:
        said += _scale("All its light is", factor)
    else:
        said += _scale("Its highlights are", factor) + _scale("Its diffuse light is", level)
    return said + _metal(heuristic, p, model, factor, colour)


def _near(p: Facets, highlight: Array) -> Iterator[Candidate]:
    """Yield the candidates that agree at a few points: most do not, which is quick to see."""
    few = slice(None, None, 10)  # each tenth point
    part = Facets(**{name: value[few] for name, value in vars(p).items()})
    forms = {form for candidate in CANDIDATES for form in candidate.factors}
    values = {form: form(part) for form in forms}
    for candidate in CANDIDATES:
        shown = multiplied(values[form] for form in candidate.factors)
        _, left = _fit(shown, highlight[few])
        # Twice the bound: fewer points differ less, or more.
        if left < 2 * ALIKE:
            yield candidate


def _fit(values: Array, seen: Array) -> tuple[float, float]:
    """Return the factor that brings values nearest to those seen, and the relative difference."""
    weight = 1 / (np.abs(seen) + np.median(np.abs(seen)) + 1e-12)
    values = values * weight
    seen = seen * weight
    factor = (values * seen).sum() / max((values**2).sum(), 1e-30)
    return float(factor), float(np.sqrt(np.mean((factor * values - seen) ** 2)))


def _scale(what: str, factor: float) -> list[str]:
    """Return what a factor other than 1 may come from."""
    if abs(factor - 1) < UNSCALED:
        return []
    known = {4.0: "is the 4 of the divisor missing", 0.25: "is it divided by 4 twice"}
    near = [words for value, words in known.items() if abs(factor / value - 1) < UNSCALED]
    mistake = near[0] if near else factor_of_pi(factor)
    return [f"{what} {factor:.3g} times the model's{f': {mistake}?' if mistake else '.'}"]


def _shares(model: Candidate) -> tuple[Factor, ...]:
    """Return what light the diffuse base may get: all, or what the interface does not reflect."""
    return _ones, lambda p: 1 - model.factors[2](p)


def _diffuse(
    heuristic: Heuristic, p: Facets, model: Candidate, factor: float, colour: Array
) -> tuple[str, float]:
    """Return the mistake of the diffuse base, if it has one, and its factor, 1 if not known."""
    seen = evaluate(heuristic, p, colour, metallic=0.0)
    base = (seen - factor * model.value(p)) / colour
    right = Form("", lambda q: q.nl)
    for form, share in product((right, *DIFFUSE), _shares(model)):
        level, left = _fit(form.value(p) * share(p), base)
        if left < ALIKE and level > ALIKE:
            return form.words, level
    return "", 1.0


def _metal(
    heuristic: Heuristic, p: Facets, model: Candidate, factor: float, colour: Array
) -> list[str]:
    """Return the mistake of metals, if there is one."""
    metal = evaluate(heuristic, p, colour, metallic=1.0)
    highlight = factor * model.value(p)
    gold = replace(p, f0=colour.astype(float))
    expected = factor * model.value(gold)
    if _fit(expected, metal)[1] < ALIKE:
        return []
    if _fit(highlight, metal)[1] < ALIKE:
        return [f"A likely mistake: {METAL_F0}."]
    # What is left beside the right highlight: a diffuse base?
    more = metal - expected
    for share, facets in product(_shares(model), (p, gold)):
        if _fit(colour * p.nl * share(facets), more)[1] < 3 * ALIKE:
            return [f"A likely mistake: {METAL_BASE}."]
    glass = evaluate(heuristic, p, colour, metallic=0.0)
    return [f"A likely mistake: {METALLIC}."] if _fit(glass, metal)[1] < ALIKE else []


def sample() -> Facets:
    """Return random points with light and viewer above the horizon."""
    random = np.random.default_rng(17)
    points: list[tuple[Array, Array, Array]] = []
    while len(points) < POINTS:
        normal, view = unit(random.normal(size=(2, 3)))
        toward = unit(np.array(LAMP) - random.uniform(-1, 1, 3))
        if min(normal @ toward, normal @ view) > LEAST_COSINE:
            points.append((normal, toward, view))
    normals = np.array([normal for normal, _, _ in points])
    towards = np.array([toward for _, toward, _ in points])
    views = np.array([view for _, _, view in points])
    ior = random.uniform(1.2, 2.2, (POINTS, 1)).astype(np.float32).astype(float)
    return Facets(
        normal=normals,
        toward=towards,
        view=views,
        half=unit(towards + views),
        alpha=random.uniform(0.15, 0.9, (POINTS, 1)).astype(np.float32).astype(float),
        ior=ior,
        f0=dielectric_f0(ior),
    )


def evaluate(heuristic: Heuristic, p: Facets, colour: Array, metallic: float) -> Array:
    """Return a heuristic's values (P, 3) over the intensity, for a light at the distance 1."""
    material = {
        "base_color": colour.T, "k_d": colour.T, "k_s": 0.3, "n": 8.0,
        "alpha": p.alpha[:, 0], "ior": p.ior[:, 0], "metallic": metallic,
    }  # fmt: skip
    position = np.array(LAMP) - p.toward
    light = PointLight(LAMP, mi.Spectrum(*INTENSITY), INVERSE_SQUARE)
    values = shaded(heuristic, (position.T, p.normal.T, p.view.T), material, [light])
    shown = np.array(values, float).reshape(3, -1).T
    relative: Array = np.broadcast_to(shown, (POINTS, 3)) / np.array(INTENSITY)
    return relative
