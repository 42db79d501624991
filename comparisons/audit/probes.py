"""Probes of any shader: what must hold for each, whatever its model is.

A probe varies one thing, such as the intensity of a light, and knows what must follow. What a
shader shows in the dark is subtracted first. Toon shaders are right, too: values may go with
``N.L`` in steps, and a shader that takes the intensity in steps is not asked about sums.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import mitsuba as mi
import numpy as np

from fotismos.comparisons.audit.furnace import UP, direction
from fotismos.comparisons.audit.subjects import shaded
from fotismos.comparisons.departure.colour import from_srgb
from fotismos.comparisons.pictures import CHANNELS, MISREADINGS, factor_of_pi
from fotismos.comparisons.textbook import unit
from fotismos.heuristic.heuristics import Heuristic
from fotismos.heuristic.lights import INVERSE_SQUARE, PointLight

Array = np.ndarray

SURFACES = {
    "matte": {"k_d": 1.0, "k_s": 0.0, "n": 1.0, "alpha": 1.0, "ior": 1.0},
    "glossy": {"k_d": 0.0, "k_s": 1.0, "n": 4.0, "alpha": 0.5, "ior": 1.5},
    "mixed": {"k_d": 0.5, "k_s": 0.3, "n": 4.0, "alpha": 0.5, "ior": 1.5},
}
"""A white matte surface, a black one with a lobe, and a grey one with a lobe."""

COEFFICIENTS = {"k_a": "k_d", "k_d": "k_d", "base_color": "k_d", "k_s": "k_s"}
"""The colours of a material, and the coefficient of a surface that each has."""

LIGHT = 0.1
"""Intensity of a light: no value comes near 1, where a shader may cut it."""

DIM = LIGHT * 2 ** np.arange(-6, 0.1, 0.25)
BRIGHT = LIGHT * 2 ** np.arange(0, 10.1, 0.25)
"""Intensities, a quarter of a stop apart."""

POINTS = 64
"""Points in random directions."""

ALIKE = 0.01
"""Relative difference up to which values count as equal."""

FLAT = 1e-3
"""Relative difference of neighbours on one step of a ramp."""

BRIGHTEST = 1.5
"""Times the intensity that a white matte surface may have, with room for ramps."""

MANY = 0.1
"""Share of the points above which a difference is more than the edge of a step."""


@dataclass(frozen=True)
class Cases:
    """Points with lights of their own; vectors are (3, N) or (3,), the others (N,) or numbers.

    ``toward`` are unit vectors to each light, ``view`` is one to the viewer. ``colour`` (3,)
    multiplies the coefficients of the ``surface``, one of :data:`SURFACES`, ``tint`` (3,) the ``intensity``.
    """

    toward: tuple[Array, ...]
    view: Any = (0.0, 0.0, 1.0)
    normal: Any = (0.0, 0.0, 1.0)
    position: Any = (0.5, 0.5, 1.5)
    distance: Any = 1.0
    intensity: Any = LIGHT
    tint: tuple[float, float, float] = (1.0, 1.0, 1.0)
    colour: tuple[float, float, float] = (1.0, 1.0, 1.0)
    surface: str = "mixed"


Values = Mapping[str, Array]
"""What lights add at the points of named cases, (3, N) each."""


@dataclass(frozen=True)
class Probe:
    """What is varied, and what must follow.

    ``find`` returns a sentence, an empty one if all is well, and None if it cannot tell. It is
    asked if all is well with the probes ``after`` which it comes. A ``vague`` one is heard if
    nothing else is found.
    """

    name: str
    cases: Mapping[str, Cases]
    find: Callable[[Values], str | None]
    after: tuple[str, ...] = ()
    vague: bool = False


def findings(heuristic: Heuristic) -> tuple[list[str], list[str]]:
    """Return what the probes find in a heuristic, as sentences: the sure ones, and the vague."""
    cases = {(probe.name, name): case for probe in PROBES for name, case in probe.cases.items()}
    # One kernel for all cases with one light, and one for those with two.
    values: dict[tuple[str, str], Array] = {}
    for number in (1, 2):
        alike = {key: case for key, case in cases.items() if len(case.toward) == number}
        values |= dict(zip(alike, evaluate(heuristic, tuple(alike.values())), strict=True))
    said: dict[str, str | None] = {}
    for probe in PROBES:
        seen = {name: values[probe.name, name] for name in probe.cases}
        is_asked = all(said[name] == "" for name in probe.after)
        is_finite = all(np.isfinite(each).all() for each in seen.values())
        said[probe.name] = probe.find(seen) if is_asked and is_finite else None
    sure = [words for probe in PROBES if (words := said[probe.name]) and not probe.vague]
    vague = [words for probe in PROBES if (words := said[probe.name]) and probe.vague]
    return sure, vague


def evaluate(heuristic: Heuristic, cases: Sequence[Cases]) -> list[Array]:
    """Return what the lights add at cases' points, (3, N) each; all have the same number of lights.

    A second evaluation in the dark tells what they add.
    """
    parts = [_inputs(case) for case in cases]
    joined = {name: np.concatenate([part[name] for part in parts], axis=1) for name in parts[0]}
    sizes = [part["position"].shape[1] for part in parts]
    lights = [
        PointLight(
            position=mi.Point3f(joined["position"] + joined["distance"] * joined[f"toward {i}"]),
            intensity=mi.Spectrum(joined["intensity"]),
            attenuation=INVERSE_SQUARE,
        )
        for i in range(len(cases[0].toward))
    ]
    dark = [replace(light, intensity=0 * light.intensity) for light in lights]
    point = (joined["position"], joined["normal"], joined["view"])
    colours = {name: joined[of] for name, of in COEFFICIENTS.items()}
    numbers = {name: joined[name][0] for name in ("n", "alpha", "ior")}
    bright, black = (
        np.array(shaded(heuristic, point, colours | numbers, each), float).reshape(3, -1)
        for each in (lights, dark)
    )
    added = np.broadcast_to(bright - black, (3, sum(sizes)))
    return np.split(added, np.cumsum(sizes)[:-1], axis=1)


def _inputs(case: Cases) -> dict[str, Array]:
    """Return the inputs at a case's points, (3, N) each."""
    surface = SURFACES[case.surface]
    vectors = {f"toward {i}": each for i, each in enumerate(case.toward)}
    vectors |= {name: getattr(case, name) for name in ("position", "normal", "view")}
    vectors |= {name: np.multiply(case.colour, surface[name]) for name in ("k_d", "k_s")}
    inputs: dict[str, Any] = {name: np.reshape(value, (3, -1)) for name, value in vectors.items()}
    inputs |= {name: surface[name] for name in ("n", "alpha", "ior")}
    inputs |= {"distance": case.distance, "intensity": np.outer(case.tint, case.intensity)}
    count = max(np.atleast_2d(value).shape[1] for value in inputs.values())
    return {name: np.broadcast_to(value, (3, count)) for name, value in inputs.items()}


# --- Directions --------------------------------------------------------------------------------


def _directions(seed: int, above: Any = None) -> Array:
    """Return random unit vectors (3, N); ``above`` puts them on the side of others, at 9 degrees.

    They are further from the horizon, but not nearer to it.
    """
    vectors = unit(np.random.default_rng(seed).normal(size=(POINTS, 3))).T
    if above is None:
        return vectors
    cosines = (vectors * above).sum(axis=0)
    return unit((vectors * np.sign(cosines) + 0.2 * above).T).T


NORMAL = _directions(1)
VIEW = _directions(2, NORMAL)
TOWARD = _directions(3)
OTHER = _directions(4)
POSITION = 2 * _directions(5)
"""Surfaces seen from above, anywhere, with lights on both sides."""

TURN = np.linalg.qr(_directions(6)[:, :3])[0]
"""A rotation, or one with a reflection."""

HIGH = _directions(7, UP)
ALSO_HIGH = _directions(8, UP)

COSINES = np.linspace(0.05, 1, 400)
RISING = direction(np.arccos(COSINES), 0.4)

ELEVATIONS = ((60.0, 75.0), (75.0, 60.0), (70.0, 70.0))
AZIMUTHS = np.arange(0.0, 360, 5)
"""Degrees from the normal of lights and viewers, and degrees that viewers turn about it."""


def _flipped(vectors: Array) -> Array:
    return vectors * [[1], [1], [-1]]


def _anywhere(turn: Array = np.eye(3), toward: tuple[Array, ...] = (TOWARD,), **more: Any) -> Cases:
    turned = tuple(turn @ each for each in toward)
    return Cases(turned, view=turn @ VIEW, normal=turn @ NORMAL, position=POSITION, **more)


def _stops(intensities: Array) -> Cases:
    """Return the points anywhere, at one intensity after the other."""
    count = len(intensities)
    return Cases(
        (np.tile(TOWARD, count),),
        view=np.tile(VIEW, count),
        normal=np.tile(NORMAL, count),
        position=np.tile(POSITION, count),
        intensity=np.repeat(intensities, POINTS),
    )


def _share(a: Array, b: Array) -> float:
    """Return the share of the points at which values (3, N) differ, of those that are lit."""
    size = np.maximum(np.abs(a), np.abs(b)).max(axis=0)
    is_lit = size > 1e-4 * size.max()
    return float((np.abs(a - b).max(axis=0) > ALIKE * size)[is_lit].mean())


# --- Probes ------------------------------------------------------------------------------------

ENCODINGS: dict[str, Callable[[Array], Array]] = {
    **{name: undo for name, undo in MISREADINGS.items() if name.startswith("values")},
    "values look encoded by a power of 1/2.2": lambda value: value**2.2,
    "values look decoded by a power of 2.2": lambda value: value ** (1 / 2.2),
    "values look sRGB-encoded twice": lambda value: from_srgb(from_srgb(value)),
    "values look tone-mapped by x / (1 + x)": lambda value: value / np.maximum(1 - value, 1e-6),
}
"""Mistakes in how a shader encodes its values, and their inverses."""


def _brightest(values: Array) -> Array:
    """Return the values at intensities, of the brightest point and channel: (intensities,)."""
    table = values.reshape(3, -1, POINTS)
    channel, _, point = np.unravel_index(table.argmax(), table.shape)
    return table[channel, :, point]


def _is_even(ratios: Array) -> bool:
    return bool(np.ptp(ratios) <= ALIKE * np.abs(ratios).max())


def _proportion(seen: Values) -> str | None:
    value = _brightest(seen["dim"])
    if value.min() <= 0 or np.mean(np.abs(np.diff(value)) < FLAT * value[1:]) > 0.5:
        return None  # dark, or in steps
    if _is_even(value / DIM):
        return ""
    times = (value[-1] / value[0]) ** (1 / np.log2(DIM[-1] / DIM[0]))
    looks = [name for name, undo in ENCODINGS.items() if _is_even(undo(value) / DIM)]
    end = f": its {looks[0]}" if looks else ", not 2 times"
    return f"Twice the light gives {times:.3g} times the value{end}."


def _cut(seen: Values) -> str:
    value = _brightest(seen["bright"])
    is_cut = np.ptp(value[-5:]) <= FLAT * value[-1]
    return f"Its values end at {value[-1]:.3g}: brighter light is cut off." if is_cut else ""


def _channels(seen: Values) -> str:
    for what in ("light", "surface"):
        # Rows: the channel given. Columns: the channels shown.
        shown = np.array([seen[f"{colour} {what}"].sum(axis=1) for colour in CHANNELS])
        order = shown.argmax(axis=0)
        right = np.diagonal(shown[order])
        rest = (shown.sum(axis=0) - right) / np.maximum(right, 1e-9)
        if sorted(order) != [0, 1, 2] or right.min() <= 0:
            continue
        if list(order) != [0, 1, 2]:
            return f"Its channels look like {', '.join(CHANNELS[each] for each in order)}."
        if rest.max() > 10 * ALIKE:
            name = CHANNELS[rest.argmax()]
            return f"Its channels are mixed: {rest.max():.0%} of {name} is of the other two."
    return ""


def _turning(seen: Values) -> str | None:
    if not seen["here"].any():
        return None
    share = _share(seen["here"], seen["turned"])
    if share <= MANY:
        return ""
    return (
        f"It changes at {share:.0%} of the points if surface, lights and viewer are turned together:"
        " is a vector in another space?"
    )


def _cosine(seen: Values) -> str | None:
    value = seen["above"].mean(axis=0)
    if value.max() <= ALIKE * seen["below"].mean(axis=0).max():
        return ""  # the next probe tells
    for power, name in ((1, ""), (0, "missing cosine"), (2, "squared cosine")):
        ratio = value / COSINES**power
        is_ramp = np.mean(np.abs(np.diff(ratio)) < FLAT * ratio.max()) > 0.9
        is_constant = np.ptp(ratio) <= 5 * ALIKE * ratio.max()
        if is_ramp and power == 1 and not is_constant:
            return "On white matte its value goes with N.L times steps of N.L: squared cosine."
        if is_constant:
            return f"On white matte its value goes with (N.L)^{power}: {name}." if name else ""
    return ""


def _below(seen: Values) -> str | None:
    above = seen["above"].mean(axis=0)
    below = seen["below"].mean(axis=0)
    if above.max() <= ALIKE * below.max():
        shown = below.max() / LIGHT
        return (
            f"Light from below gives {shown:.3g} times its intensity, and light from above none:"
            " the light vector is reversed, or the normal."
        )
    # From straight below: wrapped light may reach beyond the horizon.
    ratio = below[-1] / above[-1]
    if ratio <= ALIKE:
        return ""
    is_same = np.abs(below - above).max() <= ALIKE * above.max()
    end = "N.L has lost its sign" if is_same else "is the condition N.L > 0 missing?"
    return f"Light from below gives {ratio:.0%} of the value of light from above: {end}"


def _highlights(seen: Values) -> str | None:
    above = seen["above"].mean()
    ratio = seen["below"].mean() / above if above > 0 else 0
    if ratio <= ALIKE:
        return ""
    return (
        f"Light from below gives highlights, {ratio:.0%} of those by light from above: is the"
        " condition N.L > 0 missing?"
    )


def _mirror(seen: Values) -> str | None:
    around = seen["around"].mean(axis=0).reshape(len(ELEVATIONS), -1)
    if around.max() <= 0:
        return None
    # At the azimuth of 180 degrees the viewer looks into the mirrored light.
    ratio = around[:, around.shape[1] // 2].sum() / around.mean(axis=1).sum()
    if ratio >= 0.5:
        return ""
    return (
        f"In the mirrored direction its highlight has {ratio:.0%} of the mean around it: the view"
        " vector or the mirrored one is reversed (GLSL's reflect takes the direction in which"
        " light travels)."
    )


def _sum(seen: Values) -> str:
    first, last = seen["first"], seen["last"]
    if not (first.any() and last.any()) or _share(seen["both"], first + last) <= MANY:
        return ""
    ratio = seen["both"].sum() / (first + last).sum()
    if _share(seen["both"], first) <= MANY:
        end = "only the first light is used"
    elif _share(seen["both"], last) <= MANY:
        end = "only the last light is used; is the sum overwritten?"
    else:
        end = "they are not summed"
    return f"Two lights give {ratio:.3g} times the sum of each: {end}"


def _distance(seen: Values) -> str:
    near, far = seen["near"].sum(), seen["far"].sum()
    ratio = far / near if near > 0 else 0.25
    if abs(ratio / 0.25 - 1) <= ALIKE:
        return ""
    names = {1.0: "the intensity's fall-off with the square of the distance is missing",
             0.5: "is the light vector not normalised?",
             0.0625: "the intensity falls off with the square of the distance a second time"}  # fmt: skip
    near_to = min(names, key=lambda each: abs(each - ratio))
    end = f": {names[near_to]}" if abs(ratio / near_to - 1) <= 10 * ALIKE else ""
    return f"At twice the distance its value is {ratio:.3g} times as large, not 0.25{end}."


def _factor(seen: Values) -> str:
    level = seen["facing"].mean() / LIGHT
    mistake = factor_of_pi(level)
    if not mistake and level > BRIGHTEST:
        mistake = "no surface is as bright; is a division by pi missing?"
    return f"White matte has {level:.3g} times the light's intensity: {mistake}" if mistake else ""


def _exchange(seen: Values) -> str:
    there, back = seen["there"].mean(axis=0), seen["back"].mean(axis=0)
    # Phong's value is the same, a BRDF's is over N.L.
    brdf = there / HIGH[2], back / ALSO_HIGH[2]
    error = min(
        float(np.sqrt(np.mean((a - b) ** 2)) / max(np.mean(a + b), 1e-9))
        for a, b in ((there, back), brdf)
    )
    if error <= 20 * ALIKE:
        return ""
    return f"Its highlights change by {error:.0%} as light and viewer change places: is one reversed?"


PRIMARIES = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
NEAR_AND_FAR = {"near": _anywhere(), "far": _anywhere(distance=2.0)}
VERTICAL = {
    "above": Cases((RISING,), surface="matte"), "below": Cases((_flipped(RISING),), surface="matte")
}  # fmt: skip

PROBES = (
    Probe("proportion", {"dim": _stops(DIM)}, _proportion),
    Probe("cut", {"bright": _stops(BRIGHT)}, _cut, after=("proportion",)),
    Probe(
        "channels",
        {
            f"{name} light": _anywhere(tint=colour)
            for name, colour in zip(CHANNELS, PRIMARIES, strict=True)
        }
        | {
            f"{name} surface": Cases((RISING,), colour=colour, surface="matte")
            for name, colour in zip(CHANNELS, PRIMARIES, strict=True)
        },
        _channels,
    ),
    Probe("sum", {
            "first": _anywhere(), "last": _anywhere(toward=(OTHER,)),
            "both": _anywhere(toward=(TOWARD, OTHER)),
        }, _sum, after=("proportion",)),
    Probe("distance", {"near": _anywhere(), "far": _anywhere(distance=2.0)}, _distance, after=("proportion",)),
    Probe("turning", {"here": _anywhere(), "turned": _anywhere(TURN)}, _turning, vague=True),
    Probe("cosine", VERTICAL, _cosine, after=("turning", "proportion")),
    Probe("below", VERTICAL, _below, after=("turning", "cosine")),
    Probe("highlights", {
            "above": Cases((HIGH,), view=ALSO_HIGH, surface="glossy"),
            "below": Cases((_flipped(HIGH),), view=ALSO_HIGH, surface="glossy"),
        }, _highlights, after=("below",)),
    Probe("mirror", {
        "around": Cases(
            (np.repeat(direction(np.deg2rad([light for light, _ in ELEVATIONS]), 0.0), len(AZIMUTHS), axis=1),),
            view=np.concatenate([direction(np.deg2rad(view), np.deg2rad(AZIMUTHS)) for _, view in ELEVATIONS], axis=1),
            surface="glossy",
        )}, _mirror, after=("highlights",)),
    Probe("exchange", {
        "there": Cases((HIGH,), view=ALSO_HIGH, surface="glossy"),
        "back": Cases((ALSO_HIGH,), view=HIGH, surface="glossy"),
    }, _exchange, after=("mirror",), vague=True),
    Probe("factor", {"facing": Cases((UP,), surface="matte")}, _factor, after=("proportion", "below"), vague=True),
)  # fmt: skip
"""All of them, each after those that it builds on."""
