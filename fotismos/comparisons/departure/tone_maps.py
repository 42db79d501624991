"""Tone maps: curves by which engines turn light into what a display shows.

Each takes linear light (..., 3) with the primaries of BT.709, where 1 is display white, to linear
values from 0 to 1, before the transfer function of sRGB. An engine's exposure is a factor on the
light before the curve, and is not part of it. Light below 0 counts as none. :class:`Curves` finds
the one by which a picture shows the light of its reference.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fotismos.comparisons.departure.colour import BT709, BT2020, rgb_to_xyz, to_srgb
from fotismos.comparisons.departure.minimum import minimum
from fotismos.comparisons.records.images import Light
from fotismos.heuristic.convention import Floats

ToneMap = Callable[[Floats], Floats]
Primaries = tuple[tuple[float, float], ...]

# Hill's fit: to the primaries of ACES, AP1, with the desaturation of the reference rendering
# transform; and back from those of the output transform, with its desaturation.
_TO_ACES = np.array(
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]]
)
_FROM_ACES = np.array(
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]]
)

# AgX: stops below and above middle grey that it encodes, its matrices on linear BT.2020, and the
# coefficients of its contrast, from the constant one up.
_MIDDLE_GREY = 0.18
_STOPS = (-10.0, 6.5)
_INSET = np.array(
    [
        [0.856627153315983, 0.0951212405381588, 0.0482516061458583],
        [0.137318972929847, 0.761241990602591, 0.101439036467562],
        [0.11189821299995, 0.0767994186031903, 0.811302368396859],
    ]
)
_OUTSET = np.linalg.inv(
    [
        [0.899796955911611, 0.0871996192028351, 0.013003424885555],
        [0.11142098895748, 0.875575586156966, 0.0130034248855548],
        [0.11142098895748, 0.0871996192028349, 0.801379391839686],
    ]
)
_CONTRAST = (-0.00232, 0.1191, 0.4298, -6.868, 31.96, -40.14, 15.5)
_DARKEST = 1e-10

# Khronos PBR Neutral: F90 of a dielectric, where its toe and its shoulder begin, and how fast
# highlights lose colour.
_F90 = 0.04
_SHOULDER = 0.8 - _F90
_DESATURATION = 0.15


def reinhard(light: Floats) -> Floats:
    """Return ``L / (1 + L)`` of each channel, below 1.

    Reinhard et al., ACM Trans. Graph. 21(3), 2002, equation 3, define it for luminance; engines
    that name it so (three.js, Babylon.js) take each channel by itself.
    """
    light = np.maximum(light, 0.0)
    shown: Floats = light / (1.0 + light)
    return shown


def aces(light: Floats) -> Floats:
    """Return Hill's fit to the reference and output transforms of ACES for an sRGB display.

    As published with Pettineo's and Neubelt's Baking Lab (``ACES.hlsl``), and used by Babylon.js
    and by three.js, which shows 1 / 0.6 times the light.
    """
    light = np.maximum(light, 0.0) @ _TO_ACES.T
    above = light * (light + 0.0245786) - 0.000090537
    below = light * (0.983729 * light + 0.4329510) + 0.238081
    return np.asarray(np.clip((above / below) @ _FROM_ACES.T, 0.0, 1.0))


def agx(light: Floats) -> Floats:
    """Return Sobotka's AgX without a look, in linear BT.2020 as Blender has it.

    The contrast is Wrensch's polynomial of degree 6, as in three.js (``AgXToneMapping``), whose
    values it gives; Filament's is of degree 7. A display's exponent of 2.2 makes them linear.
    """
    wide = np.maximum(light, 0.0) @ _between(BT709, BT2020).T
    lowest, highest = np.log2(_MIDDLE_GREY) + _STOPS
    stops = np.log2(np.maximum(wide @ _INSET.T, _DARKEST))
    encoded = np.clip((stops - lowest) / (highest - lowest), 0.0, 1.0)
    contrast = np.polynomial.polynomial.polyval(encoded, _CONTRAST)
    shown: Floats = np.maximum(contrast @ _OUTSET.T, 0.0) ** 2.2
    return np.clip(shown @ _between(BT2020, BT709).T, 0.0, 1.0)


def neutral(light: Floats) -> Floats:
    """Return Khronos' PBR Neutral: base colours stay, and highlights are compressed.

    Specification: KhronosGroup/ToneMapping, ``PBR_Neutral``. The toe takes off what a dielectric
    reflects at normal incidence.
    """
    light = np.maximum(light, 0.0)
    least = light.min(axis=-1, keepdims=True)
    toe = np.where(least < 2 * _F90, least - least**2 / (4 * _F90), _F90)
    light = light - toe
    peak = light.max(axis=-1, keepdims=True)
    room = 1.0 - _SHOULDER
    beyond = np.maximum(peak - _SHOULDER, 0.0)
    compressed = 1.0 - room**2 / (beyond + room)
    shown = light * np.divide(compressed, peak, out=np.ones_like(peak), where=beyond > 0.0)
    colour = 1.0 / (_DESATURATION * np.maximum(peak - compressed, 0.0) + 1.0)
    return np.where(beyond > 0.0, compressed + colour * (shown - compressed), light)


TONE_MAPS: dict[str, ToneMap] = {
    "reinhard": reinhard,
    "aces": aces,
    "agx": agx,
    "neutral": neutral,
}
"""All tone maps, by the names of the option."""


def derivative(tone_map: ToneMap, light: Floats) -> Floats:
    """Return how a tone map's channels change with those of light (..., 3): (..., 3, 3).

    Rows are the channels shown. Central differences, one-sided at 0.
    """
    light = np.maximum(light, 0.0)
    columns = []
    for channel in np.eye(3):
        step = 1e-4 * np.maximum(light.max(axis=-1, keepdims=True), 1e-3) * channel
        above = light + step
        below = np.maximum(light - step, 0.0)
        width = (above - below) @ channel
        columns.append((tone_map(above) - tone_map(below)) / width[..., None])
    return np.stack(columns, axis=-1)


def _between(first: Primaries, second: Primaries) -> Floats:
    """Return the matrix from linear RGB of one set of primaries to another's of the same white."""
    return np.asarray(np.linalg.solve(rgb_to_xyz(second), rgb_to_xyz(first)))


# --- Found in pictures ---------------------------------------------------------------------------

CURVES: dict[str | None, ToneMap] = {None: lambda light: np.clip(light, 0, 1)}
CURVES.update(TONE_MAPS.items())
"""The curves that a picture may show light by; without a name, linearly, up to display white."""

STOPS = np.arange(-8.0, 9.0)
"""Exposures, in stops, from which the search for a picture's own begins."""

CURVE_PIXELS = 4096
"""Pixels at which curves are tried, at most."""

LEAST_CURVE = 1 / 255
BETTER_CURVE = 0.3
"""Mean difference of sRGB-encoded values from which another curve is looked for, and the largest
share of it that a credible one leaves: curves resemble each other, and some wrong shading."""


@dataclass(frozen=True)
class FittedCurve:
    """A curve at the exposure at which it shows light most like a picture.

    ``distance`` is the mean difference of sRGB-encoded values that is left and is not noise, if the
    picture has as much as the reference.
    """

    name: str | None
    exposure: float
    distance: float

    def shown(self, light: np.ndarray) -> np.ndarray:
        """Return light (..., 3) as the curve shows it."""
        return CURVES[self.name](self.exposure * light)


@dataclass(frozen=True)
class Curves:
    """Pixels of a picture and of the light of the reference, to fit curves to; all (N, 3)."""

    picture: np.ndarray
    light: np.ndarray
    standard_error: np.ndarray

    @classmethod
    def of(cls, picture: np.ndarray, light: Light, counted: np.ndarray) -> "Curves":
        """Draw counted pixels of images (H, W, 3), always the same."""
        places = np.flatnonzero(counted)
        some = np.random.default_rng(0).permutation(places)[:CURVE_PIXELS]
        images = (picture, light.mean, light.standard_error)
        drawn = [image.reshape(-1, 3)[some].astype(float) for image in images]
        return cls(picture=drawn[0], light=drawn[1], standard_error=drawn[2])

    def fit(self, name: str | None) -> FittedCurve:
        """Return a curve at its best exposure."""
        encoded = to_srgb(self.picture)

        def distance(stops: float) -> float:
            shown = to_srgb(CURVES[name](2.0**stops * self.light))
            return float(np.abs(encoded - shown).mean())

        start = min(STOPS, key=distance)
        exposure = float(2.0 ** minimum(distance, start - 1, start + 1)[0])
        return FittedCurve(
            name=name,
            exposure=exposure,
            distance=self.distance(lambda light: CURVES[name](exposure * light)),
        )

    def distance(self, show: ToneMap) -> float:
        """Return how far a picture is from light as it is shown, as :class:`FittedCurve` has it."""
        left = np.abs(to_srgb(self.picture) - to_srgb(show(self.light))).mean()
        # Two images whose noise is normal and alike are 2 / √π of their standard error apart.
        above = to_srgb(show(self.light + self.standard_error))
        below = to_srgb(show(self.light - self.standard_error))
        noise = np.abs(above - below).mean() / np.sqrt(np.pi)
        return float(np.sqrt(max(left**2 - noise**2, 0.0)))

    def other(self, given: FittedCurve) -> FittedCurve | None:
        """Return the curve that leaves the least of the difference; None if none leaves far less.

        ``given`` is the curve under which picture and reference are compared.
        """
        if given.distance < LEAST_CURVE:
            return None
        # No tone map shows more than display white.
        is_beyond = bool(self.picture.max() > 1.0 + LEAST_CURVE)
        names = CURVES.keys() & {None} if is_beyond else CURVES.keys()
        others = [self.fit(name) for name in names if name != given.name]
        if not others:
            return None
        best = min(others, key=lambda curve: curve.distance)
        return best if best.distance <= BETTER_CURVE * given.distance else None
