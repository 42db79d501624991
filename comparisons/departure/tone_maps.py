"""Tone maps: curves by which engines turn light into what a display shows.

Each takes linear light (..., 3) with the primaries of BT.709, where 1 is display white, to linear
values from 0 to 1, before the transfer function of sRGB. An engine's exposure is a factor on the
light before the curve, and is not part of it. Light below 0 counts as none.
"""

from collections.abc import Callable

import numpy as np

from fotismos.comparisons.departure.colour import BT709, BT2020, Array, rgb_to_xyz

ToneMap = Callable[[Array], Array]
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


def reinhard(light: Array) -> Array:
    """Return ``L / (1 + L)`` of each channel, below 1.

    Reinhard et al., ACM Trans. Graph. 21(3), 2002, equation 3, define it for luminance; engines
    that name it so (three.js, Babylon.js) take each channel by itself.
    """
    light = np.maximum(light, 0.0)
    shown: Array = light / (1.0 + light)
    return shown


def aces(light: Array) -> Array:
    """Return Hill's fit to the reference and output transforms of ACES for an sRGB display.

    As published with Pettineo's and Neubelt's Baking Lab (``ACES.hlsl``), and used by Babylon.js
    and by three.js, which shows 1 / 0.6 times the light.
    """
    light = np.maximum(light, 0.0) @ _TO_ACES.T
    above = light * (light + 0.0245786) - 0.000090537
    below = light * (0.983729 * light + 0.4329510) + 0.238081
    return np.asarray(np.clip((above / below) @ _FROM_ACES.T, 0.0, 1.0))


def agx(light: Array) -> Array:
    """Return Sobotka's AgX without a look, in linear BT.2020 as Blender has it.

    The contrast is Wrensch's polynomial of degree 6, as in three.js (``AgXToneMapping``), whose
    values it gives; Filament's is of degree 7. A display's exponent of 2.2 makes them linear.
    """
    wide = np.maximum(light, 0.0) @ _between(BT709, BT2020).T
    lowest, highest = np.log2(_MIDDLE_GREY) + _STOPS
    stops = np.log2(np.maximum(wide @ _INSET.T, _DARKEST))
    encoded = np.clip((stops - lowest) / (highest - lowest), 0.0, 1.0)
    contrast = np.polynomial.polynomial.polyval(encoded, _CONTRAST)
    shown: Array = np.maximum(contrast @ _OUTSET.T, 0.0) ** 2.2
    return np.clip(shown @ _between(BT2020, BT709).T, 0.0, 1.0)


def neutral(light: Array) -> Array:
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


def derivative(tone_map: ToneMap, light: Array) -> Array:
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


def _between(first: Primaries, second: Primaries) -> Array:
    """Return the matrix from linear RGB of one set of primaries to another's of the same white."""
    return np.asarray(np.linalg.solve(rgb_to_xyz(second), rgb_to_xyz(first)))
