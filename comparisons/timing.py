"""The time per sample of both halves, their ratio, and what pruning saves.

It is measured like a study of cost (:mod:`fotismos.comparisons.cost.times`): pictures with few and
with many samples, in rounds whose order alternates, after compilation and with the
processor's threads awake. Overhead cancels in the difference of both, so the ratio does not depend
on the size of a picture.
"""

import math
from collections.abc import Mapping
from contextlib import AbstractContextManager, nullcontext
from typing import Any

import numpy as np

from fotismos.comparisons.cost import times
from fotismos.comparisons.price_record import FEWEST_SPP, Price
from fotismos.reference.records import Interval, Missing
from fotismos.reference.rendering.gbuffer import image_size, resize, size_of_width
from fotismos.reference.rendering.renderer import LARGEST_PASS, Renderer, Stream, passes, warm

WIDTH = 128
"""Width of the pictures that are timed, whatever the film's is: a ratio is the same everywhere."""

LONG_S = 0.015
"""Seconds that the picture with more samples takes, at least, if the film allows so many."""

BUDGET_S = 0.4
FEWEST = 6
MOST = 15
ATTEMPTS = 4
"""Seconds that all rounds take, their number, and how often they are repeated, if need be."""

WIDEST = 0.3
"""The widest interval that a ratio may have, over the ratio."""

TOO_WIDE = Missing("passes too short, or the machine too busy, to time within 30 %")
NOT_TIMED = Missing("a picture's time is not known")


def measure(
    heuristic: Renderer,
    reference: Renderer,
    everything: Renderer | None,
    seed: int,
    alone: AbstractContextManager[Any] | None = None,
) -> Price:
    """Return the times of both halves, their ratio, and what pruning saves.

    ``everything`` renders the physical half with everything simulated, if its plan leaves out
    something. Times are taken within the context ``alone``.
    """
    halves = {"heuristic": heuristic, "reference": reference}
    if everything is not None:
        halves["everything"] = everything
    films = [(half.scene, image_size(half.scene)) for half in halves.values()]
    width, height = image_size(reference.scene)
    size = size_of_width(reference.scene, WIDTH)
    try:
        pairs = {name: _pair(half, size) for name, half in halves.items()}
        # Compiling is over: only what is timed needs the machine alone.
        with alone or nullcontext():
            found, ratio = _lines(pairs, size[0] * size[1], seed)
    finally:
        for scene, film in films:
            resize(scene, film)
    is_known = _is_narrow(ratio)
    return Price(
        ratio=ratio if is_known else None,
        reason="" if is_known else TOO_WIDE.reason,
        heuristic_s=float(found["heuristic"].per_sample[0]),
        reference_s=float(found["reference"].per_sample[0]),
        everything_s=float(found["everything"].per_sample[0]) if everything else None,
        pixels=width * height,
    )


def _lines(
    pairs: Mapping[str, tuple[Renderer, Renderer]], pixels: int, seed: int
) -> tuple[dict[str, times.Line], Interval]:
    """Time pairs of renderers until the ratio of the halves is known, or the machine too busy.

    Returns the time of each pair as a line over samples, and the ratio.
    """
    renderers = [renderer for pair in pairs.values() for renderer in pair]
    # What a round takes tells how many there are.
    round_s = sum(renderer.times[-1] for renderer in renderers)
    rounds = int(np.clip(BUDGET_S / round_s, FEWEST, MOST))
    for renderer in renderers:
        renderer.times.clear()
        renderer.processor_times.clear()
    for _ in range(ATTEMPTS):
        for _ in passes(renderers, seed, rounds, stream=Stream.PROBE):
            pass
        found = times.lines(
            {
                name: {
                    renderer.pass_spp * pixels: (renderer.times, renderer.processor_times)
                    for renderer in pair
                }
                for name, pair in pairs.items()
            }
        )
        ratio = times.ratio(found["reference"], found["heuristic"])
        if _is_narrow(ratio):
            break
    return found, ratio


def _is_narrow(ratio: Interval) -> bool:
    """Return whether a ratio is known well enough to be stated."""
    return ratio.high - ratio.low <= WIDEST * ratio.value


def _pair(half: Renderer, size: tuple[int, int]) -> tuple[Renderer, Renderer]:
    """Return a half with few and with more samples, at a size, both warm."""
    fewer = more = _warm(half, FEWEST_SPP, size)
    most = LARGEST_PASS // (size[0] * size[1])
    # Powers of 4: each new count compiles.
    while more.times[-1] < LONG_S:
        steps = math.ceil(math.log(LONG_S / more.times[-1], 4))
        spp = more.pass_spp * 4**steps
        if spp > most:
            break
        more = _warm(half, spp, size)
    if more is fewer:  # a slow scene, or a large film
        more = _warm(half, 4 * FEWEST_SPP, size)
    return fewer, more


def _warm(half: Renderer, spp: int, size: tuple[int, int]) -> Renderer:
    """Return a half with some samples per pixel, which is warm."""
    renderer = half.sampled(spp, size)
    warm(renderer)
    return renderer
