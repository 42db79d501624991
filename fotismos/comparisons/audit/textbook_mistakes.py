"""The textbook's model at points, and the usual mistakes in writing it, one declaration each.

A mistake is a changed model. Packages declare their own by entry points of the group
``fotismos.mistakes``, each a :class:`Mistake`.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import permutations, product
from typing import Any

import numpy as np

from fotismos.comparisons.departure.colour import from_srgb, to_srgb
from fotismos.comparisons.textbook import clamped, dot, halfway, lobe, mirrored, unit
from fotismos.heuristic.declared import Declared

Array = np.ndarray

Cosine = Callable[[Array, Array, Array], Array]
"""A cosine (..., 1) of normal, light and view, each (..., 3)."""

POINTS = 384

LAMPS = ((3.0, 1.0, 2.5), (-2.0, 2.5, 1.5), (1.0, -2.0, 3.0))
INTENSITIES = ((1.25, 1.1, 0.9), (1.0, 1.5, 1.3), (1.2, 1.4, 1.75))
"""Colours, so low that no value is above 1, where a shader may cut it."""

BLINN = 4.0
"""The exponent of Blinn's lobe over that of a mirrored lobe of the same width."""


def incident(normal: Array, toward: Array, view: Array) -> Array:
    """Return ``N.L``."""
    return dot(normal, toward)


@dataclass(frozen=True)
class Model:
    """The textbook's model at points: vectors and colours are (P, 3), numbers (P, 1).

    ``toward`` (L, P, 3), ``distance`` (L, P, 1) and the intensities (L, P, 3) are of the lights.
    ``facing`` is the cosine of diffuse light; if it ``is_cut``, it is 0 where ``N.L`` is. ``along``
    is the cosine of the lobe, and ``lobe`` the lobe. Ambient light is ``ambient_by`` times its own.
    """

    position: Array
    normal: Array
    view: Array
    n: Array
    k_i: Array
    k_a: Array
    k_d: Array
    k_s: Array
    ambient: Array
    toward: Array
    distance: Array
    intensity: Array
    highlight_intensity: Array
    ambient_by: Any = 1.0
    facing: Cosine = incident
    is_cut: bool = True
    along: Cosine = mirrored
    lobe: Callable[[Array, Array, Array], Array] = lobe

    def terms(self, **changes: Any) -> Array:
        """Return emission, ambient, diffuse and specular light (4, P, 3), the terms of 8.10.

        ``changes`` are other values of the model's fields.
        """
        m = replace(self, **changes)
        incidence = dot(m.normal, m.toward)
        facing = clamped(m.facing(m.normal, m.toward, m.view))
        if m.is_cut:
            facing = np.where(incidence > 0, facing, 0)
        along = m.along(m.normal, m.toward, m.view)
        diffuse = (m.intensity * facing).sum(axis=0)
        specular = (m.highlight_intensity * m.lobe(along, m.n, incidence)).sum(axis=0)
        return np.stack(
            [m.k_i, m.ambient * m.k_a * m.ambient_by, m.k_d * diffuse, m.k_s * specular]
        )


def sample(along: Cosine) -> Model:
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
    arriving = np.array(INTENSITIES)[:, None] / distance**2
    # One diffuse colour under three names: a shader may read any of them.
    diffuse = colour()
    return Model(
        position=position,
        normal=normal,
        view=view,
        n=random.uniform(2, 24, (POINTS, 1)),
        k_i=0.05 * colour(),
        k_a=diffuse,
        k_d=diffuse,
        k_s=colour(),
        ambient=np.array([0.08, 0.05, 0.1]),
        toward=away / distance,
        distance=distance,
        intensity=arriving,
        highlight_intensity=arriving,
        along=along,
    )


Changes = dict[str, Any]
"""Other values of a model's fields."""


@dataclass(frozen=True)
class Mistake:
    """A mistake in words, and the fields of a model that it changes.

    With ``is_scaled``, ``change`` takes a number, too, which stands for ``{}`` in the words and is
    fitted. ``form`` names the lobe that is meant: ``mirrored``, ``halfway``, or either.
    """

    words: str
    change: Callable[..., Changes]
    is_scaled: bool = False
    form: str = "either"
    name: str = ""


def _brackets() -> Iterator[Mistake]:
    """Yield wrong forms of the mirrored vector."""

    def mistaken(words: str, vector: Callable[[Array, Array, Array], Array]) -> Mistake:
        return Mistake(
            f"{words}: write R = 2 (N.L) N - L",
            lambda m: {
                "along": lambda normal, toward, view: dot(vector(normal, toward, view), view)
            },
            form="mirrored",
        )

    yield mistaken(
        "the mirrored vector's bracket is misplaced, 2 (N.L) (N - L)",
        lambda normal, toward, view: 2 * dot(normal, toward) * (normal - toward),
    )
    yield mistaken(
        "the mirrored vector's bracket is misplaced, 2 ((N.L) N - L)",
        lambda normal, toward, view: 2 * (dot(normal, toward) * normal - toward),
    )
    yield mistaken(
        "the mirrored vector lacks the factor 2, (N.L) N - L",
        lambda normal, toward, view: dot(normal, toward) * normal - toward,
    )
    yield mistaken(
        "the mirrored vector lacks the cosine, 2 N - L",
        lambda normal, toward, view: 2 * normal - toward,
    )
    yield mistaken(
        "the mirrored vector adds the light, 2 (N.L) N + L",
        lambda normal, toward, view: 2 * dot(normal, toward) * normal + toward,
    )
    yield mistaken(
        "the mirrored vector has the viewer's cosine, 2 (N.V) N - L",
        lambda normal, toward, view: 2 * dot(normal, view) * normal - toward,
    )
    yield mistaken(
        "the mirrored vector is reversed, L - 2 (N.L) N, such as by GLSL's reflect(L, N)",
        lambda normal, toward, view: toward - 2 * dot(normal, toward) * normal,
    )


HALF = "write H = normalize(L + V)"
HALVED = f"the half vector is not normalised, (L + V) / 2: {HALF}"
SUMMED = f"the half vector is not normalised, L + V: {HALF}"
OF_REVERSED_VIEW = f"the half vector is of the reversed view, L - V: {HALF}"
"""Words on half vectors, which microfacets have, too."""

NO_COSINE = "diffuse light goes with (N.L)^0, missing cosine: write max(N.L, 0)"
SQUARED_COSINE = "diffuse light goes with (N.L)^2, squared cosine: write max(N.L, 0)"
COSINE_OF_VIEWER = "diffuse light has the cosine of the viewer, N.V: write max(N.L, 0)"
COSINE_OF_HALF = "diffuse light has the cosine of the half vector, N.H: write max(N.L, 0)"
COSINE_OF_BOTH = "diffuse light has the cosine of light and viewer, L.V: write max(N.L, 0)"
"""Words on the cosine of diffuse light, below microfacets, too."""


def _halves() -> Iterator[Mistake]:
    """Yield wrong forms of the half vector."""

    def mistaken(words: str, along: Cosine) -> Mistake:
        return Mistake(words, lambda m: {"along": along}, form="halfway")

    yield mistaken(
        HALVED,
        lambda normal, toward, view: dot(normal, 0.5 * (toward + view)),
    )
    yield mistaken(
        SUMMED,
        lambda normal, toward, view: dot(normal, toward + view),
    )
    yield mistaken(
        f"the half vector is not normalised, L + V, and its cosine is cut at 1: {HALF}",
        lambda normal, toward, view: np.minimum(dot(normal, toward + view), 1),
    )
    yield mistaken(
        OF_REVERSED_VIEW,
        lambda normal, toward, view: dot(normal, unit(toward - view)),
    )
    yield mistaken(
        f"the half vector is that of normal and viewer, and the cosine that with the light: {HALF}",
        lambda normal, toward, view: dot(toward, unit(normal + view)),
    )
    yield mistaken(
        "the lobe's cosine is V.H in place of N.H",
        lambda normal, toward, view: dot(view, unit(toward + view)),
    )


def _cosines() -> Iterator[Mistake]:
    """Yield wrong cosines of diffuse light and of the lobe."""
    diffuse: dict[str, Cosine] = {
        NO_COSINE: lambda normal, toward, view: np.ones_like(dot(normal, toward)),
        SQUARED_COSINE: lambda normal, toward, view: clamped(dot(normal, toward)) ** 2,
        COSINE_OF_VIEWER: lambda normal, toward, view: dot(normal, view),
        COSINE_OF_HALF: halfway,
        COSINE_OF_BOTH: lambda normal, toward, view: dot(toward, view),
    }
    for (words, facing), is_cut in product(diffuse.items(), (True, False)):
        yield Mistake(
            words,
            lambda m, facing=facing, is_cut=is_cut: {"facing": facing, "is_cut": is_cut},
        )
    wrong: dict[str, Cosine] = {
        "that of diffuse light, N.L": incident,
        "that of light and viewer, L.V": lambda normal, toward, view: dot(toward, view),
        "that of the viewer, N.V": lambda normal, toward, view: (
            dot(normal, view) + 0 * toward[..., :1]
        ),
    }
    for words, along in wrong.items():
        yield Mistake(
            f"the lobe's cosine is {words}, in place of R.V",
            lambda m, along=along: {"along": along},
        )


DECODINGS: dict[str, Callable[[Array], Array]] = {
    "are decoded, but are already linear": from_srgb,
    "are decoded by a power of 2.2, but are already linear": lambda value: value**2.2,
    "are sRGB-encoded": to_srgb,
    "are encoded by a power of 1/2.2": lambda value: value ** (1 / 2.2),
}
WHICH = {
    "the material's colours": ("k_a", "k_d", "k_s"),
    "the material's diffuse colours": ("k_a", "k_d"),
    "the colours of diffuse light": ("k_d",),
    "the colours of highlights": ("k_s",),
}


def _colours() -> Iterator[Mistake]:
    """Yield colours that are decoded, encoded or exchanged."""
    for (whose, names), (words, decode) in product(WHICH.items(), DECODINGS.items()):
        yield Mistake(
            f"{whose} {words}",
            lambda m, names=names, decode=decode: {
                name: decode(getattr(m, name)) for name in names
            },
        )
    yield Mistake("highlights have the colour k_d in place of k_s", lambda m: {"k_s": m.k_d})
    yield Mistake(
        "highlights have the colours k_d and k_s, multiplied", lambda m: {"k_s": m.k_d * m.k_s}
    )
    yield Mistake("highlights lack the colour k_s", lambda m: {"k_s": np.ones_like(m.k_s)})
    yield Mistake("diffuse light has the colour k_s in place of k_d", lambda m: {"k_d": m.k_s})
    yield Mistake("ambient light lacks the colour k_a", lambda m: {"k_a": np.ones_like(m.k_a)})
    yield Mistake("ambient light has the colour k_s in place of k_a", lambda m: {"k_a": m.k_s})


LUMINANCE = np.array([0.2126, 0.7152, 0.0722])


def _lights() -> Iterator[Mistake]:
    """Yield wrong uses of the lights' intensities."""
    greys: tuple[Callable[[Array], Array], ...] = (
        lambda light: light.mean(axis=-1, keepdims=True),
        lambda light: (light * LUMINANCE).sum(axis=-1, keepdims=True),
        lambda light: light.max(axis=-1, keepdims=True),
    )
    for grey in greys:
        yield Mistake(
            "highlights lack the light's colour: multiply them by the light's intensity, too",
            lambda m, grey=grey: {"highlight_intensity": grey(m.intensity) + 0 * m.intensity},
        )
    yield Mistake(
        "highlights lack the light's intensity: multiply them by it, too",
        lambda m: {"highlight_intensity": np.ones_like(m.intensity)},
    )
    yield Mistake(
        "highlights lack the fall-off with the distance",
        lambda m: {"highlight_intensity": m.intensity * m.distance**2},
    )
    yield Mistake(
        "ambient light is multiplied by the lights' intensity",
        lambda m: {"ambient_by": m.intensity.sum(axis=0)},
    )


def _lobes() -> Iterator[Mistake]:
    """Yield wrong factors and exponents of the lobe."""
    yield Mistake(
        "the lobe is about the half vector, with the exponent for the mirrored one: too wide;"
        f" about {BLINN:g} times the exponent has its width",
        lambda m: {"along": halfway, "n": m.n},
        form="mirrored",
    )
    yield Mistake(
        "the lobe is multiplied by N.L, as in a BRDF; the textbook's is not",
        lambda m: {"lobe": lambda *given: lobe(*given) * clamped(given[-1])},
    )
    yield Mistake(
        "the exponent is 0, so that highlights are everywhere",
        lambda m: {"lobe": lambda cosine, n, incidence: 1.0 * ((cosine > 0) & (incidence > 0))},
    )
    yield Mistake(
        "the exponent is 0, so that highlights are everywhere",
        lambda m: {"lobe": lambda cosine, n, incidence: 1.0 * (incidence > 0)},
    )
    yield Mistake(
        "the lobe is shown for light from below, too: the condition N.L > 0 is missing",
        lambda m: {"lobe": lambda cosine, n, incidence: clamped(cosine) ** n},
    )
    # Constant factors are left out: the fitted coefficient takes them up.
    for more in (2, 8):
        yield Mistake(
            f"the lobe is normalised by n + {more}, which the paired k_s already includes",
            lambda m, more=more: {"k_s": m.k_s * (m.n + more)},
        )


def _spaces() -> Iterator[Mistake]:
    """Yield a mistake for each other space whose axes are the world's, swapped or reversed."""
    for order, signs in product(permutations(range(3)), product((1, -1), repeat=3)):
        # Neither the world's, nor the same reversed, which the probes tell.
        if order != (0, 1, 2) or abs(sum(signs)) != 3:
            pairs = zip(order, signs, strict=True)
            axes = ", ".join(f"{'-' if sign < 0 else ''}{'xyz'[axis]}" for axis, sign in pairs)
            yield Mistake(
                f"the normal is in another space: it looks like ({axes})",
                lambda m, order=order, signs=signs: {"normal": m.normal[:, list(order)] * signs},
            )


MISTAKES: tuple[Mistake, ...] = (
    Mistake("the view vector is reversed: it points from the viewer", lambda m: {"view": -m.view}),
    Mistake(
        "the view vector is the position reversed, which is right only in view space",
        lambda m: {"view": unit(-m.position)},
    ),
    Mistake(
        "the view vector is the position reversed, and not normalised",
        lambda m: {"view": -m.position},
    ),
    Mistake("the normal is encoded as N / 2 + 1/2", lambda m: {"normal": 0.5 * m.normal + 0.5}),
    Mistake(
        "the normal is encoded as N / 2 + 1/2, and then normalised",
        lambda m: {"normal": unit(0.5 * m.normal + 0.5)},
    ),
    *_brackets(),
    *_halves(),
    *_lobes(),
    *_cosines(),
    *_colours(),
    *_lights(),
    *_spaces(),
    # With a number to choose, more fits by chance: these come last.
    Mistake(
        "the exponent is {} times the material's", lambda m, by: {"n": m.n * by}, is_scaled=True
    ),
    Mistake(
        "the normal is not normalised: it has a length of {}",
        lambda m, by: {"normal": m.normal * by},
        is_scaled=True,
    ),
    Mistake(
        "the light vector is not normalised: it has a length of {}",
        lambda m, by: {"toward": m.toward * by},
        is_scaled=True,
    ),
    Mistake(
        "the view vector is not normalised: it has a length of {}",
        lambda m, by: {"view": m.view * by},
        is_scaled=True,
    ),
)

PACKAGES: Declared[Mistake] = Declared("mistake", "fotismos.mistakes")
"""Those that installed packages declare."""


def mistakes() -> tuple[Mistake, ...]:
    """Return all known mistakes, the package's own first."""
    return (*MISTAKES, *PACKAGES.values())
