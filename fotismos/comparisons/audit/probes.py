"""Probes of any shader: what must hold for each, whatever its model is.

A probe varies one thing, such as the intensity of a light, and knows what must follow. What a
shader shows in the dark is subtracted first. Toon shaders are right, too: values may go with
``N.L`` in steps, and a shader that takes the intensity in steps is not asked about sums.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import mitsuba as mi
import numpy as np

from fotismos.comparisons.audit import furnace
from fotismos.comparisons.audit.furnace import UP, direction
from fotismos.comparisons.audit.subjects import COLOURS, shaded
from fotismos.comparisons.departure.colour import from_srgb
from fotismos.comparisons.picture_mistakes import CHANNELS, MISREADINGS, factor_of_pi
from fotismos.heuristic import user_shaders
from fotismos.heuristic.heuristics import Heuristic
from fotismos.heuristic.lights import INVERSE_SQUARE, PointLight

Array = np.ndarray

MATTE = {"k_a": 1.0, "k_d": 1.0, "base_color": 1.0, "k_s": 0.0, "n": 1.0, "alpha": 1.0, "ior": 1.0}
ROUGH = {"n": 4.0, "alpha": 0.5, "ior": 1.5}
SURFACES = {
    "matte": MATTE,
    "glossy": dict.fromkeys(MATTE, 0.0) | {"k_s": 1.0} | ROUGH,
    "mixed": dict.fromkeys(MATTE, 0.5) | {"k_s": 0.3} | ROUGH,
}
"""A white matte surface, a black one with a lobe, and a grey one with a lobe."""

LIGHT = 0.1
"""Intensity of a light: no value comes near 1, where a shader may cut it."""

STEPS_PER_STOP = 4
INTENSITIES = LIGHT * 2 ** (np.arange(-24, 41) / STEPS_PER_STOP)
DIM = 25
"""From six stops below :data:`LIGHT` to ten above it. So many, up to :data:`LIGHT`, are dim."""

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

PEAK = 2.5
"""A lobe's largest value over the mean around the normal, at least."""


class Cases(NamedTuple):
    """Points with lights of their own: vectors (3, N) or (3, 1), and numbers (N,) or alone.

    ``toward`` are unit vectors to each light, ``view`` is one to the viewer. ``intensity`` may be a
    colour (3, 1); ``surface`` is one of :data:`SURFACES`.
    """

    toward: tuple[Array, ...]
    view: Array = UP
    normal: Array = UP
    position: Array = 0.5 + UP
    distance: float = 1.0
    intensity: Any = LIGHT
    surface: str = "mixed"


Values = Mapping[str, Array]
"""What lights add at the points of named cases, (3, N) each."""


Find = Callable[[Values], str | None]
"""Returns a sentence, an empty one if all is well, and None if it cannot tell."""


@dataclass(frozen=True)
class Probe:
    """What is varied, and what is found.

    It runs if the probes in ``after`` found nothing. What a ``vague`` probe finds counts only if no
    other finds anything.
    """

    find: Find
    cases: Mapping[str, Cases]
    after: tuple[str, ...]
    vague: bool


PROBES: dict[str, Probe] = {}
"""All probes, each after those that it builds on. Exchanging light and viewer is not one of them:
Phong's lobe, sheen and rims are right, and not reciprocal; a reversed view shows in the mirror."""


def probe(cases: Mapping[str, Cases], *after: str, vague: bool = False) -> Callable[[Find], Find]:
    """Declare a function as a probe; its first line states what must follow."""

    def declared(find: Find) -> Find:
        PROBES[find.__name__] = Probe(find=find, cases=cases, after=after, vague=vague)
        return find

    return declared


def findings(heuristic: Heuristic) -> dict[str, str]:
    """Return what the probes find in a heuristic, as sentences by the probe's name.

    One that prepares a scene gets a dark one: what it keeps of other lights is not the cases'.
    """
    cases = {
        (name, part): case for name, asked in PROBES.items() for part, case in asked.cases.items()
    }
    defaults = {given.name: given.default for given in heuristic.parameters if given.prepared}
    prepared = heuristic.prepared(user_shaders.dark_scene(), defaults)
    # One kernel for all cases with one light, and one for those with two.
    values: dict[tuple[str, str], Array] = {}
    for number in (1, 2):
        alike = {key: case for key, case in cases.items() if len(case.toward) == number}
        shown = evaluate(heuristic, tuple(alike.values()), prepared)
        values |= dict(zip(alike, shown, strict=True))
    said: dict[str, str | None] = {}
    for name, asked in PROBES.items():
        seen = {part: values[name, part] for part in asked.cases}
        is_asked = all(said[other] == "" for other in asked.after)
        is_lit = 0 < sum(np.abs(value).sum() for value in seen.values()) < np.inf  # nor NaN
        said[name] = asked.find(seen) if is_asked and is_lit else None
    return {name: words for name, words in said.items() if words}


def evaluate(heuristic: Heuristic, cases: Sequence[Cases], prepared: Any = None) -> list[Array]:
    """Return what the lights add at cases' points, (3, N) each; all have the same number of lights.

    A second evaluation in the dark tells what they add.
    """
    parts = [_inputs(case) for case in cases]
    inputs = {name: np.concatenate([part[name] for part in parts], axis=1) for name in parts[0]}
    material = {
        name: inputs[name] if name in COLOURS else inputs[name][0] for name in SURFACES["matte"]
    }
    point = (inputs["position"], inputs["normal"], inputs["view"])
    shown = []
    for intensity in (inputs["intensity"], 0 * inputs["intensity"]):
        lights = [
            PointLight(mi.Point3f(inputs[f"light {i}"]), mi.Spectrum(intensity), INVERSE_SQUARE)
            for i in range(len(cases[0].toward))
        ]
        colours = shaded(heuristic, point, material, lights, prepared=prepared)
        values = np.array(colours, float).reshape(3, -1)
        shown.append(np.broadcast_to(values, intensity.shape))
    ends = np.cumsum([part["position"].shape[1] for part in parts])
    return np.split(shown[0] - shown[1], ends[:-1], axis=1)


def _inputs(case: Cases) -> dict[str, Array]:
    """Return the inputs at a case's points, (3, N) each."""
    inputs = {name: getattr(case, name) for name in ("position", "normal", "view", "intensity")}
    inputs |= SURFACES[case.surface]
    for i, toward in enumerate(case.toward):
        inputs[f"light {i}"] = case.position + case.distance * toward
    shape = np.broadcast_shapes(*map(np.shape, inputs.values()))
    return {name: np.broadcast_to(value, shape) for name, value in inputs.items()}


# --- Directions --------------------------------------------------------------------------------

HIGH, VIEW = furnace.random_pairs(POINTS)
TOWARD, OTHER = np.roll(furnace.random_pairs(POINTS, eta=1.0), 1, axis=2)
"""To lights and viewers above the horizon, and to lights on both sides of it."""

TURN = np.linalg.qr(HIGH[:, :3])[0]
TURN *= np.linalg.det(TURN)  # a rotation without a reflection

COSINES = np.linspace(0.05, 0.99, 400)  # not 1: a reversed view would have no half vector
RISING = direction(np.arccos(COSINES), 0.4)
DOWN = np.array([[1], [1], [-1]])

ELEVATIONS = np.deg2rad([(60, 75), (75, 60), (70, 65)])
AZIMUTHS = np.deg2rad(np.arange(0, 360, 5))
"""Angles of a light and a viewer from the normal, and of viewers about it."""

ANYWHERE = Cases(toward=(TOWARD,), view=VIEW, position=2 * OTHER)
BOTH = ANYWHERE._replace(toward=(TOWARD, OTHER))
TURNED = ANYWHERE._replace(toward=(TURN @ TOWARD,), view=TURN @ VIEW, normal=TURN @ UP)
RISEN = Cases(toward=(RISING,), surface="matte")
HEIGHTS = {"above": RISEN, "below": RISEN._replace(toward=(RISING * DOWN,))}
FACING = Cases(toward=(UP,), view=direction(0.5, 0.0), surface="matte")
LOBE = Cases(toward=(HIGH,), view=VIEW, surface="glossy")
AROUND = Cases(
    toward=(direction(ELEVATIONS[:, :1], 0 * AZIMUTHS).reshape(3, -1),),
    view=direction(ELEVATIONS[:, 1:], AZIMUTHS).reshape(3, -1),
    surface="glossy",
)
BRIGHTER = Cases(
    toward=(np.tile(TOWARD, len(INTENSITIES)),),
    view=np.tile(VIEW, len(INTENSITIES)),
    intensity=np.repeat(INTENSITIES, POINTS),
)
COLOURED = {
    name: ANYWHERE._replace(intensity=LIGHT * np.reshape(colour, (3, 1)))
    for name, colour in zip(CHANNELS, np.eye(3), strict=True)
}


def _share(a: Array, b: Array) -> float:
    """Return the share of the points at which values (3, N) differ, of those that are lit."""
    size = np.maximum(np.abs(a), np.abs(b)).max(axis=0)
    is_lit = size > 1e-4 * size.max()
    return float((np.abs(a - b).max(axis=0) > ALIKE * size)[is_lit].mean())


def _brightest(values: Array) -> Array:
    """Return the values at the intensities of the brightest point, in its brightest channel."""
    table = values.reshape(3, -1, POINTS)
    channel, _, point = np.unravel_index(table.argmax(), table.shape)
    brightest: Array = table[channel, :, point]
    return brightest


def _is_even(ratios: Array) -> bool:
    return bool(np.ptp(ratios) <= ALIKE * np.abs(ratios).max())


# --- Probes ------------------------------------------------------------------------------------

ENCODINGS: dict[str, Callable[[Array], Array]] = {
    **{name: undo for name, (undo, _) in MISREADINGS.items() if name.startswith("values")},
    "values look encoded by a power of 1/2.2": lambda value: value**2.2,
    "values look decoded by a power of 2.2": lambda value: value ** (1 / 2.2),
    "values look sRGB-encoded twice": lambda value: from_srgb(from_srgb(value)),
    "values look tone-mapped by x / (1 + x)": lambda value: value / np.maximum(1 - value, 1e-6),
}
"""Mistakes in how a shader encodes its values, and their inverses."""


@probe({"brighter": BRIGHTER})
def proportion(seen: Values) -> str | None:
    """Twice the intensity gives twice the value."""
    light = INTENSITIES[:DIM]
    value = _brightest(seen["brighter"][:, : DIM * POINTS])
    steps = np.abs(np.diff(value)) < FLAT * value[1:]
    if value.min() <= 0 or np.mean(steps) > 0.5:
        return None  # dark, or in steps
    if _is_even(value / light):
        return ""
    looks = [name for name, undo in ENCODINGS.items() if _is_even(undo(value) / light)]
    end = f": its {looks[0]}" if looks else ", not 2 times"
    return (
        f"Twice the light gives {value[-1] / value[-1 - STEPS_PER_STOP]:.3g} times the value{end}."
    )


@probe({"brighter": BRIGHTER}, "proportion")
def cut(seen: Values) -> str:
    """However bright the light is, more of it gives more."""
    value = _brightest(seen["brighter"])
    is_cut = np.ptp(value[-STEPS_PER_STOP:]) <= FLAT * value[-1]
    return f"Its values end at {value[-1]:.3g}: brighter light is cut off." if is_cut else ""


@probe(COLOURED, "proportion")
def channels(seen: Values) -> str:
    """Each channel is its own."""
    # Rows: the channel of the light. Columns: what is shown.
    shown = np.array([seen[name].sum(axis=1) for name in CHANNELS])
    order = shown.argmax(axis=0)
    share = 1 - np.diagonal(shown) / np.maximum(shown.sum(axis=0), 1e-9)
    if share.max() <= MANY:
        return ""
    of = f"{share.max():.0%} of its {CHANNELS[share.argmax()]} comes from light of the other two"
    if sorted(order) == [0, 1, 2] and list(order) != [0, 1, 2]:
        return f"Its channels look like {', '.join(CHANNELS[given] for given in order)}: {of}."
    return f"Its channels are mixed: {of}."


@probe({"first": ANYWHERE, "last": ANYWHERE._replace(toward=(OTHER,)), "both": BOTH}, "proportion")
def both_lights(seen: Values) -> str:
    """Two lights give the sum of each."""
    both = seen["both"]
    total = seen["first"] + seen["last"]
    if _share(both, total) <= MANY:
        return ""
    end = "they are not added"
    if _share(both, seen["first"]) <= MANY:
        end = "only the first light is used"
    elif _share(both, seen["last"]) <= MANY:
        end = "only the last light is used, as if the sum were overwritten"
    return f"Two lights give {both.sum() / total.sum():.3g} times the sum of each: {end}."


FALL_OFFS = (
    (1.0, ": the fall-off with the square of the distance is missing"),
    (0.5, ": it falls off with the distance alone; is the light vector not normalised?"),
    (0.125, ": it falls off with the distance once more; is the light vector not normalised?"),
    (0.0625, ": it falls off with the square of the distance a second time"),
    (1 / 64, ": the squared distance is squared again, and a fall-off is there already"),
)


@probe({"near": ANYWHERE, "far": ANYWHERE._replace(distance=2.0)}, "proportion")
def distance(seen: Values) -> str:
    """At twice the distance the value is that of the intensity, which has fallen off."""
    ratio = seen["far"].sum() / seen["near"].sum()
    if abs(ratio - 0.25) <= ALIKE * 0.25:
        return ""
    named = [words for wanted, words in FALL_OFFS if abs(ratio - wanted) <= ALIKE * wanted]
    end = named[0] if named else "; is the light vector not normalised?"
    end = end if end.endswith("?") else f"{end}."
    return f"At twice the distance its value is {ratio:.3g} times as large, not 0.25{end}"


@probe({"here": ANYWHERE, "turned": TURNED}, vague=True)
def turning(seen: Values) -> str:
    """Turning surface, lights and viewer together changes nothing."""
    share = _share(seen["here"], seen["turned"])
    if share <= MANY:
        return ""
    changes = f"It changes at {share:.0%} of the points if surface, lights and viewer are turned"
    return f"{changes} together: a vector is in another space."


@probe(HEIGHTS, "proportion", "turning")
def cosine(seen: Values) -> str:
    """White matte goes with N.L, or with steps of it, seen along the normal."""
    value = seen["above"].mean(axis=0)
    if value.max() <= ALIKE * seen["below"].max():
        return ""  # the next probe tells
    for power, name in ((1, ""), (0, "missing cosine"), (2, "squared cosine")):
        ratio = value / COSINES**power
        if np.ptp(ratio) <= 5 * ALIKE * ratio.max():
            return name and f"On white matte its value goes with (N.L)^{power}: {name}."
        jumps = np.abs(np.diff(ratio))
        edges = jumps >= FLAT * ratio.max()
        # On a ramp all change is at its steps.
        is_ramp = edges.any() and jumps[~edges].sum() <= ALIKE * jumps[edges].sum()
        if power == 1 and is_ramp and edges.mean() < MANY:
            steps = f"N.L times a ramp of {edges.sum() + 1} steps"
            return f"On white matte its value goes with {steps}: squared cosine."
    return ""


@probe(HEIGHTS, "turning", "cosine")
def below(seen: Values) -> str:
    """Light from above is seen, and light from below is not, or less."""
    above = seen["above"].sum()
    below = seen["below"].sum()
    if above <= ALIKE * below:
        shown = seen["below"].max() / LIGHT
        return (
            f"Light from below gives {shown:.3g} times its intensity, and light from above none:"
            " the light vector is reversed, or the normal."
        )
    # Less is meant: light that is wrapped about the horizon, or that shines through.
    if below <= 0.7 * above:
        return ""
    share = f"{below / above:.0%} of the value of light from above"
    return f"Light from below gives {share}: N.L has lost its sign."


@probe({"above": LOBE, "below": LOBE._replace(toward=(HIGH * DOWN,))}, "below")
def highlights(seen: Values) -> str:
    """Light from below gives no highlight."""
    above = seen["above"].sum()
    below = seen["below"].sum()
    # With more from below, what is seen is not a lobe.
    if not ALIKE * above < below < above:
        return ""
    share = f"{below / above:.0%} of those by light from above"
    return f"Light from below gives highlights, {share}: the condition N.L > 0 is missing."


@probe({"around": AROUND}, "highlights")
def mirror(seen: Values) -> str:
    """A highlight is where the viewer looks into the mirrored light."""
    around = seen["around"].sum(axis=0).reshape(len(ELEVATIONS), -1)
    # Sheen and rims are brightest elsewhere, too, but are no lobe about a direction.
    if around.max() < PEAK * around.mean():
        return ""
    # Halfway around, viewers look towards the mirrored light.
    ratio = around[:, len(AZIMUTHS) // 2].sum() / around.mean(axis=1).sum()
    if ratio >= 0.5:
        return ""
    return (
        f"In the mirrored direction its highlight has {ratio:.0%} of the mean around it: the view"
        " vector or the mirrored one is reversed (GLSL's reflect takes the direction in which"
        " light travels)."
    )


@probe({"facing": FACING}, "proportion", "below", vague=True)
def factor(seen: Values) -> str:
    """White matte that faces a light is as bright as the intensity."""
    level = seen["facing"].mean() / LIGHT
    mistake = factor_of_pi(level)
    if not mistake and level > BRIGHTEST:
        mistake = "no surface is as bright; is a division by pi missing?"
    return f"White matte has {level:.3g} times the light's intensity: {mistake}." if mistake else ""
