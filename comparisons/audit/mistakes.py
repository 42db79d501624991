"""Mistakes that shaders often make: each is one change of the textbook's model.

A mistake changes the model's inputs at some points, or one of its functions. The model is written
out here in NumPy, :meth:`Textbook.terms`, because a mistake may change any part of it.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations, product

import numpy as np

from comparisons.pictures import picture_files
from comparisons.pictures.readings import READINGS, Reading

Array = np.ndarray


def dot(one: Array, other: Array) -> Array:
    """Return the dot products (P, 1) of vectors (P, 3)."""
    return np.sum(one * other, axis=1, keepdims=True)


def mirrored(normal: Array, toward: Array, view: Array) -> Array:
    """Return ``R.V``, where ``R = 2 (N.L) N - L`` (8.7)."""
    return 2 * dot(normal, toward) * dot(normal, view) - dot(toward, view)


def halfway(normal: Array, toward: Array, view: Array) -> Array:
    """Return ``N.H`` of Blinn (1977)."""
    half = toward + view
    return dot(normal, half) / np.maximum(np.sqrt(dot(half, half)), 1e-12)


def clamped(cosine: Array) -> Array:
    """Return a cosine, or 0 if it is negative."""
    return np.maximum(cosine, 0)


def _lobe(points: "Textbook", cosine: Array, incidence: Array) -> Array:
    return np.where(incidence > 0, clamped(cosine) ** points.n, 0)


@dataclass(frozen=True)
class Textbook:
    """The textbook's model at points: vectors and colours are (P, 3), numbers (P, 1).

    Attributes
    ----------
    lights
        Direction, distance and intensity of each light.
    along, incident, lobe
        The lobe's cosine, the diffuse term's function of ``N.L``, and the lobe.
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
    lobe: Callable[["Textbook", Array, Array], Array] = _lobe

    def terms(self) -> Array:
        """Return emission, ambient, diffuse and specular light (4, P, 3), the terms of 8.10."""
        diffuse = specular = np.zeros_like(self.k_d)
        for toward, _, intensity in self.lights:
            incidence = dot(self.normal, toward)
            along = self.along(self.normal, toward, self.view)
            diffuse = diffuse + intensity * self.incident(incidence)
            specular = specular + intensity * self.lobe(self, along, incidence)
        lit = self.k_d * diffuse, self.k_s * specular
        return np.stack([self.k_i, self.ambient * self.k_d, *lit])

    def relit(self, change: Callable[..., tuple[Array, Array, Array]]) -> "Textbook":
        """Return the model with each light's direction, distance and intensity changed."""
        return replace(self, lights=tuple(change(*light) for light in self.lights))


@dataclass(frozen=True)
class Mistake:
    """A change of the model, and its description, with ``{}`` for the number it changes ``by``."""

    told: str
    change: Callable[..., Textbook]
    by: tuple[float, float] | None = None


def _encoded(normal: Array) -> Array:
    return 0.5 * normal + 0.5


def _unit(vectors: Array) -> Array:
    return vectors / np.maximum(np.sqrt(dot(vectors, vectors)), 1e-12)


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


def _in_space(order: tuple[int, ...], signs: tuple[int, ...], points: Textbook) -> Textbook:
    return replace(points, normal=points.normal[:, list(order)] * signs)


def _scaled_lobe(factor: Callable[[Array], Array]) -> Callable[[Textbook], Textbook]:
    return lambda points: replace(points, k_s=points.k_s * factor(points.n))


def _coloured(undo: Callable[[Array], Array]) -> Callable[[Textbook], Textbook]:
    return lambda points: replace(points, k_d=undo(points.k_d), k_s=undo(points.k_s))


def _without_gate(points: Textbook, cosine: Array, incidence: Array) -> Array:
    return clamped(cosine) ** points.n


def _mirrored_behind(normal: Array, toward: Array, view: Array) -> Array:
    return 2 * np.abs(dot(normal, toward)) * dot(normal, view) - dot(toward, view)


def _with_cosine(points: Textbook, cosine: Array, incidence: Array) -> Array:
    return _lobe(points, cosine, incidence) * clamped(incidence)


BEHIND = "light from behind counts: N.L has lost its sign"

MISTAKES = (
    Mistake(
        "the light vector is reversed: it leads from the light to the surface",
        lambda points: points.relit(lambda to, distance, light: (-to, distance, light)),
    ),
    Mistake(
        "the view vector or the mirrored one is reversed (GLSL's reflect takes the direction in"
        " which light travels)",
        lambda points: replace(points, view=-points.view),
    ),
    Mistake(
        "the lobe is about the half vector, with the exponent for the mirrored one: too wide",
        lambda points: replace(points, along=halfway),
    ),
    Mistake(
        "the intensity falls off with the square of the distance a second time",
        lambda points: points.relit(lambda to, away, light: (to, away, light / away**2)),
    ),
    Mistake(
        "the fall-off with the square of the distance is missing",
        lambda points: points.relit(lambda to, away, light: (to, away, light * away**2)),
    ),
    Mistake(
        "the view vector is the position reversed, which is right only in view space",
        lambda points: replace(points, view=_unit(-points.position)),
    ),
    Mistake(
        "the view vector is the position reversed, and not normalised",
        lambda points: replace(points, view=-points.position),
    ),
    Mistake(
        "the normal is encoded as N / 2 + 1/2",
        lambda points: replace(points, normal=_encoded(points.normal)),
    ),
    Mistake(
        "the normal is encoded as N / 2 + 1/2, and then normalised",
        lambda points: replace(points, normal=_unit(_encoded(points.normal))),
    ),
    Mistake(BEHIND, lambda points: replace(points, incident=np.abs)),
    Mistake(BEHIND, lambda points: replace(points, incident=np.abs, along=_mirrored_behind,
                                           lobe=_without_gate)),
    Mistake("lights below the horizon cause highlights",
            lambda points: replace(points, lobe=_without_gate)),
    Mistake("the lobe is multiplied by N.L, as in a BRDF; the textbook's is not",
            lambda points: replace(points, lobe=_with_cosine)),
    Mistake("only the first light is used",
            lambda points: replace(points, lights=points.lights[:1])),
    Mistake("the lobe is normalised by n + 2, which the paired k_s already includes",
            _scaled_lobe(lambda n: n + 2)),
    Mistake("the lobe is normalised by n + 8, which the paired k_s already includes",
            _scaled_lobe(lambda n: n + 8)),
    Mistake("the material's colours are decoded, but are already linear",
            _coloured(picture_files.decoded)),
    Mistake("the material's colours are decoded by a power of 2.2, but are already linear",
            _coloured(lambda colour: colour**2.2)),
    Mistake("the material's colours are sRGB-encoded", _coloured(picture_files.encoded)),
    *_spaces(),
    Mistake("the exponent is {} times the material's",
            lambda points, by: replace(points, n=points.n * by), (0.05, 20)),
    Mistake("the normal is not normalised: it has a length of {}",
            lambda points, by: replace(points, normal=points.normal * by), (0.2, 5)),
    Mistake("the light vector is not normalised: it has a length of {}",
            lambda points, by: points.relit(lambda to, *light: (to * by, *light)), (0.2, 5)),
    Mistake("the view vector is not normalised: it has a length of {}",
            lambda points, by: replace(points, view=points.view * by), (0.2, 5)),
)  # fmt: skip

POWER = 2.2

COLOURS = (
    *READINGS,
    Reading("values look encoded by a power of 1/2.2", lambda image: image**POWER),
    Reading("values look decoded by a power of 2.2", lambda image: image ** (1 / POWER)),
    Reading(
        "values look sRGB-encoded twice",
        lambda image: picture_files.decoded(picture_files.decoded(image)),
    ),
    Reading(
        "values look tone-mapped by x / (1 + x)",
        lambda image: image / np.maximum(1 - image, 1e-6),
    ),
)
"""Mistakes in how a shader encodes its values."""
