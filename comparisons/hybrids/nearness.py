"""The rendering that a picture is nearest to, among those between the halves.

A picture from another program cannot be rendered with one effect more, so its departure cannot be
split among effects. But it can be compared with every rendering between textbook shading and the
reference. The nearest one tells which effects the picture seems to have, and which it lacks. That
is not an attribution: distances to renderings do not add up to anything.
"""

from collections.abc import Mapping, Set
from typing import Annotated, Literal

from msgspec import Meta
from numpy.typing import NDArray

from comparisons import intervals
from reference.records import Amount, Estimated, Record, Resolution, Size

ALIKE = 1.0
"""Mean ΔE2000: a picture that is nearer to a rendering hardly differs from it."""

EXPLAINED = 0.5
"""Share of the reference's distance up to which the nearest rendering explains a picture, too."""

APART = 0.1
"""Share of its distance by which a rendering must be farther than the nearest, to be told apart."""

Effects = tuple[str, ...]
"""Labels of effects, in their order."""


class Nearest(Record):
    """The rendering that a picture, or a part of it, is nearest to; not an attribution.

    Attributes
    ----------
    outcome
        ``named`` if the nearest rendering explains the picture, ``unexplained`` if not even that
        one is near, ``alike`` if the picture hardly differs from the reference.
    simulates, lacks
        Effects that the nearest renderings simulate, and those that they leave out.
    undecided
        Effects that make no difference which is more than noise.
    dE2000
        Mean distance to the nearest rendering, with that one's noise removed.
    next_dE2000, gap
        Mean distance to the nearest rendering that can be told apart, and how much farther that
        is; null if none can.
    reference_dE2000
        Mean distance to the reference, at the same small size.
    """

    outcome: Literal["named", "unexplained", "alike"]
    simulates: Effects
    lacks: Effects
    undecided: Effects
    dE2000: Amount
    next_dE2000: Amount | None
    gap: Estimated | None
    reference_dE2000: Amount


class Renderings(Record):
    """The small renderings that a picture is compared with."""

    count: Size
    resolution: Resolution
    spp: Annotated[Size, Meta(description="Samples per pixel of each.")]


def nearest(distances: Mapping[Effects, NDArray]) -> Nearest:
    """Return the rendering of least distance, of ``{simulated effects: (R + 1,)}``.

    The distances are mean ΔE2000 by all replicates, then leaving out each in turn. The rendering
    with all effects is the reference.
    """
    effects = max(distances, key=len)
    first, *others = sorted(distances, key=lambda each: distances[each][0])
    away, reference = float(distances[first][0]), float(distances[effects][0])
    gaps = {each: _gap(distances[each] - distances[first]) for each in others}
    farther = [each for each in others if gaps[each].low > 0 and gaps[each].value > APART * away]
    tied = [set(each) for each in distances if each not in farther]
    following = farther[0] if farther else None
    outcome: Literal["named", "unexplained", "alike"] = "named"
    if reference < ALIKE:
        outcome = "alike"
    elif away > max(ALIKE, EXPLAINED * reference):
        outcome = "unexplained"
    simulates, some = set.intersection(*tied), set.union(*tied)
    return Nearest(
        outcome=outcome,
        simulates=_ordered(effects, simulates),
        lacks=_ordered(effects, set(effects) - some),
        undecided=_ordered(effects, some - simulates),
        dE2000=max(away, 0.0),
        next_dE2000=None if following is None else max(float(distances[following][0]), 0.0),
        gap=None if following is None else gaps[following],
        reference_dE2000=max(reference, 0.0),
    )


def _gap(difference: NDArray) -> Estimated:
    value, *left_out = difference
    error = float(intervals.jackknife_error(left_out))
    return intervals.student(float(value), error, len(left_out))


def _ordered(effects: Effects, chosen: Set[str]) -> Effects:
    return tuple(effect for effect in effects if effect in chosen)
