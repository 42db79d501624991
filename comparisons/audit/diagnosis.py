"""Describe a shader's mistakes: evaluate it at points, and compare it with known mistakes.

The textbook's model is a sum of terms, each a coefficient times emission, ambient, diffuse or
specular light. A shader that equals this sum, with coefficients of 1, is right. One that equals the
sum of a *changed* model has made that mistake, whatever its coefficients; each coefficient that is
not 1 is a further mistake. A shader that equals neither is another model, and nothing is reported.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations, product
from typing import Any

import drjit as dr
import mitsuba as mi
import numpy as np
from scipy.optimize import minimize_scalar

from comparisons.departure.colour import from_srgb, to_srgb
from comparisons.hard.textbook import clamped, dot, halfway, lobe, mirrored, unit
from comparisons.pictures.picture_warnings import MISREADINGS, Misreading, factor_of_pi
from heuristic import heuristics
from heuristic.heuristics import Heuristic, ShadingArguments
from heuristic.lights import INVERSE_SQUARE, PointLight
from heuristic.materials import PairedMaterial
from heuristic.user_shaders import DEFAULT_VARIANT

Array = np.ndarray

POINTS = 384

ALIKE = 1e-3
"""Relative RMS difference up to which two models count as equal."""

LAMPS = ((3.0, 1.0, 2.5), (-2.0, 2.5, 1.5), (1.0, -2.0, 3.0))
INTENSITIES = (5.0, 6.0, 7.0)

TERMS = ("emission", "ambient", "diffuse", "specular")


@dataclass(frozen=True)
class Model:
    """The textbook's model at points: vectors and colours are (P, 3), numbers (P, 1).

    ``lights`` have a direction, a distance and an intensity each. ``along``, ``incident`` and
    ``lobe`` are the lobe's cosine, the diffuse term's function of ``N.L``, and the lobe.
    """

    position: Array
    normal: Array
    view: Array
    n: Array
    k_i: Array
    k_d: Array
    k_s: Array
    ambient: Array
    lights: tuple[tuple[Array, Array, Array], ...]
    along: Callable[[Array, Array, Array], Array] = mirrored
    incident: Callable[[Array], Array] = clamped
    lobe: Callable[[Array, Array, Array], Array] = lobe

    def terms(self) -> Array:
        """Return emission, ambient, diffuse and specular light (4, P, 3), the terms of 8.10."""
        diffuse = specular = np.zeros_like(self.k_d)
        for toward, _, intensity in self.lights:
            incidence = dot(self.normal, toward)
            along = self.along(self.normal, toward, self.view)
            diffuse = diffuse + intensity * self.incident(incidence)
            specular = specular + intensity * self.lobe(along, self.n, incidence)
        return np.stack(
            [self.k_i, self.ambient * self.k_d, self.k_d * diffuse, self.k_s * specular]
        )

    def relit(self, change: Callable[..., tuple[Array, Array, Array]]) -> "Model":
        """Return the model with each light's direction, distance and intensity changed."""
        return replace(self, lights=tuple(change(*light) for light in self.lights))


@dataclass(frozen=True)
class Mistake:
    """A change of the model, and its description, with ``{}`` for the number it changes ``by``."""

    words: str
    change: Callable[..., Model]
    by: tuple[float, float] | None = None


TermFit = tuple[Array, float]
"""Coefficients (3, 4) of the terms by channel, and the remaining relative RMS difference."""


def describe(name: str) -> tuple[str, ...]:
    """Return the mistakes of a heuristic, in words.

    There are none of a built-in one, or one that prepares a scene.
    """
    heuristic = heuristics.named(name)
    if heuristic.is_own or heuristic.prepare is not None:
        return ()
    with mi.scoped_set_variant(DEFAULT_VARIANT):
        return tuple(_describe(heuristics.named(name)))


def _describe(heuristic: Heuristic) -> Iterator[str]:
    model = sample(halfway if heuristic.form == "blinn" else mirrored)
    seen = evaluate(heuristic, model)
    is_cut = seen.max() == 1 and 3 < np.count_nonzero(seen == 1) < seen.size / 2
    counts = seen < 1 if is_cut else np.ones_like(seen, bool)
    explanation = _explain(model, seen, counts)
    if explanation is None:
        return
    words, fit = explanation
    if is_cut:
        yield "Its values end at 1: brighter light is cut off."
    if words:
        yield f"A likely mistake: {words}."
    yield from _factors(fit, len(model.lights))


def _explain(model: Model, seen: Array, counts: Array) -> tuple[str, TermFit] | None:
    """Return the mistake that explains the values seen, and its fit; no words if there is none."""
    readings = [("", seen), *((f"its {each.symptom}", each.undo(seen)) for each in ENCODINGS)]
    fixed = [("", model.terms())]
    fixed += [(each.words, each.change(model).terms()) for each in MISTAKES if each.by is None]
    for words, terms in fixed:  # one mistake before two
        for read, values in readings if not words else readings[:1]:
            if (fit := _fit(terms, values, counts))[1] < ALIKE:
                return words or read, fit
    scaled = [_best(each, each.by, model, seen, counts) for each in MISTAKES if each.by]
    if alike := [pair for pair in scaled if pair[1][1] < ALIKE]:
        return min(alike, key=lambda pair: len(list(_factors(pair[1], 0))))
    for read, values in readings[1:]:
        for words, terms in fixed[1:]:
            if (fit := _fit(terms, values, counts))[1] < ALIKE:
                return f"{words}; and {read}", fit
    return None


def _best(
    each: Mistake, by: tuple[float, float], model: Model, seen: Array, counts: Array
) -> tuple[str, TermFit]:
    """Return a mistake, described with the number that fits best."""

    def fit(log: float) -> TermFit:
        return _fit(each.change(model, np.exp(log)).terms(), seen, counts)

    low, high = np.log(by)
    grid, step = np.linspace(low, high, 24, retstep=True)
    start = grid[np.argmin([fit(log)[1] for log in grid])]
    bounds = start - step, start + step
    best = minimize_scalar(lambda log: fit(log)[1], bounds=bounds, options={"xatol": 1e-5}).x
    return each.words.format(f"{np.exp(best):.3g}"), fit(best)


def _fit(terms: Array, values: Array, counts: Array) -> TermFit:
    """Return the least-squares coefficients of terms (4, P, 3) by channel.

    Rows are weighted by the inverse of their size, or highlights alone would decide.
    """
    if not np.isfinite(values).all():
        return np.zeros((3, 4)), np.inf
    weights = counts / (np.abs(values) + np.median(np.abs(values)) + 1e-9)
    coefficients, left = [], []
    for channel in range(3):
        weight = weights[:, channel]
        matrix, target = (terms[:, :, channel] * weight).T, values[:, channel] * weight
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
    odd: dict[float, list[str]] = {}
    for name, value in zip(TERMS, means, strict=True):
        if abs(value) > 0.01 and abs(value - 1) > 0.02:
            odd.setdefault(float(f"{value:.3g}"), []).append(name)
    for value, names in sorted(odd.items()):
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
    normal, view = (unit(random.normal(size=(POINTS, 3))) for _ in range(2))
    view *= np.sign(dot(normal, view))
    lights = []
    for place, intensity in zip(LAMPS, INTENSITIES, strict=True):
        away = np.array(place) - position
        square = dot(away, away)
        arriving = np.broadcast_to(intensity / square, position.shape)
        lights.append((unit(away), np.sqrt(square), arriving))
    return Model(
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


def evaluate(heuristic: Heuristic, model: Model) -> Array:
    """Return a heuristic's values (P, 3) at a model's points."""

    def vector(values: Array) -> mi.Vector3f:
        return mi.Vector3f(np.ascontiguousarray(values.T, np.float32))

    def spectrum(values: Array) -> mi.Spectrum:
        return mi.Spectrum(*(mi.Float(np.float32(each)) for each in values.T))

    base = spectrum(model.k_d)
    material = PairedMaterial(
        k_i=spectrum(model.k_i),
        k_a=base,
        k_d=base,
        k_s=spectrum(model.k_s),
        n=mi.Float(np.float32(model.n[:, 0])),
        form=heuristic.form or "phong",
        base_color=base,
        alpha=dr.opaque(mi.Float, 0.3),
        ior=dr.opaque(mi.Float, 1.5),
        metallic=dr.opaque(mi.Float, 0),
    )
    lights = [
        PointLight(place, mi.Spectrum(intensity), INVERSE_SQUARE)
        for place, intensity in zip(LAMPS, INTENSITIES, strict=True)
    ]
    arguments = ShadingArguments(
        vector(model.position), vector(model.normal), vector(model.view), material, lights,
        mi.Spectrum(model.ambient.tolist()),
        lambda toward, distance: dr.full(mi.Bool, True, POINTS),
    )  # fmt: skip
    parameters = {each.name: mi.Float(each.default) for each in heuristic.parameters}
    value = mi.Spectrum(heuristic.evaluate(arguments, mi.Point2f(0.5), parameters, None))
    return np.broadcast_to(np.array(value, float).reshape(3, -1).T, (POINTS, 3))


# --- Known mistakes ----------------------------------------------------------------------------


def _changed(**changes: Callable[[Model], Any]) -> Callable[[Model], Model]:
    """Return a change of the model's fields, each by a function of the model."""

    def change(model: Model) -> Model:
        fields: dict[str, Any] = {name: new(model) for name, new in changes.items()}
        return replace(model, **fields)

    return change


def _spaces() -> Iterator[Mistake]:
    """Yield a mistake for each other space whose axes are the world's, swapped or reversed."""
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        if (order, signs) != ((0, 1, 2), (1, 1, 1)):
            axes = ", ".join(
                f"{'-' if sign < 0 else ''}{'xyz'[place]}"
                for place, sign in zip(order, signs, strict=True)
            )
            yield Mistake(
                f"the normal is in another space: it looks like ({axes})",
                partial(_in_space, order, signs),
            )


def _in_space(order: tuple[int, ...], signs: tuple[int, ...], model: Model) -> Model:
    return replace(model, normal=model.normal[:, list(order)] * signs)


def _encode(normal: Array) -> Array:
    return 0.5 * normal + 0.5


def _recoloured(undo: Callable[[Array], Array]) -> Callable[[Model], Model]:
    return _changed(k_d=lambda model: undo(model.k_d), k_s=lambda model: undo(model.k_s))


def _without_gate(cosine: Array, n: Array, incidence: Array) -> Array:
    return clamped(cosine) ** n


def _mirrored_behind(normal: Array, toward: Array, view: Array) -> Array:
    return 2 * np.abs(dot(normal, toward)) * dot(normal, view) - dot(toward, view)


BEHIND = "light from behind counts: N.L has lost its sign"

MISTAKES = (
    Mistake("the light vector is reversed: it leads from the light to the surface",
            lambda model: model.relit(lambda to, away, light: (-to, away, light))),
    Mistake("the view vector or the mirrored one is reversed (GLSL's reflect takes the direction in"
            " which light travels)", _changed(view=lambda model: -model.view)),
    Mistake("the lobe is about the half vector, with the exponent for the mirrored one: too wide",
            _changed(along=lambda model: halfway)),
    Mistake("the intensity falls off with the square of the distance a second time",
            lambda model: model.relit(lambda to, away, light: (to, away, light / away**2))),
    Mistake("the fall-off with the square of the distance is missing",
            lambda model: model.relit(lambda to, away, light: (to, away, light * away**2))),
    Mistake("the view vector is the position reversed, which is right only in view space",
            _changed(view=lambda model: unit(-model.position))),
    Mistake("the view vector is the position reversed, and not normalised",
            _changed(view=lambda model: -model.position)),
    Mistake("the normal is encoded as N / 2 + 1/2",
            _changed(normal=lambda model: _encode(model.normal))),
    Mistake("the normal is encoded as N / 2 + 1/2, and then normalised",
            _changed(normal=lambda model: unit(_encode(model.normal)))),
    Mistake(BEHIND, _changed(incident=lambda model: np.abs)),
    Mistake(BEHIND, _changed(incident=lambda model: np.abs, along=lambda model: _mirrored_behind,
                             lobe=lambda model: _without_gate)),
    Mistake("lights below the horizon cause highlights",
            _changed(lobe=lambda model: _without_gate)),
    Mistake("the lobe is multiplied by N.L, as in a BRDF; the textbook's is not",
            _changed(lobe=lambda model: lambda *words: lobe(*words) * clamped(words[-1]))),
    Mistake("only the first light is used", _changed(lights=lambda model: model.lights[:1])),
    Mistake("the lobe is normalised by n + 2, which the paired k_s already includes",
            _changed(k_s=lambda model: model.k_s * (model.n + 2))),
    Mistake("the lobe is normalised by n + 8, which the paired k_s already includes",
            _changed(k_s=lambda model: model.k_s * (model.n + 8))),
    Mistake("the material's colours are decoded, but are already linear", _recoloured(from_srgb)),
    Mistake("the material's colours are decoded by a power of 2.2, but are already linear",
            _recoloured(lambda colour: colour**2.2)),
    Mistake("the material's colours are sRGB-encoded", _recoloured(to_srgb)),
    *_spaces(),
    Mistake("the exponent is {} times the material's",
            lambda model, by: replace(model, n=model.n * by), (0.05, 20)),
    Mistake("the normal is not normalised: it has a length of {}",
            lambda model, by: replace(model, normal=model.normal * by), (0.2, 5)),
    Mistake("the light vector is not normalised: it has a length of {}",
            lambda model, by: model.relit(lambda to, *light: (to * by, *light)), (0.2, 5)),
    Mistake("the view vector is not normalised: it has a length of {}",
            lambda model, by: replace(model, view=model.view * by), (0.2, 5)),
)  # fmt: skip

ENCODINGS = (
    *MISREADINGS,
    Misreading("values look encoded by a power of 1/2.2", lambda image: image**2.2),
    Misreading("values look decoded by a power of 2.2", lambda image: image ** (1 / 2.2)),
    Misreading("values look sRGB-encoded twice", lambda image: from_srgb(from_srgb(image))),
    Misreading(
        "values look tone-mapped by x / (1 + x)",
        lambda image: image / np.maximum(1 - image, 1e-6),
    ),
)
"""Mistakes in how a shader encodes its values."""
